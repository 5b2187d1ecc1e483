"""The zenoh transport: both ends in one process, over a real TCP connection on the loopback."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from linkwind.aero.base import Capabilities
from linkwind.aero.service import serve
from linkwind.bus.inprocess import InProcessLink
from linkwind.bus.zenoh import ZenohDynamicsLink, ZenohProviderLink, loopback_endpoint
from linkwind.errors import (
    AnswerTimeoutError,
    FaultError,
    InputError,
    LostError,
    ProtocolError,
    RefusedError,
    SimulationError,
)
from linkwind.protocol import DynamicsSession, ProviderSession, fault
from linkwind.spatial import Motion, Wrench
from tests.fakes import FakeModel

STEP_NS = 1_000_000


class Provider(threading.Thread):
    """A provider that serves in a thread and remembers how it ended."""

    def __init__(
        self, endpoint: str, model: FakeModel, name: str = "aero", start_timeout: float = 10.0
    ) -> None:
        super().__init__(daemon=True)
        self.error: BaseException | None = None
        self._arguments = (endpoint, model, name, start_timeout)
        self.start()

    def run(self) -> None:
        endpoint, model, name, start_timeout = self._arguments
        link = ZenohProviderLink([endpoint], [], name=name)
        try:
            serve(link, ProviderSession(name, lambda scenario, provider: model), start_timeout)
        except BaseException as error:
            self.error = error
        finally:
            link.close()


def session(*names: str) -> DynamicsSession:
    return DynamicsSession(
        "r1", "{}", STEP_NS, 10, ["a", "b"], {name: ["a", "b"] for name in names or ("aero",)}
    )


@pytest.fixture
def endpoint() -> str:
    return loopback_endpoint()


@pytest.fixture
def open_link(endpoint: str) -> Iterator[Callable[..., ZenohDynamicsLink]]:
    links: list[ZenohDynamicsLink] = []

    def open_(d: DynamicsSession, timeout: float = 5.0) -> ZenohDynamicsLink:
        links.append(ZenohDynamicsLink(d, [endpoint], [], timeout))
        return links[-1]

    yield open_
    for link in links:
        link.close()


def exchange(d: DynamicsSession, link: ZenohDynamicsLink | InProcessLink, step: int) -> None:
    link.post(d.post(step, 0))
    while not d.answered:
        d.accept(*link.receive())


def finish(d: DynamicsSession, link: ZenohDynamicsLink | InProcessLink) -> None:
    link.post(d.post(10, 0, final=True))
    assert link.wait(lambda: not d.not_gone, 10.0, lambda: None)


def march(d: DynamicsSession, link: ZenohDynamicsLink | InProcessLink) -> bytes:
    """Run ten steps of velocity-dependent forces; return every wrench, as bytes."""
    rng = np.random.default_rng(1)
    wrenches = []
    for step in range(11):
        d.motion.trial.linear[:] = rng.normal(size=(2, 3))
        exchange(d, link, step)
        wrenches.append(d.total()[0].tobytes())
    finish(d, link)
    return b"".join(wrenches)


def test_zenoh_and_inprocess_give_the_same_bits(
    endpoint: str, open_link: Callable[..., ZenohDynamicsLink]
) -> None:
    d = session("one", "two")
    link = open_link(d)
    providers = [Provider(endpoint, FakeModel(value=i), name) for i, name in enumerate(("one", "two"))]
    assert link.wait(lambda: not d.not_ready, 10.0, lambda: None)
    over_zenoh = march(d, link)
    for provider in providers:
        provider.join(10.0)
        assert provider.error is None

    d = session("one", "two")
    models = [
        ProviderSession(name, lambda s, n, i=i: FakeModel(value=i)) for i, name in enumerate(("one", "two"))
    ]
    assert march(d, InProcessLink(d, models)) == over_zenoh


def test_provider_may_start_before_the_dynamics(
    endpoint: str, open_link: Callable[..., ZenohDynamicsLink]
) -> None:
    provider = Provider(endpoint, FakeModel())
    d = session()
    link = open_link(d)
    assert link.wait(lambda: not d.not_ready, 10.0, lambda: None)
    march(d, link)
    provider.join(10.0)
    assert provider.error is None


def test_no_dynamics_is_an_error_within_the_start_timeout(endpoint: str) -> None:
    provider = Provider(endpoint, FakeModel(), start_timeout=0.3)
    provider.join(10.0)
    assert isinstance(provider.error, LostError)
    assert f"no dynamics answered at {endpoint} within 0.3 s" in str(provider.error)


def test_second_provider_of_a_name_is_refused_and_the_run_goes_on(
    endpoint: str, open_link: Callable[..., ZenohDynamicsLink]
) -> None:
    d = session()
    link = open_link(d)
    first = Provider(endpoint, FakeModel())
    assert link.wait(lambda: not d.not_ready, 10.0, lambda: None)
    exchange(d, link, 0)
    second = Provider(endpoint, FakeModel())
    second.join(10.0)
    assert isinstance(second.error, RefusedError)
    assert 'a participant named "aero" already takes part' in str(second.error)
    for step in range(1, 11):
        exchange(d, link, step)
    finish(d, link)
    first.join(10.0)
    assert first.error is None


def test_endpoint_in_use_is_an_error_that_says_so(
    endpoint: str, open_link: Callable[..., ZenohDynamicsLink]
) -> None:
    open_link(session())
    with pytest.raises(InputError, match=f"cannot listen on {endpoint}.*is another dynamics running there"):
        open_link(session())


def test_silent_provider_is_told_from_a_lost_one(
    endpoint: str, open_link: Callable[..., ZenohDynamicsLink]
) -> None:
    release = threading.Event()

    class Stuck(FakeModel):
        def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
            if t > 0.0:
                release.wait(10.0)

    d = session()
    link = open_link(d, timeout=0.3)
    provider = Provider(endpoint, Stuck())
    assert link.wait(lambda: not d.not_ready, 10.0, lambda: None)
    exchange(d, link, 0)
    with pytest.raises(
        AnswerTimeoutError,
        match=r'no Wrench from "aero" for step 1 \(t = 0.001 s\) within 0.3 s; it is alive',
    ):
        exchange(d, link, 1)
    link.fault(fault("dynamics", 1, 0, AnswerTimeoutError("too late")))
    release.set()
    provider.join(10.0)
    assert isinstance(provider.error, FaultError)
    assert str(provider.error) == '"dynamics" stopped at step 1: AnswerTimeoutError: too late'


def test_failing_model_ends_the_run_with_its_reason(
    endpoint: str, open_link: Callable[..., ZenohDynamicsLink]
) -> None:
    class Failing(FakeModel):
        def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
            if t > 0.0:
                raise SimulationError("stalled")

    d = session()
    link = open_link(d)
    provider = Provider(endpoint, Failing())
    assert link.wait(lambda: not d.not_ready, 10.0, lambda: None)
    exchange(d, link, 0)
    with pytest.raises(FaultError, match='"aero" stopped at step 1: SimulationError: stalled'):
        exchange(d, link, 1)
    provider.join(10.0)
    assert isinstance(provider.error, SimulationError)


def test_model_that_cannot_be_built_ends_the_hand_shake(
    endpoint: str, open_link: Callable[..., ZenohDynamicsLink]
) -> None:
    class Unbuildable(FakeModel):
        @property
        def capabilities(self) -> Capabilities:
            raise SimulationError("no such wing")

        @capabilities.setter
        def capabilities(self, value: Capabilities) -> None:
            pass

    d = session()
    link = open_link(d)
    provider = Provider(endpoint, Unbuildable())
    with pytest.raises(FaultError, match="no such wing"):
        link.wait(lambda: not d.not_ready, 10.0, lambda: None)
    provider.join(10.0)
    assert isinstance(provider.error, SimulationError)


@pytest.mark.parametrize(("first", "step"), [(10.0, 1), (0.5, 0)])
def test_the_first_answer_may_take_as_long_as_a_start(endpoint: str, first: float, step: int) -> None:
    """A large model is made with the first motion; from then on the time for an answer counts."""
    release = threading.Event()

    class Large(FakeModel):
        def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
            release.wait(1.0 if t == 0.0 else 10.0)

    d = session()
    link = ZenohDynamicsLink(d, [endpoint], [], 0.3, first=first)
    provider = Provider(endpoint, Large())
    try:
        assert link.wait(lambda: not d.not_ready, 10.0, lambda: None)
        setting = "coupling.timeout" if step else "bus.start_timeout"
        late = rf'no Wrench from "aero" for step {step} .* alive\. Is it still computing\? Raise {setting},'
        for k in range(step):
            exchange(d, link, k)
        with pytest.raises(AnswerTimeoutError, match=late):
            exchange(d, link, step)
    finally:
        release.set()
        link.close()
        provider.join(10.0)


def test_dynamics_that_leaves_is_noticed(endpoint: str) -> None:
    d = session()
    link = ZenohDynamicsLink(d, [endpoint], [], 5.0)
    provider = Provider(endpoint, FakeModel())
    assert link.wait(lambda: not d.not_ready, 10.0, lambda: None)
    exchange(d, link, 0)
    link.close()
    provider.join(10.0)
    assert isinstance(provider.error, LostError)
    assert "the dynamics was lost" in str(provider.error)


@pytest.mark.parametrize(
    ("name", "payload", "expected"),
    [
        ("stranger", b"x", 'wrench from "stranger": it does not take part in run r1'),
        ("aero", b"nonsense", 'wrench from "aero": expected a WrenchStep of this run'),
    ],
)
def test_nonsense_on_a_wrench_key_is_an_error_with_a_name(
    endpoint: str, open_link: Callable[..., ZenohDynamicsLink], name: str, payload: bytes, expected: str
) -> None:
    class Slow(FakeModel):
        def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
            if t > 0.0:
                asked.set()
                release.wait(10.0)

    asked, release = threading.Event(), threading.Event()
    d = session()
    link = open_link(d)
    provider = Provider(endpoint, Slow())
    assert link.wait(lambda: not d.not_ready, 10.0, lambda: None)
    stranger = ZenohProviderLink([endpoint], [], name=name)
    stranger.join("r1")
    exchange(d, link, 0)
    link.post(d.post(1, 0))
    assert asked.wait(10.0)
    stranger.reply(payload)
    with pytest.raises(ProtocolError, match=expected) as error:
        d.accept(*link.receive())
    link.fault(fault("dynamics", 1, 0, error.value))
    release.set()
    provider.join(10.0)
    assert isinstance(provider.error, FaultError)
    stranger.close()


def test_first_motion_is_sent_again_to_whoever_has_not_answered(
    endpoint: str, open_link: Callable[..., ZenohDynamicsLink]
) -> None:
    """One provider hears the first motion, the other subscribes only when it has gone out."""
    d = session("early", "late")
    link = open_link(d)
    early = Provider(endpoint, FakeModel(), "early")
    model = FakeModel()
    late = ProviderSession("late", lambda scenario, name: model)
    slow = ZenohProviderLink([endpoint], [], name="late")
    late.welcome(slow.request(late.hello(), 10.0))
    late.build()
    late.started(slow.request(late.ready(), 10.0))
    assert link.wait(lambda: not d.not_ready, 10.0, lambda: None)
    link.post(d.post(0, 0))
    assert d.accept(*link.receive())
    assert d.unanswered == ["late"]
    slow.join("r1")
    answering = threading.Thread(target=lambda: slow.reply(late.answer(slow.receive()) or b""))
    answering.start()
    while not d.answered:
        d.accept(*link.receive())
    answering.join(10.0)
    assert model.calls == [("evaluate", 0.0)]
    link.fault(fault("dynamics", 0, 0, LostError("the test is over")))
    early.join(10.0)
    slow.close()


def test_time_that_the_dynamics_takes_itself_is_not_the_provider_s(
    endpoint: str, open_link: Callable[..., ZenohDynamicsLink]
) -> None:
    d = session()
    link = open_link(d, timeout=0.3)
    provider = Provider(endpoint, FakeModel())
    assert link.wait(lambda: not d.not_ready, 10.0, lambda: None)
    exchange(d, link, 0)
    link.post(d.post(1, 0))
    threading.Event().wait(0.8)  # a slow disk: the answer has long been here
    assert d.accept(*link.receive())
    for step in range(2, 11):
        exchange(d, link, step)
    finish(d, link)
    provider.join(10.0)
    assert provider.error is None


def test_what_is_old_does_not_give_a_silent_provider_more_time(
    endpoint: str, open_link: Callable[..., ZenohDynamicsLink]
) -> None:
    """Answers to the step before keep coming, from a double; they would for a minute."""
    release, over, given_up = threading.Event(), threading.Event(), threading.Event()

    class Stuck(FakeModel):
        def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
            if t > 0.0:
                release.wait(60.0)

    d = session()
    link = open_link(d, timeout=0.5)
    provider = Provider(endpoint, Stuck())
    assert link.wait(lambda: not d.not_ready, 10.0, lambda: None)
    exchange(d, link, 0)
    old = d.participants["aero"].payload
    double = ZenohProviderLink([endpoint], [], name="aero")
    double.join("r1")

    def repeat() -> None:
        for _ in range(3000):
            double.reply(old)
            if over.wait(0.02):
                return
        given_up.set()

    accepted: list[bool] = []

    def await_answer() -> None:
        while not d.answered:
            accepted.append(d.accept(*link.receive()))

    repeating = threading.Thread(target=repeat)
    repeating.start()
    link.post(d.post(1, 0))
    with pytest.raises(AnswerTimeoutError, match=r'no Wrench from "aero" for step 1 .* within 0.5 s'):
        await_answer()
    assert not given_up.is_set()
    assert accepted
    assert not any(accepted)
    over.set()
    repeating.join(60.0)
    link.fault(fault("dynamics", 1, 0, AnswerTimeoutError("too late")))
    release.set()
    provider.join(10.0)
    double.close()


def test_an_answer_counts_before_the_clock_is_looked_at(open_link: Callable[..., ZenohDynamicsLink]) -> None:
    """A reader that gets no time for long finds calls to wake up, and the answer that came in time behind."""
    link = open_link(session())
    for _ in range(20):
        link._wake()
    link._session.put("linkwind/v1/r1/wrench/aero", b"an answer")
    sample = link._receive()
    assert sample is not None
    assert sample.payload.to_bytes() == b"an answer"


def test_reader_that_is_busy_does_not_fill_its_own_queue(
    endpoint: str, open_link: Callable[..., ZenohDynamicsLink], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The watchdog wakes up a reader that waits; nobody would take away what it sent to one that does not."""

    class Interrupted:
        def try_recv(self) -> None:
            return None

        def recv(self) -> None:
            raise KeyboardInterrupt

    link = open_link(session())
    monkeypatch.setattr(link, "_incoming", Interrupted())
    with pytest.raises(KeyboardInterrupt):
        link.receive()
    woken = []
    monkeypatch.setattr(ZenohDynamicsLink, "_wake", lambda self: woken.append(self._reading))
    threading.Event().wait(0.5)
    assert woken == []


