"""URDF as a scenario: accelerations and motion are those of MuJoCo and Pinocchio on the same file."""

import mujoco
import numpy as np
import pytest

from linkwind.errors import InputError
from linkwind.mechanism import build
from linkwind.mechanism.export_urdf import export_urdf
from linkwind.mechanism.importers import import_file
from linkwind.native.multibody import Integrator, Multibody
from linkwind.scenario import load, loads
from linkwind.spatial import Motion
from tests.mechanism.importers.robots import Pair, ends, random_urdf

INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.2" izz="0.25" ixy="0" ixz="0" iyz="0"/></inertial>'
)
FLOATING = f'<joint name="j0" type="floating"><origin rpy="0.3 0.2 0.1"/>{ends("world", 0)}</joint>'
PLANAR = (
    '<joint name="j0" type="planar"><origin xyz="1 2 3" rpy="0.3 0.2 0.1"/>'
    f'{ends("world", 0)}<axis xyz="0 0 1"/></joint>'
)


def imported(tmp_path, text, **options):
    file = tmp_path / "robot.urdf"
    file.write_text(text)
    return import_file(file, **options)


def of_mujoco(text):
    return mujoco.MjModel.from_xml_string(text)


@pytest.mark.parametrize("seed", range(8))
def test_accelerations_are_those_of_mujoco(tmp_path, seed):
    text = random_urdf(seed)
    assert Pair(imported(tmp_path, text).scenario, of_mujoco(text)).differ(range(5)) < 1e-10


def test_a_floating_root(tmp_path):
    text = random_urdf(3, roots=FLOATING)
    pair = Pair(imported(tmp_path, text).scenario, of_mujoco(text))
    assert pair.differ(range(5)) < 1e-10
    assert "world-l0" in pair.mechanism.joints


def test_a_planar_root_moves_in_its_plane(tmp_path):
    """MuJoCo reads another plane than the standard says, so this one is by hand: normal z of the joint."""
    scenario = imported(tmp_path, random_urdf(2, roots=PLANAR)).scenario
    mechanism = build(scenario)
    core = Multibody(mechanism.tables)
    motion = Motion.at_rest(core.n)
    rng = np.random.default_rng(0)
    core.motion(core.initial_state(mechanism.q0, rng.normal(size=core.nv)), motion)
    cr, sr, cp, sp, cy, sy = *_cs(0.3), *_cs(0.2), *_cs(0.1)
    normal = np.array([cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr])
    assert abs(np.cross(normal, motion.angular[0])).max() < 1e-14
    point = motion.linear[0] + np.cross(motion.angular[0], [1, 2, 3] - motion.position[0])
    assert abs(point @ normal) < 1e-14


def _cs(angle):
    return np.cos(angle), np.sin(angle)


def test_the_fall_is_that_of_mujoco(tmp_path):
    text = random_urdf(5, n=6)
    pair = Pair(imported(tmp_path, text).scenario, of_mujoco(text))
    state = pair.random_state(0)
    pair.m.opt.integrator, pair.m.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 2.5e-4
    wrench = np.zeros((1, pair.core.n, 6))
    for _ in range(400):
        state, _ = pair.core.advance(
            state, 5e-4, np.array([0.0]), wrench, None, integrator=Integrator.DOPRI5, rtol=1e-12, atol=1e-12
        )
    for _ in range(800):
        mujoco.mj_step(pair.m, pair.d)
    motion = Motion.at_rest(pair.core.n)
    pair.core.motion(state, motion)
    mujoco.mj_kinematics(pair.m, pair.d)
    for name in ("l1", "l2", "l3", "l5"):
        body = mujoco.mj_name2id(pair.m, mujoco.mjtObj.mjOBJ_BODY, name)
        if body > 0 and pair.m.body_mass[body] == pytest.approx(_mass(pair, name)):  # not fused by MuJoCo
            ours = motion.position[pair.mechanism.bodies.index(name)]
            np.testing.assert_allclose(ours, pair.d.xipos[body], atol=1e-9)


