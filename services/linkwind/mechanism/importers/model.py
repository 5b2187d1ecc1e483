"""What importers read: a tree of rigid parts, laid out in the world with every joint at its zero.

Because everything is in the world at the joints' zero, parts that are rigidly connected add up, and the
body frames of the scenario, parallel to the world there, need no rotation.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from linkwind.mechanism.remarks import Remark
from linkwind.spatial import Array

WORLD = -1


@dataclass(frozen=True)
class Pose:
    """Where a frame is: its origin [m], shape (3,), and its rotation to the outer frame, shape (3, 3)."""

    position: Array
    rotation: Array

    def then(self, inner: Pose) -> Pose:
        """Return the pose of a frame that is given in this one."""
        return Pose(self.position + self.rotation @ inner.position, self.rotation @ inner.rotation)


ORIGIN = Pose(np.zeros(3), np.eye(3))


@dataclass
class Joint:
    """How a part hangs on its parent, in the world at the joints' zero.

    Attributes:
        name: as in the file.
        type: one of a scenario's joint types.
        point: shape (3,) [m].
        axis: shape (3,).
        stiffness, damping: one number, or one for each degree of freedom.
        rest: joint coordinates where the spring is relaxed, or None for the zero.
        stop: lowest and highest coordinate, or None where there is no end.
    """

    name: str
    type: str
    point: Array
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    stiffness: float | list[float] = 0.0
    damping: float | list[float] = 0.0
    rest: list[float] | None = None
    stop: tuple[float, float] | None = None


@dataclass
class Picture:
    """Something to draw: keys of a scenario's ``picture`` without position and orientation, and its pose."""

    keys: dict[str, Any]
    pose: Pose


@dataclass
class Part:
    """A rigid body.

    Attributes:
        name: as in the file.
        item: where it stands there, for errors.
        parent: index of the part that it hangs on, or WORLD.
        joint: by which.
        mass: [kg].
        centre: centre of mass [m], shape (3,).
        inertia: about it [kg·m²], shape (3, 3).
        pictures: what is drawn of it.
    """

    name: str
    item: str
    parent: int
    joint: Joint
    mass: float
    centre: Array
    inertia: Array
    pictures: list[Picture] = field(default_factory=list)

    @property
    def bare(self) -> bool:
        """Whether it has neither mass nor inertia."""
        return self.mass == 0.0 and not self.inertia.any()

    @property
    def body(self) -> bool:
        """Whether it can be a body by itself: it has mass, and an inertia that is possible."""
        return self.mass > 0.0 and self.possible()

    def principal(self) -> Array:
        """Return the principal moments [kg·m²], ascending, shape (3,)."""
        return np.linalg.eigvalsh(self.inertia).astype(np.float64)

    def possible(self) -> bool:
        """Return whether a rigid body can have this inertia, as a scenario checks it."""
        low, middle, high = self.principal()
        return bool(low >= -1e-12 * high and low + middle >= high * (1.0 - 1e-9))

    def take_in(self, other: Part) -> None:
        """Add another part that is rigidly connected."""
        mass = self.mass + other.mass
        centre = (self.mass * self.centre + other.mass * other.centre) / mass if mass else self.centre
        self.inertia = about(self, centre) + about(other, centre)
        self.mass, self.centre = mass, centre
        self.pictures += other.pictures


def about(part: Part, point: Array) -> Array:
    """Return the inertia of a part about a point [kg·m²], shape (3, 3) (Huygens and Steiner)."""
    d = part.centre - point
    shifted: Array = part.inertia + part.mass * ((d @ d) * np.eye(3) - np.outer(d, d))
    return shifted


@dataclass
class Closure:
    """A joint that closes a loop, in the world at the joints' zero.

    Attributes:
        name: as in the file.
        type: one of a scenario's joint types.
        ends: indices of two parts; one may be WORLD.
        points: the joint's point on each, shape (2, 3) [m]; the file may leave the loop open at the zero.
    """

    name: str
    type: str
    ends: tuple[int, int]
    points: Array


@dataclass
class Motor:
    """What drives a joint.

    Attributes:
        name: as in the file.
        joint: name of a revolute or prismatic joint, as in the file.
        law: force or torque along its coordinate, an expression of its input u, of q and v.
        unit: of that.
    """

    name: str
    joint: str
    law: str
    unit: str


@dataclass
class Model:
    """A file, read.

    Attributes:
        kind: URDF or MJCF.
        name: of the robot, as in the file.
        parts: parents before children.
        closures: what closes loops.
        motors: what drives joints.
        gravity: [m/s²], shape (3,).
        pictures: what is drawn of what stands still.
        remarks: what was left out or changed.
    """

    kind: str
    name: str
    parts: list[Part]
    gravity: Array
    closures: list[Closure] = field(default_factory=list)
    motors: list[Motor] = field(default_factory=list)
    pictures: list[Picture] = field(default_factory=list)
    remarks: list[Remark] = field(default_factory=list)

    def leave_out(self, what: str, why: str, items: Iterable[str]) -> None:
        """Note what the scenario does not have."""
        self.remarks += [Remark(what, why, item) for item in items]
