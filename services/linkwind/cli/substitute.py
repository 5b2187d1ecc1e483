"""``linkwind replay --substitute``: one side of a log live, the other recorded."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from linkwind.cli.own import Given, as_models, by_provider
from linkwind.cli.run import behind_a_bar, print_summary

if TYPE_CHECKING:
    from linkwind.log.reader import Log
    from linkwind.runs.forces import ForceDifference
    from linkwind.runs.live_provider import Answered
    from linkwind.runs.run import Outcome

Silent = Callable[[int], None]


def substitute(
    path: Path,
    live: str,
    overrides: Sequence[str],
    given: Given,
    out: Path | None,
    listen: Sequence[str],
    connect: Sequence[str],
    tls: Path | None,
    as_json: bool,
) -> None:
    """Do what the options ask for and print what came of it.

    Args:
        path: of the log.
        live: the side that is live, ``dynamics`` or the name of a provider.
        overrides: ``KEY=VALUE`` settings of the live side.
        given: models of the user's own in the place of its model.
        out: folder for the results.
        listen: endpoints to listen on.
        connect: endpoints to connect to.
        tls: folder with the certificate of whoever is recorded; None without TLS.
        as_json: print one object.

    Raises:
        InputError: there is no such side.
    """
    from linkwind.errors import InputError
    from linkwind.log.contents import DYNAMICS
    from linkwind.log.reader import open_log

    log = open_log(path)
    if live != DYNAMICS and live not in log.provider_bodies:
        names = ", ".join([DYNAMICS, *log.provider_bodies])
        raise InputError(f"--substitute: expected one of {names}; got {live}.")
    if log.damage is not None:
        typer.echo(f"note: the log is not complete: {log.damage.text}", err=True)
    if live != DYNAMICS:
        _provider(log, live, overrides, given, out, listen, connect, tls, as_json)
    elif listen or connect:
        _answer(log, listen, connect, tls, as_json)
    else:
        _dynamics(log, overrides, out, as_json)


def _dynamics(log: Log, overrides: Sequence[str], out: Path | None, as_json: bool) -> None:
    """Run new dynamics here; print what it came to, and how it differs."""
    from linkwind.cli.verify import show_diff
    from linkwind.runs.diff import diff
    from linkwind.runs.live_dynamics import live_dynamics

    def job(progress: Silent) -> Outcome:
        return live_dynamics(log, overrides, out, progress)

    if as_json:
        outcome = job(lambda step: None)
        compared = diff(log.path, outcome.log).as_json()
        typer.echo(json.dumps(outcome.as_json() | {"difference": compared}))
        return
    outcome = behind_a_bar("dynamics", _steps(log), job)
    print_summary(outcome)
    typer.echo("A: recorded, B: live dynamics under the recorded forces")
    show_diff(diff(log.path, outcome.log), 0.0)


def _answer(log: Log, listen: Sequence[str], connect: Sequence[str], tls: Path | None, as_json: bool) -> None:
    """Give the recorded forces to dynamics elsewhere."""
    from linkwind.runs.live_dynamics import answer_dynamics

    def tell(name: str) -> None:
        if not as_json:
            typer.echo(f"{name}: waiting for a dynamics at {', '.join([*listen, *connect])}")

    last = answer_dynamics(log, listen, connect, tls, tell)
    typer.echo(json.dumps({"steps": last}) if as_json else f"answered up to step {last}, the last one")


def _provider(
    log: Log,
    live: str,
    overrides: Sequence[str],
    given: Given,
    out: Path | None,
    listen: Sequence[str],
    connect: Sequence[str],
    tls: Path | None,
    as_json: bool,
) -> None:
    """Ask a provider about the recorded motion; print how its forces differ from the recorded ones."""
    from linkwind.log.reader import open_log
    from linkwind.runs.forces import force_differences, same_answers
    from linkwind.runs.keeping import Kept
    from linkwind.runs.live_provider import live_provider
    from linkwind.runs.own import settled
    from linkwind.runs.substitution import changed

    first, _ = changed(log, overrides)
    own = by_provider(first, *given)
    first, changes = changed(log, [*overrides, *as_models(own)])
    scenario, tables = settled(first, own, another=True)
    changes = {step: settled(each, own, another=True)[0] for step, each in changes.items()}

    def tell() -> None:
        if not as_json:
            where = ", ".join([*listen, *connect]).replace("0.0.0.0", "THIS-MACHINE")
            typer.echo(f"waiting for {live}: linkwind aero --connect {where} --name {live}")

    def job(progress: Silent) -> Kept[Answered]:
        return live_provider(
            log,
            live,
            scenario,
            changes,
            out,
            progress,
            own=own,
            listen=listen,
            connect=connect,
            tls=tls,
            opened=tell,
        )

    if as_json:
        kept = job(lambda step: None)
    else:
        for table in tables:
            typer.echo(table)
        kept = behind_a_bar(live, scenario.steps, job)
    new = open_log(kept.log)
    found = list(force_differences(log, new, log.provider_bodies[live]))
    same = same_answers(log, new, live)
    if as_json:
        typer.echo(json.dumps(_summary(kept, found, same)))
    else:
        _show(kept, found, same)
    if kept.result.missing:
        typer.echo(f"note: {kept.result.missing}", err=True)


def _summary(kept: Any, found: Sequence[ForceDifference], same: tuple[int, int]) -> dict[str, Any]:
    return {
        "steps": kept.result.steps,
        "exchanges": kept.result.exchanges,
        "identical_answers": same[0],
        "forces": [each._asdict() for each in found],
        "log": str(kept.log),
        "report": None if kept.report_trouble else str(kept.report),
    }


def _show(kept: Any, found: Sequence[ForceDifference], same: tuple[int, int]) -> None:
    typer.echo(
        f"{kept.result.exchanges} exchanges over {kept.result.steps} steps of recorded motion; {same[0]} of "
        f"{same[1]} answers have the recorded bits"
    )
    head = ("recorded", "live", "difference", "largest")
    typer.echo(f"{'':>20}  " + "  ".join(f"{name:>10}" for name in head) + "  at t [s]")
    for each in found:
        sizes = (each.recorded, each.live, each.difference, each.largest)
        title = f"{each.body} {each.quantity} [{each.unit}]"
        typer.echo(f"{title:>20}  " + "  ".join(f"{size:>10.4g}" for size in sizes) + f"  {each.t:g}")
    typer.echo("root mean squares over the communication points; the largest difference")
    typer.echo(f"{'log':>20}  {kept.log}")
    typer.echo(f"{'report':>20}  {kept.report_trouble or kept.report}")


def _steps(log: Log) -> int:
    from linkwind.log.scenarios import last_recorded

    return last_recorded(log).steps
