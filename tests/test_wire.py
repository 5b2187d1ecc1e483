"""Fixed layouts against protobuf's own serialisation and parser."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import given
from hypothesis import strategies as st

from linkwind.schema import MESSAGES
from linkwind.wire import FixedLayout

FLOATS = st.floats(width=64) | st.sampled_from([math.nan, -0.0, math.inf, -math.inf, 5e-324])
UINT64 = st.integers(0, 2**64 - 1)
UINT32 = st.integers(0, 2**32 - 1)
MOTION = {"position": 3, "orientation": 4, "linear": 3, "angular": 3}


def motion_step(n, run="run-1", value=0.0):
    message = MESSAGES["MotionStep"](run=run, step=0, iteration=0, time_ns=0, final=0)
    for motion in (message.accepted, message.trial):
        for name, width in MOTION.items():
            getattr(motion, name)[:] = [value] * width * n
    return message


def wrench_step(n, added=0, kind=1):
    message = MESSAGES["WrenchStep"](run="run-1", provider="aero", step=0, iteration=0, time_ns=0, kind=kind)
    message.force[:] = message.torque[:] = [0.0] * 3 * n
    message.added_inertia[:] = [0.0] * added
    return message


def another(message, **fields):
    """Return the message with other fields; None takes one away."""
    for name, value in fields.items():
        message.ClearField(name) if value is None else setattr(message, name, value)
    return message


def same_bits(a, b):
    return struct.pack(f"<{len(a)}d", *a) == struct.pack(f"<{len(b)}d", *b)


@st.composite
def filled_motion_steps(draw):
    """A MotionStep of random size with random values, as protobuf holds it."""
    message = motion_step(draw(st.integers(0, 5)), run=draw(st.text(max_size=200)))
    message.step, message.time_ns = draw(UINT64), draw(UINT64)
    message.iteration, message.final = draw(UINT32), draw(UINT32)
    for motion in (message.accepted, message.trial):
        for name in MOTION:
            values = getattr(motion, name)
            values[:] = draw(st.lists(FLOATS, min_size=len(values), max_size=len(values)))
    return message


@given(filled_motion_steps())
def test_written_in_place_equals_protobuf(message):
    layout = FixedLayout(motion_step(len(message.trial.position) // 3, run=message.run))
    for name in ("step", "iteration", "time_ns", "final"):
        layout.views[name][0] = getattr(message, name)
    for state in ("accepted", "trial"):
        for name in MOTION:
            layout.views[f"{state}.{name}"][:] = getattr(getattr(message, state), name)
    assert layout.payload() == message.SerializeToString()


@given(filled_motion_steps())
def test_load_and_fill_read_what_protobuf_wrote(message):
    data = message.SerializeToString()
    template = motion_step(len(message.trial.position) // 3, run=message.run)
    loaded, filled = FixedLayout(template), FixedLayout(template)
    assert loaded.load(data)
    filled.fill(message)
    for layout in (loaded, filled):
        assert layout.payload() == data
        assert layout.views["step"][0] == message.step
        assert same_bits(layout.views["trial.linear"], message.trial.linear)


@given(filled_motion_steps(), st.integers(0, 2**16 - 1), st.integers(1, 255))
def test_a_changed_byte_is_a_value_or_refused(message, part, bits):
    """Whatever single byte changes: either protobuf reads the loaded values too, or load refuses."""
    layout = FixedLayout(message)
    wire = bytearray(layout.template)
    at = part * len(wire) // 2**16
    wire[at] ^= bits
    in_value = any(region.offset <= at < region.end for region in layout.regions.values())
    assert layout.load(bytes(wire)) is in_value
    assert layout.payload() == (bytes(wire) if in_value else layout.template)


def test_refused_load_changes_nothing():
    layout = FixedLayout(motion_step(2))
    other = motion_step(2, run="run-2", value=7.0).SerializeToString()
    for data in (b"", other, other[:-1], layout.template + b"\0"):
        assert not layout.load(data)
        assert layout.payload() == layout.template


def test_other_encodings_are_filled_through_the_parser():
    """Unpacked arrays, another field order and unknown fields mean the same to protobuf."""
    message = wrench_step(1)
    message.force[:], message.torque[:], message.step = [1.5, -0.0, math.inf], [4.0, 5.0, 6.0], 2**63
    wire = b"".join(b"\x41" + struct.pack("<d", x) for x in message.torque)  # field 8, unpacked
    wire += b"".join(b"\x39" + struct.pack("<d", x) for x in message.force)  # field 7, unpacked
    wire += b"\x30\x01" + b"\x29" + bytes(8) + b"\x25" + bytes(4) + b"\x19" + struct.pack("<Q", 2**63)
    wire += b"\x12\x04aero" + b"\x0a\x05run-1" + b"\xf8\x3f\x2a"  # and an unknown field 1023
    layout = FixedLayout(wrench_step(1))
    assert not layout.load(wire)
    layout.fill(MESSAGES["WrenchStep"].FromString(wire))
    assert layout.payload() == message.SerializeToString()


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (wrench_step(3), r"WrenchStep\.force: expected 6 values; got 9 values"),
        (wrench_step(2, added=72), r"WrenchStep\.added_inertia: expected 0 values; got 72 values"),
        (
            wrench_step(2, kind=2),
            r"WrenchStep\.kind: expected \"WRENCH_KIND_POINT\"; got \"WRENCH_KIND_MEAN\"",
        ),
        (wrench_step(2, kind=7), r"WrenchStep\.kind: expected \"WRENCH_KIND_POINT\"; got 7"),
        (another(wrench_step(2), run="run-2"), r"WrenchStep\.run: expected \"run-1\"; got \"run-2\""),
        (another(wrench_step(2), provider=None), r"WrenchStep\.provider: expected \"aero\"; got nothing"),
        (MESSAGES["WrenchStep"](), r"WrenchStep\.step: expected 1 values; got no field"),
    ],
)
def test_fill_names_what_differs(message, text):
    layout = FixedLayout(wrench_step(2))
    with pytest.raises(ValueError, match=text):
        layout.fill(message)
    assert layout.payload() == layout.template


def test_empty_repeated_field_is_an_empty_view():
    views = FixedLayout(wrench_step(2)).views
    assert views["added_inertia"].size == views["response"].size == 0
    assert views["force"].shape == (6,)


def test_views_stay_bound_to_the_buffer():
    layout = FixedLayout(motion_step(1))
    view = layout.views["trial.position"]
    assert layout.load(motion_step(1, value=3.0).SerializeToString())
    assert np.array_equal(view, [3.0, 3.0, 3.0])
    view[1] = -8.0
    assert MESSAGES["MotionStep"].FromString(layout.payload()).trial.position[1] == -8.0


def field(name, number, kind, label="OPTIONAL", type_name=None, packed=None):
    proto = descriptor_pb2.FieldDescriptorProto(
        name=name, number=number, type=f"TYPE_{kind}", label=f"LABEL_{label}", type_name=type_name
    )
    if packed is not None:
        proto.options.packed = packed
    return proto


def dynamic_message(*fields):
    file = descriptor_pb2.FileDescriptorProto(name="t.proto", package="t", syntax="proto3")
    file.message_type.add(name="M").field.extend(fields)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("t.M"))


def test_every_fixed_width_type():
    kinds = {
        "DOUBLE": "<d",
        "FLOAT": "<f",
        "FIXED64": "<Q",
        "SFIXED64": "<q",
        "FIXED32": "<I",
        "SFIXED32": "<i",
    }
    for number, (kind, code) in enumerate(kinds.items(), start=14):  # numbers past 15 have two-byte tags
        cls = dynamic_message(
            field("value", number, kind, "REPEATED"),
            field("count", 90, "UINT64"),
            field("text", 91, "STRING"),
        )
        values = [3, -5] if kind in ("DOUBLE", "FLOAT", "SFIXED64", "SFIXED32") else [3, 2**31]
        layout = FixedLayout(cls(value=[0, 0], count=2**40, text="x"))
        layout.views["value"][:] = values
        assert list(cls.FromString(layout.payload()).value) == values
        assert layout.views["value"].tobytes() == b"".join(struct.pack(code, v) for v in values)


def test_layouts_that_cannot_be_fixed_are_refused():
    repeated = dynamic_message(field("child", 1, "MESSAGE", "REPEATED", ".t.M"))
    with pytest.raises(TypeError, match="repeated message"):
        FixedLayout(repeated(child=[repeated()]))
    unpacked = dynamic_message(field("value", 1, "DOUBLE", "REPEATED", packed=False))
    with pytest.raises(TypeError, match="packed"):
        FixedLayout(unpacked(value=[1.0, 2.0]))
