"""Frames of every kind as messages: arrays to bytes and back, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from linkwind.errors import ProtocolError
from linkwind.frames import FlowFrame, Sent, VolumeFrame, WakeFrame, decode, logged
from linkwind.schema import MESSAGES
from tests.flows import equal, vortices

STEP_NS = 1_000_000


@pytest.fixture
def frame() -> FlowFrame:
    return vortices(0.1, STEP_NS)


def test_a_frame_comes_back_bit_for_bit(frame: FlowFrame) -> None:
    number, again = decode(Sent("flow", frame.encode("r1", "aero", 7)), "r1", "aero")
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
        decode(Sent("flow", payload), "r1", "aero")


@pytest.mark.parametrize("field", ["velocity", "pressure", "vorticity"])
def test_an_array_that_is_too_short_is_refused(frame: FlowFrame, field: str) -> None:
    message = MESSAGES["FlowFrame"].FromString(frame.encode("r1", "aero", 1))
    setattr(message, field, getattr(message, field)[:-4])
    with pytest.raises(ProtocolError, match=rf"{field}: expected \d+ bytes for \(28, 32.*\); got \d+"):
        decode(Sent("flow", message.SerializeToString()), "r1", "aero")


@pytest.fixture
def wake() -> WakeFrame:
    """Two wings of two rows of three rings, with five rows behind each."""
    numbers = np.random.default_rng(3).normal(size=2 * 8 * 4 * 3 + 2 * 7 * 3).astype("f4")
    corner, strength = np.split(numbers, [2 * 8 * 4 * 3])
    return WakeFrame(40, 40 * STEP_NS, 2, corner.reshape(2, 8, 4, 3), strength.reshape(2, 7, 3))


def same(one: WakeFrame, other: WakeFrame) -> bool:
    numbers = all(
        getattr(one, name) == getattr(other, name) for name in ("step", "time_ns", "bound", "shape")
    )
    return numbers and all(
        getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in ("corner", "strength")
    )


def test_wings_and_wakes_come_back_bit_for_bit(wake: WakeFrame) -> None:
    number, again = decode(Sent("wake", wake.encode("r1", "aero", 7)), "r1", "aero")
    assert number == 7
    assert isinstance(again, WakeFrame)
    assert same(again, wake)
    assert same(logged(WakeFrame, wake.encode()), wake)


def test_a_log_does_not_hold_who_sent_a_wake(wake: WakeFrame) -> None:
    message = MESSAGES["WakeFrame"].FromString(wake.encode())
    assert [field.name for field, _ in message.ListFields()] == [
        "step", "time_ns", "wings", "rows", "columns", "bound", "corner", "strength",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("field", "value", "reason"),
    [
        ("corner", b"1234", r"corner: expected 768 bytes for \(2, 8, 4, 3\); got 4"),
        ("strength", b"", r"strength: expected 168 bytes for \(2, 7, 3\); got 0"),
        ("rows", 8, r"corner: expected 864 bytes for \(2, 9, 4, 3\); got 768"),
        ("wings", 0, r"corner: expected sizes above 0; got \(0, 8, 4, 3\)"),
        ("columns", 2**32 - 1, r"corner: expected \d+ bytes for \(2, 8, 4294967296, 3\); got 768"),
        ("bound", 8, "bound: expected at most 7 rows; got 8"),
    ],
)
def test_a_damaged_wake_is_refused(wake: WakeFrame, field: str, value: object, reason: str) -> None:
    message = MESSAGES["WakeFrame"].FromString(wake.encode("r1", "aero", 1))
    setattr(message, field, value)
    with pytest.raises(ProtocolError, match=f"expected a WakeFrame of this run: {reason}"):
        decode(Sent("wake", message.SerializeToString()), "r1", "aero")


@pytest.fixture
def volume() -> VolumeFrame:
    """Three layers of four rows of five columns."""
    numbers = np.random.default_rng(5).normal(size=4 * 60).astype("f4")
    velocity, pressure = np.split(numbers, [180])
    place = ((-0.5, 0.25, 1.0), 0.125)
    return VolumeFrame(40, 40 * STEP_NS, *place, velocity.reshape(3, 4, 5, 3), pressure.reshape(3, 4, 5))


def alike(one: VolumeFrame, other: VolumeFrame) -> bool:
    names = ("step", "time_ns", "origin", "cell", "shape")
    numbers = all(getattr(one, name) == getattr(other, name) for name in names)
    return numbers and all(
        getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in ("velocity", "pressure")
    )


def test_a_box_of_fluid_comes_back_bit_for_bit(volume: VolumeFrame) -> None:
    number, again = decode(Sent("volume", volume.encode("r1", "aero", 7)), "r1", "aero")
    assert number == 7
    assert isinstance(again, VolumeFrame)
    assert alike(again, volume)
    assert alike(logged(VolumeFrame, volume.encode()), volume)


def test_the_message_of_a_box_is_as_the_schema_says(volume: VolumeFrame) -> None:
    payload = volume.encode()
    message = MESSAGES["VolumeFrame"].FromString(payload)
    assert message.SerializeToString() == payload
    assert [field.name for field, _ in message.ListFields()] == [
        "step", "time_ns", "layers", "rows", "columns", "cell", "origin_x", "origin_y", "origin_z",
        "velocity", "pressure",
    ]  # fmt: skip
    assert (message.layers, message.rows, message.columns) == (3, 4, 5)
    # Of layer 2, row 1, column 3 the z of the velocity: rows of 5 cells, layers of 4 rows.
    place = (2 * 4 + 1) * 5 + 3
    assert np.frombuffer(message.velocity, "<f4")[3 * place + 2] == volume.velocity[2, 1, 3, 2]
    assert np.frombuffer(message.pressure, "<f4")[place] == volume.pressure[2, 1, 3]


def test_a_box_reaches_half_a_cell_beyond_the_centres(volume: VolumeFrame) -> None:
    assert volume.extent == ((-0.5625, 0.1875, 0.9375), (0.0625, 0.6875, 1.3125))


@pytest.mark.parametrize(
    ("field", "value", "reason"),
    [
        ("velocity", b"1234", r"velocity: expected 720 bytes for \(3, 4, 5, 3\); got 4"),
        ("pressure", b"", r"pressure: expected 240 bytes for \(3, 4, 5\); got 0"),
        ("layers", 4, r"velocity: expected 960 bytes for \(4, 4, 5, 3\); got 720"),
        ("rows", 0, r"velocity: expected sizes above 0; got \(3, 0, 5, 3\)"),
        ("columns", 2**32 - 1, r"velocity: expected \d+ bytes for \(3, 4, 4294967295, 3\); got 720"),
        ("cell", 0.0, r"expected two or more layers, .* above 0 m; got \(3, 4, 5\) of 0 m"),
        ("cell", np.nan, r"expected two or more layers, .* above 0 m; got \(3, 4, 5\) of nan m"),
    ],
)
def test_a_damaged_box_is_refused(volume: VolumeFrame, field: str, value: object, reason: str) -> None:
    message = MESSAGES["VolumeFrame"].FromString(volume.encode("r1", "aero", 1))
    setattr(message, field, value)
    with pytest.raises(ProtocolError, match=f"expected a VolumeFrame of this run: {reason}"):
        decode(Sent("volume", message.SerializeToString()), "r1", "aero")


def test_one_layer_is_no_box(volume: VolumeFrame) -> None:
    flat = dataclasses.replace(volume, velocity=volume.velocity[:1], pressure=volume.pressure[:1])
    with pytest.raises(ProtocolError, match=r"two or more layers, .*; got \(1, 4, 5\) of 0.125 m"):
        decode(Sent("volume", flat.encode("r1", "aero", 1)), "r1", "aero")


def test_a_frame_of_the_other_kind_and_of_none_is_refused(frame: FlowFrame, wake: WakeFrame) -> None:
    with pytest.raises(ProtocolError, match="expected a WakeFrame of this run: corner: expected"):
        decode(Sent("wake", frame.encode("r1", "aero", 1)), "r1", "aero")
    with pytest.raises(ProtocolError, match="expected a FlowFrame of this run: velocity: expected"):
        decode(Sent("flow", wake.encode("r1", "aero", 1)), "r1", "aero")
    with pytest.raises(
        ProtocolError, match='frame from "aero": expected one of flow, volume, wake; got smoke'
    ):
        decode(Sent("smoke", b""), "r1", "aero")
