"""How the values of an FMU are laid out: the sections of ``fmu/fmi/lw_fmu.h`` and their sizes."""

from __future__ import annotations

from itertools import accumulate


def dynamics_sections(
    n: int, nq: int, nv: int, closures: int, forces: int, inputs: int, events: int
) -> dict[str, int]:
    """Return the size of each section, in order.

    Args:
        n: number of bodies.
        nq: number of coordinates.
        nv: number of degrees of freedom of the tree.
        closures: number of joints that close loops.
        forces: number of force elements.
        inputs: number of their inputs.
        events: number of things that may happen to joints.
    """
    known = {
        "MASS": n, "INERTIA": 6 * n, "PARENT_POINT": 3 * n, "CHILD_POINT": 3 * n, "GRAVITY": 3,
        "STIFFNESS": nv, "DAMPING": nv, "REST": nq,
        "FORCE_NUMBER": 3 * forces, "RTOL": 1, "ATOL": 1,
        "FORCE": 3 * n, "TORQUE": 3 * n, "FORCE_INPUT": inputs, "ADDED_INERTIA": 36 * n,
        "EVENT_COMMAND": events, "Q": nq, "V": nv,
    }  # fmt: skip
    calculated = {
        "DER_Q": nq, "DER_V": nv, "POSITION": 3 * n, "ORIENTATION": 4 * n, "LINEAR": 3 * n, "ANGULAR": 3 * n,
        "LINEAR_ACCELERATION": 3 * n, "ANGULAR_ACCELERATION": 3 * n, "REACTION_FORCE": 3 * n,
        "REACTION_TORQUE": 3 * n, "CLOSURE_FORCE": 3 * closures, "CLOSURE_TORQUE": 3 * closures,
        "EVENT_TIME": events, "EVENT_INDICATOR": events, "FORCE_EFFORT": forces, "FORCE_POWER": forces,
        "KINETIC_ENERGY": 1, "POTENTIAL_ENERGY": 1,
    }  # fmt: skip
    return known | calculated


def aero_sections(n: int, wind_inputs: int) -> dict[str, int]:
    """Return the size of each section of a force FMU, in order, for n bodies."""
    return {
        "DENSITY": 1, "WIND": 3, "LENGTH": n, "SPAN": n,
        "POSITION": 3 * n, "ORIENTATION": 4 * n, "LINEAR": 3 * n, "ANGULAR": 3 * n,
        "WIND_INPUT": wind_inputs,
        "FORCE": 3 * n, "TORQUE": 3 * n, "ADDED_INERTIA": 36 * n,
    }  # fmt: skip


def starts(sections: dict[str, int]) -> dict[str, int]:
    """Return where each section starts in the array of all values."""
    return dict(zip(sections, accumulate(sections.values(), initial=0), strict=False))
