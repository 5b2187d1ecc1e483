"""The pictures for Foxglove, parsed with the schema that the file carries."""

from __future__ import annotations

import json

import numpy as np
import pytest
from foxglove.messages import FrameTransforms, SceneUpdate
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader

from linkwind.log.scene import STANDARD_GRAVITY, Scene
from linkwind.spatial import Motion, Wrench
from tests.log.sample import NAMES, SCENARIO, STEP_NS, N, new_writer, state


def parsed(path, topic):
    """Yield schema, log time and message, by a parser made from the file alone."""
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(topics=[topic]):
            assert channel.message_encoding == "protobuf"
            pool = descriptor_pool.DescriptorPool()
            for proto in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
                pool.Add(proto)
            cls = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
            yield schema, message.log_time, cls.FromString(message.data)


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """A log with a picture of every point: scenario steps of 20 ms are slower than 60 Hz."""
    path = tmp_path_factory.mktemp("log") / "log.mcap"
    rng = np.random.default_rng(5)
    points = [state(rng) for _ in range(6)]
    points[3].wrench.force[0] = 0.0
    points[4].wrench.force[0] = [-3.0, 0.0, 0.0]
    scenario = json.dumps(SCENARIO | {"coupling": {"step": 0.02}})
    with new_writer(path, scenario_json=scenario) as writer:
        for k, point in enumerate(points):
            writer.scene(k * 20 * STEP_NS, point.motion, point.wrench.force)
        writer.close(final_state_sha256="00")
    return path, points


def rotation(q):
    """Return the matrix of a quaternion message, by Rodrigues' formula on its vector part."""
    x = np.array([q.x, q.y, q.z])
    cross = np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])
    return np.eye(3) + 2.0 * q.w * cross + 2.0 * cross @ cross


def vector(v):
    return np.array([v.x, v.y, v.z])


def test_the_schemas_are_foxgloves(pictures):
    path, _ = pictures
    for topic, cls in (("/tf", FrameTransforms), ("/scene", SceneUpdate)):
        expected = cls.get_schema()
        schema, _, _ = next(parsed(path, topic))
        assert schema.name == expected.name == f"foxglove.{cls.__name__}"
        assert (schema.encoding, schema.data) == ("protobuf", expected.data)


def test_transforms_are_the_poses(pictures):
    path, points = pictures
    found = list(parsed(path, "/tf"))
    assert len(found) == len(points)
    for k, (_, log_time, message) in enumerate(found):
        assert log_time == 20 * k * STEP_NS
        assert [(t.parent_frame_id, t.child_frame_id) for t in message.transforms] == [
            ("world", name) for name in NAMES
        ]
        for body, transform in enumerate(message.transforms):
            stamp, q = transform.timestamp, transform.rotation
            assert stamp.seconds * 1_000_000_000 + stamp.nanos == log_time
            assert vector(transform.translation).tolist() == points[k].motion.position[body].tolist()
            assert [q.w, q.x, q.y, q.z] == points[k].motion.orientation[body].tolist()


def test_every_update_shows_plates_balls_and_joints(pictures):
    path, _ = pictures
    for _, _, update in parsed(path, "/scene"):
        bodies = {entity.id: entity for entity in update.entities if entity.id in NAMES}
        assert all(entity.frame_id == name and entity.frame_locked for name, entity in bodies.items())
        sizes = {name: [vector(cube.size) for cube in bodies[name].cubes] for name in NAMES}
        assert [size[[0, 2]].tolist() for size in sizes["link1"]] == [[0.5, 1.0]]
        assert [size[[0, 2]].tolist() for size in sizes["link2"]] == [[0.3, 0.8]]
        assert 0.0 < sizes["link2"][0][1] < 0.1 * 0.3
        points = {name: [vector(s.pose.position).tolist() for s in bodies[name].spheres] for name in NAMES}
        assert points == {"link1": [], "link2": [[-0.15, 0.0, 0.0]], "ball": [[0.0, 0.0, 0.0]]}


def test_arrows_are_the_forces(pictures):
    """From the centre of mass, along the force, one longest plate for the weight of the heaviest body."""
    path, points = pictures
    for k, (_, _, update) in enumerate(parsed(path, "/scene")):
        entities = {entity.id: entity for entity in update.entities}
        for body, name in enumerate(NAMES):
            force = points[k].wrench.force[body]
            entity = entities[f"{name} force"]
            if not force.any():
                assert not entity.arrows
                continue
            (arrow,) = entity.arrows
            assert entity.frame_id == "world"
            assert vector(arrow.pose.position).tolist() == points[k].motion.position[body].tolist()
            along = rotation(arrow.pose.orientation) @ [1.0, 0.0, 0.0]
            drawn = (arrow.shaft_length + arrow.head_length) * along * 2.0 * STANDARD_GRAVITY / 0.5
            np.testing.assert_allclose(drawn, force, rtol=0.0, atol=1e-9)


def test_what_stands_still_is_drawn_in_the_world(tmp_path):
    floor = {"type": "box", "size": [4.0, 4.0, 0.1], "position": [1.0, 2.0, 3.0]}
    described = json.dumps(SCENARIO | {"environment": {"picture": [floor]}})
    with new_writer(tmp_path / "log.mcap", scenario_json=described) as writer:
        writer.scene(0, Motion.at_rest(N), np.zeros((N, 3)))
        writer.close(final_state_sha256="00")
    ((_, _, update),) = parsed(tmp_path / "log.mcap", "/scene")
    (entity,) = [each for each in update.entities if each.id == "environment"]
    (cube,) = entity.cubes
    assert entity.frame_id == "world"
    assert vector(cube.pose.position).tolist() == [1.0, 2.0, 3.0]
    assert vector(cube.size).tolist() == [4.0, 4.0, 0.1]


@pytest.mark.parametrize("force", [[np.nan, 0.0, 0.0], [np.inf, 1.0, 0.0]])
def test_a_force_that_is_no_number_is_not_drawn(force):
    wrench = Wrench.zeros(N)
    wrench.force[1] = force
    assert Scene(SCENARIO).update(0, Motion.at_rest(N), wrench.force) is not None


@pytest.mark.parametrize(
    ("step", "end", "stride"),
    [
        (1e-3, 1.2, 17),  # 58.8 pictures a second
        (0.02, 1.0, 1),
        (1e-3, 100.0, 100),  # 100 000 steps: 1001 pictures
        (1e-6, 1e-3, 16667),
    ],
)
def test_pictures_are_few(tmp_path, step, end, stride):
    scenario = SCENARIO | {"coupling": {"step": step}, "time": {"end": end}}
    assert Scene(scenario).stride == stride
    assert 1.0 / (stride * step) <= 60.0
    assert round(end / step) / stride <= 1000


def test_pictures_are_chosen_by_counting(tmp_path):
    """The same calls give the same pictures, whatever the clock says."""
    motion, wrench = Motion.at_rest(N), Wrench.zeros(N)
    with new_writer(tmp_path / "log.mcap") as writer:
        for k in range(101):
            writer.scene(k * STEP_NS, motion, wrench.force)
        writer.close(final_state_sha256="00")
    times = [time for _, time, _ in parsed(tmp_path / "log.mcap", "/tf")]
    assert times == [k * STEP_NS for k in range(0, 101, 17)]
    assert times == [time for _, time, _ in parsed(tmp_path / "log.mcap", "/scene")]
