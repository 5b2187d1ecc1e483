"""Parts without an inertia of their own: rigidly connected ones are added up, idle ones are left out.

All of it is exact: the rest moves as before. What no body can have is refused, or repaired on demand.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from linkwind.errors import InputError
from linkwind.mechanism.importers.model import WORLD, Model, Part

MERGED = "links merged into the one that they are fixed to"
IDLE = "links without mass at the end of the tree, with their joints"
REPAIRED = "impossible inertias repaired"


def settle(model: Model, file: Path, repair: bool) -> None:
    """Make a mechanism of what was read from ``file``.

    Raises:
        InputError: nothing that moves has mass, or a moving part has an inertia that no body can have.
    """
    _forget_round_off(model)
    _keep(model, _merged(model))
    _keep(model, _idle(model))
    inside = [closure for closure in model.closures if len(set(closure.ends)) == 1]
    model.leave_out("loops", "both ends are in one body", [closure.name for closure in inside])
    model.closures = [closure for closure in model.closures if closure not in inside]
    joints = {part.joint.name for part in model.parts}
    gone = [motor.name for motor in model.motors if motor.joint not in joints]
    model.leave_out("actuators", "their joints are left out", gone)
    model.motors = [motor for motor in model.motors if motor.joint in joints]
    if not model.parts:
        raise InputError(f"{file}: expected a link with mass; got none. Give links inertials.")
    for part in model.parts:
        if part.mass == 0.0 and (part.joint.type == "free" or not part.bare):
            raise InputError(f"{part.item}: expected a mass above 0, as it moves; got 0. Correct it.")
    impossible = [part for part in model.parts if not part.possible()]
    if impossible and not repair:
        raise InputError("\n".join(map(_impossible, impossible)))
    for part in impossible:
        before = _moments(part)
        _repair(part)
        why = "the smallest moment raised to the least that a body can have"
        model.leave_out(REPAIRED, why, [f"{part.name} ({before} → {_moments(part)} kg·m²)"])


def _forget_round_off(model: Model) -> None:
    """Make a point mass of a part with a radius of gyration below 1 µm: signs of such moments are chance."""
    for part in model.parts:
        if np.abs(part.inertia).max() < 1e-12 * part.mass:
            part.inertia = np.zeros((3, 3))


def _merged(model: Model) -> dict[int, int]:
    """Add parts to those that they are fixed to, where one of the two cannot be a body by itself.

    Returns:
        Which part each of them is in now, by index; WORLD for what is fixed to the world.
    """
    into: dict[int, int] = {}
    for i, part in enumerate(model.parts):  # parents before children
        at = into.get(part.parent, part.parent)
        if part.joint.type != "fixed":
            continue
        if at == WORLD and not part.body:
            into[i] = WORLD
            model.pictures += part.pictures
            model.leave_out(MERGED, "fixed to the world", [f"{part.name} → world"])
        elif at != WORLD and not (part.body and model.parts[at].body):
            into[i] = at
            model.parts[at].take_in(part)
            model.leave_out(MERGED, "the motion is the same", [f"{part.name} → {model.parts[at].name}"])
    return into


def _idle(model: Model) -> dict[int, int]:
    """Find moving parts without mass on which nothing hangs: nothing feels them. Their pictures stay."""
    into: dict[int, int] = {}
    carrying = {end for closure in model.closures for end in closure.ends}
    for i, part in reversed(list(enumerate(model.parts))):
        if not part.bare or i in carrying:
            carrying.add(part.parent)
            continue
        into[i] = part.parent
        (model if part.parent == WORLD else model.parts[part.parent]).pictures += part.pictures
        model.leave_out(IDLE, "they do not move the rest", [f"{part.name} ({part.joint.name})"])
    return into


def _keep(model: Model, into: dict[int, int]) -> None:
    """Keep the parts that are in no other one, and renumber."""
    kept = [i for i in range(len(model.parts)) if i not in into]
    place = {i: k for k, i in enumerate(kept)} | {WORLD: WORLD}
    parts = [model.parts[i] for i in kept]
    for part in parts:
        part.parent = place[into.get(part.parent, part.parent)]
    model.parts = parts
    for closure in model.closures:
        first, second = (place[into.get(end, end)] for end in closure.ends)
        closure.ends = first, second


def _repair(part: Part) -> None:
    moments, axes = np.linalg.eigh(part.inertia)
    moments[1] = max(moments[1], 0.0)
    moments[0] = max(moments[0], moments[2] - moments[1], 0.0)
    part.inertia = axes @ np.diag(moments) @ axes.T


def _moments(part: Part) -> str:
    return ", ".join(f"{moment:.4g}" for moment in part.principal())


def _impossible(part: Part) -> str:
    return (
        f"{part.item}: expected principal moments of inertia above 0, of which two add up to at least "
        f"the third; got {_moments(part)} kg·m². Correct them, or import with --repair-inertia."
    )
