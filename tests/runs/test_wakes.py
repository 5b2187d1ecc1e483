"""A run whose provider shows wakes: every way that a frame goes, and the same bits at the end of each."""

from __future__ import annotations

import json
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from linkwind.bus.zenoh import loopback_endpoint
from linkwind.errors import LogError
from linkwind.frames import Sent, decode
from linkwind.log import contents
from linkwind.log.reader import Log, open_log
from linkwind.log.seek import open_seekable
from linkwind.log.vtk import export_vtk
from linkwind.runs.diff import diff
from linkwind.runs.playback import Steering
from linkwind.runs.replay import Selection, replay
from linkwind.runs.resume import plan, resume
from linkwind.runs.run import Outcome, run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load
from tests.runs.edit import rewrite
from tests.runs.test_export_vtk import cells, collected, read
from tests.runs.test_record import heard_from_the_start
from tests.runs.test_replay import Subscriber

STEPS = 30
SIZE = ("aero.model=vortex", "aero.vortex.chordwise=2", "aero.vortex.spanwise=3", "aero.vortex.wake=15")
SETTINGS = (f"time.end={STEPS / 1000}", "aero.vortex.frames=4", *SIZE)
TOPIC, SCENE = "/wake/aero", "/scene/wake/aero"


def fly(folder: Path, *more: str) -> Outcome:
    return run(
        load("flapper", ["bus.transport=inprocess", *SETTINGS, *more]),
        folder,
        lambda step: None,
        report=False,
    )


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fly(tmp_path_factory.mktemp("run") / "out", "log.checkpoint_every=7").log


def messages(log: Path) -> list[tuple[str, int, bytes]]:
    return [tuple(m) for m in open_log(log).raw() if m.topic != contents.TIMING]  # type: ignore[misc]


def test_the_log_holds_every_frame(log: Path) -> None:
    opened = open_log(log)
    assert (opened.wakes, opened.flows) == (("aero",), ())
    frames = list(opened.wake_frames("aero"))
    assert [frame.step for frame in frames] == [0, 8, 16, 24]  # of 30 steps every 8th
    assert [frame.shape for frame in frames] == [(3, 2 + min(f.step, 15), 3) for f in frames]
    seekable = open_seekable(log)
    assert seekable.wakes == ("aero",)
    found = seekable.wake_frame("aero", 16_000_000, 1_000_000)
    assert found is not None
    assert found.encode() == frames[2].encode()
    assert seekable.wake_frame("aero", 17_000_000, 1_000_000) is None


def test_a_wing_s_rings_lie_on_its_plate(log: Path) -> None:
    """Along the chord from a quarter of a panel behind the front; between the tips along the span."""
    opened = open_log(log)
    path, scenario = opened.trajectory(), json.loads(opened.scenario_json)
    names = [body["name"] for body in scenario["bodies"]]
    for frame in opened.wake_frames("aero"):
        for wing, name in enumerate(opened.provider_bodies["aero"]):
            body = names.index(name)
            shape = scenario["bodies"][body]["shape"]
            w, x, y, z = path.orientation[frame.step, body]
            turn = np.array([
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ])  # fmt: skip
            own = (frame.corner[wing, :3] - path.position[frame.step, body]) @ turn
            along = np.abs(own[:, 0, 0] / shape["length"])  # panels of 1/2: corners at 1/8, 5/8, and behind
            np.testing.assert_allclose(along[:2], [0.375, 0.125], atol=2e-6)
            assert 0.5 - 0.5 / 24 - 2e-6 < along[2] <= 0.625 + 2e-6  # within a quarter of a panel of the edge
            assert np.abs(own[..., 1]).max() < 1e-6
            assert np.ptp(own[..., 2]) == pytest.approx(shape["span"] * 3 / 3.5, rel=1e-5)


