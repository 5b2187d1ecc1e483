"""Every command and group shows how it is used, in commands that are there, with options that they have."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from linkwind.cli import app

README = Path(__file__).parents[2] / "README.md"


def commands(command: Any, *path: str) -> Iterator[tuple[str, Any]]:
    yield " ".join(("linkwind", *path)), command
    for name, below in getattr(command, "commands", {}).items():
        yield from commands(below, *path, name)


ALL = dict(commands(typer.main.get_command(app)))


def examples(text: str) -> list[str]:
    """Return the command lines of linkwind in the examples of a help text."""
    found = re.findall(r"^\s*(?:Example|Start with|Then|and, there): (.*)$", text, re.MULTILINE)
    return [line for whole in found for line in lines(whole)]


def lines(text: str) -> list[str]:
    parts = re.split(r"&&|;|\band\b|\s#", text)
    return [part.strip().removeprefix("until ") for part in parts if "linkwind " in part]


def parse(line: str) -> Any:
    """Let the command read its arguments, without doing what they say; return it."""
    words = shlex.split(line)
    name, command = words.pop(0), ALL["linkwind"]
    while words and f"{name} {words[0]}" in ALL:
        name = f"{name} {words.pop(0)}"
        command = ALL[name]
    assert not hasattr(command, "commands"), f"{line}: no command of the group {name}"
    command.make_context(name, words)
    return command


@pytest.mark.parametrize("name", ALL)
def test_the_help_has_examples_that_can_be_typed(name):
    command = ALL[name]
    shown = examples(command.help or "")
    assert any(line.startswith(name) for line in shown)
    called = [parse(line) for line in shown]
    assert hasattr(command, "commands") or command in called


def test_the_readme_has_examples_that_can_be_typed():
    indented = re.findall(r"^    (linkwind .*)$", README.read_text(encoding="utf-8"), re.MULTILINE)
    typed = [line for text in indented for line in lines(text)]
    assert len(typed) > 20
    for line in typed:
        parse(line)


@pytest.mark.parametrize(
    "line", ["linkwind run two_link --speed 3", "linkwind log look LOG", "linkwind fmu export --fmi 4 x"]
)
def test_what_cannot_be_typed_is_found(line):
    with pytest.raises(Exception, match=r"No such option|no command of|is not one of"):
        parse(line)
