"""Checkpoints between the two state machines, and a provider that goes on from one."""

from __future__ import annotations

import hashlib
from typing import Any

import pytest

from linkwind import checkpoints
from linkwind.checkpoints import Checkpoint, Joining, State, decode
from linkwind.errors import ParticipantError, ProtocolError, RefusedError, SimulationError
from linkwind.protocol import Course, DynamicsSession, ProviderSession
from linkwind.schema import MESSAGES
from linkwind.spatial import Motion
from tests.fakes import FakeModel

STEP_NS, STEPS = 1_000_000, 10


def saved(number: int, step: int, blob: bytes) -> Checkpoint:
    return Checkpoint(number, step, step * STEP_NS, State.of(blob))


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
    while (missing := p.fetch()) is not None:
        p.fetched(d.control(missing))
    p.build()
    p.started(d.control(p.ready()))
    return d, p


def send(d: DynamicsSession, p: ProviderSession) -> list[Checkpoint]:
    """Send the pieces that there are; return the checkpoints that are whole then."""
    for piece in p.pieces():
        d.piece("aero", piece)
    return [checkpoint for _, checkpoint in d.checkpoints()]


def march(d: DynamicsSession, p: ProviderSession, first: int = 0) -> dict[int, Checkpoint]:
    """Do the steps from ``first`` on; return the checkpoints by the exchange that brought them."""
    came = {}
    for step in range(first, STEPS + 1):
        answer = p.answer(d.post(step, 0))
        came |= [(step, checkpoint) for checkpoint in send(d, p)]
        assert d.accept("aero", answer or b"")
    assert p.answer(d.post(STEPS, 0, final=True)) is None
    came |= [(STEPS + 1, checkpoint) for checkpoint in send(d, p)]
    d.control(p.bye())
    d.check_frames()
    return came


def test_a_checkpoint_is_taken_after_the_commit_of_its_step() -> None:
    came = march(*pair(Counting(), course=Course(checkpoint_every=4)))
    assert came == {5: saved(1, 4, b"5"), 9: saved(2, 8, b"9")}


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
    d, p = pair(model, course=Course(checkpoint_every=4, start=4, states={"aero": saved(1, 4, b"5")}))
    came = march(d, p, first=5)
    assert came == {5: saved(1, 4, b"5"), 9: saved(2, 8, b"9")}
    times = [t for name, t in model.calls if name == "commit"]
    assert times == pytest.approx([0.005, 0.006, 0.007, 0.008, 0.009, 0.010])
    assert model.calls[0] == ("evaluate", 0.005)


def test_a_provider_that_goes_on_refuses_another_step() -> None:
    d, p = pair(Counting(), course=Course(start=4, states={"aero": saved(1, 4, b"5")}))
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
        d.course = Course(start=start, states={"aero": saved(1, start, b"1")}, changes={3: "2.0"})
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
    _, second = p.pieces()
    with pytest.raises(ProtocolError, match=r'checkpoint from "aero": step 3 .*expected number 1; got 2'):
        d.piece("aero", second)


class Long(Counting):
    """Its memory is longer than a piece."""

    def save(self) -> bytes:
        return b"%04d" % self.count * 25

    def restore(self, blob: bytes) -> None:
        assert blob == blob[:4] * 25
        self.count = int(blob[:4])


