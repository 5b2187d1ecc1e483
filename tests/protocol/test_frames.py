"""Frames between the two state machines: each once, before the answer it came with, none lost unnoticed."""

from __future__ import annotations

import dataclasses

import pytest

from linkwind.errors import ProtocolError
from linkwind.frames import FlowFrame, Sent
from linkwind.protocol import DynamicsSession, ProviderSession
from tests.fakes import FakeModel
from tests.flows import VortexModel, equal, vortices

STEP_NS = 1_000_000


def pair(model: object) -> tuple[DynamicsSession, ProviderSession]:
    d = DynamicsSession("r1", "{}", STEP_NS, 10, ["a", "b"], {"aero": ["a", "b"]})
    p = ProviderSession("aero", lambda scenario, name: model)
    p.welcome(d.control(p.hello()))
    p.build()
    p.started(d.control(p.ready()))
    return d, p


def exchange(d: DynamicsSession, p: ProviderSession, step: int) -> list[Sent]:
    """Do one step; return the frames that were to be sent before the answer."""
    answer = p.answer(d.post(step, 0))
    frames = p.frames()
    assert d.accept("aero", answer or b"")
    return frames


def finish(d: DynamicsSession, p: ProviderSession) -> list[Sent]:
    assert p.answer(d.post(10, 0, final=True)) is None
    frames = p.frames()
    d.control(p.bye())
    return frames


def test_frames_come_when_they_are_due_the_last_one_at_the_end() -> None:
    d, p = pair(VortexModel(every=5))
    sent = {step: exchange(d, p, step) for step in range(11)}
    sent[11] = finish(d, p)
    assert {step: len(frames) for step, frames in sent.items() if frames} == {0: 1, 6: 1, 11: 1}
    taken = [d.frame("aero", payload) for frames in sent.values() for payload in frames]
    assert [frame.step for frame in taken] == [0, 5, 10]
    assert all(equal(frame, vortices(frame.time_ns / 1e9, STEP_NS)) for frame in taken)
    d.check_frames()


def test_a_model_without_frames_shows_none() -> None:
    d, p = pair(FakeModel())
    assert [exchange(d, p, step) for step in range(11)] == [[]] * 11
    assert finish(d, p) == []
    d.check_frames()


def test_a_repeated_motion_brings_no_second_frame() -> None:
    d, p = pair(VortexModel())
    motion = d.post(0, 0)
    first = p.answer(motion)
    assert len(p.frames()) == 1
    assert p.answer(motion) == first
    assert p.frames() == []


def test_a_frame_that_is_lost_is_missed_at_the_next_one() -> None:
    d, p = pair(VortexModel(every=5))
    exchange(d, p, 0)
    for step in range(1, 6):
        exchange(d, p, step)
    (second,) = exchange(d, p, 6)
    with pytest.raises(
        ProtocolError,
        match=r'frame from "aero": step 6 \(t = 0.006 s\): expected number 1; got 2. A frame was',
    ):
        d.frame("aero", second)


def test_the_last_frame_is_missed_at_the_end() -> None:
    d, p = pair(VortexModel(every=5))
    for step in range(11):
        for payload in exchange(d, p, step):
            d.frame("aero", payload)
    finish(d, p)
    expected = r'frames from "aero": expected 3, as its Bye says; got 2\. The last ones were lost'
    with pytest.raises(ProtocolError, match=expected):
        d.check_frames()


def test_a_stranger_s_frame_is_refused() -> None:
    d, p = pair(VortexModel())
    (frame,) = exchange(d, p, 0)
    with pytest.raises(ProtocolError, match='frame from "cfd": it does not take part in run r1'):
        d.frame("cfd", frame)


def test_a_frame_of_another_time_than_its_step_is_refused() -> None:
    class Late(VortexModel):
        def frame(self) -> FlowFrame | None:
            frame = super().frame()
            return frame and dataclasses.replace(frame, time_ns=frame.time_ns + 1)

    d, p = pair(Late())
    with pytest.raises(ProtocolError, match='"aero": frame of step 0: expected time 0 ns; got 1'):
        p.answer(d.post(0, 0))
