"""Sessions with linkwind's settings, and the names that may stand in keys and endpoints."""

from __future__ import annotations

import json
import os
import re
import socket
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import zenoh

from linkwind.checkpoints import PIECE
from linkwind.credentials import Identity
from linkwind.errors import InputError

# Of participants, as a router tells them apart: it passes on what goes from one region to another.
DYNAMICS, PROVIDER, OBSERVER = REGIONS = ("dynamics", "provider", "observer")
LAST_PORT = 65535
LEASE = 1.0  # s without a sign of life after which a participant counts as lost

# bytes of a message, which wait in memory until it is whole; what is larger is dropped
LARGEST = 2**28  # of any
LARGEST_REQUEST = 2**16  # of a control request; the answer may have a piece of a checkpoint
LARGEST_PIECE = PIECE + 2**16
LARGEST_FAULT = 2**16
LARGEST_MOTION = 2**24  # 30,000 bodies; a provider does not know how many there are before it has joined

# One runtime for accepting and receiving: less time a round trip than with zenoh's separate threads. Sending
# has its own: what is passed on waits, in the thread that received it, until there is room to send it.
os.environ.setdefault("ZENOH_RUNTIME", "(rx: (handover: app), acc: (handover: app))")


@dataclass(frozen=True)
class Security:
    """What makes a bus secure.

    Attributes:
        identity: what this end shows.
        access: what others may do, as zenoh's access control.
    """

    identity: Identity
    access: dict[str, Any]

    def settings(self) -> dict[str, Any]:
        """Return it as zenoh takes it: TLS on both sides and nothing else."""
        identity = self.identity
        return {
            "transport/link/protocols": ["tls"],
            "transport/link/tls": {
                "root_ca_certificate": str(identity.ca),
                "listen_certificate": str(identity.certificate),
                "listen_private_key": str(identity.key),
                "connect_certificate": str(identity.certificate),
                "connect_private_key": str(identity.key),
                "enable_mtls": True,
                "verify_name_on_connect": True,
                "close_link_on_expiration": True,
            },
            "access_control": self.access,
        }


def open_session(
    listen: Sequence[str],
    connect: Sequence[str],
    region: str,
    security: Security | None = None,
    limits: Mapping[str, int] = MappingProxyType({}),
) -> zenoh.Session:
    """Open zenoh with linkwind's settings, on and to these endpoints.

    Args:
        listen: endpoints such as ``tcp/127.0.0.1:7447``, ``tls/…`` with ``security``.
        connect: likewise.
        region: what kind of participant this is, for a router.
        security: certificates and rules; None for a network that can be trusted.
        limits: bytes that a message may have under a key expression; larger ones never get here.

    Raises:
        InputError: an endpoint cannot be opened, or is of the wrong kind.
    """
    return _open(listen, connect, security, {"mode": "peer", "region_name": region}, limits)


def open_router(
    listen: Sequence[str], connect: Sequence[str], security: Security | None = None
) -> zenoh.Session:
    """Open what only passes messages on, between participants that need not reach each other."""
    regions = [{"filters": [{"region_names": [region]}]} for region in REGIONS]
    return _open(listen, connect, security, {"mode": "router", "gateway": {"south": regions}}, {})


def _open(
    listen: Sequence[str],
    connect: Sequence[str],
    security: Security | None,
    place: dict[str, Any],
    limits: Mapping[str, int],
) -> zenoh.Session:
    _check_kind([*listen, *connect], security)
    settings = {
        **place,
        "listen/endpoints": list(listen),
        "connect/endpoints": list(connect),
        "connect/retry": {"period_init_ms": 50, "period_max_ms": 100, "period_increase_factor": 2},
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False,
        # A lost peer is dialled again until the session closes, and closing waits for that call.
        "transport/unicast/open_timeout": int(LEASE * 1000),
        "transport/link/tx/lease": int(LEASE * 1000),
        "transport/link/tx/keep_alive": 4,
        "transport/link/tx/queue/size/data_low": 16,  # of 64 kB, for listeners that are behind for a moment
        "transport/link/rx/max_message_size": LARGEST,
        "low_pass_filter": [
            _limit("query", "**", LARGEST_REQUEST),
            *(_limit("put", key, limit) for key, limit in limits.items()),
        ],
        **(security.settings() if security else {}),
    }
    try:
        config = zenoh.Config()
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
        return zenoh.open(config)
    except zenoh.ZError as error:
        where = f"listen on {', '.join(listen)}" if listen else f"connect to {', '.join(connect)}"
        reason = str(error).split(" at /")[0]  # without the place in zenoh's sources
        raise InputError(
            f"zenoh: cannot {where}: {reason}. Expected a free endpoint such as tcp/127.0.0.1:7448; is "
            "another dynamics running there, is the address this machine's?"
        ) from error


def close_session(session: zenoh.Session) -> None:
    """Leave the bus; whoever cannot be told within a lease finds out by itself."""

    def close() -> None:
        with suppress(zenoh.ZError):  # some peer did not answer
            session.close()  # type: ignore[no-untyped-call]

    closing = threading.Thread(target=close, name="linkwind-close", daemon=True)
    closing.start()
    closing.join(LEASE)


def _limit(message: str, key: str, size: int) -> dict[str, Any]:
    """Return the rule that keeps out what is larger."""
    return {
        "id": f"{message} {key}",
        "messages": [message],
        "flows": ["ingress"],
        "key_exprs": [key],
        "size_limit": size,
    }


def _check_kind(endpoints: Sequence[str], security: Security | None) -> None:
    """Raise InputError unless all are endpoints, and all of TLS or none."""
    for endpoint in endpoints:
        found = re.fullmatch(r"\w+/\S+:(\d+)([?#]\S*)?", endpoint)
        if found is None or int(found[1]) > LAST_PORT:
            raise InputError(
                f"expected an endpoint with protocol, address and port, such as tcp/127.0.0.1:7447; got "
                f'"{endpoint}". Did you mean {_meant(endpoint, "tls" if security else "tcp")}?'
            )
        if endpoint.startswith("tls/") != (security is not None):
            expected = "an endpoint with TLS, such as tls/10.0.0.2:7447, because of --tls"
            if security is None:
                expected = "--tls DIR (or LINKWIND_TLS) with this endpoint, which has TLS"
            raise InputError(f"{endpoint}: expected {expected}")


def _meant(endpoint: str, protocol: str) -> str:
    """Return the endpoint that something like it was probably meant to be."""
    host, _, port = endpoint.rpartition("/")[2].rpartition(":")
    if not port.isdigit():
        host, port = host or port, ""
    return f"{protocol}/{host or '127.0.0.1'}:{port if port and int(port) <= LAST_PORT else 7447}"


def key_segment(value: str, what: str) -> str:
    """Return ``value`` if it may stand in a bus key.

    Raises:
        InputError: it is empty or has characters that mean something in a key.
    """
    if not re.fullmatch(r"[A-Za-z0-9_.-]+", value):
        raise InputError(f'{what}: expected letters, digits, "_", "-" and "."; got "{value}"')
    return value


def loopback_endpoint(protocol: str = "tcp") -> str:
    """Return an endpoint of this machine that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"{protocol}/127.0.0.1:{probe.getsockname()[1]}"
