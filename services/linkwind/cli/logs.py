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


def info(log: Annotated[Path, typer.Argument(help="The MCAP log of a run.")], as_json: JsonOption = False) -> None:
    """Print what a log holds: topics, messages, steps, whether it is complete, versions.

    Example: linkwind log info runs/two_link-20260101-120000/log.mcap
    """
