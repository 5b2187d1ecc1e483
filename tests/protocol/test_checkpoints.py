"""Checkpoints between the two state machines, and a provider that goes on from one."""

from __future__ import annotations

import dataclasses

import pytest

from linkwind.checkpoints import Checkpoint, decode
from linkwind.errors import ProtocolError, SimulationError
from linkwind.protocol import Course, DynamicsSession, ProviderSession
from linkwind.spatial import Motion
from tests.fakes import FakeModel

STEP_NS, STEPS = 1_000_000, 10


class Counting(FakeModel):
    """Its memory is how many times it has committed."""

    def __init__(self, **settings: object) -> None:
        super().__init__(**settings)
        self.count = 0

    def commit(self, t: float, motion: Motion) -> None:
        super().commit(t, motion)
        self.count += 1

    def save(self) -> bytes:
        return str(self.count).encode()

    def restore(self, blob: bytes) -> None:
        self.count = int(blob)


def pair(*models: FakeModel, course: Course) -> tuple[DynamicsSession, ProviderSession]:
    """Return both sides; the provider takes the next of ``models`` whenever it builds one."""
    d = DynamicsSession("r1", "{}", STEP_NS, STEPS, ["a", "b"], {"aero": ["a", "b"]})
    d.course = course
    waiting = iter(models)
    p = ProviderSession("aero", lambda scenario, name: next(waiting))
    p.welcome(d.control(p.hello()))
    p.build()
    p.started(d.control(p.ready()))
    return d, p


def march(d: DynamicsSession, p: ProviderSession, first: int = 0) -> dict[int, Checkpoint]:
    """Do the steps from ``first`` on; return the checkpoints by the exchange that brought them."""
    came = {}
    for step in range(first, STEPS + 1):
        answer = p.answer(d.post(step, 0))
        came |= [(step, d.checkpoint("aero", payload)) for payload in p.checkpoints()]
        assert d.accept("aero", answer or b"")
    assert p.answer(d.post(STEPS, 0, final=True)) is None
    came |= [(STEPS + 1, d.checkpoint("aero", payload)) for payload in p.checkpoints()]
    d.control(p.bye())
    d.check_frames()
    return came


def test_a_checkpoint_is_taken_after_the_commit_of_its_step() -> None:
    came = march(*pair(Counting(), course=Course(checkpoint_every=4)))
    assert came == {5: Checkpoint(4, 4 * STEP_NS, b"5"), 9: Checkpoint(8, 8 * STEP_NS, b"9")}


def test_the_last_step_has_one_as_well() -> None:
    came = march(*pair(Counting(), course=Course(checkpoint_every=5)))
    assert {step: c.step for step, c in came.items()} == {6: 5, 11: 10}


def test_no_checkpoints_unless_asked_for() -> None:
    assert march(*pair(Counting(), course=Course())) == {}


def test_models_that_cannot_save_have_none() -> None:
    class Failing(Counting):
        def save(self) -> bytes:
            raise SimulationError("no FMU state")

    for model in (Counting(rollback=False), Failing()):
        assert march(*pair(model, course=Course(checkpoint_every=4))) == {}


def test_a_provider_goes_on_from_its_checkpoint() -> None:
    model = Counting()
    d, p = pair(model, course=Course(checkpoint_every=4, start=4, states={"aero": (1, b"5")}))
    came = march(d, p, first=5)
    assert came == {5: Checkpoint(4, 4 * STEP_NS, b"5"), 9: Checkpoint(8, 8 * STEP_NS, b"9")}
    times = [t for name, t in model.calls if name == "commit"]
    assert times == pytest.approx([0.005, 0.006, 0.007, 0.008, 0.009, 0.010])
    assert model.calls[0] == ("evaluate", 0.005)


def test_a_provider_that_goes_on_refuses_another_step() -> None:
    d, p = pair(Counting(), course=Course(start=4, states={"aero": (1, b"5")}))
    with pytest.raises(ProtocolError, match="expected step 5 iteration 0; got step 6"):
        p.answer(d.post(6, 0))


def test_a_change_on_the_way_keeps_the_memory() -> None:
    before, after = Counting(value=1.0), Counting(value=2.0)
    d, p = pair(before, after, course=Course(changes={3: "{}"}))
    torques = []
    for step in range(6):
        assert d.accept("aero", p.answer(d.post(step, 0)) or b"")
        torques.append(d.total()[0][0, 3])
    assert torques == [1.0, 1.0, 1.0, 1.0, 2.0, 2.0]
    assert (before.count, after.count) == (4, 5)


def test_behind_a_change_the_changed_scenario_counts() -> None:
    for start, built in ((2, 1.0), (3, 1.0), (4, 2.0)):
        names = []
        d = DynamicsSession("r1", "1.0", STEP_NS, STEPS, ["a", "b"], {"aero": ["a", "b"]})
        d.course = Course(start=start, states={"aero": (1, b"1")}, changes={3: "2.0"})
        p = ProviderSession("aero", lambda text, name: names.append(text) or Counting(value=float(text)))  # noqa: B023
        p.welcome(d.control(p.hello()))
        p.build()
        assert [float(text) for text in names] == [built]


def test_a_change_of_what_the_answer_holds_is_refused() -> None:
    d, p = pair(Counting(), Counting(added_inertia=True), course=Course(changes={0: "{}"}))
    p.answer(d.post(0, 0))
    with pytest.raises(ProtocolError, match="step 0: expected a model with the same kind of answer"):
        p.answer(d.post(1, 0))


def test_a_lost_checkpoint_is_missed() -> None:
    d, p = pair(Counting(), course=Course(checkpoint_every=1))
    for step in range(4):
        p.answer(d.post(step, 0))
    _, second, _ = [*p.checkpoints(), b""]
    with pytest.raises(ProtocolError, match=r'checkpoint from "aero": step 3 .*expected number 1; got 2'):
        d.checkpoint("aero", second)


def test_a_damaged_or_foreign_checkpoint_is_refused() -> None:
    one = Checkpoint(3, 3 * STEP_NS, b"memory")
    payload = one.encode("r1", "aero", 7)
    assert decode(payload, "r1", "aero") == (7, one)
    with pytest.raises(ProtocolError, match="expected a Checkpoint of this run, SHA-256"):
        decode(payload.replace(b"memory", b"memorx"), "r1", "aero")
    for run, provider in (("r2", "aero"), ("r1", "cfd")):
        with pytest.raises(ProtocolError, match='got one of run r1 from "aero"'):
            decode(payload, run, provider)
    with pytest.raises(ProtocolError, match="expected a Checkpoint of this run; got"):
        decode(b"\xff", "r1", "aero")
    assert dataclasses.replace(one, state=b"").encode("r1", "aero", 1)
