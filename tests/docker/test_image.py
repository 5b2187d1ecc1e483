"""The image: small, not root, with linkwind in it and nothing of the machine that built it."""

from __future__ import annotations

import json

import pytest

from tests.docker.compose import REASON, docker

if REASON:
    pytest.skip(REASON, allow_module_level=True)

MEGABYTE = 1_000_000
LARGEST = 600  # MB; half of it is wheels that linkwind needs


def test_image_has_linkwind_and_another_user_than_root(image: str) -> None:
    assert docker("run", "--rm", image, "linkwind", "--version") == docker(
        "run",
        "--rm",
        image,
        "python",
        "-c",
        "from importlib.metadata import version; print(version('linkwind'))",
    )
    assert docker("run", "--rm", image, "id", "-u") == "1000"
    assert docker("inspect", "--format", "{{.Config.User}}", image) == "1000:1000"


def test_image_is_small_and_has_no_compiler(image: str) -> None:
    size = int(docker("inspect", "--format", "{{.Size}}", image)) / MEGABYTE
    print(f"size of the image: {size:.0f} MB")
    assert size < LARGEST
    found = docker(
        "run", "--rm", image, "sh", "-c", "ls /opt/linkwind/lib/python3*/site-packages; which gcc cc; true"
    )
    assert not {"ziglang", "pip", "cmake", "/usr/bin/gcc"} & set(found.split())


def test_no_build_argument_stays_in_the_image(image: str) -> None:
    kept = docker("history", "--no-trunc", image) + docker(
        "inspect", "--format", "{{json .Config.Env}}", image
    )
    assert "PIP_" not in kept


def test_image_runs_a_scenario_by_itself(image: str) -> None:
    command = ["linkwind", "run", "two_link", "--json", "--set", "time.end=0.05"]
    assert json.loads(docker("run", "--rm", image, *command))["steps"] == 50
