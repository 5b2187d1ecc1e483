"""Attacks on a run. Each is tried in every way that there is, and says what the attacker saw.

What is published would end the run if it got through: nonsense, faults, a participant that goes away.
"""

from __future__ import annotations

import shutil
import socket
import ssl
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass

import zenoh

from linkwind.bus.zenoh.diagnosis import check_trust
from linkwind.credentials import Identity
from linkwind.credentials.authority import DEFAULT_ROLES, issue
from linkwind.errors import SimulationError, TrustError
from linkwind.protocol import fault
from linkwind.schema import MESSAGES, SHA256
from tests.security.bed import BASE, Bed, attacker

GRACE = 0.5  # s for what an attacker has sent to arrive
MEGABYTE = 1_000_000


@dataclass
class Attempt:
    """What came of an attack.

    Attributes:
        tried: ways and times.
        saw: by the attacker.
    """

    tried: int
    saw: str


def hostile() -> dict[str, bytes]:
    """Return messages that would end the run, by key."""
    end = fault("aero", 1, 0, SimulationError("an attack"))
    return {
        "motion": b"nonsense",
        "wrench/aero": b"nonsense",
        "observe/flow/aero": b"nonsense",
        "checkpoint/aero": b"nonsense",
        "fault": end,
    }


def control() -> dict[str, bytes]:
    """Return requests that would end the run or take part in it, by what they are."""
    hello = {"name": "aero", "schema_sha256": "0" * 64, "version": "0", "instance": "attack"}
    requests = {
        "hello": {"hello": hello},
        "hello again": {"hello": hello | {"schema_sha256": SHA256}},
        "fault": {"fault": {"participant": "aero", "code": "SimulationError", "text": "an attack"}},
        "bye": {"bye": {"name": "aero"}},
    }
    return {name: MESSAGES["Control"](**body).SerializeToString() for name, body in requests.items()}


def everything(session: zenoh.Session, rounds: int = 5) -> tuple[int, int]:
    """Try all that a session can do; return how much it was and how many answers came."""
    tried = answers = 0
    for _ in range(rounds):
        for key, payload in hostile().items():
            session.put(f"{BASE}/{key}", payload)
            session.put(f"linkwind/v1/*/{key}", payload)
            session.delete(f"{BASE}/{key}")
            tried += 3
    for payload in control().values():
        for key in (f"{BASE}/control/aero", "linkwind/v1/*/control/*", "linkwind/**"):
            replies = session.get(key, payload=payload, timeout=0.2)
            answers += sum(
                1 for reply in replies if reply.ok is not None and "control" in str(reply.ok.key_expr)
            )
            tried += 1
    token = session.liveliness().declare_token(f"{BASE}/alive/aero")
    time.sleep(0.1)
    token.undeclare()  # type: ignore[no-untyped-call]
    own = session.declare_queryable(f"{BASE}/control/*", lambda query: query.reply(query.key_expr, b"x"))
    time.sleep(GRACE)
    own.undeclare()
    return tried + 2, answers


def listening(session: zenoh.Session) -> int:
    """Return how many messages of the run a session gets to see."""
    heard: list[zenoh.Sample] = []
    subscribers = [
        session.declare_subscriber(key, heard.append)
        for key in (f"{BASE}/motion", f"{BASE}/wrench/aero", "linkwind/**", "**")
    ]
    time.sleep(GRACE)
    for subscriber in subscribers:
        subscriber.undeclare()
    return len(heard)


def rejected(endpoint: str, identity: Identity | None) -> str:
    """Return what an honest program in the attacker's place is told."""
    try:
        check_trust(endpoint, identity)
    except TrustError as error:
        return str(error).partition(": ")[2].partition(". ")[0]
    return "let in"


def with_role(bed: Bed, role: str) -> Attempt:
    """Use a good certificate of a role for everything that it gives no right to."""
    tried = answers = 0
    for endpoint in (bed.direct, bed.by_router):
        for mode in ("peer", "client"):
            with closing(attacker(endpoint, Identity(role, bed.certs / role), mode, "provider")) as session:
                more, heard = everything(session)
                tried, answers = tried + more, answers + heard
    return Attempt(tried, f"link up, {answers} answers, everything dropped")


def unauthenticated(bed: Bed) -> Attempt:
    """Come without TLS, and with TLS but no certificate."""
    tried = 0
    for endpoint in (bed.direct, bed.by_router):
        with closing(attacker(endpoint.replace("tls/", "tcp/"), None)) as session:
            more, answers = everything(session, 1)
            assert not answers
            tried += more + listening(session)
        assert "let in" not in rejected(endpoint.replace("tls/", "tcp/"), None)
        assert not accepts(bed, endpoint)
        tried += 1
    return Attempt(tried, rejected(bed.direct.replace("tls/", "tcp/"), None))


