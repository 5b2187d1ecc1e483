"""The numbers of a mechanism, laid out as the core reads them."""

from __future__ import annotations

import math

import numpy as np

from linkwind.errors import MechanismError
from linkwind.mechanism.events import Happening, event_tables, released
from linkwind.mechanism.loops import closure_tables
from linkwind.mechanism.quaternion import matrix
from linkwind.mechanism.start import JointStart, Start
from linkwind.mechanism.tree import Carrier, Loop, order
from linkwind.native.multibody import JOINT_TYPES, NQ, NV, Tables
from linkwind.scenario import Body, Scenario
from linkwind.spatial import Array


def tables(
    scenario: Scenario, carriers: list[Carrier], joints: list[JointStart], loops: list[Loop],
    starts: list[Start], happening: list[Happening],
) -> Tables:  # fmt: skip
    """Return the tables of a mechanism, bodies in scenario order.

    Args:
        scenario: what is to be laid out.
        carriers: joint of each body.
        joints: the same joints at the start.
        loops: joints that close loops.
        starts: bodies at the start.
        happening: what may happen to joints.

    Raises:
        MechanismError: springs or dampers do not fit the joint's degrees of freedom, or a joint cannot close
            a loop.
    """
    types = [carrier.type for carrier in carriers]
    roomy = room(types, happening)
    parents = [carrier.parent for carrier in carriers]
    return Tables(
        parent=np.array(parents, dtype=np.int32),
        order=np.array(order(parents), dtype=np.int32),
        joint_type=np.array([JOINT_TYPES[kind] for kind in types], dtype=np.int32),
        q_index=_starts([NQ[kind] for kind in roomy]),
        v_index=_starts([NV[kind] for kind in roomy]),
        parent_point=np.array([carrier.parent_point for carrier in carriers]),
        parent_rotation=np.array([matrix(joint.parent_rotation) for joint in joints]),
        child_point=np.array([carrier.child_point for carrier in carriers]),
        child_rotation=np.array([matrix(joint.child_rotation) for joint in joints]),
        mass=np.array([body.mass for body in scenario.bodies]),
        inertia=np.array([_inertia(body) for body in scenario.bodies]),
        gravity=np.array(scenario.environment.gravity),
        stiffness=padded([_per_freedom(carrier, "stiffness") for carrier in carriers], roomy, NV),
        damping=padded([_per_freedom(carrier, "damping") for carrier in carriers], roomy, NV),
        rest=padded([_rest(carrier) for carrier in carriers], roomy, NQ),
        **closure_tables(loops, starts, planar=scenario.planar),
        **event_tables(happening),
    )


def room(types: list[str], happening: list[Happening]) -> list[str]:
    """Return the type whose coordinates each joint has room for: free, where it may be released."""
    loose = released(happening, len(types))
    return ["free" if i in loose else kind for i, kind in enumerate(types)]


def padded(values: list[Array], roomy: list[str], sizes: dict[str, int]) -> Array:
    """Return the values of all joints in one row, with zeros where a joint has room for more."""
    return np.concatenate(
        [np.pad(own, (0, sizes[kind] - len(own))) for own, kind in zip(values, roomy, strict=True)]
    )


def _starts(lengths: list[int]) -> np.ndarray[tuple[int], np.dtype[np.int32]]:
    """Return where each of the consecutive pieces starts."""
    return np.cumsum([0, *lengths[:-1]], dtype=np.int32)


def _inertia(body: Body) -> tuple[float, ...]:
    """Return Ixx, Iyy, Izz, Ixy, Ixz, Iyz [kg·m²].

    A planar body gets the inertia of a flat disc in the plane, Ixx = Iyy = Izz/2: physical, and without
    influence on motion in the plane.
    """
    if isinstance(body.inertia, float):
        half = body.inertia / 2.0
        return half, half, body.inertia, 0.0, 0.0, 0.0
    return body.inertia


def _per_freedom(carrier: Carrier, key: str) -> Array:
    """Return stiffness or damping for each degree of freedom."""
    count = NV[carrier.type]
    value = getattr(carrier.joint, key) if carrier.joint else 0.0
    numbers = value if isinstance(value, tuple) else (value,) * count
    if len(numbers) != count or (value and not count):
        _refuse(carrier, key, f"one number, or a list of {count}," if count else "nothing", value)
    return np.array(numbers, dtype=np.float64)


def _rest(carrier: Carrier) -> Array:
    """Return the joint coordinates at which the springs are relaxed; rotations as unit quaternions."""
    count = NQ[carrier.type]
    value = carrier.joint.rest if carrier.joint else None
    rest = np.zeros(count)
    turns_freely = carrier.type in ("spherical", "free")
    if turns_freely:
        rest[-4] = 1.0
    if value is None:
        return rest
    numbers = value if isinstance(value, tuple) else (value,)
    if len(numbers) != count:
        _refuse(carrier, "rest", f"{count} {'number' if count == 1 else 'numbers'}", value)
    rest[:] = numbers
    if turns_freely:
        norm = math.hypot(*rest[-4:])
        if abs(norm - 1.0) > 1e-6:
            _refuse(carrier, "rest", "a unit quaternion [w, x, y, z] at the end", value)
        rest[-4:] /= norm
    return rest


def _refuse(carrier: Carrier, key: str, expected: str, value: float | tuple[float, ...]) -> None:
    got = list(value) if isinstance(value, tuple) else value
    raise MechanismError(
        f"{carrier.item}.{key}: expected {expected} for a {carrier.type} joint; got {got}. Correct it."
    )
