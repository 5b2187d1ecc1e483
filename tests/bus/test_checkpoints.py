"""Checkpoints on the bus: in many pieces, there when the wrench or the Bye is; a provider begins with one."""

from __future__ import annotations

import pytest

from linkwind import checkpoints
from linkwind.bus.inprocess import InProcessLink
from linkwind.bus.zenoh import ZenohDynamicsLink, loopback_endpoint
from linkwind.bus.zenoh.dynamics import PIECES
from linkwind.checkpoints import Checkpoint, State
from linkwind.protocol import Course, DynamicsSession, ProviderSession
from linkwind.spatial import Motion
from tests.bus.test_zenoh import STEP_NS, Provider, finish, session
from tests.fakes import FakeModel

PIECE = 1000  # bytes
SIZE = 2 * PIECES * PIECE + 1  # more pieces than can wait for the dynamics


class Large(FakeModel):
    """Its memory begins with the number of commits."""

    count = 0

    def commit(self, t: float, motion: Motion) -> None:
        self.count += 1

    @staticmethod
    def memory(count: int) -> bytes:
        return count.to_bytes(8, "little") + bytes(SIZE - 8)

    def save(self) -> bytes:
        return self.memory(self.count)

    def restore(self, blob: bytes) -> None:
        assert len(blob) == SIZE
        self.count = int.from_bytes(blob[:8], "little")


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkpoints, "PIECE", PIECE)


def steps(
    d: DynamicsSession, link: ZenohDynamicsLink | InProcessLink, first: int
) -> list[tuple[int, Checkpoint]]:
    """Do the steps from ``first`` on; return the checkpoints, each with the exchange that brought it."""
    came: list[tuple[int, Checkpoint]] = []
    for step in range(first, 11):
        link.post(d.post(step, 0))
        while not d.answered:
            d.accept(*link.receive())
        came += [(step, checkpoint) for _, checkpoint in d.checkpoints()]
    finish(d, link)
    came += [(11, checkpoint) for _, checkpoint in d.checkpoints()]
    d.check_frames()
    return came


def over_zenoh(course: Course, first: int) -> list[tuple[int, Checkpoint]]:
    endpoint, d = loopback_endpoint(), session()
    d.course = course
    link = ZenohDynamicsLink(d, [endpoint], [], 10.0)
    try:
        provider = Provider(endpoint, Large())
        assert link.wait(lambda: not d.not_ready, 20.0, lambda: None)
        came = steps(d, link, first)
    finally:
        link.close()
    provider.join(10.0)
    assert provider.error is None
    return came


def in_process(course: Course, first: int) -> list[tuple[int, Checkpoint]]:
    d = session()
    d.course = course
    return steps(d, InProcessLink(d, [ProviderSession("aero", lambda scenario, name: Large())]), first)


@pytest.mark.parametrize("march", [in_process, over_zenoh])
def test_there_and_back(march) -> None:  # type: ignore[no-untyped-def]
    came = march(Course(checkpoint_every=5), 0)
    assert came == [
        (6, Checkpoint(1, 5, 5 * STEP_NS, State.of(Large.memory(6)))),
        (11, Checkpoint(2, 10, 10 * STEP_NS, State.of(Large.memory(11)))),
    ]
    assert march(Course(5, start=5, states={"aero": came[0][1]}, piece=SIZE // 3), 6) == came
