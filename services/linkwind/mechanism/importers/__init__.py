"""Robots of other programs as scenarios: URDF and, compiled by MuJoCo, MJCF.

Each importer reads a file into a ``Model``; ``settle`` makes a mechanism of it, ``text`` a scenario.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from linkwind import __version__
from linkwind.errors import InputError, SimulationError
from linkwind.mechanism import build
from linkwind.mechanism.importers import mjcf, urdf, xmltree
from linkwind.mechanism.importers.configuration import drop_stops, parse
from linkwind.mechanism.importers.model import Model
from linkwind.mechanism.importers.settle import settle
from linkwind.mechanism.importers.stiffness import stiff_joints
from linkwind.mechanism.importers.text import scenario_text
from linkwind.mechanism.remarks import Remark
from linkwind.native.multibody import Multibody
from linkwind.scenario import Scenario, loads

__all__ = ["Imported", "import_file"]


@dataclass(frozen=True)
class Imported:
    """A file of another program as a scenario.

    Attributes:
        kind: URDF or MJCF.
        text: the scenario as commented TOML.
        scenario: what it says.
        remarks: what was left out or changed.
    """

    kind: str
    text: str
    scenario: Scenario
    remarks: tuple[Remark, ...]


def import_file(
    path: Path, base: urdf.Base | None = None, at: Sequence[str] = (), repair: bool = False
) -> Imported:
    """Return the scenario of a URDF or MJCF file.

    Args:
        path: the file.
        base: of a URDF, whether its root link is fixed to the world (default) or free.
        at: ``JOINT=VALUE`` for each joint that does not start at its zero [rad or m].
        repair: whether inertias that no body can have are changed into ones that can be.

    Raises:
        InputError: the file cannot be read, something in it is wrong, or nothing in it can move.
    """
    model = _read(path, base)
    settle(model, path, repair)
    start = parse(at, model)
    drop_stops(model, start)
    welds = [closure.name for closure in model.closures if closure.type == "fixed"]
    if start and welds:
        raise InputError(
            f"--at {at[0]}: expected no weld that closes a loop; got {welds[0]}. Leave out --at."
        )
    scenario = loads(scenario_text(model, path.name, __version__, start), str(path))
    stiff = _stiff(scenario, path)
    model.leave_out("stiff joints", "runs take very small steps; lower springs and dampers", stiff)
    text = scenario_text(model, path.name, __version__, start)
    return Imported(model.kind, text, scenario, tuple(model.remarks))


def _read(path: Path, base: urdf.Base | None) -> Model:
    root = xmltree.read(path)
    if root.tag == "robot":
        return urdf.read(root, base or "fixed")
    if root.tag == "mujoco":
        if base is not None:
            raise InputError(f"--base {base}: expected it for URDF only; got {path}, an MJCF.")
        return mjcf.read(path)
    return root.refuse(
        "<robot> (URDF) or <mujoco> (MJCF)", f"<{root.tag}>", "Convert the file to one of the two."
    )


def _stiff(scenario: Scenario, path: Path) -> list[str]:
    """Find out before a run whether the mechanism can be moved, and in steps of which size."""
    mechanism = build(scenario)
    core = Multibody(mechanism.tables, mechanism.bodies, mechanism.closures)
    try:
        return list(stiff_joints(mechanism, core, scenario.coupling.step))
    except SimulationError as error:
        raise InputError(f"{path}: {error}") from None
