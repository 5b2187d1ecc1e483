"""``linkwind verify`` and ``linkwind diff``: whether two runs are the same."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from linkwind.cli.force_fmu import ForceFmuOption, files_by_provider, refuse_missing
from linkwind.cli.options import JsonOption, LogArgument

if TYPE_CHECKING:
    from linkwind.log.reader import Log
    from linkwind.runs.verify import Verified
    from linkwind.scenario import Scenario

DIFFERENT = 5  # exit code


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(verify)


def verify(
    log: LogArgument,
    from_recorded_wrenches: Annotated[
        bool,
        typer.Option(
            "--from-recorded-wrenches", help="Take the forces from the log: its provider is not at hand."
        ),
    ] = False,
    force_fmu: ForceFmuOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run a log again from what it contains and compare bit for bit; exit code 5 if a bit differs.

    Example: linkwind verify runs/two_link-20260101-120000/log.mcap
    """
    from linkwind.runs.verify import scenario_of
    from linkwind.runs.verify import verify as verify_log

    opened, scenario = scenario_of(log)
    files: dict[str, Path] = {}
    if not from_recorded_wrenches:
        files = files_by_provider(scenario, force_fmu or [])
        refuse_missing(scenario, files)

    def job(progress: Callable[[int], None]) -> Verified:
        return verify_log(opened, scenario, progress, files, from_recorded_wrenches=from_recorded_wrenches)

    found = job(lambda step: None) if as_json else _behind_a_bar(scenario, job)
    if as_json:
        first = found.difference.as_json() | {"changed": found.changed} if found.difference else None
        typer.echo(
            json.dumps({"identical": found.identical, "steps": found.steps, "first_difference": first})
        )
        if found.remark:
            typer.echo(f"note: {found.remark}", err=True)
    else:
        _show(opened, scenario, found)
    if not found.identical:
        raise typer.Exit(DIFFERENT)


def _behind_a_bar(scenario: Scenario, job: Callable[[Callable[[int], None]], Verified]) -> Verified:
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(f"{scenario.name} (steps)", total=scenario.steps)
        return job(lambda step: bar.update(task, completed=step))


def _show(log: Log, scenario: Scenario, found: Verified) -> None:
    if found.difference is not None:
        typer.echo("different: the first difference is")
        rows(found.difference.lines("recorded", "again"))
        if found.changed:
            typer.echo("not as it was when the log was made:")
            rows((name, f"{then} -> {now}") for name, (then, now) in found.changed.items())
        else:
            typer.echo("versions, processor and library are those that made the log")
    else:
        extent = f"{found.steps} of {scenario.steps} steps, {found.messages} messages"
        typer.echo(f"identical: {extent}, every bit of them")
        if found.changed:
            typer.echo(f"though made with another {', '.join(found.changed)}")
    if found.remark:
        typer.echo(f"note: {found.remark}")


def rows(lines: Iterable[tuple[str, str]]) -> None:
    """Print names and texts below each other."""
    for name, text in lines:
        typer.echo(f"{name:>20}  {text}")
