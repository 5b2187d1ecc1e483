"""The image, built once; and a project of its own for each test, which leaves nothing behind."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.docker.compose import COMPOSE, IMAGE, ROOT, Project


@pytest.fixture(scope="session")
def image() -> str:
    """Build the image by the compose file, on $BASE where it is given."""
    compose = [COMPOSE, "-f", str(ROOT / "docker" / "compose.yaml"), "build", "--quiet"]
    done = subprocess.run(
        compose, env=os.environ | {"LINKWIND_IMAGE": IMAGE}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return IMAGE


@pytest.fixture
def project(tmp_path: Path, image: str) -> Iterator[Project]:
    started = Project(tmp_path, image)
    yield started
    started.end()
    assert not started.leftovers()


@pytest.fixture
def secure(tmp_path: Path, image: str) -> Iterator[Project]:
    started = Project(tmp_path, image, "compose.secure.yaml")
    yield started
    started.end()
    assert not started.leftovers()
