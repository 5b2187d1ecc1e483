"""The coordinates of the joints as variables: pieces of q and v with one unit each."""

from __future__ import annotations

from dataclasses import dataclass

from linkwind.fmi import units
from linkwind.mechanism import Mechanism
from linkwind.native.multibody import ACTIONS, JOINT_TYPES, NQ, NV

_TYPE_NAMES = {code: name for name, code in JOINT_TYPES.items()}
# type: suffix, whether it turns, first and number of its coordinates, first and number of its velocities
_PIECES: dict[str, tuple[tuple[str, bool, int, int, int, int], ...]] = {
    "fixed": (),
    "revolute": (("", True, 0, 1, 0, 1),),
    "prismatic": (("", False, 0, 1, 0, 1),),
    "planar": (("_translation", False, 0, 2, 0, 2), ("_rotation", True, 2, 1, 2, 1)),
    "spherical": (("", True, 0, 4, 0, 3),),
    "free": (("_translation", False, 0, 3, 0, 3), ("_rotation", True, 3, 4, 3, 3)),
}
# Of a joint that may be released: its own coordinates at first, then those of a free one.
_ROOMY = (("", True, 0, NQ["free"], 0, NV["free"]),)


@dataclass(frozen=True)
class Piece:
    """Some of a joint's coordinates, all translations or all rotations.

    Attributes:
        name: of the joint.
        suffix: of the variables: ``q`` and this.
        turns: whether they are rotations.
        of_root: whether the joint's parent is the world.
        q, nq: first coordinate in the mechanism's q, and number.
        v, nv: first velocity in the mechanism's v, and number.
    """

    name: str
    suffix: str
    turns: bool
    of_root: bool
    q: int
    nq: int
    v: int
    nv: int

    @property
    def quaternion(self) -> bool:
        """Whether the coordinates are a unit quaternion."""
        return self.nq == 4

    def called(self, what: str) -> str:
        """Return the name of a variable: ``hinge.q``, ``world_link1.v_rotation``."""
        return f"{self.name}.{what}{self.suffix}"

    @property
    def quantities(self) -> dict[str, units.Quantity]:
        """What the coordinates, velocities, springs and so on measure."""
        if self.nq == NQ["free"]:
            whats = ("q", "v", "der_q", "der_v", "stiffness", "damping")
            return dict.fromkeys(whats, units.COORDINATE)
        if not self.turns:
            return {
                "q": units.POSITION, "v": units.VELOCITY, "der_q": units.VELOCITY,
                "der_v": units.ACCELERATION, "stiffness": units.STIFFNESS, "damping": units.DAMPING,
            }  # fmt: skip
        return {
            "q": units.QUATERNION if self.quaternion else units.ANGLE,
            "v": units.ANGULAR_VELOCITY,
            "der_q": units.QUATERNION_RATE if self.quaternion else units.ANGULAR_VELOCITY,
            "der_v": units.ANGULAR_ACCELERATION,
            "stiffness": units.ROTATIONAL_STIFFNESS,
            "damping": units.ROTATIONAL_DAMPING,
        }


def joint_names(mechanism: Mechanism) -> list[str]:
    """Return the name that each joint has in the FMU; see `linkwind.fmi.variables`."""
    taken = set(mechanism.bodies)
    names = []
    for joint in mechanism.joints:
        name = joint.replace("-", "_")
        while name in taken:
            name += "_joint"
        taken.add(name)
        names.append(name)
    return names


def force_names(mechanism: Mechanism) -> list[str]:
    """Return the name that each force element has in the FMU."""
    taken = {*mechanism.bodies, *joint_names(mechanism)}
    names = []
    for name in mechanism.forces:
        while name in taken:
            name += "_force"
        taken.add(name)
        names.append(name)
    return names


def pieces(mechanism: Mechanism) -> list[list[Piece]]:
    """Return the pieces of every joint; none for a fixed one."""
    tables = mechanism.tables
    roomy = set(tables.event_joint[tables.event_action == ACTIONS["release"]].tolist())
    found = []
    for i, name in enumerate(joint_names(mechanism)):
        q, v, of_root = int(tables.q_index[i]), int(tables.v_index[i]), bool(tables.parent[i] < 0)
        found.append(
            [
                Piece(name, suffix, turns, of_root, q + q_at, nq, v + v_at, nv)
                for suffix, turns, q_at, nq, v_at, nv in (
                    _ROOMY if i in roomy else _PIECES[_TYPE_NAMES[int(tables.joint_type[i])]]
                )
            ]
        )
    return found
