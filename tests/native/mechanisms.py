"""Mechanisms for the tests of the core, and their kinematics written a second time, with matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from linkwind.native.multibody import JOINT_TYPES, NQ, NV, Multibody, Tables
from linkwind.spatial import Motion

IDENTITY = np.eye(3)
AXES = {  # translations and rotations of each joint type, as columns of the joint frame
    "fixed": ([], []),
    "revolute": ([], [2]),
    "prismatic": ([2], []),
    "planar": ([0, 1], [2]),
    "spherical": ([], [0, 1, 2]),
    "free": ([0, 1, 2], [0, 1, 2]),
}


@dataclass
class Body:
    parent: int = -1
    joint: str = "free"
    mass: float = 1.0
    inertia: np.ndarray = field(default_factory=lambda: 0.1 * IDENTITY)
    parent_point: tuple[float, ...] = (0.0, 0.0, 0.0)
    child_point: tuple[float, ...] = (0.0, 0.0, 0.0)
    parent_rotation: np.ndarray = field(default_factory=lambda: IDENTITY)
    child_rotation: np.ndarray = field(default_factory=lambda: IDENTITY)
    stiffness: np.ndarray | float = 0.0
    damping: np.ndarray | float = 0.0
    rest: np.ndarray | None = None


KEPT = {  # bits: translations 1, 2, 4, turns 8, 16, 32, distance 64
    "spherical": 7, "revolute": 31, "prismatic": 59, "planar": 28, "fixed": 63, "distance": 64
}  # fmt: skip


@dataclass
class Closure:
    """A joint between two bodies of the tree; ``kept`` are the bits of the core's table."""

    first: int
    second: int
    kept: int
    first_point: tuple[float, ...] = (0.0, 0.0, 0.0)
    second_point: tuple[float, ...] = (0.0, 0.0, 0.0)
    first_rotation: np.ndarray = field(default_factory=lambda: IDENTITY)
    second_rotation: np.ndarray = field(default_factory=lambda: IDENTITY)
    length: float = 1.0


def closed(closures: list[Closure]) -> dict[str, np.ndarray]:
    """Return the tables of closures, for ``Tables``."""
    return {
        "closure_body": np.array([(c.first, c.second) for c in closures], np.int32).reshape(-1, 2),
        "closure_rows": np.array([c.kept for c in closures], np.int32),
        "closure_point": np.reshape([(c.first_point, c.second_point) for c in closures], (-1, 2, 3)),
        "closure_rotation": np.reshape(
            [(c.first_rotation, c.second_rotation) for c in closures], (-1, 2, 3, 3)
        ),
        "closure_length": np.array([c.length for c in closures], float),
    }


def rest_of(body: Body) -> np.ndarray:
    if body.rest is not None:
        return np.asarray(body.rest, float)
    rest = np.zeros(NQ[body.joint])
    if body.joint in ("spherical", "free"):
        rest[-4] = 1.0
    return rest


def topological(bodies: list[Body]) -> list[int]:
    order: list[int] = []
    while len(order) < len(bodies):
        order += [i for i, b in enumerate(bodies) if i not in order and b.parent in (-1, *order)]
    return order


def tables(bodies: list[Body], gravity=(0.0, -9.81, 0.0), closures: Sequence[Closure] = ()) -> Tables:
    nq, nv = [NQ[b.joint] for b in bodies], [NV[b.joint] for b in bodies]

    def degrees(name):
        values = [np.broadcast_to(getattr(b, name), NV[b.joint]) for b in bodies]
        return np.concatenate([np.zeros(0), *values])

    return Tables(
        parent=np.array([b.parent for b in bodies], np.int32),
        order=np.array(topological(bodies), np.int32),
        joint_type=np.array([JOINT_TYPES[b.joint] for b in bodies], np.int32),
        q_index=np.cumsum([0, *nq[:-1]]).astype(np.int32),
        v_index=np.cumsum([0, *nv[:-1]]).astype(np.int32),
        parent_point=np.array([b.parent_point for b in bodies], float),
        parent_rotation=np.array([b.parent_rotation for b in bodies], float),
        child_point=np.array([b.child_point for b in bodies], float),
        child_rotation=np.array([b.child_rotation for b in bodies], float),
        mass=np.array([b.mass for b in bodies], float),
        inertia=np.array([b.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]] for b in bodies], float),
        gravity=np.array(gravity, float),
        stiffness=degrees("stiffness"),
        damping=degrees("damping"),
        rest=np.concatenate([rest_of(b) for b in bodies]),
        **closed(list(closures)),
    )