def _mass(pair, name):
    return pair.mechanism.tables.mass[pair.mechanism.bodies.index(name)]


@pytest.mark.parametrize("seed", range(4))
def test_accelerations_are_those_of_pinocchio(tmp_path, seed):
    pin = pytest.importorskip("pinocchio")
    text = random_urdf(seed)
    scenario = imported(tmp_path, text).scenario
    model = pin.buildModelFromXML(text)
    data, mechanism = model.createData(), build(scenario)
    t, rng = mechanism.tables, np.random.default_rng(seed)
    q, v = mechanism.q0.copy(), mechanism.v0.copy()
    their_q, their_v, torque = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    ours = np.zeros(model.nv, int)
    for j in range(1, model.njoints):
        joint, place = model.joints[j], mechanism.joints.index(model.names[j])
        angle, speed, rate = rng.normal(), rng.normal(), t.v_index[place]
        q[t.q_index[place]], v[rate] = angle, speed
        coordinates = [np.cos(angle), np.sin(angle)] if joint.nq == 2 else [angle]
        their_q[joint.idx_q : joint.idx_q + joint.nq], their_v[joint.idx_v] = coordinates, speed
        torque[joint.idx_v], ours[joint.idx_v] = -t.damping[rate] * speed, rate
    model.damping[:] = 0.0
    theirs = pin.aba(model, data, their_q, their_v, torque)
    core = Multibody(t)
    found = core.evaluate(core.initial_state(q, v), np.zeros((core.n, 6))).joint_acceleration[ours]
    assert np.abs(found - theirs).max() < 1e-10 * np.abs(theirs).max()


@pytest.mark.parametrize("roots", ["", FLOATING, PLANAR], ids=["fixed", "floating", "planar"])
@pytest.mark.parametrize("seed", range(3))
def test_there_and_back_again(tmp_path, seed, roots):
    once = imported(tmp_path, random_urdf(seed, roots=roots)).scenario
    exported = export_urdf(once)
    again = imported(tmp_path, exported.text).scenario
    assert {(j.name, j.stop) for j in again.joints} == {(j.name, j.stop) for j in once.joints}
    cores = [Multibody(build(scenario).tables) for scenario in (once, again)]
    rng = np.random.default_rng(seed)
    state = cores[0].initial_state(np.array([*build(once).q0]), rng.normal(size=cores[0].nv))
    other = cores[1].initial_state(
        np.array([*build(again).q0]), state[cores[0].nq : cores[0].nq + cores[0].nv]
    )
    if roots == PLANAR:
        other = state.copy()  # its plane has axes of its own, turned about the normal, and so have q and v
        other[cores[0].nq : cores[0].nq + 2] = _turned_in_plane(build(once), build(again), state, cores[0].nq)
    wrench = np.zeros((cores[0].n, 6))
    a, b = (core.evaluate(s, wrench).acceleration for core, s in zip(cores, (state, other), strict=True))
    assert np.abs(a - b).max() < 1e-10 * np.abs(a).max()
    if not roots:
        assert Pair(once, of_mujoco(exported.text)).differ(range(3)) < 1e-10


def _turned_in_plane(once, again, state, at):
    turn = again.tables.parent_rotation[0].T @ once.tables.parent_rotation[0]
    return (turn @ [*state[at : at + 2], 0.0])[:2]


