"""The tables of a mechanism, and what the core has to say against them."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field, fields
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from linkwind.errors import MechanismError
from linkwind.spatial import Array

Index = NDArray[np.int32]

JOINT_TYPES: dict[str, int] = {
    "fixed": 0,
    "revolute": 1,
    "prismatic": 2,
    "planar": 3,
    "spherical": 4,
    "free": 5,
}
NQ: dict[str, int] = dict(zip(JOINT_TYPES, (0, 1, 1, 3, 4, 7), strict=True))
NV: dict[str, int] = dict(zip(JOINT_TYPES, (0, 1, 1, 3, 3, 6), strict=True))
ACTIONS: dict[str, int] = {"release": 0, "lock": 1, "stop": 2}
OCCASIONS: dict[str, int] = {
    "command": 0,
    "time": 1,
    "force": 2,
    "torque": 3,
    "position": 4,
    "speed": 5,
    "distance": 6,
}
KEEP_TRANSLATION, KEEP_ROTATION, DISTANCE = (1, 2, 4), (8, 16, 32), 64  # bits of closure_rows
FORCE_TYPES: dict[str, int] = {"spring": 0, "actuator": 1, "motion": 2, "point_force": 3, "buoyancy": 4}
QUATERNION_AT = {JOINT_TYPES["spherical"]: 0, JOINT_TYPES["free"]: 3}


@dataclass(frozen=True)
class Tables:
    """A mechanism of n bodies in scenario order; joint i carries body i.

    Attributes:
        parent: index of the parent body, -1 for the world, int32, shape (n,).
        order: the bodies with every parent before its children, int32, shape (n,).
        joint_type: codes of ``JOINT_TYPES``, int32, shape (n,).
        q_index, v_index: first coordinate of each joint in q and v, int32, shape (n,).
        parent_point: joint frame origin from the parent's centre of mass, in its body frame [m], shape
            (n, 3); of a root in W.
        parent_rotation: joint frame to parent body frame, shape (n, 3, 3).
        child_point: joint frame origin from the child's centre of mass, in its body frame [m], shape (n, 3).
        child_rotation: joint frame to child body frame, shape (n, 3, 3).
        mass: [kg], shape (n,).
        inertia: Ixx, Iyy, Izz, Ixy, Ixz, Iyz as matrix elements, body frame, about the centre of mass
            [kg·m²], shape (n, 6).
        gravity: [m/s²], shape (3,), in W.
        stiffness, damping: of each degree of freedom [N/m or N·m/rad; times s], shape (nv,).
        rest: coordinates without spring force, shape (nq,); quaternions where q has them.
        closure_body: the two bodies of each of c joints that close loops, -1 for the world, int32, shape
            (c, 2).
        closure_rows: what they keep: sums of ``KEEP_TRANSLATION`` along and ``KEEP_ROTATION`` about the axes
            of the frame on the first body; or ``DISTANCE``; int32, shape (c,).
        closure_point: joint frame origins on both bodies, as parent_point, shape (c, 2, 3).
        closure_rotation: joint frames to body frames, shape (c, 2, 3, 3).
        closure_length: distance that a ``DISTANCE`` keeps [m], shape (c,).
        event_joint: what each of e events happens to: the joint of a body, or n + a closure, int32, shape
            (e,).
        event_action, event_occasion: codes of ``ACTIONS`` and ``OCCASIONS``, int32, shape (e,).
        event_side: 1 for at or above the threshold, -1 for at or below it, int32, shape (e,).
        event_threshold: [s, N, N·m, rad, m or per second], shape (e,).
        event_restitution: of a stop, 0 to 1, shape (e,).
        force_type: codes of ``FORCE_TYPES`` of f force elements, int32, shape (f,).
        force_body: the two bodies of a spring, -1 for the world; of others the body (of an actuator or a
            motion the one that the joint carries, and the number of the coordinate), int32, shape (f, 2).
        force_point: its points on both bodies, body frame, from the centre of mass [m], shape (f, 2, 3).
        force_number: stiffness [N/m], damping [N·s/m], length without tension [m] of a spring; whether a
            point force is in the body frame; volume [m³], density [kg/m³], shape (f, 3).
        force_start, force_code, force_constants: programs as in ``FieldTable``, maybe empty, shapes (f + 1,),
            (instructions, 2), (any,); their variables and results are those of ``lw_force_type``.
        force_input: which of the constants are inputs, with the value at the start, int32, shape (inputs,).
    """

    parent: Index
    order: Index
    joint_type: Index
    q_index: Index
    v_index: Index
    parent_point: Array
    parent_rotation: Array
    child_point: Array
    child_rotation: Array
    mass: Array
    inertia: Array
    gravity: Array
    stiffness: Array
    damping: Array
    rest: Array
    closure_body: Index = field(default_factory=lambda: np.zeros((0, 2), np.int32))
    closure_rows: Index = field(default_factory=lambda: np.zeros(0, np.int32))
    closure_point: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))
    closure_rotation: Array = field(default_factory=lambda: np.zeros((0, 2, 3, 3)))
    closure_length: Array = field(default_factory=lambda: np.zeros(0))
    event_joint: Index = field(default_factory=lambda: np.zeros(0, np.int32))
    event_action: Index = field(default_factory=lambda: np.zeros(0, np.int32))
    event_occasion: Index = field(default_factory=lambda: np.zeros(0, np.int32))
    event_side: Index = field(default_factory=lambda: np.zeros(0, np.int32))
    event_threshold: Array = field(default_factory=lambda: np.zeros(0))
    event_restitution: Array = field(default_factory=lambda: np.zeros(0))
    force_type: Index = field(default_factory=lambda: np.zeros(0, np.int32))
    force_body: Index = field(default_factory=lambda: np.zeros((0, 2), np.int32))
    force_point: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))
    force_number: Array = field(default_factory=lambda: np.zeros((0, 3)))
    force_start: Index = field(default_factory=lambda: np.zeros(1, np.int32))
    force_code: Index = field(default_factory=lambda: np.zeros((0, 2), np.int32))
    force_constants: Array = field(default_factory=lambda: np.zeros(0))
    force_input: Index = field(default_factory=lambda: np.zeros(0, np.int32))


COUNTS = ("n", "nq", "nv", "closures", "events", "forces", "instructions", "constants", "inputs")


class CTables(ctypes.Structure):
    """``lw_tables`` of the library."""

    _fields_ = [(name, ctypes.c_int32) for name in COUNTS] + [
        (table.name, ctypes.c_void_p) for table in fields(Tables)
    ]


_CHECKS = {
    40: ("parent", "at least one body"),
    41: ("parent", "the index of another body, or -1 for the world"),
    42: ("order", "every body once, its parent before it"),
    43: ("joint_type", "one of " + ", ".join(f"{code} ({name})" for name, code in JOINT_TYPES.items())),
    44: ("q_index", "room in q for the joint's coordinates, shared with no other joint"),
    45: ("v_index", "room in v for the joint's coordinates, shared with no other joint"),
    46: ("parent_point", "finite numbers"),
    47: ("parent_rotation", "a rotation matrix"),
    48: ("child_point", "finite numbers"),
    49: ("child_rotation", "a rotation matrix"),
    50: ("mass", "zero or more"),
    51: ("inertia", "finite numbers and a diagonal of zero or more"),
    52: ("gravity", "finite numbers"),
    53: ("stiffness", "finite numbers"),
    54: ("damping", "finite numbers"),
    55: ("rest", "finite coordinates, quaternions not zero"),
    56: ("closure_body", "two different bodies, -1 for the world"),
    57: ("closure_rows", "bits of directions to keep, or a distance"),
    58: ("closure_point", "finite numbers"),
    59: ("closure_rotation", "rotation matrices"),
    60: ("closure_length", "a distance above zero"),
    61: ("event_joint", "a joint or closure"),
    62: ("event_action", "something that can happen to this joint"),
    63: ("event_occasion", "something that this joint has"),
    64: ("event_side", "1 or -1"),
    65: ("event_threshold", "a finite number"),
    66: ("event_restitution", "a number from 0 to 1"),
    70: ("force_type", "one of " + ", ".join(f"{code} ({name})" for name, code in FORCE_TYPES.items())),
    71: ("force_body", "a body that is there, of a spring two different ones; or a coordinate of its joint"),
    72: ("force_point", "finite numbers"),
    73: ("force_number", "finite numbers"),
    74: ("force_start", "an instruction, not before the one before it"),
    75: ("force_input", "one of the constants"),
}


_INTEGERS = (
    "parent", "order", "joint_type", "q_index", "v_index", "closure_body", "closure_rows", "event_joint",
    "event_action", "event_occasion", "event_side", "force_type", "force_body",
    "force_start", "force_code", "force_input",
)  # fmt: skip


def counts(tables: Tables) -> dict[str, int]:
    """Return how many there are of what: the ``COUNTS``."""
    sized: tuple[Array | Index, ...] = (
        tables.parent, tables.rest, tables.stiffness, tables.closure_rows, tables.event_joint,
        tables.force_type, np.atleast_2d(tables.force_code)[:, 0], tables.force_constants,
        tables.force_input,
    )  # fmt: skip
    return {name: int(np.size(table)) for name, table in zip(COUNTS, sized, strict=True)}


def _shapes(
    n: int, nq: int, nv: int, closures: int, events: int, forces: int, instructions: int, constants: int,
    inputs: int,
) -> dict[str, tuple[int, ...]]:  # fmt: skip
    integers = dict.fromkeys(("parent", "order", "joint_type", "q_index", "v_index"), (n,))
    points = dict.fromkeys(("parent_point", "child_point"), (n, 3))
    rotations = dict.fromkeys(("parent_rotation", "child_rotation"), (n, 3, 3))
    degrees = dict.fromkeys(("stiffness", "damping"), (nv,))
    happening = ("joint", "action", "occasion", "side", "threshold", "restitution")
    closed = {"body": (2,), "rows": (), "point": (2, 3), "rotation": (2, 3, 3), "length": ()}
    pushing = {"type": (), "body": (2,), "point": (2, 3), "number": (3,)}
    programs = {"start": (forces + 1,), "code": (instructions, 2), "constants": (constants,)}
    programs["input"] = (inputs,)
    return (
        {"mass": (n,), "inertia": (n, 6), "gravity": (3,), "rest": (nq,)}
        | integers | points | rotations | degrees
        | {f"closure_{name}": (closures, *shape) for name, shape in closed.items()}
        | {f"event_{name}": (events,) for name in happening}
        | {f"force_{name}": shape for name, shape in programs.items()}
        | {f"force_{name}": (forces, *shape) for name, shape in pushing.items()}
    )  # fmt: skip


def contiguous(tables: Tables) -> dict[str, NDArray[Any]]:
    """Return the tables as contiguous arrays of the right type, or raise MechanismError for a shape."""
    many, arrays = counts(tables), {}
    for name, shape in _shapes(**many).items():
        wanted = np.int32 if name in _INTEGERS else np.float64
        arrays[name] = np.ascontiguousarray(getattr(tables, name), dtype=wanted)
        if np.shape(getattr(tables, name)) != shape:
            raise MechanismError(
                f"tables.{name}: expected shape {shape} for {many['n']} bodies, {many['nq']} coordinates and "
                f"{many['nv']} degrees of freedom; got {np.shape(getattr(tables, name))}. "
                "Make all tables of one mechanism."
            )
    return arrays


def refuse(tables: Tables, status: int, item: int) -> NoReturn:
    """Raise MechanismError for the row ``item`` of the table that the core named by ``status``."""
    field, expected = _CHECKS[status]
    rows = np.atleast_1d(getattr(tables, field))
    whole = field in ("gravity", "order") or item >= len(rows)
    place, got = (field, rows) if whole else (f"{field}[{item}]", rows[item])
    raise MechanismError(
        f"tables.{place}: expected {expected}; got {np.array(got).tolist()}. Correct the mechanism."
    )