@pytest.mark.parametrize("piece", [1, 7, 99, 100, 101])
def test_in_pieces_of_any_size_it_is_the_same(piece: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 100 bytes; there, and back to another process."""
    whole = march(*pair(Long(), course=Course(checkpoint_every=4)))
    assert whole[9] == saved(2, 8, b"0009" * 25)
    monkeypatch.setattr(checkpoints, "PIECE", piece)
    d, p = pair(Long(), course=Course(checkpoint_every=4))
    for step in range(6):
        p.answer(d.post(step, 0))
    pieces = list(p.pieces())
    assert [decode(each, "r1", "aero").offset for each in pieces] == list(range(0, 100, piece))
    resumed = pair(Long(), course=Course(4, start=4, states={"aero": whole[5]}, piece=piece))
    assert march(*resumed, first=5) == whole


def pieces() -> list[Any]:
    """Return ten messages of ten bytes each."""
    whole = saved(7, 3, bytes(range(100)))
    return [whole.piece("r1", "aero", offset, 10) for offset in range(0, 100, 10)]


def join(messages: list[Any]) -> list[Checkpoint | None]:
    joining = Joining("checkpoint")
    return [joining.add(message) for message in messages]


def test_all_pieces_make_the_whole() -> None:
    *others, last = join(pieces())
    assert others == [None] * 9
    assert last == saved(7, 3, bytes(range(100)))
    assert last.state.whole() == bytes(range(100))


WRONG = {
    "the first one is missing": (lambda p: p[1:], "begins with byte 0; got that of byte 10"),
    "one is missing": (lambda p: p[:4] + p[5:], "begins with byte 40; got that of byte 50"),
    "one comes twice": (lambda p: p[:4] + p[3:], "begins with byte 40; got that of byte 30"),
    "two are swapped": (lambda p: [p[1], p[0], *p[2:]], "begins with byte 0; got that of byte 10"),
    "the last are missing": (
        lambda p: [*p[:8], saved(8, 6, b"next").piece("r1", "aero", 0, 9)],
        "number 8: expected a piece of number 7, as the one before; got 8. The rest of that",
    ),
}  # fmt: skip


@pytest.mark.parametrize("wrong", WRONG)
def test_pieces_that_are_not_those_that_were_sent_are_refused(wrong: str) -> None:
    change, reason = WRONG[wrong]
    with pytest.raises(ProtocolError, match=reason):
        join(change(pieces()))


def test_a_piece_that_does_not_fit_into_the_whole_is_refused() -> None:
    long, empty = pieces(), pieces()
    long[9].state += b"x"
    empty[4].state = b""
    with pytest.raises(ProtocolError, match=r"expected a piece with 1 to 10 of its 100 bytes; got 11"):
        join(long)
    with pytest.raises(ProtocolError, match=r"expected a piece with 1 to 60 of its 100 bytes; got 0"):
        join(empty)


def test_a_damaged_whole_is_refused() -> None:
    damaged = pieces()
    damaged[4].state = b"x" * 10
    right = hashlib.sha256(bytes(range(100))).hexdigest()[:12]
    with pytest.raises(ProtocolError, match=f"number 7: expected SHA-256 {right}, as it says; got"):
        join(damaged)


def test_what_is_announced_takes_no_memory_and_has_to_have_room() -> None:
    huge = pieces()[0]
    huge.size = 10**18
    with pytest.raises(
        ParticipantError, match=r"expected room for 10{18} bytes among temporary files; got room"
    ):
        Joining("checkpoint").add(huge)


def test_a_foreign_checkpoint_is_refused() -> None:
    payload = next(saved(7, 3, b"memory").pieces("r1", "aero"))
    for run, provider in (("r2", "aero"), ("r1", "cfd")):
        with pytest.raises(ProtocolError, match='got one of run r1 from "aero"'):
            decode(payload, run, provider)
    with pytest.raises(ProtocolError, match="expected a Checkpoint of this run; got"):
        decode(b"\xff", "r1", "aero")


def test_an_empty_memory_is_one_piece() -> None:
    (only,) = saved(1, 4, b"").pieces("r1", "aero")
    assert join([decode(only, "r1", "aero")]) == [saved(1, 4, b"")]


def test_a_memory_that_is_here_is_not_copied() -> None:
    blob = bytes(range(256))
    assert State.of(blob).whole() is blob


def test_the_rest_of_what_a_lost_provider_has_sent_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkpoints, "PIECE", 30)
    d, lost = pair(Long(), course=Course(checkpoint_every=1, recovery=True))
    for step in range(2):
        d.accept("aero", lost.answer(d.post(step, 0)) or b"")
    answer = lost.answer(d.post(2, 0))
    first, *rest = lost.pieces()
    d.piece("aero", first)
    d.lose("aero")
    for piece in rest:
        d.piece("aero", piece)
    back = ProviderSession("aero", lambda scenario, name: Long())
    back.welcome(d.control(back.hello()))
    while (missing := back.fetch()) is not None:
        back.fetched(d.control(missing))
    back.build()
    back.catch_up()
    back.started(d.control(back.ready()))
    assert back.answer(d.post(2, 0)) == answer
    assert send(d, back) == [saved(1, 1, b"0002" * 25)]


def test_only_who_has_said_hello_gets_pieces_of_its_own_checkpoint() -> None:
    d = DynamicsSession("r1", "{}", STEP_NS, STEPS, ["a", "b"], {"aero": ["a", "b"]})
    d.course = Course(4, start=4, states={"aero": saved(1, 4, b"0005" * 25)}, piece=30)
    p, other = (ProviderSession("aero", lambda scenario, name: Long()) for _ in range(2))
    p.welcome(d.control(p.hello()))
    other.welcome(d.control(p.hello()))
    with pytest.raises(RefusedError, match='"aero": Fetch without Hello'):
        other.fetched(d.control(other.fetch() or b""))
    request = MESSAGES["Control"].FromString(p.fetch() or b"")
    request.fetch.offset = 100
    with pytest.raises(RefusedError, match='"aero": Fetch: expected an offset below 100; got 100'):
        p.fetched(d.control(request.SerializeToString()))


def test_a_run_from_the_beginning_has_nothing_to_fetch() -> None:
    d, p = pair(Long(), course=Course())
    assert p.fetch() is None
    request = MESSAGES["Control"](fetch={"name": "aero", "instance": p.instance, "offset": 0})
    with pytest.raises(RefusedError, match='"aero": Fetch: expected an offset below 0; got 0'):
        p.fetched(d.control(request.SerializeToString()))
