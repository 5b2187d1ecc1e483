"""What the container's start makes of its environment; needs no Docker."""

from __future__ import annotations

import os
import subprocess
from itertools import pairwise
from pathlib import Path

import pytest

START = Path(__file__).parents[2] / "docker" / "linkwind-dynamics"
PROGRAMS = {"id": "echo 1000", "linkwind": """for word in "$@"; do printf '%s\\n' "$word"; done"""}


def words(settings: str, folder: Path) -> list[str]:
    """Return the words that linkwind is started with."""
    (folder / "bin").mkdir()
    (folder / "runs").mkdir()
    for name, body in PROGRAMS.items():
        program = folder / "bin" / name
        program.write_text(f"#!/bin/sh\n{body}\n")
        program.chmod(0o755)
    environment = {"PATH": f"{folder / 'bin'}:{os.environ['PATH']}", "LINKWIND_SET": settings}
    done = subprocess.run(
        ["sh", str(START)],
        env=environment,
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ("", []),
        ("time.end=0.5", ["time.end=0.5"]),
        (
            "environment.gravity=[0, -1.62, 0]; time.end=0.5",
            ["environment.gravity=[0, -1.62, 0]", "time.end=0.5"],
        ),
        ("\n a.b=x *\n\n  c.d=2 ;\n", ["a.b=x *", "c.d=2"]),
    ],
)
def test_settings_end_at_a_semicolon_or_a_line(settings: str, expected: list[str], tmp_path: Path) -> None:
    given = words(settings, tmp_path)
    assert given[:3] == ["dynamics", "two_link", "--resume"]
    assert given[-1] != "--set"
    settings_given = [word for before, word in pairwise(given) if before == "--set"]
    assert [word for word in settings_given if not word.startswith("bus.recovery=")] == expected
