"""Frames on the bus: large ones, each there when the wrench or the Bye is that it was sent before."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from linkwind.bus.base import DynamicsLink
from linkwind.bus.inprocess import InProcessLink
from linkwind.bus.zenoh import ZenohDynamicsLink, loopback_endpoint
from linkwind.errors import ProtocolError
from linkwind.frames import FlowFrame, Frame
from linkwind.protocol import DynamicsSession, ProviderSession
from tests.bus.test_zenoh import Provider, finish, session
from tests.flows import VortexModel, equal, vortices
from tests.volumes import VolumeModel, hill

STEP_NS = 1_000_000
LARGE = {"rows": 224, "columns": 256}  # 0.9 MB


def march(d: DynamicsSession, link: DynamicsLink) -> list[list[tuple[str, Frame]]]:
    """Do ten steps; return the frames that were there after the answers of each, and after the Byes."""
    came = []

    def take() -> None:
        came.append([(name, d.frame(name, sent)) for name, sent in link.frames()])

    for step in range(11):
        link.post(d.post(step, 0))
        while not d.answered:
            d.accept(*link.receive())
        take()
    finish(d, link)
    take()
    d.check_frames()
    return came


def check(came: list[list[tuple[str, Frame]]], every: dict[str, int]) -> None:
    """The frame of t_k comes with the answer to k + 1, which commits it; the last one with the Bye."""
    for exchange, frames in enumerate(came):
        k = max(0, exchange - 1)
        due = [name for name, n in every.items() if k % n == 0 and exchange != 1]
        assert sorted(name for name, _ in frames) == due, exchange
        assert all(equal(frame, vortices(k * 1e-3, STEP_NS, **LARGE)) for _, frame in frames)


@pytest.mark.parametrize("every", [{"aero": 1}, {"one": 1, "two": 3}])
def test_every_frame_is_there_when_its_wrench_is(every: dict[str, int]) -> None:
    endpoint, d = loopback_endpoint(), session(*every)
    link = ZenohDynamicsLink(d, [endpoint], [], 5.0)
    try:
        providers = [Provider(endpoint, VortexModel(every=n, **LARGE), name) for name, n in every.items()]
        assert link.wait(lambda: not d.not_ready, 10.0, lambda: None)
        check(march(d, link), every)
    finally:
        link.close()
    for provider in providers:
        provider.join(10.0)
        assert provider.error is None


def model(every: int) -> Callable[[str, str], VortexModel]:
    return lambda scenario, name: VortexModel(every=every, **LARGE)


@pytest.mark.parametrize("every", [{"aero": 1}, {"one": 1, "two": 3}])
def test_the_same_in_one_process(every: dict[str, int]) -> None:
    d = session(*every)
    check(march(d, InProcessLink(d, [ProviderSession(name, model(n)) for name, n in every.items()])), every)


def test_a_box_of_a_quarter_of_a_million_cells_comes_over_the_bus() -> None:
    large = {"size": (60, 62, 67), "cell": 0.02}
    endpoint, d = loopback_endpoint(), session()
    link = ZenohDynamicsLink(d, [endpoint], [], 5.0)
    try:
        provider = Provider(endpoint, VolumeModel(every=5, **large), "aero")
        assert link.wait(lambda: not d.not_ready, 10.0, lambda: None)
        came = [frame for frames in march(d, link) for _, frame in frames]
    finally:
        link.close()
    provider.join(10.0)
    assert provider.error is None
    assert [frame.step for frame in came] == [0, 5, 10]
    assert all(f.encode() == hill(f.step * 1e-3, STEP_NS, **large).encode() for f in came)
    assert 3.98e6 < len(came[0].encode()) < 4.0e6


def test_a_frame_that_cannot_be_sent_ends_the_run() -> None:
    class Lopsided(VortexModel):
        def frame(self) -> FlowFrame | None:
            frame = super().frame()
            if frame is not None:
                object.__setattr__(frame, "vorticity", frame.vorticity[1:])
            return frame

    d = session()
    link = InProcessLink(d, [ProviderSession("aero", lambda scenario, name: Lopsided())])
    link.post(d.post(0, 0))
    with pytest.raises(Exception, match=r"frame: vorticity: expected \(28, 32\)") as error:
        link.receive()
    assert isinstance(error.value.__cause__, ProtocolError)