def random_inertia(rng) -> np.ndarray:
    """Inertia of a random cloud of mass: physical by construction."""
    points = rng.normal(size=(6, 3)) * rng.uniform(0.05, 0.4, 3)
    return sum(p @ p * IDENTITY - np.outer(p, p) for p in points)


def random_rotation(rng) -> np.ndarray:
    return Rotation.from_quat(rng.normal(size=4)).as_matrix()


def random_rest(rng, joint: str) -> np.ndarray:
    rest = rng.normal(size=NQ[joint])
    if joint in ("spherical", "free"):
        rest[-4:] /= np.linalg.norm(rest[-4:])
    return rest


def random_body(rng, joint: str, parent: int, springs: bool = False) -> Body:
    return Body(
        parent,
        joint,
        rng.uniform(0.5, 3.0),
        random_inertia(rng),
        rng.normal(size=3) * 0.3,
        rng.normal(size=3) * 0.3,
        random_rotation(rng),
        random_rotation(rng),
        rng.uniform(0.0, 5.0, NV[joint]) if springs else 0.0,
        rng.uniform(0.0, 2.0, NV[joint]) if springs else 0.0,
        random_rest(rng, joint),
    )


def random_tree(rng, n: int, springs: bool = False) -> list[Body]:
    """A tree with every joint type, several roots, and bodies listed in any order."""
    name = rng.permutation(n)
    types = [*JOINT_TYPES][: min(n, 6)] + list(rng.choice([*JOINT_TYPES], max(0, n - 6)))
    types = rng.permutation(types)
    bodies: list[Body | None] = [None] * n
    for k in range(n):
        parent = -1 if k == 0 or rng.random() < 0.15 else int(name[rng.integers(k)])
        bodies[name[k]] = random_body(rng, str(types[k]), parent, springs)
    return bodies


def random_state(rng, multibody: Multibody, speed: float = 1.0) -> np.ndarray:
    return multibody.initial_state(rng.normal(size=multibody.nq), speed * rng.normal(size=multibody.nv))


def random_added(rng, n: int, size: float = 1.0) -> np.ndarray:
    roots = rng.normal(size=(n, 6, 6)) * np.sqrt(size)
    return np.ascontiguousarray(roots @ roots.transpose(0, 2, 1))


def motion_of(multibody: Multibody, state: np.ndarray) -> Motion:
    motion = Motion.at_rest(multibody.n)
    multibody.motion(state, motion)
    return motion


def matrix(quaternion) -> np.ndarray:
    return Rotation.from_quat(quaternion, scalar_first=True).as_matrix()


def two_link() -> list[Body]:
    """The mechanism of the paper: two equal links, hinged at their ends, free in the plane."""
    inertia = np.diag([0.7, 0.7, 1.4])
    return [
        Body(-1, "planar", 2.0, inertia),
        Body(0, "revolute", 2.0, inertia, (-0.25, 0.0, 0.0), (-0.25, 0.0, 0.0)),
    ]


def space_mechanism(rng, springs: bool = True) -> list[Body]:
    """A 3-D mechanism with a spherical, a free, a revolute, a planar and a prismatic joint."""
    joints = [("spherical", -1), ("free", 0), ("revolute", 1), ("planar", 0), ("prismatic", 3)]
    return [random_body(rng, joint, parent, springs) for joint, parent in joints]
