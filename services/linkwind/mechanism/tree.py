"""The tree of bodies: which joint carries each, its parent, an order from the roots; and what is left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from linkwind.errors import MechanismError
from linkwind.scenario import Joint, Scenario
from linkwind.scenario.topology import carries
from linkwind.spatial import Array

WORLD = -1


@dataclass(frozen=True)
class Carrier:
    """The joint that carries a body.

    Attributes:
        name: of the joint; of an automatic root ``world-`` and the body's name.
        type: of the joint.
        parent: index of the body, or -1 for the world.
        joint: the scenario's, or None for an automatic root.
        item: where it stands in the scenario, for errors.
    """

    name: str
    type: str
    parent: int
    joint: Joint | None
    item: str

    @property
    def parent_point(self) -> Array:
        """The joint's point from the parent's centre of mass, in its body frame [m], shape (3,)."""
        return np.array(self.joint.parent_point if self.joint else (0.0, 0.0, 0.0))

    @property
    def child_point(self) -> Array:
        """The joint's point from the child's centre of mass, in its body frame [m], shape (3,)."""
        return np.array(self.joint.child_point if self.joint else (0.0, 0.0, 0.0))

    @property
    def axis(self) -> Array:
        """The joint frame's z axis in the parent's body frame, any length, shape (3,)."""
        return np.array(self.joint.axis if self.joint else (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Loop:
    """A joint that closes a loop.

    Attributes:
        joint: the scenario's.
        parent: index of its parent, or -1 for the world.
        child: index of its child.
        item: where it stands in the scenario, for errors.
    """

    joint: Joint
    parent: int
    child: int
    item: str


def carriers(scenario: Scenario) -> tuple[list[Carrier], list[Loop]]:
    """Return the joint that carries each body, in scenario order, and the joints that close loops.

    Bodies without a joint get one to the world.

    Raises:
        MechanismError: a joint would leave the plane of a planar mechanism.
    """
    index = {body.name: i for i, body in enumerate(scenario.bodies)} | {"world": WORLD}
    root = "planar" if scenario.planar else "free"
    found = [
        Carrier(f"world-{body.name}", root, WORLD, None, scenario.where("bodies", i))
        for i, body in enumerate(scenario.bodies)
    ]
    loops = []
    carrying = carries((joint.type, joint.parent, joint.child) for joint in scenario.joints)
    for i, joint in enumerate(scenario.joints):
        item = scenario.where("joints", i)
        if scenario.planar:
            _check_planar(joint, item)
        parent, child = index[joint.parent], index[joint.child]
        if carrying[i]:
            found[child] = Carrier(joint.name, joint.type, parent, joint, item)
        else:
            loops.append(Loop(joint, parent, child, item))
    return found, loops


def order(parents: list[int]) -> list[int]:
    """Return the bodies with parents before children, otherwise in scenario order."""
    placed: list[int] = []
    done = {WORLD}
    while len(placed) < len(parents):
        # One generation a pass; the scenario has made sure that there are no loops.
        generation = [i for i, parent in enumerate(parents) if i not in done and parent in done]
        placed += generation
        done.update(generation)
    return placed


def _check_planar(joint: Joint, item: str) -> None:
    """A single number as inertia says nothing about turning out of the plane."""
    if joint.type in ("spherical", "free"):
        raise MechanismError(
            f"{item}.type: expected fixed, revolute, prismatic, planar or distance, because every inertia is "
            f'a single number; got "{joint.type}". Give 6 numbers for the inertia of each body.'
        )
    x, y, z = joint.axis
    if joint.type in ("revolute", "planar") and (x or y):
        expected, advice = "an axis along z", "Leave it out"
    elif joint.type == "prismatic" and z:
        expected, advice = "an axis in the x, y plane", "Use for example [1, 0, 0]"
    else:
        return
    raise MechanismError(
        f"{item}.axis: expected {expected}, because every inertia is a single number; got "
        f"[{x:g}, {y:g}, {z:g}]. {advice}, or give 6 numbers for the inertia of each body."
    )
