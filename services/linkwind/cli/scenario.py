"""``linkwind init``: a commented scenario to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(init)


def init(
    file: Annotated[Path, typer.Argument(help="The file to write.")] = Path("scenario.toml"),
    source: Annotated[
        str | None, typer.Option("--from", help="A built-in scenario to copy, instead.", metavar="NAME")
    ] = None,
) -> None:
    """Write a commented scenario with every section, to change and run.

    Example: linkwind init my_wing.toml && linkwind run my_wing.toml

    Example: linkwind init my_bird.toml --from flapper_wake
    """
    from linkwind.errors import InputError
    from linkwind.scenario import builtin_text, template

    text = builtin_text(source) if source else template()
    try:
        with file.open("x", encoding="utf-8") as target:
            target.write(text)
    except FileExistsError as error:
        raise InputError(f"{file}: expected a new file; got one that exists. Choose another name") from error
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {error.strerror}") from error
    typer.echo(f"wrote {file}; run it with: linkwind run {file}")
