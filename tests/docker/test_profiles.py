"""What else the compose files offer, run: a flow, a log heard again, an FMU and a recorder over TLS."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from linkwind.log.reader import Log, open_log
from tests.docker.compose import PATIENCE, REASON, Project, digest_outside, linkwind

if REASON:
    pytest.skip(REASON, allow_module_level=True)

END = "0.3"


@pytest.fixture(params=["plain", "secure"])
def either(request: pytest.FixtureRequest) -> tuple[Project, str]:
    """Return a project, and how its endpoints begin."""
    if request.param == "plain":
        return request.getfixturevalue("project"), "tcp"
    return request.getfixturevalue("secure"), "tls"


def log_of(project: Project, pattern: str) -> Log:
    (folder,) = project.folders["runs"].glob(pattern)
    return open_log(folder / "log.mcap")


@pytest.mark.parametrize(
    ("scenario", "settings"),
    [
        ("two_link_flow", {"SET": "aero.flow.cells=16"}),
        ("two_link", {"MODEL": "flow", "STEP": "1e-4", "SET": "aero.flow.cells=16"}),
    ],
    ids=["scenario", "model"],
)
def test_a_flow_takes_the_aero_side(
    scenario: str, settings: dict[str, str], project: Project, tmp_path: Path
) -> None:
    status, output = project.up(SCENARIO=scenario, END="0.02", **settings)
    assert status == 0, output
    options = ["time.end=0.02", "coupling.step=1e-4", "aero.model=flow", "aero.flow.cells=16"]
    outside = digest_outside(tmp_path / "outside", scenario, *(f"--set={option}" for option in options))
    assert log_of(project, "two_link*").final_state_sha256 == outside


def test_a_log_is_heard_again(either: tuple[Project, str]) -> None:
    project, protocol = either
    status, output = project.up(END=END)
    assert status == 0, output
    own = log_of(project, "two_link-2*")
    settings = {"LOG": str(own.path), "RATE": "0"}
    up = project.start("--profile", "replay", "up", "--no-color", "replay", **settings)
    status, output = project.do(
        "run", "--rm", "--no-deps", "observe",
        "linkwind", "record", "--connect", f"{protocol}/replay:7447", **settings,
    )  # fmt: skip
    assert status == 0, output
    assert up.wait(PATIENCE) == 0
    heard = log_of(project, "two_link-heard-*")
    assert heard.complete
    assert list(heard.raw()) == list(own.raw())


def test_recorder_and_fmu_over_tls(secure: Project, tmp_path: Path) -> None:
    fmu = secure.folders["fmus"] / "plate.fmu"
    linkwind("fmu", "export", "two_link", "--part", "aero", "-o", str(fmu))
    fmu.chmod(0o644)
    profiles = ["--profile", "force-fmu", "--profile", "observe"]
    settings = {"FMU": "plate.fmu", "OBSERVED": "1", "END": END}
    status, output = secure.do(*profiles, "up", "--exit-code-from", "dynamics", **settings)
    assert status == 0, output
    own, heard = log_of(secure, "two_link-2*"), log_of(secure, "two_link-heard-*")
    options = [f"--set=time.end={END}", f"--force-fmu={fmu}"]
    assert own.final_state_sha256 == digest_outside(tmp_path / "outside", "two_link", *options)
    assert [provider["model"] for provider in json.loads(own.scenario_json)["providers"]] == ["fmu"]
    assert heard.complete
    assert list(heard.raw()) == list(own.raw())
