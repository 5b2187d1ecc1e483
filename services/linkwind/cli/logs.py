"""``linkwind log …``: what is in a log."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from linkwind.cli.options import JsonOption


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = typer.Typer(help="Look into a log.", no_args_is_help=True)
    group.command()(info)
    app.add_typer(group, name="log")


def info(
    log: Annotated[Path, typer.Argument(help="The MCAP log of a run.")], as_json: JsonOption = False
) -> None:
    """Print what a log holds: topics, messages, steps, whether it is complete, versions.

    Example: linkwind log info runs/two_link-20260101-120000/log.mcap
    """
    from linkwind.log.reader import open_log

    opened = open_log(log)
    about = opened.info._asdict()
    if as_json:
        typer.echo(json.dumps(about))
        return
    ending = "yes" if opened.complete else f"no: {opened.error or 'the run was cut off'}"
    if opened.damage is not None:
        ending += f" ({opened.damage.text})"
    rows = {
        "run": opened.run,
        "scenario": about["scenario"],
        "steps": about["steps"],
        "complete": ending,
        "final state": opened.final_state_sha256 or "none",
        "messages": about["messages"],
        **{f"  {topic}": count for topic, count in about["topics"].items()},
        **about["versions"],
    }
    for name, value in rows.items():
        typer.echo(f"{name:>20}  {value}")