def self_made(bed: Bed) -> Attempt:
    """Come with a certificate in the name of aero, and of the dynamics, that one has made oneself."""
    own = bed.folder / "own"
    if not own.exists():
        issue(own, DEFAULT_ROLES, 2)
        for role in ("aero", "dynamics"):  # it trusts the true authority, else the attacker would hang up
            shutil.copy(bed.certs / role / "ca.pem", own / role / "ca.pem")
    tried = 0
    for endpoint in (bed.direct, bed.by_router):
        for role in ("aero", "dynamics"):
            with closing(attacker(endpoint, Identity(role, own / role))) as session:
                more, answers = everything(session, 1)
                assert not answers
                tried += more
    said = rejected(bed.direct, Identity("aero", own / "aero"))
    return Attempt(tried, said.replace(str(own), "…"))


def spoofed(bed: Bed) -> Attempt:
    """Speak as aero with the certificate of another provider."""
    return with_role(bed, "tail")


def observer_publishes(bed: Bed) -> Attempt:
    """Speak as everybody with the certificate of an observer, then of an operator."""
    attempts = [with_role(bed, role) for role in ("observer", "operator")]
    return Attempt(sum(attempt.tried for attempt in attempts), attempts[0].saw)


def reads_without_right(bed: Bed) -> Attempt:
    """Listen without a certificate, and with one of a provider that has no part in the run."""
    heard = 0
    for endpoint in (bed.direct, bed.by_router):
        with closing(attacker(endpoint, Identity("tail", bed.certs / "tail"))) as session:
            heard += listening(session)
        with closing(attacker(endpoint.replace("tls/", "tcp/"), None)) as session:
            heard += listening(session)
    assert not heard, f"{heard} messages"
    return Attempt(16, "0 messages")


def replayed(bed: Bed) -> Attempt:
    """Publish recorded messages of the run again: as observer, as aero itself, and as bytes on the wire."""
    recorded: list[bytes] = []
    with closing(attacker(bed.by_router, Identity("observer", bed.certs / "observer"), "client")) as session:
        subscriber = session.declare_subscriber(
            f"{BASE}/wrench/aero", lambda s: recorded.append(s.payload.to_bytes())
        )
        deadline = time.monotonic() + 10.0
        while len(recorded) < 50 and time.monotonic() < deadline:
            time.sleep(0.02)
        subscriber.undeclare()
        assert len(recorded) >= 50, "an observer hears the wrenches"
        for payload in recorded[:50]:
            session.put(f"{BASE}/wrench/aero", payload)
    # Even with the right certificate, in case it was stolen: what is old is dropped.
    with closing(attacker(bed.by_router, Identity("aero", bed.certs / "aero"), "client")) as session:
        for payload in recorded[:50]:
            session.put(f"{BASE}/wrench/aero", payload)
        time.sleep(GRACE)
    return Attempt(100 + on_the_wire(bed), "dropped; TLS rejects repeated bytes")


def on_the_wire(bed: Bed) -> int:
    """Record what a client's TCP connection carries, and send the same bytes again."""
    host, port = "127.0.0.1", int(bed.direct.rpartition(":")[2])
    with recording_proxy(host, port) as (own_port, sent):
        identity = Identity("aero", bed.certs / "aero")
        with closing(attacker(f"tls/127.0.0.1:{own_port}", identity)) as session:
            session.put(f"{BASE}/wrench/aero", b"")
            time.sleep(GRACE)
    assert len(sent) > 500
    for _ in range(5):
        with socket.create_connection((host, port), 5.0) as again, suppress(OSError):
            again.sendall(bytes(sent))
            again.settimeout(2.0)
            while again.recv(65536):  # until it hangs up
                pass
    return 5


@contextmanager
def recording_proxy(host: str, port: int) -> Iterator[tuple[int, bytearray]]:
    """Pass connections on; yield the proxy's port and what clients send through it."""
    sent = bytearray()
    listener = socket.create_server(("127.0.0.1", 0))

    def copy(source: socket.socket, target: socket.socket, keep: bool) -> None:
        with suppress(OSError):
            while data := source.recv(65536):
                if keep:
                    sent.extend(data)
                target.sendall(data)

    def serve() -> None:
        with suppress(OSError):
            client, _ = listener.accept()
            server = socket.create_connection((host, port))
            threading.Thread(target=copy, args=(server, client, False), daemon=True).start()
            copy(client, server, True)
            server.close()
            client.close()

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    yield listener.getsockname()[1], sent
    listener.close()


