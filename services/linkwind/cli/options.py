"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

LOG = "log.mcap"  # in the folder of a run
DIFFERENT = 5  # exit code: two things that should be equal are not

ScenarioArgument = Annotated[str, typer.Argument(help="A built-in scenario's name, or a TOML file.")]


def log_in(path: Path) -> Path:
    """Return the log that a path stands for: a file, or the folder of a run with its ``log.mcap``."""
    return path / LOG if path.is_dir() else path


LogArgument = Annotated[
    Path, typer.Argument(help="The MCAP log of a run, or the run's folder.", callback=log_in)
]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", "-o", help="Folder for the results; a new one under runs/ if not given."),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Override a key, such as coupling.step=5e-4; repeatable."
    ),
]
ListenOption = Annotated[
    list[str] | None,
    typer.Option("--listen", metavar="ENDPOINT", help="Listen here, such as tcp/0.0.0.0:7447."),
]
ConnectOption = Annotated[
    list[str] | None,
    typer.Option("--connect", metavar="ENDPOINT", help="Connect there, such as tcp/10.0.0.2:7447."),
]
TlsOption = Annotated[
    Path | None,
    typer.Option(
        "--tls", metavar="DIR", envvar="LINKWIND_TLS",
        help="Mutual TLS with the certificates of this folder, made by linkwind certs; endpoints are tls/….",
    ),
]  # fmt: skip
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]


def default_endpoint(tls: Path | None) -> str:
    """Return where the participants meet on one machine if nothing else is said."""
    return "tls/127.0.0.1:7447" if tls else "tcp/127.0.0.1:7447"
