"""MJCF as a scenario: the same accelerations, compiled and simulated by MuJoCo."""

import mujoco
import numpy as np
import pytest

from linkwind.errors import InputError
from linkwind.mechanism.importers import import_file
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
  <equality><connect name="loop" body1="foot" body2="trunk" anchor="0 0 0"/></equality>
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
    assert left["joint limits"] == ["hip_y"]
    assert left["armatures"] == ["hip_y"]
    assert left["joint frictions"] == ["knee"]
    assert left["equality constraints"] == ["loop"]
    assert (left["tendons"], left["actuators"], left["sensors"]) == (["cord"], ["m"], ["gyro"])
    assert left["contacts"] == ["world", "trunk", "thigh", "shin", "foot", "toe"]


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
        imported(tmp_path, ROBOT.replace('body1="foot"', 'body1="nobody"'))


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
