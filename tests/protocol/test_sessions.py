"""The lock-step protocol without a network: both state machines, message by message."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from linkwind.errors import FaultError, ProtocolError, RefusedError, SimulationError
from linkwind.protocol import DynamicsSession, ProviderSession, ProviderState, fault_error
from linkwind.schema import MESSAGES, SHA256
from tests.fakes import FakeModel

Control = MESSAGES["Control"]
STEP_NS = 1_000_000


def dynamics(**providers: list[str]) -> DynamicsSession:
    return DynamicsSession("r1", "{}", STEP_NS, 10, ["a", "b"], providers or {"aero": ["a", "b"]})


def provider(model: FakeModel | None = None, name: str = "aero") -> ProviderSession:
    made = model or FakeModel()
    return ProviderSession(name, lambda scenario_json, name: made)


def shake_hands(d: DynamicsSession, p: ProviderSession) -> None:
    p.welcome(d.control(p.hello()))
    p.build()
    p.started(d.control(p.ready()))


@pytest.fixture
def pair() -> tuple[DynamicsSession, ProviderSession, FakeModel]:
    model = FakeModel()
    d, p = dynamics(), provider(model)
    shake_hands(d, p)
    return d, p, model


def exchange(d: DynamicsSession, p: ProviderSession, step: int, iteration: int = 0) -> bytes:
    answer = p.answer(d.post(step, iteration))
    assert answer is not None
    assert d.accept(p.name, answer)
    return answer


def reason(reply: bytes) -> str:
    return str(Control.FromString(reply).refuse.reason)


OTHERS = 'control: expected a message of "tail", by its key; got one of "aero"'


def test_nobody_speaks_by_the_key_of_another() -> None:
    d, p = dynamics(), provider()
    for message in (
        p.hello(),
        Control(bye={"name": "aero"}).SerializeToString(),
        p.fault(ProtocolError("x")),
    ):
        assert reason(d.control(message, "tail")) == OTHERS
    assert d.failure is None
    assert d.not_gone == ["aero"]
    p.welcome(d.control(p.hello(), "aero"))


def test_hand_shake_names_bodies_and_steps() -> None:
    d, p = dynamics(aero=["b"]), provider()
    welcome = Control.FromString(d.control(p.hello())).welcome
    assert (welcome.run, welcome.step_ns, welcome.steps) == ("r1", STEP_NS, 10)
    assert list(welcome.bodies) == ["a", "b"]
    assert list(welcome.provider_bodies) == ["b"]
    assert d.not_ready == ["aero"]
    shake_hands(d, p)
    assert d.not_ready == []
    assert p.state is ProviderState.RUNNING


def test_step_zero_commits_nothing_and_gives_the_first_wrench(
    pair: tuple[DynamicsSession, ProviderSession, FakeModel],
) -> None:
    d, p, model = pair
    d.motion.trial.linear[:] = [[1, 2, 3], [4, 5, 6]]
    exchange(d, p, 0)
    assert model.calls == [("evaluate", 0.0)]
    wrench, added, _ = d.total()
    assert added is None
    assert wrench[:, :3].tolist() == [[-1, -2, -3], [-4, -5, -6]]  # FakeModel: force = −velocity


def test_order_of_exchange(pair: tuple[DynamicsSession, ProviderSession, FakeModel]) -> None:
    d, p, model = pair
    for step in range(3):
        exchange(d, p, step)
    assert model.calls == [
        ("evaluate", 0.0),
        ("commit", 0.0),
        ("evaluate", 0.001),
        ("commit", 0.001),
        ("evaluate", 0.002),
    ]


def test_iteration_evaluates_again_without_a_commit(
    pair: tuple[DynamicsSession, ProviderSession, FakeModel],
) -> None:
    d, p, model = pair
    exchange(d, p, 0)
    exchange(d, p, 1)
    exchange(d, p, 1, iteration=1)
    assert model.calls[-3:] == [("commit", 0.0), ("evaluate", 0.001), ("evaluate", 0.001)]


def test_iteration_without_rollback_is_refused() -> None:
    d, p = dynamics(), provider(FakeModel(rollback=False))
    shake_hands(d, p)
    exchange(d, p, 0)
    exchange(d, p, 1)
    with pytest.raises(ProtocolError, match="iteration 1 asked, but it cannot roll back"):
        p.answer(d.post(1, 1))


def test_repeated_motion_is_answered_from_memory(
    pair: tuple[DynamicsSession, ProviderSession, FakeModel],
) -> None:
    d, p, model = pair
    first = exchange(d, p, 0)
    calls = list(model.calls)
    assert p.answer(d.post(0, 0)) == first
    assert model.calls == calls


def test_stale_motion_is_dropped_and_leaves_no_trace(
    pair: tuple[DynamicsSession, ProviderSession, FakeModel], caplog: pytest.LogCaptureFixture
) -> None:
    d, p, model = pair
    old = d.post(0, 0)
    exchange(d, p, 0)
    exchange(d, p, 1)
    calls = list(model.calls)
    assert p.answer(old) is None
    assert model.calls == calls
    assert "stale" in caplog.text
    exchange(d, p, 2)


@pytest.mark.parametrize(("step", "iteration"), [(2, 0), (1, 1), (5, 0)])
def test_gap_is_an_error(
    pair: tuple[DynamicsSession, ProviderSession, FakeModel], step: int, iteration: int
) -> None:
    d, p, _ = pair
    exchange(d, p, 0)
    with pytest.raises(ProtocolError, match=f"expected step 1 iteration 0; got step {step}"):
        p.answer(d.post(step, iteration))


def test_end_commits_the_last_state_and_says_bye(
    pair: tuple[DynamicsSession, ProviderSession, FakeModel],
) -> None:
    d, p, model = pair
    exchange(d, p, 0)
    assert p.answer(d.post(10, 0, final=True)) is None
    assert model.calls[-1] == ("commit", 0.01)
    assert p.state is ProviderState.DONE
    assert d.not_gone == ["aero"]
    d.control(p.bye())
    assert d.not_gone == []
    assert d.answered or d.unanswered == []


def test_second_participant_of_a_name_is_refused_and_the_first_goes_on(
    pair: tuple[DynamicsSession, ProviderSession, FakeModel],
) -> None:
    d, p, _ = pair
    exchange(d, p, 0)
    with pytest.raises(RefusedError, match='a participant named "aero" already takes part in run r1'):
        provider().welcome(d.control(provider().hello()))
    assert d.failure is None
    exchange(d, p, 1)


def test_hello_may_be_repeated_by_the_same_process() -> None:
    d, p = dynamics(), provider()
    assert d.control(p.hello()) == d.control(p.hello())


def test_unknown_name_is_refused() -> None:
    d = dynamics()
    with pytest.raises(RefusedError, match='participant "wing": expected one of aero'):
        provider().welcome(d.control(provider(name="wing").hello()))
    assert d.failure is None


def test_other_schema_ends_the_run_on_both_sides() -> None:
    d = dynamics()
    hello = {"name": "aero", "schema_sha256": "0" * 64, "version": "mine 0.0.1", "instance": "x"}
    reply = d.control(Control(hello=hello).SerializeToString())
    assert f"expected schema {SHA256[:12]}" in reason(reply)
    assert "got 000000000000 (mine 0.0.1)" in reason(reply)
    assert isinstance(d.failure, RefusedError)


@pytest.mark.parametrize("request_", [b"", b"\xff\xff\xff", b"hello", Control(start={}).SerializeToString()])
def test_nonsense_on_control_is_refused(request_: bytes) -> None:
    d = dynamics()
    assert "control: expected" in reason(d.control(request_))


def test_ready_without_hello_is_refused() -> None:
    d = dynamics()
    assert "Ready without Hello" in reason(d.control(Control(ready={"name": "aero"}).SerializeToString()))
    assert d.not_ready == ["aero"]


def test_response_of_a_wrong_size_is_refused() -> None:
    d, p = dynamics(), provider()
    p.welcome(d.control(p.hello()))
    ready = Control(ready={"name": "aero", "instance": p.instance, "response_size": 71})
    refused = reason(d.control(ready.SerializeToString()))
    assert "expected 0, 72 or 144 numbers for 2 bodies; got 71" in refused


def test_responses_of_several_providers_add_up_at_the_rows_and_columns_of_their_bodies() -> None:
    d = dynamics(aero=["b", "a"], wing=["b"])
    coupled, own = FakeModel(response_size=144), FakeModel(response_size=36)
    coupled.response, own.response = np.arange(144.0), -np.arange(36.0)
    participants = [provider(coupled), provider(own, "wing")]
    for p in participants:
        shake_hands(d, p)
    d.post(0, 0)
    for p in participants:
        assert d.accept(p.name, p.answer(d.motion.payload()) or b"")
    matrix, block = coupled.response.reshape(12, 12), own.response.reshape(6, 6)
    expected = np.zeros((12, 12))
    swap = [*range(6, 12), *range(6)]  # the provider's first body is the scenario's second
    expected[np.ix_(swap, swap)] = matrix
    expected[6:, 6:] += block
    np.testing.assert_array_equal(d.total()[2], expected)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["force", "torque", "added_inertia"])
def test_wrench_that_is_not_finite_names_provider_body_and_step(bad: float, where: str) -> None:
    model = FakeModel(added_inertia=True)
    d, p = dynamics(), provider(model)
    shake_hands(d, p)
    exchange(d, p, 0)
    d.total()
    model.poison = (where, 1, bad)
    exchange(d, p, 1)
    name = where.replace("_", " ")
    with pytest.raises(
        SimulationError, match=rf'"aero": step 1 \(t = 0.001 s\): {name} on b: expected finite'
    ):
        d.total()


def test_wrench_that_is_huge_is_not_taken_for_infinite() -> None:
    d, p = dynamics(), provider(FakeModel(value=1e200))
    shake_hands(d, p)
    exchange(d, p, 0)
    assert d.total()[0][0, 3] == 1e200


def test_wrench_of_the_future_is_an_error_and_of_the_past_is_dropped(
    pair: tuple[DynamicsSession, ProviderSession, FakeModel],
) -> None:
    d, p, _ = pair
    first = exchange(d, p, 0)
    d.motion.trial.linear[:] = 7.0
    answer = p.answer(d.post(1, 0))
    assert answer is not None
    assert d.accept("aero", first) is False
    assert not d.answered
    assert d.accept("aero", answer) is True
    assert d.answered
    # A late repetition must not overwrite the numbers that were accepted.
    assert d.accept("aero", first) is False
    wrench, _, _ = d.total()
    assert (wrench[:, :3] == -7.0).all()
    d.post(0, 0)
    with pytest.raises(ProtocolError, match="expected step 0 iteration 0; got step 1"):
        d.accept("aero", answer)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda m: m.update(run="other"),
        lambda m: m.update(provider="wing"),
        lambda m: m.update(force=[0.0] * 9),
        lambda m: m.update(torque=[]),
        lambda m: m.update(kind=2),
    ],
    ids=["run", "provider", "too many", "missing", "kind"],
)
def test_wrench_of_another_run_provider_or_size_is_an_error(
    pair: tuple[DynamicsSession, ProviderSession, FakeModel], spoil: Callable[[dict[str, object]], None]
) -> None:
    d, _, _ = pair
    d.post(0, 0)
    fields: dict[str, object] = {
        "run": "r1",
        "provider": "aero",
        "step": 0,
        "iteration": 0,
        "time_ns": 0,
        "kind": 1,
        "force": [0.0] * 6,
        "torque": [0.0] * 6,
    }
    assert d.accept("aero", MESSAGES["WrenchStep"](**fields).SerializeToString())
    d.post(0, 0)
    spoil(fields)
    with pytest.raises(ProtocolError, match=r'wrench from "aero": WrenchStep\.\w+: expected .*; got '):
        d.accept("aero", MESSAGES["WrenchStep"](**fields).SerializeToString())


def test_answers_of_several_providers_add_up_in_scenario_order() -> None:
    d = DynamicsSession("r1", "{}", STEP_NS, 10, ["a", "b", "c"], {"one": ["c", "a"], "two": ["b", "c"]})
    one, two = (
        provider(FakeModel(value=1.0, added_inertia=True), "one"),
        provider(FakeModel(value=10.0), "two"),
    )
    shake_hands(d, one)
    shake_hands(d, two)
    motion = d.post(0, 0)
    for p in (two, one):
        answer = p.answer(motion)
        assert answer is not None
        d.accept(p.name, answer)
    wrench, added, _ = d.total()
    assert added is not None
    assert wrench[:, 3].tolist() == [1.0, 10.0, 11.0]  # FakeModel: torque x = value
    assert added[:, 0, 0].tolist() == [1.0, 0.0, 1.0]


def test_fault_names_participant_step_and_cause(
    pair: tuple[DynamicsSession, ProviderSession, FakeModel],
) -> None:
    d, p, _ = pair
    exchange(d, p, 0)
    exchange(d, p, 1)
    d.control(p.fault(SimulationError("alpha is out of range")))
    assert isinstance(d.failure, FaultError)
    assert str(d.failure) == '"aero" stopped at step 1: SimulationError: alpha is out of range'
    with pytest.raises(ProtocolError, match="control: expected one of fault"):
        raise fault_error(p.hello())


def test_provider_that_died_before_ready_can_be_replaced() -> None:
    d, first, second = dynamics(), provider(), provider()
    first.welcome(d.control(first.hello()))
    shake_hands(d, second)
    assert d.not_ready == []
    first.build()
    with pytest.raises(RefusedError, match="Ready without Hello"):
        first.started(d.control(first.ready()))
