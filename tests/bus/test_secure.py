"""A secure bus: who belongs there gets the same bits, who does not gets nowhere and is told why."""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import pytest

from linkwind import checkpoints
from linkwind.aero.service import serve
from linkwind.bus.zenoh import (
    ZenohDynamicsLink,
    ZenohListener,
    ZenohProviderLink,
    ZenohRouter,
    loopback_endpoint,
)
from linkwind.checkpoints import Checkpoint, State
from linkwind.credentials import Identity
from linkwind.credentials.authority import DEFAULT_ROLES, Role, issue
from linkwind.credentials.checks import load_identity
from linkwind.errors import InputError, LostError, RefusedError, TrustError
from linkwind.protocol import Course, DynamicsSession, ProviderSession
from tests.bus.test_checkpoints import Large, steps
from tests.bus.test_zenoh import STEP_NS, march, session
from tests.fakes import FakeModel

Start = Callable[..., tuple[DynamicsSession, ZenohDynamicsLink]]
PATIENCE = 20.0  # s for a machine under load


@pytest.fixture(scope="module")
def certs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("certs")
    issue(folder, [*DEFAULT_ROLES, Role("tail"), Role("router", ("127.0.0.1",))], 2)
    issue(folder / "strangers", [*DEFAULT_ROLES, Role("tail")], 2)
    return folder


@pytest.fixture
def endpoint() -> str:
    return loopback_endpoint("tls")


class Provider(threading.Thread):
    """A provider that serves in a thread and remembers how it ended."""

    def __init__(
        self, endpoint: str, folder: Path | None, name: str = "aero", model: FakeModel | None = None
    ) -> None:
        super().__init__(daemon=True)
        self.error: BaseException | None = None
        self.took = 0.0
        self._arguments = endpoint, folder, name, model or FakeModel()
        self.start()

    def run(self) -> None:
        endpoint, folder, name, model = self._arguments
        identity = load_identity(folder, name) if folder else None
        start = time.monotonic()
        with closing(ZenohProviderLink([endpoint], [], name=name, identity=identity)) as link:
            try:
                serve(link, ProviderSession(name, lambda scenario, provider: model), PATIENCE)
            except BaseException as error:
                self.error = error
        self.took = time.monotonic() - start


@pytest.fixture
def dynamics(certs: Path, endpoint: str) -> Iterator[Start]:
    links: list[ZenohDynamicsLink] = []

    def start(folder: Path | None = certs, at: str = endpoint, connect: str = ""):
        d = session()
        identity = load_identity(folder, "dynamics") if folder else None
        ends = ([], [connect]) if connect else ([at], [])
        links.append(ZenohDynamicsLink(d, *ends, 5.0, identity))
        return d, links[-1]

    yield start
    for link in links:
        link.close()


def complete(d: DynamicsSession, link: ZenohDynamicsLink, provider: Provider) -> bytes:
    """Do ten steps; return every wrench."""
    assert link.wait(lambda: not d.not_ready, PATIENCE, lambda: None)
    wrenches = march(d, link)
    provider.join(PATIENCE)
    assert provider.error is None
    return wrenches


def test_same_bits_as_without_tls_directly_and_through_a_router(
    certs: Path, endpoint: str, dynamics: Start
) -> None:
    plain, other = loopback_endpoint(), loopback_endpoint("tls")
    without = complete(*dynamics(None, plain), Provider(plain, None))
    assert complete(*dynamics(), Provider(endpoint, certs)) == without
    provider = Provider(other, certs)
    d, link = dynamics(connect=other)
    with closing(ZenohRouter([other], [], ["aero"], load_identity(certs, "router"))):
        assert complete(d, link, provider) == without


@pytest.mark.parametrize("routed", [False, True], ids=["directly", "through a router"])
def test_checkpoints_go_there_and_back_in_pieces(
    routed: bool, certs: Path, endpoint: str, dynamics: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkpoints, "PIECE", 100_000)
    with ExitStack() as stack:
        if routed:
            identity = load_identity(certs, "router")
            stack.enter_context(closing(ZenohRouter([endpoint], [], ["aero"], identity)))
        begin = Checkpoint(1, 5, 5 * STEP_NS, State.of(Large.memory(6)))
        d, link = dynamics(connect=endpoint if routed else "")
        d.course = Course(5, start=5, states={"aero": begin}, piece=70_000)
        provider = Provider(endpoint, certs, model=Large())
        assert link.wait(lambda: not d.not_ready, PATIENCE, lambda: None)
        last = Checkpoint(2, 10, 10 * STEP_NS, State.of(Large.memory(11)))
        assert steps(d, link, 6) == [(6, begin), (11, last)]
        provider.join(PATIENCE)
    assert provider.error is None


