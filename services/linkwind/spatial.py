"""Motion and force of bodies as arrays, and the rotations between their frames.

Frames and units are the project's: world ``W`` is right-handed; a pose is the position of the centre
of mass [m] and a unit quaternion ``(w, x, y, z)``, body to world; twist and wrench are in ``W`` at the
centre of mass.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def address(array: Array) -> int:
    """Return the memory address of a C-contiguous float64 array, for the native library."""
    if array.dtype != np.float64 or not array.flags.c_contiguous:
        raise TypeError(f"expected a C-contiguous float64 array, got {array.dtype} {array.strides}")
    return int(array.__array_interface__["data"][0])


def rotations(orientation: Array) -> Array:
    """Return the rotation matrices of unit quaternions (w, x, y, z), shape (n, 4), as shape (n, 3, 3)."""
    w, x, y, z = orientation.T
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )
    return np.ascontiguousarray(np.moveaxis(np.array(rows), -1, 0))


def turned(turn: Array, vectors: Array) -> Array:
    """Return vectors, shape (…, 3), times a matrix (3, 3), without BLAS: the same bits on every machine."""
    product: Array = (turn * vectors[..., None, :]).sum(axis=-1)
    return product


class Motion:
    """Poses and twists of bodies as four arrays, which may be views into a message.

    Attributes:
        position: centres of mass [m], shape (n, 3), in W.
        orientation: unit quaternions (w, x, y, z), body to world, shape (n, 4).
        linear: velocities of the centres of mass [m/s], shape (n, 3), in W.
        angular: angular velocities [rad/s], shape (n, 3), in W.
        addresses: where the four arrays lie in memory, in this order.
    """

    __slots__ = ("addresses", "angular", "linear", "orientation", "position")

    def __init__(self, position: Array, orientation: Array, linear: Array, angular: Array) -> None:
        self.position = position
        self.orientation = orientation
        self.linear = linear
        self.angular = angular
        self.addresses = tuple(map(address, (position, orientation, linear, angular)))

    @classmethod
    def at_rest(cls, n: int) -> Motion:
        """Return ``n`` bodies at rest at the origin, in arrays of their own."""
        orientation = np.zeros((n, 4))
        orientation[:, 0] = 1.0
        return cls(np.zeros((n, 3)), orientation, np.zeros((n, 3)), np.zeros((n, 3)))

    @classmethod
    def of(cls, views: Mapping[str, Any], name: str) -> Motion:
        """Return the motion that the field ``name`` of a message holds, in its memory (`linkwind.wire`)."""
        return cls(
            views[f"{name}.position"].reshape(-1, 3),
            views[f"{name}.orientation"].reshape(-1, 4),
            views[f"{name}.linear"].reshape(-1, 3),
            views[f"{name}.angular"].reshape(-1, 3),
        )

    def rotation(self) -> Array:
        """Return rotation matrices, body to world, shape (n, 3, 3); column j is axis j of the body in W."""
        return rotations(self.orientation)

    def __len__(self) -> int:
        return len(self.position)


class Wrench:
    """Forces on bodies as arrays, which may be views into a message.

    The wrench on body b is ``(force[b], torque[b]) - rotated(added_inertia[b]) @ (linear acceleration,
    angular acceleration) - (response @ (twist - trial twist))[b]``; everything that is proportional to
    acceleration stays out of force and torque.

    Attributes:
        force: [N], shape (n, 3), in W at the centre of mass.
        torque: [N·m], shape (n, 3), in W about the centre of mass.
        added_inertia: ``A`` [kg, kg·m, kg·m²], shape (n, 6, 6), symmetric positive semi-definite, force
            rows first, in the **body** frame at the centre of mass, so that it is constant for a rigid
            shape; None where the provider returns none.
        response: ``G`` [N·s/m, N·s, N·m·s], minus the derivative of the wrenches by the twists at the end of
            the step, in W, shape (6n, 6n) where bodies are coupled, (n, 6, 6) where not; rows force and
            torque, columns linear and angular of body after body; None where the provider returns none.
        diagnostics: numbers of the provider's own about the step, shape (any,); None for none.
        addresses: where force, torque and added_inertia lie in memory (0 for None).
    """

    __slots__ = ("added_inertia", "addresses", "diagnostics", "force", "response", "torque")

    def __init__(
        self,
        force: Array,
        torque: Array,
        added_inertia: Array | None = None,
        response: Array | None = None,
        diagnostics: Array | None = None,
    ) -> None:
        self.force = force
        self.torque = torque
        self.added_inertia = added_inertia
        self.response = response
        self.diagnostics = diagnostics
        self.addresses = (
            address(force),
            address(torque),
            0 if added_inertia is None else address(added_inertia),
        )

    @classmethod
    def zeros(cls, n: int, *, added_inertia: bool = False) -> Wrench:
        """Return zero wrenches on ``n`` bodies, in arrays of their own."""
        added = np.zeros((n, 6, 6)) if added_inertia else None
        return cls(np.zeros((n, 3)), np.zeros((n, 3)), added)

    def __len__(self) -> int:
        return len(self.force)
