"""Frames of a fluid as messages: arrays to bytes and back, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from linkwind.errors import ProtocolError
from linkwind.frames import FlowFrame, decode
from linkwind.schema import MESSAGES
from tests.flows import equal, vortices

STEP_NS = 1_000_000


@pytest.fixture
def frame() -> FlowFrame:
    return vortices(0.1, STEP_NS)


def test_a_frame_comes_back_bit_for_bit(frame: FlowFrame) -> None:
    number, again = decode(frame.encode("r1", "aero", 7), "r1", "aero")
    assert number == 7
    assert equal(again, frame)
    assert again.origin == frame.origin


def test_arrays_of_another_layout_are_sent_row_by_row(frame: FlowFrame) -> None:
    turned = dataclasses.replace(frame, vorticity=np.asfortranarray(frame.vorticity))
    assert turned.encode("r1", "aero", 1) == frame.encode("r1", "aero", 1)


def test_the_message_is_as_the_schema_says(frame: FlowFrame) -> None:
    payload = frame.encode("r1", "aero", 1)
    message = MESSAGES["FlowFrame"].FromString(payload)
    assert message.SerializeToString() == payload
    rows, columns = frame.shape
    assert (message.rows, message.columns, message.step, message.time_ns) == (rows, columns, 100, 100_000_000)
    assert np.frombuffer(message.velocity, "<f4")[2 * columns + 1] == frame.velocity[1, 0, 1]


def test_the_extent_reaches_half_a_cell_beyond_the_centres(frame: FlowFrame) -> None:
    assert frame.extent == pytest.approx((-2.05, 1.15, -1.45, 1.35))


def test_an_array_of_another_shape_is_refused(frame: FlowFrame) -> None:
    wrong = dataclasses.replace(frame, vorticity=frame.vorticity[1:])
    with pytest.raises(ProtocolError, match=r'"aero": frame: vorticity: expected \(28, 32\); got \(27, 32\)'):
        wrong.encode("r1", "aero", 1)


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b"nonsense", "expected a FlowFrame of this run; got Error parsing message"),
        (vortices(0.0, STEP_NS).encode("r2", "aero", 1), 'got one of run r2 from "aero"'),
        (vortices(0.0, STEP_NS).encode("r1", "cfd", 1), 'got one of run r1 from "cfd"'),
    ],
)
def test_another_message_is_refused(payload: bytes, reason: str) -> None:
    with pytest.raises(ProtocolError, match=reason):
        decode(payload, "r1", "aero")


@pytest.mark.parametrize("field", ["velocity", "pressure", "vorticity"])
def test_an_array_that_is_too_short_is_refused(frame: FlowFrame, field: str) -> None:
    message = MESSAGES["FlowFrame"].FromString(frame.encode("r1", "aero", 1))
    setattr(message, field, getattr(message, field)[:-4])
    with pytest.raises(ProtocolError, match=rf"{field}: expected \d+ bytes for \(28, 32.*\); got \d+"):
        decode(message.SerializeToString(), "r1", "aero")
