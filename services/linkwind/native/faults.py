"""What the core reports, as exceptions."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any, NamedTuple, NoReturn

from linkwind.errors import SimulationError


class Fault(ctypes.Structure):
    """``lw_fault``: the item, and the time [s] within the macro step."""

    _fields_ = [("item", ctypes.c_int32), ("time", ctypes.c_double)]


class Names(NamedTuple):
    """Of what an item may be, for messages: in quotes."""

    bodies: Sequence[str]
    closures: Sequence[str]
    events: Sequence[str]
    forces: Sequence[str]


_REPAIR = "Check forces, stiffnesses and dampers; a smaller step, more substeps, dopri5 or radau5 may help"
_NUMERICS = {
    1: ("joint of body {item}", "inertia to move the body", "a singular inertia",
        "Give the body mass, inertia or added inertia"),
    2: ("body {item}", "finite coordinates", "an overflow", _REPAIR),
    3: ("dopri5", "a substep that meets the tolerance",
        "one that shrank to nothing, or a million of them", _REPAIR),
    4: ("wrench on body {item}", "finite numbers", "NaN or infinity", "Check the force provider"),
    5: ("added inertia of body {item}", "finite numbers", "NaN or infinity", "Check the force provider"),
    6: ("state[{item}]", "a finite number", "NaN or infinity", _REPAIR),
    7: ("response of body {item}", "finite numbers", "NaN or infinity", "Check the force provider"),
    8: ("wrench on body {item}", "one that agrees with the twist it leads to", "none after ten corrections",
        "Take a smaller step"),
    9: ("joint of body {item}", "a motion that keeps it closed", "none after ten corrections",
        "Take a smaller step"),
    10: ("joint {item}", "bodies that close the loop", "a position from which they do not reach",
        "Check points, lengths and the start; a smaller step may help"),
    11: ("event {item}", "a few times within a step", "a thousand", "Give its stop a smaller restitution"),
    12: ("joint of body {item}", "Newton's method of radau5 to converge", "changes that do not get small",
        "Take more substeps"),
    13: ("force {item}", "a finite number", "NaN or infinity",
        "Does its expression divide by zero, or leave a function's domain?"),
    14: ("force {item}", "two points apart", "points that coincide, so that it has no direction",
        "Move one of the points; a smaller step may help"),
}  # fmt: skip
_UNNAMED = (3, 6)  # the item is no body
_KINDS = {10: 1, 11: 2, 13: 3, 14: 3}  # it is a joint that closes a loop, an event, or a force element
_ARGUMENTS = {
    20: ("h", "a positive macro step [s]"),
    21: ("nodes", "1 to 8 distinct finite nodes"),
    22: ("integrator", "a code of Integrator"),
    23: ("substeps", "at least 1"),
    24: ("rtol, atol", "rtol of zero or more and a positive atol"),
}


def fail(status: int, fault: Fault, names: Names, arguments: dict[str, Any]) -> NoReturn:
    """Raise what the core reported; ``names`` are those of items.

    Raises:
        ValueError: one of the ``arguments`` of the call makes no sense.
        SimulationError: numerical trouble.
    """
    if status in _ARGUMENTS:
        name, expected = _ARGUMENTS[status]
        raise ValueError(f"{name}: expected {expected}; got {arguments[name]}. Correct the call.")
    item = str(fault.item) if status in _UNNAMED else names[_KINDS.get(status, 0)][fault.item]
    subject, expected, found, repair = (text.format(item=item) for text in _NUMERICS[status])
    raise SimulationError(
        f"{subject}: expected {expected}; got {found}, {fault.time:.9g} s into the step. {repair}."
    )
