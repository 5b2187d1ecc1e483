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
    while _merge_one(model) or _drop_one(model):
        pass
    for part in model.parts:
        if part.mass == 0.0 and not part.bare:
            raise InputError(
                f"{part.item}: expected a mass above 0, as it has inertia and moves; got 0. Correct it."
            )
    impossible = [part for part in model.parts if not part.possible()]
    if impossible and not repair:
        raise InputError("\n".join(map(_impossible, impossible)))
    for part in impossible:
        before = _moments(part)
        _repair(part)
        why = "the smallest moment raised to the least that a body can have"
        model.leave_out(REPAIRED, why, [f"{part.name} ({before} → {_moments(part)} kg·m²)"])
    if not model.parts:
        raise InputError(f"{file}: expected a link with mass; got none. Give links inertials.")


def _forget_round_off(model: Model) -> None:
    """Make a point mass of a part with a radius of gyration below 1 µm: signs of such moments are chance."""
    for part in model.parts:
        if np.abs(part.inertia).max() < 1e-12 * part.mass:
            part.inertia = np.zeros((3, 3))


def _merge_one(model: Model) -> bool:
    """Add one part to another that it is fixed to, where one of the two cannot be a body by itself."""
    for i, part in enumerate(model.parts):
        if part.joint.type != "fixed":
            continue
        if part.parent == WORLD:
            if not part.body:
                _remove(model, i, "fixed to the world")
                return True
            continue
        parent = model.parts[part.parent]
        if not (part.body and parent.body):
            parent.take_in(part)
            _remove(model, i, "", f"{part.name} → {parent.name}")
            return True
    return False


def _drop_one(model: Model) -> bool:
    """Leave out one moving part at the end of a branch that has no mass: nothing feels it."""
    carrying = {part.parent for part in model.parts}
    for i, part in enumerate(model.parts):
        if part.bare and i not in carrying:
            if part.parent != WORLD:
                model.parts[part.parent].pictures += part.pictures
            model.leave_out(IDLE, "they do not move the rest", [f"{part.name} ({part.joint.name})"])
            _take_out(model, i)
            return True
    return False


def _remove(model: Model, index: int, why: str, item: str = "") -> None:
    model.leave_out(MERGED, why or "the motion is the same", [item or f"{model.parts[index].name} → world"])
    _take_out(model, index)


def _take_out(model: Model, index: int) -> None:
    """Hang the children of a part on its parent, and renumber."""
    parent = model.parts[index].parent
    del model.parts[index]
    for part in model.parts:
        if part.parent == index:
            part.parent = parent
        if part.parent > index:
            part.parent -= 1


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