def test_a_run_with_wakes_is_the_same_again(log: Path) -> None:
    found = verify(*scenario_of(log))
    assert (found.difference, found.remark, found.steps) == (None, "", STEPS)
    compared = ("/motion", "/wrench/aero", "/state", "/step", TOPIC)
    assert found.messages == sum(open_log(log).topics[topic] for topic in compared)


@pytest.mark.parametrize("transport", ["inprocess", "zenoh"])
@pytest.mark.parametrize("step", [7, 8, 16, 21, 26])
def test_a_run_that_goes_on_shows_the_same(log: Path, tmp_path: Path, step: int, transport: str) -> None:
    """From checkpoints at 7, 14, 21 and 28; frames are due at 8, 16 and 24."""
    done = resume(plan(open_log(log), step, [f"bus.transport={transport}"]), tmp_path / "again", report=False)
    strip = {"/scene", "/tf"}
    assert [m for m in messages(done.outcome.log) if m[0] not in strip] == [
        m for m in messages(log) if m[0] not in strip
    ]
    assert verify(*scenario_of(done.outcome.log)).identical


def test_a_frame_that_is_due_at_a_checkpoint_is_not_lost(tmp_path: Path) -> None:
    whole = fly(tmp_path / "whole", "log.checkpoint_every=8")
    for step in (8, 16, 20):
        done = resume(plan(open_log(whole.log), step, []), tmp_path / str(step), report=False)
        assert messages(done.outcome.log) == messages(whole.log)


def test_how_many_frames_there_are_may_change(log: Path, tmp_path: Path) -> None:
    done = resume(plan(open_log(log), 14, ["aero.vortex.frames=30"]), tmp_path / "more", report=False)
    assert [f.step for f in open_log(done.outcome.log).wake_frames("aero")] == [0, 8, *range(15, 31)]
    state = open_log(log).final_state_sha256
    assert done.outcome.result.final_state_sha256 == state
    assert verify(*scenario_of(done.outcome.log)).identical


def test_one_bit_of_a_frame_is_found_and_named(log: Path, tmp_path: Path) -> None:
    def edit(topic: str, number: int, payload: bytes) -> bytes:
        return (
            payload[:-4] + bytes([payload[-4] ^ 1]) + payload[-3:]
            if (topic, number) == (TOPIC, 3)
            else payload
        )

    other = rewrite(log, tmp_path / "edited.mcap", edit)
    found = verify(*scenario_of(other)).difference
    assert found is not None
    assert (found.topic, found.step, found.field, found.ulp) == (TOPIC, 16, "strength", 1)
    assert found.element == 3 * 17 * 3 - 1  # wings, rows, columns: the last one
    compared = diff(log, other)
    (only,) = compared.fields
    assert (only.topic, only.field, only.messages, only.t) == (TOPIC, "strength", 1, 0.016)
    assert diff(log, other, rtol=1e-6).identical


def test_other_rings_are_told(log: Path, tmp_path: Path) -> None:
    def edit(topic: str, number: int, payload: bytes) -> bytes:
        if (topic, number) != (TOPIC, 2):
            return payload
        frame = list(open_log(log).wake_frames("aero"))[1]
        return replace(frame, corner=frame.corner[:, :-1], strength=frame.strength[:, :-1]).encode()

    (only,) = diff(log, rewrite(log, tmp_path / "edited.mcap", edit)).fields
    assert (only.field, only.first.recorded) == ("grid", "(3, 10, 3) rings, 2 rows of them on the wing")


def test_a_damaged_frame_in_a_log_is_refused(log: Path, tmp_path: Path) -> None:
    def edit(topic: str, number: int, payload: bytes) -> bytes:
        return payload[:-4] if topic == TOPIC else payload

    other = open_log(rewrite(log, tmp_path / "edited.mcap", edit))
    with pytest.raises(LogError, match=r"edited.mcap: /wake/aero: expected a WakeFrame"):
        list(other.wake_frames("aero"))


