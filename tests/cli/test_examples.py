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

ROOT = Path(__file__).parents[2]
GUIDES = [ROOT / "README.md", ROOT / "docker/README.md", *sorted((ROOT / "services/guide").glob("*.md"))]


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


def test_the_guides_have_examples_that_can_be_typed():
    texts = [guide.read_text(encoding="utf-8") for guide in GUIDES]
    indented = [line for text in texts for line in re.findall(r"^    (linkwind .*)$", text, re.MULTILINE)]
    typed = [line for text in indented for line in lines(text)]
    assert len(typed) > 40
    for line in typed:
        parse(line)


def test_the_readme_names_every_command():
    table = (
        GUIDES[0].read_text(encoding="utf-8").partition("## Commands")[2].partition("Built-in scenarios")[0]
    )
    named = set(
        re.findall(r"[a-z]+", " ".join(row.split("|", 2)[1] for row in table.splitlines() if "|" in row))
    )
    assert {name.split()[1] for name in ALL if len(name.split()) == 2} <= named


@pytest.mark.parametrize("guide", GUIDES, ids=lambda guide: str(guide.relative_to(ROOT)))
def test_links_lead_somewhere(guide):
    text = guide.read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([^)]+)\)", text):
        if link.startswith("http"):
            continue
        path, _, anchor = link.partition("#")
        target = (guide.parent / path).resolve() if path else guide
        assert target.exists(), link
        if anchor:
            titles = re.findall(r"^#+ (.*)$", target.read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor in {re.sub(r"[^a-z0-9 -]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize(
    "line", ["linkwind run two_link --speed 3", "linkwind log look LOG", "linkwind fmu export --fmi 4 x"]
)
def test_what_cannot_be_typed_is_found(line):
    with pytest.raises(Exception, match=r"No such option|no command of|is not one of"):
        parse(line)
