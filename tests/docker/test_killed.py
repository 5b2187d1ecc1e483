"""Containers whose process is killed: started again, they take the run to the end that it would have had."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from linkwind.log.reader import open_log
from linkwind.runs.verify import scenario_of, verify
from tests.docker.compose import PATIENCE, REASON, Project, digest_outside, docker, linkwind

if REASON:
    pytest.skip(REASON, allow_module_level=True)

END = "12"  # s: some seconds of wall clock


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("undisturbed") / "out"
    return digest_outside(folder, "two_link", f"--set=time.end={END}")


def check(project: Project, undisturbed: str) -> None:
    """The run is over, and its log is whole, right and alone with the report."""
    folder = project.folder()
    assert sorted(path.name for path in folder.iterdir()) == ["log.mcap", "report.html"]
    assert open_log(folder / "log.mcap").final_state_sha256 == undisturbed
    assert verify(*scenario_of(folder / "log.mcap")).identical


@pytest.mark.parametrize("service", ["dynamics", "aero"])
def test_killed_again_and_again_it_ends_in_the_same_state(
    service: str, project: Project, undisturbed: str
) -> None:
    assert project.do("up", "--detach", END=END, RESTART="on-failure:5")[0] == 0
    for _ in range(2):
        project.await_steps()
        project.kill(service)
    assert project.await_end() == 0, project.do("logs", "dynamics")[1]
    assert docker("inspect", "--format", "{{.RestartCount}}", project.container(service)) == "2"
    check(project, undisturbed)


def test_killed_by_docker_it_goes_on_by_the_same_command(project: Project, undisturbed: str) -> None:
    for service in ("dynamics", "aero"):
        up = project.start("up", "--exit-code-from", "dynamics", END=END)
        project.await_steps()
        project.kill(service, by_docker=True)
        assert up.wait(PATIENCE) > 0
    status, said = project.up(END=END)
    assert status == 0, said
    assert "goes on after step " in said
    check(project, undisturbed)


def test_killed_over_tls(secure: Project, undisturbed: str) -> None:
    assert secure.do("up", "--detach", END=END, RESTART="on-failure:5")[0] == 0
    for service in ("dynamics", "aero"):
        secure.await_steps()
        secure.kill(service)
    assert secure.await_end() == 0, secure.do("logs", "dynamics")[1]
    check(secure, undisturbed)


def test_killed_with_an_fmu(project: Project, tmp_path: Path) -> None:
    fmu = project.folders["fmus"] / "plate.fmu"
    linkwind("fmu", "export", "two_link", "--part", "aero", "-o", str(fmu))
    fmu.chmod(0o644)
    settings = {"FMU": "plate.fmu", "END": "4", "RESTART": "on-failure:5"}
    assert project.do("--profile", "force-fmu", "up", "--detach", **settings)[0] == 0
    project.await_steps()
    project.kill("force-fmu")
    project.await_steps()
    project.kill("dynamics")
    assert project.await_end() == 0, project.do("logs", "dynamics")[1]
    log = open_log(project.folder() / "log.mcap")
    assert [provider["model"] for provider in json.loads(log.scenario_json)["providers"]] == ["fmu"]
    outside = tmp_path / "outside"
    assert log.final_state_sha256 == digest_outside(
        outside, "two_link", "--set=time.end=4", f"--force-fmu={fmu}"
    )
