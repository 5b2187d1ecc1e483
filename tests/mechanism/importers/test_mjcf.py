"""MJCF as a scenario: the same accelerations, compiled and simulated by MuJoCo."""

import mujoco
import numpy as np
import pytest

from linkwind.errors import InputError
from linkwind.mechanism import build
from linkwind.mechanism.export_urdf import export_urdf
from linkwind.mechanism.importers import import_file
from linkwind.native.multibody import Multibody
from tests.mechanism.importers.robots import Pair

ROBOT = """
<mujoco model="walker">
  <compiler angle="degree" eulerseq="zyx"/>
  <option gravity="0.3 -0.2 -9.7"/>
  <default>
    <geom type="capsule" density="700"/>
    <joint damping="0.1"/>
    <default class="stiff"><joint stiffness="3" springref="20" damping="0.3"/></default>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="trunk" pos="0 0 1" euler="20 30 40">
      <freejoint/>
      <geom size="0.1 0.2"/>
      <site name="imu"/>
      <body name="thigh" pos="0.3 0 0" euler="0 50 10">
        <joint name="hip_x" axis="1 0 0" pos="0 0 0.05"/>
        <joint name="hip_y" axis="0 1 1" class="stiff" ref="10" range="-30 30" limited="true"
          armature="0.01"/>
        <geom fromto="0 0 0 0 0.1 -0.4" size="0.05"/>
        <body name="shin" pos="0 0 -0.4">
          <joint name="knee" type="slide" axis="0 1 2" class="stiff" frictionloss="0.2"/>
          <geom type="ellipsoid" size="0.1 0.2 0.15" euler="0 30 0"/>
          <body name="foot" pos="0 0.1 -0.2" euler="0 0 70">
            <joint name="ankle" type="ball" stiffness="2"/>
            <geom type="box" size="0.1 0.05 0.02"/>
            <body name="toe"><geom type="cylinder" size="0.02 0.1" pos="0.1 0 0"/></body>
          </body>
        </body>
      </body>
    </body>
    <body name="slider" pos="2 0 0">
      <joint name="sx" type="slide" axis="1 0 0"/><joint name="sy" type="slide" axis="0 1 0"/>
      <joint name="turn" type="hinge" axis="0 0 1"/>
      <inertial pos="0.1 0 0" quat="1 1 0 0" mass="2" diaginertia="0.1 0.2 0.25"/>
    </body>
  </worldbody>
  <tendon><fixed name="cord"><joint joint="hip_x" coef="1"/></fixed></tendon>
  <actuator><motor name="m" joint="hip_x"/></actuator>
  <sensor><gyro name="gyro" site="imu"/></sensor>
  <equality><joint name="geared" joint1="sx" joint2="sy"/></equality>
</mujoco>
"""


def imported(tmp_path, text, **options):
    file = tmp_path / "robot.xml"
    file.write_text(text)
    return import_file(file, **options)


def test_accelerations_are_those_of_mujoco(tmp_path):
    got = imported(tmp_path, ROBOT)
    pair = Pair(got.scenario, mujoco.MjModel.from_xml_string(ROBOT))
    assert pair.differ(range(10)) < 1e-10
    assert len(pair.joints) == 8
    assert got.scenario.environment.gravity == (0.3, -0.2, -9.7)


def test_several_joints_of_a_body_become_a_chain(tmp_path):
    scenario = imported(tmp_path, ROBOT).scenario
    massless = [body.name for body in scenario.bodies if body.mass == 0.0]
    assert massless == ["thigh_hip_x", "slider_sx", "slider_sy"]
    chain = [(joint.parent, joint.child) for joint in scenario.joints if joint.name in ("sx", "sy", "turn")]
    assert chain == [("world", "slider_sx"), ("slider_sx", "slider_sy"), ("slider_sy", "slider")]


def test_what_was_left_out_is_named(tmp_path):
    left = {}
    for remark in imported(tmp_path, ROBOT).remarks:
        left.setdefault(remark.what, []).append(remark.item)
    assert "joint limits" not in left
    assert left["armatures"] == ["hip_y"]
    assert left["joint frictions"] == ["knee"]
    assert left["equality constraints"] == ["geared"]
    assert (left["tendons"], left["sensors"]) == (["cord"], ["gyro"])
    assert left["contacts"] == ["world", "trunk", "thigh", "shin", "foot", "toe"]


