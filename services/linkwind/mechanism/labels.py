"""What the numbers of a logged State are called that belong to no body."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from linkwind.mechanism import Mechanism
from linkwind.native.tables import FORCE_TYPES, JOINT_TYPES

# Units of coordinates and of velocities by the type of joint; a quaternion has none.
_Q = {
    "fixed": (), "revolute": ("rad",), "prismatic": ("m",), "planar": ("m", "m", "rad"),
    "spherical": ("",) * 4, "free": ("m",) * 3 + ("",) * 4,
}  # fmt: skip
_V = {
    "fixed": (), "revolute": ("rad/s",), "prismatic": ("m/s",), "planar": ("m/s", "m/s", "rad/s"),
    "spherical": ("rad/s",) * 3, "free": ("m/s",) * 3 + ("rad/s",) * 3,
}  # fmt: skip
_TYPES = {code: name for name, code in JOINT_TYPES.items()}
_ALONG_A_JOINT = (FORCE_TYPES["actuator"], FORCE_TYPES["motion"])


def labels(mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """Return the names of numbers of State by field: ``hinge.q``, ``wrist.v.2``, ``flap.force_effort``."""
    tables, joints = mechanism.tables, mechanism.joints
    per_force = {
        field: tuple(f"{name}.{field}" for name in mechanism.forces)
        for field in ("force_effort", "force_power")
    }
    return {
        "q": tuple(_coordinates("q", joints, tables.q_index, len(mechanism.q0))),
        "v": tuple(_coordinates("v", joints, tables.v_index, len(mechanism.v0))),
        "event_time": tuple(f"{name}.event_time" for name in mechanism.events),
        **per_force,
    }


def units(mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """Return the units of the numbers that :func:`labels` names, empty for none.

    The coordinates of a joint that may be released have none: they are others before and after that.
    """
    tables = mechanism.tables
    types = [_TYPES[code] for code in tables.joint_type.tolist()]
    return {
        "q": tuple(_units([_Q[each] for each in types], tables.q_index, len(mechanism.q0))),
        "v": tuple(_units([_V[each] for each in types], tables.v_index, len(mechanism.v0))),
        "event_time": ("s",) * len(mechanism.events),
        "force_effort": tuple(_efforts(mechanism, types)),
        "force_power": ("W",) * len(mechanism.forces),
    }


def _efforts(mechanism: Mechanism, types: Sequence[str]) -> Iterator[str]:
    """Yield the unit of each force element's effort: a force, but of what turns a joint."""
    tables = mechanism.tables
    for code, (body, coordinate) in zip(tables.force_type.tolist(), tables.force_body.tolist(), strict=True):
        turns = code in _ALONG_A_JOINT and _Q[types[body]][coordinate] == "rad"
        yield "N m" if turns else "N"


def _coordinates(field: str, joints: Sequence[str], starts: NDArray[np.int32], size: int) -> Iterator[str]:
    """Yield a name for each coordinate, joint after joint as they lie in the state."""
    for joint, width in _widths(starts, size):
        for place in range(width):
            yield f"{joints[joint]}.{field}" if width == 1 else f"{joints[joint]}.{field}.{place}"


def _units(known: Sequence[Sequence[str]], starts: NDArray[np.int32], size: int) -> Iterator[str]:
    """Yield the unit of each coordinate in the same order; ``known`` are those of each joint's own."""
    for joint, width in _widths(starts, size):
        yield from known[joint] if len(known[joint]) == width else ("",) * width


def _widths(starts: NDArray[np.int32], size: int) -> Iterator[tuple[int, int]]:
    """Yield each joint and how many coordinates it has, as they lie in the state."""
    order = np.argsort(starts, kind="stable")
    ends = [*starts[order][1:].tolist(), size]
    for joint, end in zip(order.tolist(), ends, strict=True):
        yield joint, end - int(starts[joint])