def accepts(bed: Bed, endpoint: str, identity: Identity | None = None, **limits: ssl.TLSVersion) -> bool:
    """Tell whether a hand-shake of these TLS versions comes to an end that the other side accepts."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    context.set_ciphers("ALL:@SECLEVEL=0")
    if limits:
        context.minimum_version, context.maximum_version = limits["low"], limits["high"]
    if identity:
        context.load_cert_chain(identity.certificate, identity.key)
    address = ("127.0.0.1", int(endpoint.rpartition(":")[2]))
    try:
        with socket.create_connection(address, 5.0) as raw, context.wrap_socket(raw) as secure:
            secure.settimeout(0.5)
            return bool(secure.recv(1))
    except TimeoutError:
        return True  # it waits for our first message
    except OSError:
        return False


def downgraded(bed: Bed) -> Attempt:
    """Offer only old versions of TLS, only ciphers without secrets, or none at all in the dynamics' place."""
    identity, tried = Identity("aero", bed.certs / "aero"), 0
    assert accepts(bed, bed.direct, identity), "TLS of today is accepted"
    for endpoint in (bed.direct, bed.by_router):
        for version in (ssl.TLSVersion.TLSv1, ssl.TLSVersion.TLSv1_1):
            assert not accepts(bed, endpoint, identity, low=version, high=version)
            tried += 1
    with plain_impostor() as port:
        said = rejected(f"tls/127.0.0.1:{port}", identity)
    assert "there is no TLS" in said
    return Attempt(tried + 1, said)


@contextmanager
def plain_impostor() -> Iterator[int]:
    """Listen as a dynamics without TLS would."""
    config = zenoh.Config()
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    listener.close()
    for key, value in (
        ("listen/endpoints", f'["tcp/127.0.0.1:{port}"]'),
        ("scouting/multicast/enabled", "false"),
    ):
        config.insert_json5(key, value)
    with closing(zenoh.open(config)):
        yield port


def impostor_dynamics(bed: Bed) -> Attempt:
    """Listen in the dynamics' place with a good certificate of another role."""
    said = ""
    for role in ("observer", "tail", "aero"):
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(bed.certs / role / "certificate.pem", bed.certs / role / "key.pem")
        with socket.create_server(("127.0.0.1", 0)) as listener:

            def serve(listener: socket.socket = listener, context: ssl.SSLContext = context) -> None:
                for _ in range(2):
                    with suppress(OSError), listener.accept()[0] as raw, context.wrap_socket(raw, True):
                        pass

            threading.Thread(target=serve, daemon=True).start()
            said = rejected(
                f"tls/127.0.0.1:{listener.getsockname()[1]}", Identity("aero", bed.certs / "aero")
            )
            assert "the certificate there is not to be trusted" in said, said
    return Attempt(3, said)


def oversized(bed: Bed) -> Attempt:
    """Send large messages where small ones are due."""
    large = bytes(50 * MEGABYTE)
    tried = 0
    for endpoint in (bed.direct, bed.by_router):
        with closing(attacker(endpoint, Identity("observer", bed.certs / "observer"), "client")) as session:
            for key in ("wrench/aero", "motion"):
                session.put(f"{BASE}/{key}", large, congestion_control=zenoh.CongestionControl.BLOCK)
                tried += 1
            list(session.get(f"{BASE}/control/aero", payload=large, timeout=1.0))
            list(session.get(f"{BASE}/refusal", payload=large, timeout=1.0))
            tried += 2
    time.sleep(GRACE)
    return Attempt(tried, "dropped")


def scenario_paths(bed: Bed) -> Attempt:
    """Be a dynamics whose scenario names files wherever there is a text."""
    program = [sys.executable, "-m", "tests.security.scenario_paths"]
    done = subprocess.run(program, capture_output=True, text=True, check=False, timeout=120.0)
    assert done.returncode == 0, done.stdout + done.stderr
    tried, touched, said = done.stdout.strip().split("\t")
    assert touched == "0", done.stdout
    return Attempt(int(tried), said)


def tampered_fmu(bed: Bed) -> Attempt:
    """Change a byte of the force FMU that the scenario, and so the log, knows by its SHA-256."""
    from linkwind.fmi.host.archive import sha256

    folder = bed.folder
    linkwind = [sys.executable, "-m", "linkwind"]
    fmu, other = folder / "plate.fmu", folder / "tampered.fmu"
    export = [*linkwind, "fmu", "export", "two_link", "--part", "aero", "-o", str(fmu)]
    subprocess.run(export, check=True, capture_output=True)
    other.write_bytes(fmu.read_bytes() + b"\0")
    known = ["--set", f'aero.fmu.sha256="{sha256(fmu)}"', "--set=time.end=0.01"]
    run = ["run", "two_link", "--force-fmu", str(other), "--out", "fmu", *known]
    done = subprocess.run([*linkwind, *run], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 3, done.stderr
    assert "expected the FMU with SHA-256" in done.stderr
    assert not (folder / "fmu" / "log.mcap").exists()
    return Attempt(1, done.stderr.strip().partition("tampered.fmu: ")[2][:60] + "…")


ATTACKS: dict[str, Callable[[Bed], Attempt]] = {
    "unauthenticated publish": unauthenticated,
    "self-made certificate": self_made,
    "spoofed participant": spoofed,
    "observer that publishes": observer_publishes,
    "read without a right": reads_without_right,
    "replayed old messages": replayed,
    "impostor of the dynamics": impostor_dynamics,
    "TLS downgrade": downgraded,
    "oversized messages": oversized,
    "tampered scenario paths": scenario_paths,
    "tampered FMU": tampered_fmu,
}