REFUSED = {  # folder of the certificates, role, error and what it says
    "plain text": (None, "aero", TrustError, "there is TLS, and this side has none"),
    "another authority": ("strangers", "aero", TrustError, "the certificate there is not to be trusted: "),
    "no part in the run": (".", "tail", RefusedError, "r1: expected the certificate of aero; got another's"),
    "only to observe": (".", "observer", RefusedError, "r1: expected the certificate of aero; got another's"),
}


@pytest.mark.parametrize("who", REFUSED)
def test_who_does_not_belong_there_is_told_why_at_once(
    who: str, certs: Path, endpoint: str, dynamics: Start
) -> None:
    d, link = dynamics()
    folder, name, kind, text = REFUSED[who]
    at = endpoint if folder else endpoint.replace("tls/", "tcp/")
    provider = Provider(at, certs / folder if folder else None, name)
    provider.join(PATIENCE)
    assert isinstance(provider.error, kind), provider.error
    with pytest.raises(kind, match=text):
        raise provider.error
    assert provider.took < PATIENCE / 2  # no timeout
    complete(d, link, Provider(endpoint, certs))  # and the run does not mind


def test_certificate_that_the_dynamics_does_not_know_is_named(
    certs: Path, endpoint: str, dynamics: Start, tmp_path: Path
) -> None:
    """The stranger trusts the dynamics; the dynamics does not trust the stranger."""
    dynamics()
    shutil.copytree(certs / "strangers" / "aero", tmp_path / "aero")
    shutil.copy(certs / "aero" / "ca.pem", tmp_path / "aero" / "ca.pem")
    link = ZenohProviderLink([endpoint], [], name="aero", identity=Identity("aero", tmp_path / "aero"))
    with (
        closing(link),
        pytest.raises(TrustError, match=r"it does not accept the certificate of .*: unknown ca"),
    ):
        link.request(b"", PATIENCE)


def test_dynamics_without_tls_is_not_taken_for_one_with(certs: Path, dynamics: Start) -> None:
    plain = loopback_endpoint()
    dynamics(None, plain)
    provider = Provider(plain.replace("tcp/", "tls/"), certs)
    provider.join(PATIENCE)
    with pytest.raises(TrustError, match=r"there is no TLS. Start that side with --tls DIR"):
        raise provider.error or AssertionError


def test_recorder_is_told_as_well(certs: Path, endpoint: str, dynamics: Start) -> None:
    dynamics()
    for at, identity, error in (
        (endpoint.replace("tls/", "tcp/"), None, "there is TLS, and this side has none"),
        (endpoint, load_identity(certs / "strangers", "observer"), "not to be trusted"),
    ):
        with (
            closing(ZenohListener([], [at], identity=identity)) as listener,
            pytest.raises(TrustError, match=error),
        ):
            listener.find(PATIENCE)


def test_dynamics_of_another_name_is_not_believed(
    certs: Path, endpoint: str, dynamics: Start, tmp_path: Path
) -> None:
    """A good certificate, but for another machine: the name that one connects to counts."""
    shutil.copytree(certs / "ca", tmp_path / "ca")
    issue(tmp_path, [Role("dynamics", ("10.9.9.9",))], 2)
    dynamics(tmp_path)
    provider = Provider(endpoint, certs)
    provider.join(PATIENCE)
    with pytest.raises(TrustError, match="not to be trusted: IP address mismatch"):
        raise provider.error or AssertionError


def test_endpoints_and_certificates_go_together(certs: Path) -> None:
    identity = load_identity(certs, "aero")
    with pytest.raises(InputError, match=r"tcp/127.0.0.1:1: expected an endpoint with TLS, such as tls/"):
        ZenohProviderLink(["tcp/127.0.0.1:1"], [], name="aero", identity=identity)
    with pytest.raises(InputError, match=r"tls/127.0.0.1:1: expected --tls DIR \(or LINKWIND_TLS\)"):
        ZenohProviderLink(["tls/127.0.0.1:1"], [], name="aero")


def test_nobody_there_is_no_question_of_trust(certs: Path, endpoint: str) -> None:
    link = ZenohProviderLink([endpoint], [], name="aero", identity=load_identity(certs, "aero"))
    with closing(link), pytest.raises(LostError, match="no dynamics answered"):
        link.request(b"", 1.5)
