"""Frames of a fluid in the log: Foxglove's own message, read back bit for bit, from cut logs as well."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from foxglove.messages import Grid

from linkwind.errors import LogError
from linkwind.log import grid
from linkwind.log.contents import FLOW
from linkwind.log.difference import between_frames
from linkwind.log.export import export_csv
from linkwind.log.reader import open_log
from linkwind.log.recover import recover
from tests.flows import equal, vortices
from tests.log.sample import SCENARIO, STEP_NS, Recorder, new_writer, state
from tests.log.test_scene import parsed

LARGE = {"rows": 224, "columns": 256}  # 0.9 MB, several times a chunk
NAMES = ("mach [1]", "slip [m/s]")


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    """A log with a frame at every fifth of 20 points."""
    path = tmp_path_factory.mktemp("log") / "log.mcap"
    rng = np.random.default_rng(3)
    frames = []
    with new_writer(path) as writer:
        writer.diagnostics({"aero": NAMES, "other": ()})
        recorder = Recorder(writer)
        for k in range(20):
            recorder.point(k, state(rng))
            if k % 5 == 0:
                frames.append(vortices(k * STEP_NS / 1e9, STEP_NS, **LARGE))
                writer.frame("aero", frames[-1])
        writer.close(final_state_sha256="cd" * 32)
    return path, frames, recorder.messages


def test_frames_come_back_bit_for_bit(logged):
    path, frames, _ = logged
    log = open_log(path)
    assert log.flows == ("aero",)
    assert log.topics["/flow/aero"] == 4
    assert all(equal(one, other) for one, other in zip(log.frames("aero"), frames, strict=True))
    assert list(log.frames("other")) == []


def test_the_message_is_foxglove_s_grid(logged):
    path, frames, _ = logged
    for (schema, log_time, message), frame in zip(parsed(path, "/flow/aero"), frames, strict=True):
        rows, columns = frame.shape
        assert (schema.name, schema.data) == ("foxglove.Grid", Grid.get_schema().data)
        assert log_time == frame.time_ns == message.timestamp.seconds * 10**9 + message.timestamp.nanos
        assert message.frame_id == "world"
        corner = message.pose.position
        assert (corner.x, corner.y, corner.z) == (frame.extent[0], frame.extent[2], 0.0)
        assert message.pose.orientation.w == 1.0
        assert (message.cell_size.x, message.cell_size.y) == (frame.cell, frame.cell)
        assert (message.column_count, message.cell_stride, message.row_stride) == (columns, 16, 16 * columns)
        kinds = {field.name: (field.offset, field.type) for field in message.fields}
        assert kinds == {"vx": (0, 7), "vy": (4, 7), "pressure": (8, 7), "vorticity": (12, 7)}  # FLOAT32
        cells = np.frombuffer(message.data, "<f4").reshape(rows, columns, 4)
        assert np.array_equal(
            cells[3, 5], [*frame.velocity[3, 5], frame.pressure[3, 5], frame.vorticity[3, 5]]
        )


def test_a_log_knows_the_names_of_the_providers_numbers(logged):
    assert open_log(logged[0]).diagnostics == {"aero": NAMES}


def test_a_log_without_frames_is_as_before(tmp_path):
    with new_writer(tmp_path / "log.mcap") as writer:
        writer.diagnostics({"aero": ()})
        Recorder(writer).point(0, state(np.random.default_rng(0)))
        writer.close(final_state_sha256="00")
    log = open_log(tmp_path / "log.mcap")
    assert (log.flows, log.diagnostics) == ((), {})
    assert not any(topic.startswith(FLOW) for topic in log.topics)


def test_what_reads_logs_passes_frames_by(logged, tmp_path):
    path, _, messages = logged
    log = open_log(path)
    assert log.complete
    assert log.info.messages == sum(log.topics.values())
    assert [m.topic for m in log.decoded()] == [topic for topic, _, _ in messages]
    assert sorted(p.name for p in export_csv(log, tmp_path)) == [
        "steps.csv",
        "trajectory.csv",
        "wrench_aero.csv",
    ]


@pytest.mark.parametrize("part", [0.3, 0.5, 0.7, 0.95, 1.0])
def test_a_cut_log_is_recovered_with_the_frames_that_are_whole(logged, tmp_path, part):
    path, frames, messages = logged
    data = path.read_bytes()
    cut, target = tmp_path / "cut.mcap", tmp_path / "recovered.mcap"
    cut.write_bytes(data[: int(part * len(data))])
    done = recover(cut, target)
    old, new = open_log(cut), open_log(target)
    assert list(new.raw()) == list(old.raw())
    assert done.messages == sum(new.topics.values()) == sum(old.topics.values())
    found = list(new.frames("aero"))
    assert len(found) == int(4.001 * part)
    assert all(equal(one, other) for one, other in zip(found, frames, strict=False))
    assert new.diagnostics == {"aero": NAMES}
    ours = [m for m in new.raw() if not m.topic.startswith(FLOW)]
    assert ours == messages[: len(ours)]


def test_frames_are_read_in_constant_memory(logged):
    """An iterator over a chunk at a time: the first frame is there before the rest is read."""
    log = open_log(logged[0])
    frames = log.frames("aero")
    assert next(frames).step == 0
    assert next(frames).step == 5


def test_another_message_under_the_topic_is_named(logged):
    kind = Grid.get_schema()
    with pytest.raises(LogError, match=r"expected a foxglove\.Grid; got Error parsing"):
        grid.decode(b"nonsense", kind.name, kind.data, STEP_NS)
    with pytest.raises(LogError, match="expected a Grid of vx, vy, pressure, vorticity; got , 0 bytes"):
        grid.decode(b"", kind.name, kind.data, STEP_NS)


@pytest.mark.parametrize(
    ("field", "place"), [("velocity", (3, 5, 1)), ("pressure", (3, 5)), ("vorticity", (3, 5))]
)
def test_one_bit_of_an_array_is_found_and_named(field, place):
    frame, other = (vortices(0.1, STEP_NS) for _ in range(2))
    array = getattr(other, field)
    array[place] = np.nextafter(array[place], np.float32(1e9))
    found = between_frames("/flow/aero", STEP_NS, grid.encode(frame), grid.encode(other))
    assert (found.topic, found.step, found.time_ns, found.field) == ("/flow/aero", 100, 100_000_000, field)
    assert (found.element, found.ulp) == (int(np.ravel_multi_index(place, array.shape)), 1)
    assert (found.recorded, found.again) == (getattr(frame, field)[place], array[place])


@pytest.mark.parametrize(
    ("change", "field", "element"),
    [({"origin": (-2.0, -1.5)}, "origin", 1), ({"origin": (-1.95, -1.35), "cell": 0.2}, "origin", 0)],
)
def test_another_place_is_found_and_named(change, field, element):
    frame = vortices(0.1, STEP_NS)
    other = dataclasses.replace(frame, **change)
    found = between_frames("/flow/aero", STEP_NS, grid.encode(frame), grid.encode(other))
    assert (found.field, found.element) == (field, element)


def test_frames_of_another_size_differ_by_their_size():
    frame, other = vortices(0.1, STEP_NS), vortices(0.1, STEP_NS, rows=20)
    found = between_frames("/flow/aero", STEP_NS, grid.encode(frame), grid.encode(other))
    assert (found.field, found.recorded, found.again) == ("velocity", "(28, 32, 2)", "(20, 32, 2)")


def test_the_scenario_of_the_log_gives_the_step(logged):
    assert json.loads(open_log(logged[0]).scenario_json)["coupling"] == SCENARIO["coupling"]
    assert [frame.step for frame in open_log(logged[0]).frames("aero")] == [0, 5, 10, 15]
