"""Actuators of MJCF as laws: the force along a joint's coordinate, of its input u, position q and rate v.

Of an actuator on a joint, MuJoCo computes gear · (gain · u + bias) with length = gear · coordinate, where
gain and bias may be affine in length and velocity: motors, position and velocity servos, dampers
(https://mujoco.readthedocs.io/en/stable/computation/index.html#actuation-model).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from linkwind.mechanism.importers.model import Model, Motor

ON_JOINT = ("mjTRN_JOINT", "mjTRN_JOINTINPARENT")
SLIDE, HINGE = 2, 3  # mjtJoint
LATER = {  # what only later versions of MuJoCo know
    "actuator_delay": "they act with a delay",
    "actuator_damping": "they damp on the side of the rotor",
    "actuator_dampingpoly": "they damp on the side of the rotor",
}


def add_motors(model: Model, mujoco: Any, m: Any) -> None:
    """Add the actuators of a compiled model to ``model``, and note which ones cannot be."""
    off = bool(m.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    for index in range(len(m.actuator_trntype)):
        name = mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_ACTUATOR, index) or f"actuator{index}"
        why = "the file turns actuation off" if off else _trouble(mujoco, m, index)
        if why:
            model.leave_out("actuators", why, [name])
            continue
        joint = int(m.actuator_trnid[index, 0])
        joint_name = mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_JOINT, joint) or f"joint{joint}"
        clamps = not m.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL
        unit = "N·m" if m.jnt_type[joint] == HINGE else "N"
        model.motors.append(Motor(name, joint_name, _law(m, index, joint, clamps=clamps), unit))
        if m.jnt_actfrclimited[joint] and [motor.joint for motor in model.motors].count(joint_name) == 2:
            model.leave_out("limits of joints with several actuators", "each is limited alone", [joint_name])


def _trouble(mujoco: Any, m: Any, index: int) -> str:
    """Return why an actuator is none of a joint that follows its input at once; empty if it is."""
    if mujoco.mjtTrn(int(m.actuator_trntype[index])).name not in ON_JOINT:
        return "they do not act on a joint"
    if m.jnt_type[m.actuator_trnid[index, 0]] not in (SLIDE, HINGE):
        return "they act on a joint with more than one coordinate"
    if mujoco.mjtDyn(int(m.actuator_dyntype[index])).name != "mjDYN_NONE":
        return "their activation has dynamics of its own"
    gain = mujoco.mjtGain(int(m.actuator_gaintype[index])).name
    bias = mujoco.mjtBias(int(m.actuator_biastype[index])).name
    if gain not in ("mjGAIN_FIXED", "mjGAIN_AFFINE") or bias not in ("mjBIAS_NONE", "mjBIAS_AFFINE"):
        return "their law is not affine"
    for what, why in LATER.items():
        if np.any(getattr(m, what, np.zeros(index + 1))[index]):
            return why
    return ""


def _law(m: Any, index: int, joint: int, *, clamps: bool) -> str:
    """Return force or torque along the coordinate of the joint, whose zero is qpos0."""
    gear, zero = float(m.actuator_gear[index, 0]), float(m.qpos0[m.jnt_qposadr[joint]])
    gain, bias = np.array(m.actuator_gainprm[index, :3]), np.array(m.actuator_biasprm[index, :3])
    gain[1:] *= bool(m.actuator_gaintype[index])  # else it is fixed
    bias *= bool(m.actuator_biastype[index])  # else there is none
    signal = "u"
    if clamps and m.actuator_ctrllimited[index]:
        signal = _between(signal, *m.actuator_ctrlrange[index])
    per_input, alone = (_affine(part, gear, zero) for part in (gain, bias))
    law = _sum([*_times(per_input, signal), *alone])
    if m.actuator_forcelimited[index]:
        law = _between(law, *sorted(gear * m.actuator_forcerange[index]))
    if m.jnt_actfrclimited[joint]:
        law = _between(law, *m.jnt_actfrcrange[joint])
    return law


def _affine(coefficients: Any, gear: float, zero: float) -> list[str]:
    """Return gear (c0 + c1 length + c2 velocity) as terms in q and v."""
    constant, by_length, by_velocity = coefficients.tolist()
    numbers = {
        "": gear * (constant + by_length * gear * zero),
        "q": gear * gear * by_length,
        "v": gear * gear * by_velocity,
    }
    return [_product(number, name) for name, number in numbers.items() if number]


def _times(terms: list[str], signal: str) -> Iterator[str]:
    if len(terms) == 1:
        yield signal if terms[0] == "1.0" else f"{terms[0]}*{signal}"
    elif terms:
        yield f"({_sum(terms)})*{signal}"


def _product(number: float, name: str) -> str:
    text = _number(number)
    return f"{text}*{name}" if name else text


def _sum(terms: list[str]) -> str:
    return " + ".join(terms).replace("+ -", "- ") or "0.0"


def _between(law: str, low: float, high: float) -> str:
    return f"min(max({law}, {_number(low)}), {_number(high)})"


def _number(value: float) -> str:
    return repr(float(f"{float(value):.15g}"))