def test_the_start(tmp_path):
    """--at is MuJoCo's qpos, for turning and sliding joints, branches included."""
    text = random_urdf(6)
    compiled = of_mujoco(text)
    data, at = mujoco.MjData(compiled), []
    for joint in range(compiled.njnt):
        data.qpos[compiled.jnt_qposadr[joint]] = value = 0.3 + 0.1 * joint
        at.append(f"{mujoco.mj_id2name(compiled, mujoco.mjtObj.mjOBJ_JOINT, joint)}={value!r}")
    mujoco.mj_kinematics(compiled, data)
    mechanism = build(imported(tmp_path, text, at=at).scenario)
    core, names = Multibody(mechanism.tables), [argument.split("=")[0] for argument in at]
    for k, name in enumerate(names):
        q = mechanism.q0[mechanism.tables.q_index[mechanism.joints.index(name)]]
        assert q == pytest.approx(0.3 + 0.1 * k, abs=1e-12)
    motion = Motion.at_rest(core.n)
    core.motion(core.initial_state(mechanism.q0, mechanism.v0), motion)
    for joint, name in enumerate(names):
        body = mechanism.joints.index(name)
        point = mechanism.tables.child_point[body]
        at_joint = motion.position[body] + _rotated(motion.orientation[body], point)
        axis = data.xaxis[joint]
        off = np.cross(axis, at_joint - data.xanchor[joint])  # a sliding joint's anchor moves along its axis
        np.testing.assert_allclose(off, 0.0, atol=1e-12)


def _rotated(quaternion, vector):
    result = np.zeros(3)
    mujoco.mju_rotVecQuat(result, vector, quaternion)
    return result


def test_links_without_mass_are_merged_or_left_out(tmp_path):
    """A frame, a point mass on a fixed joint, a massless cross between two hinges, an idle wheel."""
    text = (
        f'<robot name="r"><link name="base"/><link name="arm">{INERTIAL}</link><link name="tool"/>'
        '<link name="bob"><inertial><origin xyz="0 0 1"/><mass value="2"/></inertial></link>'
        f'<link name="cross"/><link name="fore">{INERTIAL}</link><link name="wheel"/>'
        '<joint name="a" type="revolute"><parent link="base"/><child link="arm"/><limit/></joint>'
        '<joint name="t" type="fixed"><parent link="arm"/><child link="tool"/></joint>'
        '<joint name="b" type="fixed"><parent link="tool"/><child link="bob"/></joint>'
        '<joint name="x" type="continuous"><origin xyz="0 0 1"/><parent link="tool"/><child link="cross"/>'
        '</joint><joint name="y" type="continuous"><parent link="cross"/><child link="fore"/>'
        '<axis xyz="0 1 0"/></joint>'
        '<joint name="w" type="continuous"><parent link="fore"/><child link="wheel"/></joint></robot>'
    )
    got = imported(tmp_path, text)
    bodies = {body.name: body for body in got.scenario.bodies}
    assert sorted(bodies) == ["arm", "bob", "cross", "fore"]
    assert (bodies["cross"].mass, bodies["cross"].inertia) == (0.0, (0.0,) * 6)
    assert (bodies["bob"].mass, bodies["bob"].inertia) == (2.0, (0.0,) * 6)  # a point mass may be one
    assert [joint.parent for joint in got.scenario.joints if joint.name == "x"] == ["arm"]
    left = {(remark.what, remark.item) for remark in got.remarks}
    assert ("links with mass and without inertia", "bob") in left
    assert ("links without mass at the end of the tree, with their joints", "wheel (w)") in left
    merged = "links merged into the one that they are fixed to"
    assert {(merged, "base → world"), (merged, "tool → arm")} < left
    tables = build(got.scenario).tables
    core = Multibody(tables)
    q = np.array([0.3, 0.4, 0.5])
    found = core.evaluate(core.initial_state(q, np.zeros(3)), np.zeros((core.n, 6))).joint_acceleration
    # Almost massless gives almost the same: the limit exists, and is what we compute.
    almost = got.text.replace(
        'name = "cross"\nmass = 0.0    # kg\ninertia = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]',
        'name = "cross"\nmass = 1e-9\ninertia = [1e-9, 1e-9, 1e-9, 0.0, 0.0, 0.0]',
    )
    assert almost != got.text
    core = Multibody(build(loads(almost, "almost")).tables)
    near = core.evaluate(core.initial_state(q, np.zeros(3)), np.zeros((core.n, 6))).joint_acceleration
    assert 0.0 < np.abs(found - near).max() < 1e-7