@pytest.mark.parametrize("name", ["", "a/b", "*", "a b"])
def test_names_that_mean_something_in_a_key_are_refused(endpoint: str, name: str) -> None:
    with pytest.raises(InputError, match="--run: expected letters"):
        ZenohDynamicsLink(DynamicsSession(name, "{}", 1, 1, ["a"], {"aero": ["a"]}), [endpoint], [], 1.0)
    if name != "*":
        with pytest.raises(InputError, match="--run: expected letters"):
            ZenohProviderLink([endpoint], [], name, name="aero")


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [
        ("foo:1", "tcp/foo:1"),
        ("7447", "tcp/127.0.0.1:7447"),
        (":7448", "tcp/127.0.0.1:7448"),
        ("foo", "tcp/foo:7447"),
        ("tcp/foo", "tcp/foo:7447"),
        ("tcp/foo:99999", "tcp/foo:7447"),
        ("tcp/foo:http", "tcp/foo:7447"),
        ("", "tcp/127.0.0.1:7447"),
    ],
)
def test_endpoint_that_is_none_is_an_error_of_ours(wrong: str, meant: str) -> None:
    with pytest.raises(InputError) as error:
        ZenohProviderLink([wrong], [], name="aero")
    assert str(error.value) == (
        "expected an endpoint with protocol, address and port, such as tcp/127.0.0.1:7447; got "
        f'"{wrong}". Did you mean {meant}?'
    )
