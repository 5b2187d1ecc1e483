"""Ports, multicast, certificates, and whether another machine can be reached."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Iterator
from pathlib import Path

from linkwind.credentials import identity_in
from linkwind.doctor.finding import FAIL, OK, WARN, Finding
from linkwind.errors import LinkwindError

PORT = 7447
GROUP = "224.0.0.224", 7446  # zenoh's own
PATIENCE = 3.0  # s


def ports() -> Iterator[Finding]:
    """Look whether the loopback has ports, the usual one among them."""
    try:
        with socket.create_server(("127.0.0.1", 0)):
            pass
    except OSError as error:
        change = "linkwind run needs the loopback: bring the interface lo up, allow binding"
        yield Finding("ports", FAIL, f"127.0.0.1: {error.strerror}", change)
        return
    try:
        with socket.create_server(("0.0.0.0", PORT)):
            yield Finding("ports", OK, f"free ones on the loopback; {PORT} is free")
    except OSError as error:
        change = (
            f"another dynamics or router may listen there (ss -ltnp sport = :{PORT}); use another --listen"
        )
        yield Finding("ports", WARN, f"{PORT}: {error.strerror}", change)


def multicast() -> Finding:
    """Look whether multicast comes back, which linkwind does not need."""
    member = struct.pack("4s4s", socket.inet_aton(GROUP[0]), socket.inet_aton("127.0.0.1"))
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
            receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            receiver.bind(GROUP)
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
            receiver.settimeout(0.5)
            receiver.sendto(b"linkwind", GROUP)
            receiver.recv(64)
        found = "works on the loopback"
    except OSError as error:
        found = f"does not work ({error})"
    return Finding("multicast", OK, f"{found}; not needed, endpoints are explicit")


def certificates(tls: Path | None) -> Iterator[Finding]:
    """Look at every role's certificate in a folder, or at the one of a single role."""
    if tls is None:
        yield Finding("TLS", OK, "not asked for (--tls DIR)")
        return
    from linkwind.credentials.checks import days_left, role_in

    folders = [path.parent for path in sorted(tls.glob("*/certificate.pem")) if path.parent.name != "ca"]
    for folder in folders or [tls]:
        try:
            identity = identity_in(folder, role_in(folder))
            assert identity is not None
            days = days_left(identity)
        except LinkwindError as error:
            yield Finding("TLS", FAIL, str(error).split(". ")[0], str(error).partition(". ")[2])
            continue
        change = "" if days > 30 else "make a new one with linkwind certs before then"
        found = f'certificate of "{identity.role}", {days:.0f} days left'
        yield Finding("TLS", OK if days > 30 else WARN, found, change)


def reach(endpoint: str, tls: Path | None) -> Iterator[Finding]:
    """Look whether somebody listens at an endpoint, trusts us, and is to be trusted."""
    from linkwind.bus.zenoh import check_trust
    from linkwind.credentials.checks import role_in

    address = endpoint.partition("/")[2]
    host, _, port = address.rpartition(":")
    try:
        start = time.perf_counter()
        with socket.create_connection((host.strip("[]"), int(port)), PATIENCE):
            took = time.perf_counter() - start
        check_trust(endpoint, identity_in(tls, role_in(tls)) if tls else None)
    except (OSError, ValueError) as error:
        change = "start the dynamics or the router there; look at the firewall between (TCP)"
        yield Finding("reach", FAIL, f"{endpoint}: {error}", change)
    except LinkwindError as error:
        yield Finding("reach", FAIL, str(error).split(". ")[0], str(error).partition(". ")[2])
    else:
        yield Finding("reach", OK, f"{endpoint}: answers in {1e3 * took:.1f} ms")