def test_an_impossible_inertia_is_refused_or_repaired(tmp_path):
    text = (
        '<robot name="r">\n<link name="a"/>\n<link name="b"><inertial><mass value="1"/>'
        '<inertia ixx="0.1" iyy="0.2" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>'
    )
    with pytest.raises(InputError) as refused:
        imported(tmp_path, text)
    assert str(refused.value) == (
        f'{tmp_path}/robot.urdf:3: <link name="b">: expected principal moments of inertia above 0, of which '
        "two add up to at least the third; got 0.1, 0.2, 0.5 kg·m². Correct them, or import with "
        "--repair-inertia."
    )
    got = imported(tmp_path, text, repair=True)
    np.testing.assert_allclose(got.scenario.bodies[0].inertia, [0.3, 0.2, 0.5, 0, 0, 0], atol=1e-15)
    assert [remark.item for remark in got.remarks if "repaired" in remark.what] == [
        "b (0.1, 0.2, 0.5 → 0.2, 0.3, 0.5 kg·m²)"
    ]


def test_what_was_left_out_is_at_the_top_of_the_file(tmp_path):
    text = (
        '<robot name="r"><link name="a.b"><collision><geometry><box size="1 1 1"/></geometry></collision>'
        f'</link><link name="a-b">{INERTIAL}</link><link name="1">{INERTIAL}</link>'
        '<transmission name="tr"/><gazebo/>'
        '<joint name="j" type="revolute"><parent link="a.b"/><child link="a-b"/><limit effort="1"/>'
        '<dynamics damping="0.5" friction="0.1"/><mimic joint="k"/></joint>'
        '<joint name="k" type="prismatic"><parent link="a-b"/><child link="1"/></joint></robot>'
    )
    got = imported(tmp_path, text)
    assert [(body.name, body.mass) for body in got.scenario.bodies] == [("a_b", 1.0), ("n1", 1.0)]
    assert [joint.damping for joint in got.scenario.joints] == [0.5, 0.0]
    head = got.text.split("\n\n")[0]
    assert all(line.startswith("#") and len(line) <= 110 for line in head.splitlines())
    for line in (
        "transmissions (1): joints have no motors",
        "mimic joints (1): they move freely",
        "joint limits (1): the start is not between them; see --at",
        "joint frictions (1): dry friction is not modelled",
        "limits of effort and velocity (1): they are the controller's",
        "gazebo extensions (1): they are for another program",
        "collision shapes (1): bodies do not touch",
    ):
        assert f"#   - {line}" in head
    assert '# "a-b" in the file' in got.text


def test_pictures_are_where_the_file_has_them(tmp_path):
    """The centre of a picture in the world, from the scenario and from the file by hand."""
    text = (
        '<robot name="r"><link name="w"/><link name="a"><inertial><origin xyz="0.1 0.2 0.3"/>'
        '<mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<visual><origin xyz="0 0 2"/><geometry><cylinder radius="0.1" length="3"/></geometry></visual>'
        '<visual><geometry><mesh filename="package://p/a.stl"/></geometry></visual></link>'
        '<joint name="j" type="continuous"><origin xyz="1 0 0" rpy="0 1.5707963267948966 0"/>'
        '<parent link="w"/><child link="a"/></joint></robot>'
    )
    (body,) = imported(tmp_path, text).scenario.bodies
    cylinder, mesh = body.picture
    centre = np.array([1.3, 0.2, -0.1])  # turned about y: x of the link is -z of the world, z is x
    np.testing.assert_allclose(centre + cylinder.position, [3.0, 0.0, 0.0], atol=1e-14)
    np.testing.assert_allclose(cylinder.axis, [1.0, 0.0, 0.0], atol=1e-14)
    np.testing.assert_allclose(centre + mesh.position, [1.0, 0.0, 0.0], atol=1e-14)
    assert (cylinder.diameter, cylinder.length, mesh.file) == (0.2, 3.0, "package://p/a.stl")


