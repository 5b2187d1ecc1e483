"""Actuators of MJCF: forces of joints under any input, as MuJoCo computes them."""

import mujoco
import numpy as np
import pytest

from linkwind.mechanism import build
from linkwind.mechanism.importers import import_file
from linkwind.native.multibody import Multibody
from linkwind.scenario import loads

ARM = """
<mujoco model="arm">
  <compiler angle="radian"/>
  <option>{flags}</option>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" ref="0.3" {limit}/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.05"/>
      <body name="lower" pos="0 0 -0.4">
        <joint name="elbow" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.04"/>
        <body name="rod" pos="0 0 -0.3">
          <joint name="reach" type="slide" axis="0 0 1"/>
          <geom type="box" size="0.02 0.02 0.1"/>
          <body name="hand" pos="0 0 -0.1"><joint name="wrist" type="ball"/><geom size="0.05"/></body>
        </body>
      </body>
    </body>
  </worldbody>
  <tendon><fixed name="cord"><joint joint="elbow" coef="1"/></fixed></tendon>
  <actuator>{actuators}</actuator>
</mujoco>
"""
KNOWN = {
    "motor": '<motor name="m" joint="shoulder" gear="3"/>',
    "motor between limits": '<motor name="m" joint="reach" gear="-2" ctrlrange="-0.5 1" ctrllimited="true"/>',
    "position": '<position name="m" joint="shoulder" kp="7" kv="0.4" gear="2"/>',
    "position with limits": '<position name="m" joint="elbow" kp="50" forcerange="-2 3" gear="-1.5"/>',
    "velocity": '<velocity name="m" joint="elbow" kv="0.6"/>',
    "damper": '<damper name="m" joint="elbow" kv="0.6" ctrlrange="0 1"/>',
    "general": '<general name="m" joint="shoulder" gaintype="affine" gainprm="1 2 -0.3" biastype="affine" '
    'biasprm="0.5 -3 -0.2" gear="0.7"/>',
    "two on one joint": '<motor name="m" joint="elbow"/><position name="p" joint="elbow" kp="3"/>',
}
DYNAMIC = "their activation has dynamics of its own"
UNKNOWN = {
    '<motor name="m" tendon="cord"/>': "they do not act on a joint",
    '<motor name="m" joint="wrist" gear="1 2 3"/>': "they act on a joint with more than one coordinate",
    '<intvelocity name="m" joint="elbow" kp="3" actrange="-1 1"/>': DYNAMIC,
    '<muscle name="m" joint="elbow" lengthrange="0 1"/>': DYNAMIC,
}


def arm(tmp_path, actuators, flags="", limit=""):
    text = ARM.format(actuators=actuators, flags=flags, limit=limit)
    file = tmp_path / "arm.xml"
    file.write_text(text)
    return import_file(file), mujoco.MjModel.from_xml_string(text)


def theirs(model, q, v, u):
    """MuJoCo's forces of its actuators along shoulder, elbow and reach, whose places come first."""
    data = mujoco.MjData(model)
    data.qpos[:3] = model.qpos0[:3] + q
    data.qvel[:3] = v
    data.ctrl[:] = u
    mujoco.mj_forward(model, data)
    return data.qfrc_actuator[:3].copy()


def ours(text, q, v, u):
    """The difference that our actuators make to the generalised forces, from the accelerations and M."""
    accelerations = []
    for scenario in (loads(text, "arm.toml"), loads(text.split("[[forces]]")[0], "arm.toml")):
        values = [f"forces.{name}.inputs.u={value!r}" for name, value in u.items()]
        mechanism = build(loads(text, "arm.toml", values) if scenario.forces else scenario)
        core = Multibody(mechanism.tables, mechanism.bodies)
        q0, v0 = mechanism.q0.copy(), mechanism.v0.copy()
        places = [mechanism.joints.index(name) for name in ("shoulder", "elbow", "reach")]
        q0[mechanism.tables.q_index[places]], v0[mechanism.tables.v_index[places]] = q, v
        state = core.initial_state(q0, v0)
        found = core.evaluate(state, np.zeros((core.n, 6)))
        accelerations.append(found.joint_acceleration)
    return accelerations[0] - accelerations[1]


def mass_matrix(model, q):
    data = mujoco.MjData(model)
    data.qpos[:3] = model.qpos0[:3] + q
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full) if mujoco.__version__ >= "4" else mujoco.mj_fullM(model, full, data.qM)
    return full


@pytest.mark.parametrize("limit", ["", 'actuatorfrcrange="-1 0.8" actuatorfrclimited="true"'])
@pytest.mark.parametrize("actuators", KNOWN.values(), ids=KNOWN)
def test_forces_are_those_of_mujoco(tmp_path, actuators, limit):
    got, model = arm(tmp_path, actuators, limit=limit)
    names = [force.name for force in got.scenario.forces]
    assert len(names) == model.nu
    assert not [remark for remark in got.remarks if remark.what == "actuators"]
    rng = np.random.default_rng(3)
    for _ in range(20):
        q, v, u = rng.normal(size=3), rng.normal(size=3), rng.normal(size=model.nu)
        change = ours(got.text, q, v, dict(zip(names, u.tolist(), strict=True)))
        force = mass_matrix(model, q) @ change
        np.testing.assert_allclose(force[:3], theirs(model, q, v, u), rtol=0, atol=1e-9)


def test_a_limit_of_several_is_told(tmp_path):
    limit = 'actuatorfrcrange="-1 0.8" actuatorfrclimited="true"'
    got, _ = arm(tmp_path, KNOWN["motor"] + KNOWN["position"].replace('"m"', '"p"'), limit=limit)
    assert [force.name for force in got.scenario.forces] == ["m", "p"]
    told = [remark for remark in got.remarks if remark.what == "limits of joints with several actuators"]
    assert [remark.item for remark in told] == ["shoulder"]


@pytest.mark.parametrize(("actuator", "why"), UNKNOWN.items())
def test_others_are_left_out_and_told(tmp_path, actuator, why):
    got, _ = arm(tmp_path, actuator)
    assert got.scenario.forces == ()
    assert [(remark.why, remark.item) for remark in got.remarks if remark.what == "actuators"] == [(why, "m")]


def test_actuation_that_is_off_stays_off(tmp_path):
    got, _ = arm(tmp_path, KNOWN["motor"], flags='<flag actuation="disable"/>')
    assert got.scenario.forces == ()
    assert "the file turns actuation off" in got.text
