"""A run whose provider shows its fluid in a box: every way that a frame goes, the same bits at its end."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from vtkmodules.vtkIOXML import vtkXMLImageDataReader

from linkwind import aero
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
from linkwind.runs.run import run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load
from tests.runs.edit import rewrite
from tests.runs.test_export_vtk import cells, collected, read
from tests.runs.test_record import heard_from_the_start
from tests.runs.test_replay import Subscriber
from tests.volumes import AXIS, RADIUS, SPEED, START, VolumeModel, hill

STEPS, EVERY, STEP_NS = 30, 8, 1_000_000
SETTINGS = (f"time.end={STEPS / 1000}", "aero.model=none")
TOPIC, SCENE = "/volume/aero", "/scene/volume/aero"
SHAPE = (18, 20, 24)


@pytest.fixture(scope="module", autouse=True)
def volume_model() -> Iterator[None]:
    """The model ``none`` shows Hill's vortex."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(aero.MODELS, "none", lambda scenario, provider: VolumeModel(every=EVERY))
        yield


@pytest.fixture(scope="module")
def log(volume_model: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    settings = ["bus.transport=inprocess", *SETTINGS, "log.checkpoint_every=7"]
    return run(
        load("two_link", settings), tmp_path_factory.mktemp("run") / "out", lambda step: None, report=False
    ).log


def messages(log: Path) -> list[tuple[str, int, bytes]]:
    return [tuple(m) for m in open_log(log).raw() if m.topic != contents.TIMING]  # type: ignore[misc]


def test_the_log_holds_every_frame(log: Path) -> None:
    opened = open_log(log)
    assert (opened.volumes, opened.flows, opened.wakes) == (("aero",), (), ())
    frames = list(opened.volume_frames("aero"))
    assert [frame.step for frame in frames] == [0, 8, 16, 24]
    assert all(f.encode() == hill(f.time_ns / 1e9, STEP_NS).encode() for f in frames)
    seekable = open_seekable(log)
    assert seekable.volumes == ("aero",)
    found = seekable.volume_frame("aero", 16_000_000, STEP_NS)
    assert found is not None
    assert found.encode() == frames[2].encode()
    assert seekable.volume_frame("aero", 17_000_000, STEP_NS) is None


def test_a_run_with_boxes_is_the_same_again(log: Path) -> None:
    found = verify(*scenario_of(log))
    assert (found.difference, found.remark, found.steps) == (None, "", STEPS)
    compared = ("/motion", "/wrench/aero", "/state", "/step", TOPIC)
    assert found.messages == sum(open_log(log).topics[topic] for topic in compared)


@pytest.mark.parametrize("step", [7, 8, 16, 21])
def test_a_run_that_goes_on_shows_the_same(log: Path, tmp_path: Path, step: int) -> None:
    done = resume(plan(open_log(log), step, ["bus.transport=inprocess"]), tmp_path / "again", report=False)
    strip = {"/scene", "/tf"}
    assert [m for m in messages(done.outcome.log) if m[0] not in strip] == [
        m for m in messages(log) if m[0] not in strip
    ]


def test_one_bit_of_a_frame_is_found_and_named_by_frame_and_cell(log: Path, tmp_path: Path) -> None:
    def edit(topic: str, number: int, payload: bytes) -> bytes:
        last = payload[:-4] + bytes([payload[-4] ^ 1]) + payload[-3:]
        return last if (topic, number) == (TOPIC, 3) else payload

    other = rewrite(log, tmp_path / "edited.mcap", edit)
    found = verify(*scenario_of(other)).difference
    assert found is not None
    assert (found.topic, found.step, found.field, found.ulp) == (TOPIC, 16, "pressure", 1)
    assert found.element == np.prod(SHAPE) - 1
    (only,) = diff(log, other).fields
    assert (only.topic, only.field, only.messages, only.t) == (TOPIC, "pressure", 1, 0.016)
    assert (only.first.step, only.first.element) == (16, np.prod(SHAPE) - 1)
    assert diff(log, other, rtol=1e-6).identical


def test_another_box_is_told(log: Path, tmp_path: Path) -> None:
    def edit(topic: str, number: int, payload: bytes) -> bytes:
        if (topic, number) != (TOPIC, 2):
            return payload
        frame = list(open_log(log).volume_frames("aero"))[1]
        return replace(frame, origin=(-0.6, -0.5, 0.0)).encode()

    (only,) = diff(log, rewrite(log, tmp_path / "edited.mcap", edit)).fields
    assert only.field == "grid"
    assert only.first.recorded == str(hill(0.0, STEP_NS).extent)


def test_a_damaged_frame_in_a_log_is_refused(log: Path, tmp_path: Path) -> None:
    def edit(topic: str, number: int, payload: bytes) -> bytes:
        return payload[:-4] if topic == TOPIC else payload

    other = rewrite(log, tmp_path / "edited.mcap", edit)
    with pytest.raises(LogError, match=r"edited.mcap: /volume/aero: expected a VolumeFrame"):
        list(open_log(other).volume_frames("aero"))


def test_a_listener_s_log_is_the_run_s_own(tmp_path: Path) -> None:
    own, recording = heard_from_the_start(tmp_path, *SETTINGS)
    heard = open_log(recording.log)
    assert (recording.missed, recording.error) == ("", "")
    assert list(heard.raw()) == list(own.raw())
    assert heard.topics == own.topics
    assert heard.topics[TOPIC] == heard.topics[SCENE] == 4


def test_a_replay_shows_the_frames_as_they_were_sent(log: Path) -> None:
    endpoint, opened = loopback_endpoint(), open_log(log)
    with closing(Subscriber(endpoint, "linkwind/v1/out/observe/volume/*", enough=4)) as subscriber:
        replay(opened, Selection(), listen=[endpoint], connect=[], steering=Steering(0.0))
        assert subscriber.done.wait(60.0)
    got = [decode(Sent("volume", payload), "out", "aero") for _, payload in subscriber.got]
    assert [number for number, _ in got] == [1, 2, 3, 4]
    assert [f.encode() for _, f in got] == [f.encode() for f in opened.volume_frames("aero")]  # type: ignore[call-arg]


def scenes(log: Log) -> list[object]:
    """What Foxglove reads, with the schema that the file carries."""
    schema = next(channel.schema for channel in log.channels.values() if channel.topic == SCENE)
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
    return [kind.FromString(m.payload) for m in log.raw(SCENE)]


def test_foxglove_sees_triangles_over_the_vortex(log: Path) -> None:
    opened = open_log(log)
    for scene, frame in zip(scenes(opened), opened.volume_frames("aero"), strict=True):
        (entity,) = scene.entities
        (mesh,) = entity.triangles
        assert (entity.id, entity.frame_id) == ("vortices", "world")
        assert entity.timestamp.ToNanoseconds() == frame.time_ns
        points = np.array([(p.x, p.y, p.z) for p in mesh.points])
        assert len(mesh.indices) > 300
        assert max(mesh.indices) == len(points) - 1 == len(mesh.colors) - 1
        off = points - (START + SPEED * frame.time_ns / 1e9, *AXIS)
        assert np.linalg.norm(off, axis=1).max() < RADIUS + frame.cell
        # The vorticity, about y or z, is opposite on the two sides of the line along which the vortex goes.
        reds = np.array([color.r > color.b for color in mesh.colors])
        signs = (np.sign(off[:, 1]), -np.sign(off[:, 2]))
        assert max(np.mean(reds == (sign > 0.0)) for sign in signs) > 0.95


def test_images_for_paraview(log: Path, tmp_path: Path) -> None:
    opened = open_log(log)
    volume, bodies = export_vtk(opened, tmp_path / "vtk")
    assert (volume.name, bodies.name) == ("volume_aero.pvd", "bodies.pvd")
    frames, files = list(opened.volume_frames("aero")), collected(volume)
    assert list(files) == list(collected(bodies)) == [frame.time_ns / 1e9 for frame in frames]
    for frame, file in zip(frames, files.values(), strict=True):
        image = read(vtkXMLImageDataReader(), file)
        assert image.GetDimensions() == (25, 21, 19)  # points: one more than cells, x first
        low, high = frame.extent
        edges = [edge for pair in zip(low, high, strict=True) for edge in pair]
        assert image.GetBounds() == pytest.approx(edges, rel=1e-12)
        assert np.array_equal(cells(image, "velocity [m/s]").reshape(*SHAPE, 3), frame.velocity)
        assert np.array_equal(cells(image, "pressure [Pa]").reshape(SHAPE), frame.pressure)
        omega, q = (
            cells(image, "vorticity [1/s]").reshape(*SHAPE, 3),
            cells(image, "Q [1/s^2]").reshape(SHAPE),
        )
        u, v = frame.velocity[..., 0].astype(float), frame.velocity[..., 1].astype(float)
        about_z = np.gradient(v, frame.cell, axis=2) - np.gradient(u, frame.cell, axis=1)
        np.testing.assert_allclose(omega[..., 2], about_z, atol=1e-3)
        assert q[omega[..., 2] > 0.5 * omega[..., 2].max()].mean() > 0.0