def test_pictures_of_what_stands_still_stay_in_the_world(tmp_path):
    """Of a stand without mass, of what is fixed to it, and of an idle knob that could turn; and out again."""
    box = '<geometry><box size="1 2 3"/></geometry>'
    text = (
        f'<robot name="r"><link name="w"><visual><origin xyz="0 0 1"/>{box}</visual></link>'
        f'<link name="stand"><visual>{box}</visual></link><link name="knob"><visual>{box}</visual></link>'
        f'<link name="arm">{INERTIAL}</link>'
        '<joint name="s" type="fixed"><origin xyz="0 0 2"/><parent link="w"/><child link="stand"/></joint>'
        '<joint name="k" type="continuous"><origin xyz="0 0 3"/><parent link="w"/><child link="knob"/>'
        '</joint><joint name="a" type="continuous"><parent link="stand"/><child link="arm"/></joint></robot>'
    )
    scenario = imported(tmp_path, text).scenario
    assert [body.name for body in scenario.bodies] == ["arm"]
    heights = [picture.position for picture in scenario.environment.picture]
    assert sorted(heights) == [(0.0, 0.0, 1.0), (0.0, 0.0, 2.0), (0.0, 0.0, 3.0)]
    again = imported(tmp_path, export_urdf(scenario).text).scenario
    assert again.environment.picture == scenario.environment.picture


def test_export_says_what_it_leaves_out():
    exported = export_urdf(load("two_link", ["joints.hinge.stiffness=2"]))
    assert {remark.what for remark in exported.remarks} == {
        "springs", "inertias about z only", "starts", "gravities", "force models"
    }  # fmt: skip
    assert (exported.links, exported.joints) == (3, 2)


def test_export_leaves_out_a_wing_and_says_so():
    points = "[[0.5, 0.0], [-0.5, 0.0], [-0.2, 1.0]]"
    exported = export_urdf(
        load("two_link", [f'bodies.link2.shape={{type="wing",points={points}}}', "aero.model=none"])
    )
    assert [remark.item for remark in exported.remarks if remark.what == "shapes"] == ["link2"]
    assert exported.text.count("<visual>") == 1


def test_a_spherical_joint_goes_out_as_three(tmp_path):
    text = random_urdf(1, n=3).replace('name="j2" type="fixed"', 'name="j2" type="spherical"')
    assert "spherical" in text
    once = imported(tmp_path, text).scenario
    again = imported(tmp_path, export_urdf(once).text).scenario
    assert [joint.name for joint in again.joints if joint.name.startswith("j2")] == ["j2_x", "j2_y", "j2_z"]
    found = []
    for scenario in (once, again):
        mechanism = build(scenario)
        core = Multibody(mechanism.tables)
        state = core.initial_state(mechanism.q0, np.zeros(core.nv))
        found.append(core.evaluate(state, np.zeros((core.n, 6))).acceleration)
    keep = [i for i, body in enumerate(again.bodies) if body.mass]
    np.testing.assert_allclose(found[1][keep], found[0], atol=1e-11 * np.abs(found[0]).max())


def test_limits_become_stops(tmp_path):
    """Those that the start is between; a continuous joint has none."""
    text = random_urdf(3, n=4).replace('lower="-9"', 'lower="0.5"', 1)
    names = [f"j{i}" for i in range(1, 4)]
    got = imported(tmp_path, text)
    stops = {joint.name: joint.stop for joint in got.scenario.joints if joint.name in names}
    assert stops == {"j1": None, "j2": None, "j3": (-9.0, 9.0)}
    assert [remark.item for remark in got.remarks if remark.what == "joint limits"] == ["j1 (0.5 to 9)"]
