"""``linkwind mechanism``: robots of other programs as scenarios, and back."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from linkwind.cli.options import JsonOption, ScenarioArgument, SetOption
from linkwind.errors import InputError

if TYPE_CHECKING:
    from linkwind.mechanism.remarks import Remark

HELP = """Take mechanisms from URDF and MJCF files, and give URDF.

Example: linkwind mechanism import robot.urdf && linkwind run robot.toml

Example: linkwind mechanism export robot.toml -o robot.urdf
"""

SHOWN = 4  # names of a group of remarks; the file has all


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = typer.Typer(no_args_is_help=True, help=HELP)
    group.command("import")(import_)
    group.command()(export)
    app.add_typer(group, name="mechanism")


def import_(
    file: Annotated[Path, typer.Argument(help="A URDF or MJCF file.")],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="The scenario to write; default: FILE.toml here."),
    ] = None,
    base: Annotated[
        Literal["fixed", "free"] | None,
        typer.Option(help="Of a URDF: the root link fixed to the world (default), or free to move."),
    ] = None,
    at: Annotated[
        list[str] | None,
        typer.Option("--at", metavar="JOINT=VALUE", help="Where a joint starts, in rad or m; repeatable."),
    ] = None,
    repair_inertia: Annotated[
        bool, typer.Option("--repair-inertia", help="Change inertias that no body can have, and list them.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Write the scenario of a URDF or MJCF file, and say what was left out.

    Example: linkwind mechanism import robot.urdf --at shoulder=0.5 -o robot.toml
    """
    from linkwind.mechanism.importers import import_file

    target = out or Path(f"{file.stem}.toml")
    imported = import_file(file, base, at or (), repair_inertia)
    _write(target, imported.text)
    scenario = imported.scenario
    if as_json:
        facts = {"kind": imported.kind, "bodies": len(scenario.bodies), "joints": len(scenario.joints)}
        typer.echo(json.dumps({"file": str(target), **facts, "left_out": _as_json(imported.remarks)}))
        return
    counts = f"{len(scenario.bodies)} bodies, {len(scenario.joints)} joints"
    typer.echo(f"wrote {target} ({imported.kind}: {counts}); run it with: linkwind run {target}")
    _show(imported.remarks)


def export(
    scenario: ScenarioArgument,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="The file to write; default: SCENARIO.urdf here."),
    ] = None,
    set_: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write the mechanism of a scenario as URDF, and say what was left out.

    Example: linkwind mechanism export robot.toml -o robot.urdf
    """
    from linkwind.mechanism.export_urdf import export_urdf
    from linkwind.scenario import load

    loaded = load(scenario, set_ or [])
    target = out or Path(f"{loaded.name}.urdf")
    exported = export_urdf(loaded)
    _write(target, exported.text)
    if as_json:
        counts = {"links": exported.links, "joints": exported.joints}
        typer.echo(json.dumps({"file": str(target), **counts, "left_out": _as_json(exported.remarks)}))
        return
    typer.echo(f"wrote {target} ({exported.links} links, {exported.joints} joints)")
    _show(exported.remarks)


def _write(target: Path, text: str) -> None:
    try:
        with target.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{target}: expected a new file; got one that exists. Use another -o.") from None
    except OSError as error:
        raise InputError(f"{target}: cannot be written: {error.strerror}. Choose another place.") from None


def _as_json(remarks: Iterable[Remark]) -> list[dict[str, Any]]:
    from linkwind.mechanism.remarks import grouped

    return [{"what": what, "why": why, "items": items} for (what, why), items in grouped(remarks).items()]


def _show(remarks: Iterable[Remark]) -> None:
    from linkwind.mechanism.remarks import grouped

    groups = grouped(remarks)
    typer.echo("left out or changed:" if groups else "nothing was left out")
    for (what, why), items in groups.items():
        more = f" and {len(items) - SHOWN} more" if len(items) > SHOWN else ""
        typer.echo(f"  {what} ({len(items)}): {why}\n      {', '.join(items[:SHOWN])}{more}")
