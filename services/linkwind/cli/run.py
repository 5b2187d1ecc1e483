"""``linkwind run`` and ``linkwind dynamics``: a run, its progress and its summary."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from linkwind.cli.options import (
    ConnectOption,
    JsonOption,
    ListenOption,
    OutOption,
    ScenarioArgument,
    SetOption,
    TlsOption,
    default_endpoint,
)
from linkwind.cli.own import ForceFmuOption, ModelOption, load_with
from linkwind.cli.view import LOCAL, HostOption, NoOpenOption, PortOption, ViewOption, watched

if TYPE_CHECKING:
    from linkwind.runs.restart import Finished
    from linkwind.runs.resume import Plan, Resumed
    from linkwind.runs.run import Ends, Outcome, Progress
    from linkwind.scenario import Scenario

    Summary = Outcome | Resumed | Finished

T = TypeVar("T")


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(run)
    app.command()(dynamics)


def run(
    scenario: ScenarioArgument,
    out: OutOption = None,
    set_: SetOption = None,
    force_fmu: ForceFmuOption = None,
    model: ModelOption = None,
    tls: TlsOption = None,
    view: ViewOption = False,
    host: HostOption = LOCAL,
    port: PortOption = 0,
    no_open: NoOpenOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a scenario: start every participant, exchange, log, report.

    Example: linkwind run two_link --set coupling.step=5e-4

    Example: linkwind run two_link --model kite.py:Kite
    """
    from linkwind.runs.run import run as run_scenario

    loaded, own, tables = load_with(scenario, set_ or [], force_fmu, model)
    for table in [] if as_json else tables:
        typer.echo(table)
    with watched(view, host, port, no_open) as watch:
        _show(loaded, lambda progress: run_scenario(loaded, out, progress, own, tls, watch), as_json=as_json)


def dynamics(
    scenario: ScenarioArgument,
    out: OutOption = None,
    set_: SetOption = None,
    listen: ListenOption = None,
    connect: ConnectOption = None,
    tls: TlsOption = None,
    run_id: Annotated[str, typer.Option("--run", help="Id of the run; the folder's name if not given.")] = "",
    view: ViewOption = False,
    host: HostOption = LOCAL,
    port: PortOption = 0,
    no_open: NoOpenOption = False,
    await_listener: Annotated[
        bool, typer.Option("--await-listener", help="Begin when somebody listens (linkwind record).")
    ] = False,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Go on with the run in --out, or the newest of these settings under runs/, if it was cut.",
        ),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Start the dynamics alone; the providers connect from elsewhere.

    Example: linkwind dynamics two_link --listen tcp/0.0.0.0:7447

    Example: until linkwind dynamics two_link --out runs/mine --resume; do sleep 1; done
    """
    from linkwind.runs.restart import restart
    from linkwind.runs.run import dynamics as run_dynamics
    from linkwind.scenario import load

    loaded = load(scenario, set_ or [])
    ends = meeting(loaded, listen, connect, tls, quiet=as_json)

    def job(progress: Progress) -> Summary:
        how: dict[str, Any] = {"run_id": run_id, "watch": watch, "listened": await_listener}
        if resume:
            tell = (lambda found: None) if as_json else tell_plan
            say = (lambda text: None) if as_json else typer.echo
            return restart(loaded, out, progress, ends, goes_on=tell, tell=say, **how)
        return run_dynamics(loaded, out, progress, ends, **how)

    with watched(view, host, port, no_open) as watch:
        _show(loaded, job, as_json=as_json)


def meeting(
    scenario: Scenario, listen: list[str] | None, connect: list[str] | None, tls: Path | None, *, quiet: bool
) -> Ends:
    """Return where a dynamics meets its providers; once that is open, tell how they get there."""
    from linkwind.credentials import identity_in
    from linkwind.runs.run import Ends

    shown = identity_in(tls, "dynamics")
    if not listen and not connect:
        listen = [default_endpoint(tls)]
    where = [*(listen or []), *(connect or [])][0].replace("0.0.0.0", "THIS-MACHINE")

    def tell() -> None:
        for provider in () if quiet else scenario.providers:
            options = f"--connect {where} --name {provider.name}" + (" --tls DIR" if tls else "")
            options += {"fmu": " --force-fmu FILE", "python": " --model FILE.py:NAME"}.get(provider.model, "")
            typer.echo(f"waiting for {provider.name}: linkwind aero {options}")

    return Ends(listen or [], connect or [], shown, tell)


def tell_plan(found: Plan) -> None:
    """Print where a run goes on."""
    damage = found.log.damage
    if damage is not None:
        typer.echo(f"note: the log is not complete: {damage.text}")
    begin = f"a checkpoint of step {found.start}" if found.start >= 0 else "the beginning"
    typer.echo(f"goes on after step {found.last} of {found.steps}; providers start from {begin}")


def _show(scenario: Scenario, job: Callable[[Progress], Summary], *, as_json: bool) -> None:
    """Do the job behind a progress bar and print its summary."""
    if as_json:
        typer.echo(json.dumps(job(lambda step: None).as_json()))
        return
    print_summary(behind_a_bar(scenario.name, scenario.steps, job))


def behind_a_bar(name: str, steps: int, job: Callable[[Progress], T]) -> T:
    """Do the job of so many steps behind a progress bar."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=Console(stderr=True))
    task = bar.add_task(f"{name} (steps)", total=steps)

    def progress(step: int) -> None:
        bar.start()  # not before there is something to show
        bar.update(task, completed=step)

    try:
        outcome = job(progress)
        progress(steps)
    finally:
        if bar.live.is_started:  # else it would leave an empty line
            bar.stop()
    return outcome


def _happened(at: float | None) -> str:
    return "did not happen" if at is None else f"at {at:.9g} s"


def print_summary(done: Summary) -> None:
    """Print what a run came to."""
    from linkwind.runs.restart import Finished
    from linkwind.runs.resume import Resumed

    if isinstance(done, Finished):
        state = done.log.final_state_sha256
        typer.echo(
            f"{done.log.path}: this run has come to its end, step {done.log.steps}: nothing is left to do"
        )
        typer.echo(f"{'final state':>26}  {state}")
        typer.echo(f"{'report':>26}  {done.report}")
        return
    _print_outcome(done.outcome if isinstance(done, Resumed) else done)


def _print_outcome(outcome: Outcome) -> None:
    summary = outcome.as_json()
    exchange, gap = summary["exchange_us"], summary["joint_gap_max_m"]
    rows = {
        "steps": f"{summary['steps']}  ({summary['exchanges']} exchanges)",
        "wall time": f"{summary['wall_s']:.2f} s",
        "exchange time": f"{exchange['median']:.0f} µs median, {exchange['p99']:.0f} µs p99",
        "largest joint gap": "no joints" if gap is None else f"{gap:.2g} m",
        "largest aerodynamic force": f"{summary['force_max_N']:.4g} N",
        **{name: _happened(at) for name, at in summary["events"].items()},
        "log": outcome.log_trouble or summary["log"],
        "report": outcome.report_trouble or summary["report"],
    }
    for name, value in rows.items():
        typer.echo(f"{name:>26}  {value}")
