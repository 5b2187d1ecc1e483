"""Checkpoints on the bus: large ones, there when the wrench or the Bye is; a provider begins with one."""

from __future__ import annotations

from linkwind.bus.zenoh import ZenohDynamicsLink, loopback_endpoint
from linkwind.checkpoints import Checkpoint
from linkwind.protocol import Course
from linkwind.spatial import Motion
from tests.bus.test_zenoh import Provider, finish, session
from tests.fakes import FakeModel

SIZE = 48_000_000  # bytes: a flow of two million cells and more


class Large(FakeModel):
    """Its memory is large, and begins with the number of commits."""

    count = 0

    def commit(self, t: float, motion: Motion) -> None:
        self.count += 1

    def save(self) -> bytes:
        return self.count.to_bytes(8, "little") + bytes(SIZE)

    def restore(self, blob: bytes) -> None:
        assert len(blob) == SIZE + 8
        self.count = int.from_bytes(blob[:8], "little")


def march(course: Course, first: int) -> list[tuple[int, Checkpoint]]:
    """Do the steps from ``first`` on; return the checkpoints, each with the exchange that brought it."""
    endpoint, d = loopback_endpoint(), session()
    d.course = course
    came: list[tuple[int, Checkpoint]] = []
    link = ZenohDynamicsLink(d, [endpoint], [], 10.0)
    try:
        provider = Provider(endpoint, Large())
        assert link.wait(lambda: not d.not_ready, 20.0, lambda: None)
        for step in range(first, 11):
            link.post(d.post(step, 0))
            while not d.answered:
                d.accept(*link.receive())
            came += [(step, d.checkpoint(*sent)) for sent in link.checkpoints()]
        finish(d, link)
        came += [(11, d.checkpoint(*sent)) for sent in link.checkpoints()]
        d.check_frames()
    finally:
        link.close()
    provider.join(10.0)
    assert provider.error is None
    return came


def test_large_checkpoints_there_and_back() -> None:
    came = march(Course(checkpoint_every=5), 0)
    assert [(exchange, checkpoint.step) for exchange, checkpoint in came] == [(6, 5), (11, 10)]
    resumed = march(Course(5, start=5, states={"aero": (1, came[0][1].state)}), 6)
    assert resumed == came
