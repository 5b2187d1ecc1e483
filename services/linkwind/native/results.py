"""What the multibody core is told and what it returns: integrators, evaluations, affine steps."""

from __future__ import annotations

import enum
from typing import NamedTuple

from linkwind.spatial import Array


class Integrator(enum.IntEnum):
    """How a macro step is taken; all but DOPRI5 take equal substeps, RADAU5 is implicit."""

    EULER = 0
    SEMI_IMPLICIT_EULER = 1
    RK4 = 2
    DOPRI5 = 3
    RADAU5 = 4


class AffineStep(NamedTuple):
    """What an affine wrench came to over a step.

    Attributes:
        wrench: the newest wrench at the twist that came out [N, N·m], shape (n, 6), in W.
        held: newest wrench that the step was integrated with, shape (n, 6), in W; with ``added_inertia`` it
            amounts to the same.
        added_inertia: that it was integrated with, shape (n, 6, 6), in the body frames.
    """

    wrench: Array
    held: Array
    added_inertia: Array


class Evaluation(NamedTuple):
    """Accelerations and forces at one instant.

    Attributes:
        joint_acceleration: dv/dt [rad/s², m/s²], shape (nv,).
        acceleration: of the bodies in W at the centres of mass, linear first [m/s², rad/s²], shape (n, 6).
        reaction: of the parent on the child through the joint, springs and dampers included, force first
            [N, N·m], shape (n, 6), in W at the joint's point on the child.
        total_wrench: wrench - A a [N, N·m], shape (n, 6), force first, in W at the centres of mass.
        effort: of force elements: tension of a spring [N], force or torque of an actuator or motion [N or
            N·m], size of the force of others [N], shape (f,).
        power: that they give to the bodies [W], shape (f,).
        closure_reaction: of the first on the second body of each joint that closes a loop [N, N·m], shape
            (c, 6), force first, in W at the joint's point on the second.
    """

    joint_acceleration: Array
    acceleration: Array
    reaction: Array
    total_wrench: Array
    effort: Array
    power: Array
    closure_reaction: Array