def test_ranges_become_stops(tmp_path):
    """They are from the joint's zero, which is ref."""
    stops = {joint.name: joint.stop for joint in imported(tmp_path, ROBOT).scenario.joints}
    assert stops.pop("hip_y") == pytest.approx(np.radians([-40.0, 20.0]))
    assert set(stops.values()) == {None}


def test_warnings_of_mujoco_are_passed_on_and_leave_no_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = ROBOT.replace('eulerseq="zyx"', 'eulerseq="zyx" settotalmass="5"')
    warnings = [r.item for r in imported(tmp_path, text).remarks if r.what == "warnings of MuJoCo"]
    assert len(warnings) <= 1  # a warning of some versions
    assert [file.name for file in tmp_path.iterdir()] == ["robot.xml"]


def test_a_base_is_for_urdf(tmp_path):
    with pytest.raises(InputError, match=r"--base free: expected it for URDF only; got .*xml, an MJCF\."):
        imported(tmp_path, ROBOT, base="free")


def test_what_mujoco_refuses(tmp_path):
    with pytest.raises(InputError, match=r"robot\.xml: MuJoCo refuses it: .*'nobody'.*Correct it\.$"):
        imported(tmp_path, ROBOT.replace('joint1="sx"', 'joint1="nobody"'))


def test_pictures_are_where_mujoco_has_the_geometry(tmp_path):
    compiled = mujoco.MjModel.from_xml_string(ROBOT)
    data = mujoco.MjData(compiled)
    mujoco.mj_kinematics(compiled, data)
    bodies = {body.name: body for body in imported(tmp_path, ROBOT).scenario.bodies}
    for geom in range(1, compiled.ngeom):
        name = mujoco.mj_id2name(compiled, mujoco.mjtObj.mjOBJ_BODY, compiled.geom_bodyid[geom])
        (picture,) = bodies[name].picture
        at = data.xipos[compiled.geom_bodyid[geom]] + np.array(picture.position)
        np.testing.assert_allclose(at, data.geom_xpos[geom], atol=1e-13)
        turned = np.zeros(9)
        mujoco.mju_quat2Mat(turned, np.array(picture.orientation))
        np.testing.assert_allclose(turned, data.geom_xmat[geom], atol=1e-13)


def test_pictures_of_the_world_stay_there(tmp_path):
    table = '<geom type="box" size="0.5 1 0.1" pos="0 3 0"/><body name="trunk"'
    (picture,) = imported(tmp_path, ROBOT.replace('<body name="trunk"', table)).scenario.environment.picture
    assert (picture.size, picture.position) == ((1.0, 2.0, 0.2), (0.0, 3.0, 0.0))


LOOP = """
<mujoco>
  <worldbody>
    <body name="crank" pos="0 0 1" euler="0 10 0">
      <joint name="a" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.02"/>
      <body name="rod" pos="0 0 0.3" euler="0 80 0">
        <joint name="b" type="ball"/><geom type="capsule" fromto="0 0 0 0 0 1" size="0.02"/>
        <site name="end" pos="0 0 1"/>
      </body>
    </body>
    <body name="rocker" pos="1 0 1">
      <joint name="c" axis="0 1 0.1"/><geom type="capsule" fromto="0 0 0 0 0 0.5" size="0.03"/>
    </body>
    <body name="floating" pos="2 0 1"><freejoint/><geom size="0.1"/></body>
  </worldbody>
  <equality>
    <connect name="pin" body1="rod" body2="rocker" anchor="0 0 0.9"/>
    <weld name="held" body1="rocker" body2="floating"/>
    <weld name="twisted" body1="crank" body2="floating" relpose="0 0 0 0.6 0.8 0 0"/>
    <connect name="inactive" body1="rod" body2="floating" anchor="0 0 0" active="false"/>
  </equality>
</mujoco>
"""


