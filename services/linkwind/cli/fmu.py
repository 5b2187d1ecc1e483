"""``linkwind fmu …``: FMUs out of scenarios, and what is in an FMU."""

from __future__ import annotations

import json
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from linkwind.cli.fmu_map import fmu_map
from linkwind.cli.options import DIFFERENT, JsonOption, ScenarioArgument, SetOption

if TYPE_CHECKING:
    from linkwind.fmi.check import Checked
    from linkwind.scenario import Scenario

FileArgument = Annotated[Path, typer.Argument(help="The FMU.")]


HELP = """Export, check and look into FMUs.

Example: linkwind fmu export two_link -o two_link.fmu && linkwind fmu check two_link.fmu

Example: linkwind fmu info their.fmu
"""


class Fmi(StrEnum):
    """Version of FMI."""

    TWO = "2"
    THREE = "3"


class PartChoice(StrEnum):
    """What is exported."""

    DYNAMICS = "dynamics"
    AERO = "aero"


class ArraysChoice(StrEnum):
    """How arrays appear in FMI 3."""

    NATIVE = "native"
    SCALAR = "scalar"


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = typer.Typer(help=HELP, no_args_is_help=True)
    group.command()(export)
    group.command()(check)
    group.command()(info)
    group.command("map")(fmu_map)
    app.add_typer(group, name="fmu")


def export(
    scenario: ScenarioArgument,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="The file; SCENARIO.fmu here if not given.")
    ] = None,
    fmi: Annotated[Fmi, typer.Option(help="Version of FMI.")] = Fmi.TWO,
    platforms: Annotated[
        str,
        typer.Option(
            metavar="host|all|LIST",
            help="Binaries: for this machine, for all platforms, or a list such as "
            "x86_64-linux,aarch64-linux,x86_64-windows,x86_64-darwin,aarch64-darwin.",
        ),
    ] = "host",
    part: Annotated[
        PartChoice, typer.Option(help="The mechanism, or the force model.")
    ] = PartChoice.DYNAMICS,
    arrays: Annotated[
        ArraysChoice, typer.Option(help="Arrays in FMI 3; scalar for tools that have none.")
    ] = ArraysChoice.NATIVE,
    ssp: Annotated[
        bool,
        typer.Option(
            "--ssp", help="Mechanism and force models, connected, as SCENARIO.ssp (SSP 1.0, FMI 2)."
        ),
    ] = False,
    set_: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write a scenario's mechanism as an FMU: Co-Simulation and Model Exchange, C inside.

    Example: linkwind fmu export two_link -o two_link.fmu --fmi 3 --platforms all

    Example: linkwind fmu export two_link --ssp
    """
    from linkwind.fmi.export import export as export_fmu
    from linkwind.scenario import load

    if ssp and (fmi is Fmi.THREE or part is PartChoice.AERO):
        given = "--fmi 3" if fmi is Fmi.THREE else "--part aero"
        raise typer.BadParameter(
            f"--ssp: expected nothing that chooses one FMU; got {given}. Leave one of them out."
        )
    loaded = load(scenario, set_ or [])
    if ssp:
        _export_system(loaded, out or Path(f"{loaded.name}.ssp"), platforms.split(","), as_json=as_json)
        return
    ending = "_aero" if part is PartChoice.AERO else ""
    done = export_fmu(
        loaded,
        out or Path(f"{loaded.name}{ending}.fmu"),
        fmi=fmi.value,
        platforms=platforms.split(","),
        part=part.value,
        arrays=arrays.value,
    )
    if as_json:
        summary = {"file": str(done.file), "bytes": done.bytes, "fmi": done.fmi}
        typer.echo(json.dumps(summary | {"platforms": list(done.platforms)}))
        return
    typer.echo(
        f"wrote {done.file}: FMI {done.fmi}, {done.bytes / 1000:.0f} kB, for {', '.join(done.platforms)}"
    )
    acting = [provider.name for provider in loaded.providers if provider.model != "none"]
    if part is PartChoice.DYNAMICS and acting:
        typer.echo(
            f"The forces of {', '.join(acting)} are inputs of it: no wind is in there. "
            "--ssp takes both, --part aero the model alone."
        )


def _export_system(scenario: Scenario, out: Path, platforms: list[str], *, as_json: bool) -> None:
    from linkwind.fmi.ssp import export_system

    done = export_system(scenario, out, platforms=platforms)
    if as_json:
        summary = {"file": str(done.file), "bytes": done.bytes, "fmi": done.fmi}
        names = {"platforms": done.platforms, "components": done.components, "left_out": done.left_out}
        typer.echo(json.dumps(summary | {key: list(value) for key, value in names.items()}))
        return
    parts = " and ".join(done.components)
    typer.echo(
        f"wrote {done.file}: {parts}, FMI {done.fmi}, {done.bytes / 1000:.0f} kB, for "
        f"{', '.join(done.platforms)}"
    )
    for name in done.left_out:
        typer.echo(f"left out: provider {name}, whose model is not in C; its forces are inputs of the system")


def check(file: FileArgument, as_json: JsonOption = False) -> None:
    """Check any FMU: with FMPy and other tools that are installed, and against its own references.

    Example: linkwind fmu check two_link.fmu
    """
    from linkwind.fmi.check import check as check_fmu

    found = check_fmu(file)
    if as_json:
        typer.echo(json.dumps(_as_json(found)))
    else:
        _show(found)
    if not found.ok:
        raise typer.Exit(DIFFERENT)


def _as_json(found: Checked) -> dict[str, Any]:
    return {
        "ok": found.ok,
        "errors": list(found.errors),
        "checkers": found.checkers,
        "reference_max_error": found.reference_max_error,
    }


def _show(found: Checked) -> None:
    for name, result in found.checkers.items():
        typer.echo(f"{name:>26}  {result}")
    if found.reference_max_error is not None:
        typer.echo(f"{'deviation from references':>26}  {found.reference_max_error:.3g}")
    for error in found.errors:
        typer.echo(f"error: {error}", err=True)


def info(file: FileArgument, as_json: JsonOption = False) -> None:
    """Print what an FMU can do, the platforms that it runs on, and its variables.

    Example: linkwind fmu info two_link.fmu
    """
    from linkwind.cli.tables import console
    from linkwind.fmi.info import facts, show

    if as_json:
        typer.echo(json.dumps(facts(file)))
    else:
        show(file, console())