def test_a_listener_s_log_is_the_run_s_own(tmp_path: Path) -> None:
    own, recording = heard_from_the_start(tmp_path, *SETTINGS, name="flapper")
    heard = open_log(recording.log)
    assert (recording.missed, recording.error) == ("", "")
    assert list(heard.raw()) == list(own.raw())
    assert heard.topics == own.topics
    assert heard.topics[TOPIC] == heard.topics[SCENE] == 4


def test_a_replay_shows_the_frames_as_they_were_sent(log: Path) -> None:
    endpoint, opened = loopback_endpoint(), open_log(log)
    with closing(Subscriber(endpoint, "linkwind/v1/out/observe/wake/*", enough=4)) as subscriber:
        replay(opened, Selection(), listen=[endpoint], connect=[], steering=Steering(0.0))
        assert subscriber.done.wait(60.0)
    got = [decode(Sent("wake", payload), "out", "aero") for _, payload in subscriber.got]
    assert [number for number, _ in got] == [1, 2, 3, 4]
    assert [f.encode() for _, f in got] == [f.encode() for f in opened.wake_frames("aero")]  # type: ignore[call-arg]


def scenes(log: Log) -> list[object]:
    """What Foxglove reads, with the schema that the file carries."""
    schema = next(channel.schema for channel in log.channels.values() if channel.topic == SCENE)
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
    return [kind.FromString(m.payload) for m in log.raw(SCENE)]


def test_foxglove_sees_triangles_over_the_wakes(log: Path) -> None:
    opened = open_log(log)
    for scene, frame in zip(scenes(opened), opened.wake_frames("aero"), strict=True):
        assert [entity.id for entity in scene.entities] == ["wake 1", "wake 2", "wake 3"]
        for wing, entity in enumerate(scene.entities):
            (mesh,) = entity.triangles
            points = np.array([(p.x, p.y, p.z) for p in mesh.points])
            assert np.array_equal(points, frame.corner[wing, 2:].reshape(-1, 3))
            rings = (frame.shape[1] - 2) * 3
            assert len(mesh.indices) == 6 * rings
            assert len(mesh.colors) == len(points)
            assert rings == 0 or max(mesh.indices) == len(points) - 1
            assert entity.timestamp.ToNanoseconds() == frame.time_ns
            ring = np.pad(frame.strength[wing, 2:].astype(float), 1, constant_values=np.nan)
            for place, color in enumerate(mesh.colors if rings else ()):
                i, j = divmod(place, 4)
                mean = np.nanmean(ring[i : i + 2, j : j + 2])  # of the rings around a corner
                if abs(mean) > 0.02 * np.abs(frame.strength).max():
                    assert (color.r > color.b) == (mean > 0.0)  # red for what is positive, else blue


def test_rings_for_paraview(log: Path, tmp_path: Path) -> None:
    opened = open_log(log)
    wake, bodies = export_vtk(opened, tmp_path / "vtk")
    assert (wake.name, bodies.name) == ("wake_aero.pvd", "bodies.pvd")
    frames, files = list(opened.wake_frames("aero")), collected(wake)
    assert list(files) == list(collected(bodies)) == [frame.time_ns / 1e9 for frame in frames]
    for frame, file in zip(frames, files.values(), strict=True):
        grid = read(vtkXMLUnstructuredGridReader(), file)
        assert grid.GetNumberOfCells() == frame.strength.size
        assert np.array_equal(cells(grid, "circulation [m^2/s]"), frame.strength.ravel())
        assert cells(grid, "bound").sum() == 3 * 2 * 3
        points = vtk_to_numpy(grid.GetPoints().GetData())
        wings, rows, columns = frame.shape
        for wing, row, column in ((0, 0, 0), (wings - 1, rows - 1, columns - 1)):
            ids = grid.GetCell((wing * rows + row) * columns + column).GetPointIds()
            found = points[[ids.GetId(i) for i in range(4)]]
            corners = [(row, column), (row, column + 1), (row + 1, column + 1), (row + 1, column)]
            assert np.array_equal(found, [frame.corner[wing, i, j] for i, j in corners])