def constrained(compiled):
    """Accelerations at rest at qpos0 under connect and weld as equations, from MuJoCo's matrices."""
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    m, nv, rows = compiled, compiled.nv, []
    for name, turns in (("pin", False), ("held", True)):
        e = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_EQUALITY, name)
        body1, body2, given = m.eq_obj1id[e], m.eq_obj2id[e], m.eq_data[e]
        point = data.xpos[body1] + data.xmat[body1].reshape(3, 3) @ given[3:6] if turns else None
        point = point if turns else data.xpos[body1] + data.xmat[body1].reshape(3, 3) @ given[0:3]
        both = np.zeros((2, 2, 3, nv))
        for k, body in enumerate((body1, body2)):
            mujoco.mj_jac(m, data, both[k, 0], both[k, 1], point, body)
        rows += [both[1, 0] - both[0, 0]] + ([both[1, 1] - both[0, 1]] if turns else [])
    jacobian, mass = np.vstack(rows), np.zeros((nv, nv))
    mujoco.mj_fullM(m, mass, data.qM) if hasattr(data, "qM") else mujoco.mj_fullM(m, data, mass)
    force = data.qfrc_passive - data.qfrc_bias
    free, moved = np.linalg.solve(mass, force), np.linalg.solve(mass, jacobian.T)
    return data, free, free - moved @ np.linalg.lstsq(jacobian @ moved, jacobian @ free, rcond=1e-12)[0]


def test_connect_and_weld_close_loops(tmp_path):
    got = imported(tmp_path, LOOP)
    closures = [(joint.name, joint.type, joint.parent, joint.child) for joint in got.scenario.joints[-2:]]
    assert closures == [("pin", "spherical", "rod", "rocker"), ("held", "fixed", "rocker", "floating")]
    left = {remark.item: remark.why for remark in got.remarks if remark.what == "equality constraints"}
    assert left == {"twisted": "they are twisted at the joints' zero", "inactive": "they do not hold"}
    compiled = mujoco.MjModel.from_xml_string(LOOP)
    data, free, expected = constrained(compiled)
    assert np.abs(expected - free).max() > 1.0  # the loops matter
    mechanism = build(got.scenario)
    core = Multibody(mechanism.tables, mechanism.bodies, mechanism.closures)
    found = core.evaluate(core.initial_state(mechanism.q0, mechanism.v0), np.zeros((core.n, 6)))
    data.qacc[:] = expected
    mujoco.mj_rnePostConstraint(compiled, data)
    scale = np.abs(found.acceleration).max()
    for i, name in enumerate(mechanism.bodies):
        body, both = mujoco.mj_name2id(compiled, mujoco.mjtObj.mjOBJ_BODY, name), np.zeros(6)
        mujoco.mj_objectAcceleration(compiled, data, mujoco.mjtObj.mjOBJ_BODY, body, both, 0)
        np.testing.assert_allclose(found.acceleration[i, 3:], both[:3], atol=1e-9 * scale)
    lost = {remark.item for remark in export_urdf(got.scenario).remarks if remark.what == "loops"}
    assert lost == {"pin", "held"}


def test_a_weld_keeps_the_start_at_zero(tmp_path):
    with pytest.raises(InputError, match=r"--at a=0\.1: expected no weld that closes a loop; got held\."):
        imported(tmp_path, LOOP, at=["a=0.1"])


def test_stiff_joints_are_named(tmp_path):
    """About 4e-5 kg·m² a damper relaxes in I/c, a spring in √(I/k)."""
    joint = (
        '<joint name="{}" axis="0 0 1" {}/><inertial pos="0 0 0" mass="0.1" diaginertia="4e-5 4e-5 4e-5"/>'
    )
    kinds = {"soft": 'damping="0.01"', "damped": 'damping="40"', "sprung": 'stiffness="4e9"'}
    bodies = "".join(f"<body>{joint.format(name, values)}</body>" for name, values in kinds.items())
    remarks = imported(tmp_path, f"<mujoco><worldbody>{bodies}</worldbody></mujoco>").remarks
    stiff = [remark.item for remark in remarks if remark.what == "stiff joints"]
    assert stiff == ["damped (relaxes in 1e-06 s)", "sprung (relaxes in 1e-07 s)"]
