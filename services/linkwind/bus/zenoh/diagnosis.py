"""Why zenoh does not get through to an endpoint: it tries for ever and does not say."""

from __future__ import annotations

import socket
import ssl
import time
from collections.abc import Sequence

import zenoh

from linkwind.credentials import Identity
from linkwind.errors import TrustError

DOUBT = 1.0  # s without a connection after which we look why, and again
PATIENCE = 3.0  # s for the other side's part of a TLS hand-shake
VERDICT = 1.0  # s in which the other side rejects a certificate: TLS 1.3 tells after the hand-shake
AGAIN = 0.3  # s between two looks: one alone may meet a process that is just ending
# Makes the hello longer than 790 bytes. An end without TLS takes its first two for that length, and hangs up
# at the content as soon as it is there, instead of waiting for more.
LONG_HELLO = [f"linkwind-{i:03}-{'x' * 32}" for i in range(30)]


class Doubt:
    """Looks, as long as a session has no connection, whether it can ever get one."""

    def __init__(self, session: zenoh.Session, connect: Sequence[str], identity: Identity | None) -> None:
        """Remember what the session connects to, and what it shows."""
        self._session, self._connect, self._identity = session, connect, identity
        self._at = time.monotonic() + DOUBT

    def check(self) -> None:
        """Look now and then.

        Raises:
            TrustError: what we connect to will never let us in, or must not be let in.
        """
        if time.monotonic() < self._at:
            return
        info = self._session.info
        if not any(True for _ in (*info.peers_zid(), *info.routers_zid())):
            for endpoint in self._connect:
                check_trust(endpoint, self._identity)
        self._at = time.monotonic() + DOUBT


def check_trust(endpoint: str, identity: Identity | None) -> None:
    """Look whether an endpoint and we could trust each other, if somebody listens there.

    Args:
        endpoint: such as ``tls/10.0.0.2:7447``.
        identity: what we show; None without TLS.

    Raises:
        TrustError: no, whatever time passes.
    """
    trouble = _trouble(endpoint, identity)
    if trouble:
        time.sleep(AGAIN)
        if trouble == _trouble(endpoint, identity):
            raise TrustError(f"{endpoint}: {trouble}")


def _trouble(endpoint: str, identity: Identity | None) -> str:
    """Return what is wrong between this end and that; empty if nothing is, or nobody is there."""
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.split("?")[0].split("#")[0].rpartition(":")
    if protocol not in ("tcp", "tls") or not port.isdecimal():
        return ""
    host = host.strip("[]")
    try:
        with socket.create_connection((host, int(port)), PATIENCE) as raw:
            return _trusting(raw, host, identity) if identity else _plain(raw)
    except OSError:
        return ""


def _plain(raw: socket.socket) -> str:
    """Return whether somebody there would speak TLS only, which we do not."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    context.set_alpn_protocols(LONG_HELLO)
    try:
        context.wrap_socket(raw).close()
    except (ssl.SSLError, OSError):
        return ""
    return "there is TLS, and this side has none. Give it its certificate with --tls DIR and tls/ endpoints"


def _trusting(raw: socket.socket, host: str, identity: Identity) -> str:
    """Return why the two ends do not trust each other."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.load_verify_locations(identity.ca)
    context.load_cert_chain(identity.certificate, identity.key)
    context.set_alpn_protocols(LONG_HELLO)
    try:
        with context.wrap_socket(raw, server_hostname=host) as secure:
            secure.settimeout(VERDICT)
            secure.recv(1)
    except ssl.SSLCertVerificationError as error:
        return f"the certificate there is not to be trusted: {error.verify_message.rstrip('.')}. {REMEDY}"
    except (ssl.SSLEOFError, ConnectionResetError):
        return "there is no TLS. Start that side with --tls DIR, or this side without, on a network you trust"
    except ssl.SSLError as error:
        reason = str(error.reason).lower().replace("_", " ").partition(" alert ")[2]
        if reason:
            return f"it does not accept the certificate of {identity.certificate}: {reason}. {REMEDY}"
        return f"no TLS hand-shake: {str(error.reason).lower().replace('_', ' ')}"
    except OSError:
        return ""
    return ""


REMEDY = "Both sides need certificates of one authority (linkwind certs), with the name they are reached at"
