"""The page of a run that containers made, from one of its own."""

from __future__ import annotations

import json
import time
from urllib.error import URLError
from urllib.request import urlopen

import pytest

from tests.docker.compose import PATIENCE, REASON, Project

if REASON:
    pytest.skip(REASON, allow_module_level=True)

PORT = "18081"


def test_the_newest_run_is_shown(project: Project) -> None:
    status, output = project.up(END="0.1")
    assert status == 0, output
    status, output = project.do("--profile", "view", "up", "-d", "view", PORT=PORT)
    assert status == 0, output
    assert facts()["complete"]
    assert project.do("--profile", "view", "down", PORT=PORT)[0] == 0


def facts() -> dict[str, object]:
    """Return what the page is told first, as soon as it is served."""
    end = time.monotonic() + PATIENCE
    while True:
        try:
            with urlopen(f"http://127.0.0.1:{PORT}/facts", timeout=PATIENCE) as answer:
                return dict(json.load(answer))
        except (URLError, ConnectionError):
            assert time.monotonic() < end
            time.sleep(0.2)
