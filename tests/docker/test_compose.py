"""The compose file, run: the same bits as outside, the run's status, the truth when something goes wrong."""

from __future__ import annotations

import json
import os
import shutil
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from linkwind.log.reader import open_log
from tests.docker.compose import (
    NOBODY,
    PATIENCE,
    REASON,
    ROOT,
    Project,
    digest_outside,
    docker,
    linkwind,
    users,
)

if REASON:
    pytest.skip(REASON, allow_module_level=True)


def test_run_gives_the_same_bits_as_outside(project: Project, tmp_path: Path) -> None:
    status, output = project.up()
    assert status == 0, output
    log = open_log(project.folder() / "log.mcap")
    assert log.complete
    assert log.steps == 1200
    assert log.final_state_sha256 == digest_outside(tmp_path / "outside", "two_link")
    assert (project.folder() / "report.html").stat().st_size > 100_000
    assert project.do("down")[0] == 0
    assert not project.leftovers()


def test_a_recorder_beside_the_run_has_all_of_it(project: Project) -> None:
    status, output = project.do(
        "--profile", "observe", "up", "--exit-code-from", "dynamics", OBSERVED="1", END="0.5"
    )  # fmt: skip
    assert status == 0, output
    own, heard = (
        open_log(next(project.folders["runs"].glob(pattern)) / "log.mcap")
        for pattern in ("two_link-2*", "two_link-heard-*")
    )
    assert heard.complete
    assert list(heard.raw()) == list(own.raw())
    assert (heard.metadata, heard.versions) == (own.metadata, own.versions)


def test_environment_says_what_to_run(project: Project, tmp_path: Path) -> None:
    linkwind("init", str(project.folders["scenarios"] / "my.toml"))
    settings = [
        "coupling.step=0.002",
        "time.end=0.2",
        "providers.aero.model=plate",
        "environment.wind=[-4,0,0]",
    ]
    status, output = project.up(
        SCENARIO="/scenarios/my.toml",
        STEP="0.002",
        END="0.2",
        MODEL="plate",
        SET="environment.wind=[-4, 0, 0]; coupling.scheme=explicit",
    )
    assert status == 0, output
    log = open_log(project.folder() / "log.mcap")
    assert log.steps == 100
    options = [f"--set={setting}" for setting in (*settings, "coupling.scheme=explicit")]
    scenario = str(project.folders["scenarios"] / "my.toml")
    assert log.final_state_sha256 == digest_outside(tmp_path / "outside", scenario, *options)


def test_fmu_takes_the_aero_side(project: Project, tmp_path: Path) -> None:
    fmu = project.folders["fmus"] / "plate.fmu"
    linkwind("fmu", "export", "two_link", "--part", "aero", "-o", str(fmu))
    fmu.chmod(0o644)
    status, output = project.do(
        "--profile", "force-fmu", "up", "--exit-code-from", "dynamics", FMU="plate.fmu", END="0.2"
    )
    assert status == 0, output
    log = open_log(project.folder() / "log.mcap")
    outside = digest_outside(tmp_path / "outside", "two_link", "--set=time.end=0.2", f"--force-fmu={fmu}")
    assert log.final_state_sha256 == outside
    assert [provider["model"] for provider in json.loads(log.scenario_json)["providers"]] == ["fmu"]


def test_a_model_in_python_takes_the_aero_side(project: Project, tmp_path: Path) -> None:
    for name, folder in (("kite.py", "models"), ("kite.toml", "scenarios")):
        shutil.copy(ROOT / "schemas/examples" / name, project.folders[folder] / name)
    status, output = project.do(
        "--profile", "own-model", "up", "--exit-code-from", "dynamics",
        OWN="kite.py:Kite", SCENARIO="/scenarios/kite.toml", END="0.2",
    )  # fmt: skip
    assert status == 0, output
    log = open_log(project.folder() / "log.mcap")
    scenario, model = (project.folders["scenarios"] / "kite.toml", project.folders["models"] / "kite.py")
    linkwind(
        "run", str(scenario), "--set=time.end=0.2", f"--model={model}:Kite", "--out", str(tmp_path / "out")
    )
    outside = open_log(tmp_path / "out/log.mcap").trajectory()
    # Not to the bit: the kite is numpy's arithmetic, whose libraries are not the same in the image.
    np.testing.assert_allclose(log.trajectory().position, outside.position, rtol=0, atol=1e-9)
    assert [provider["model"] for provider in json.loads(log.scenario_json)["providers"]] == ["python"]


def test_aero_stays_for_the_next_run(project: Project) -> None:
    """As a machine with a standing aero service is used: dynamics come and go."""
    assert project.do("up", "--detach", "aero", END="0.05")[0] == 0
    for _ in range(2):
        status, output = project.do("run", "--rm", "--use-aliases", "dynamics", END="0.05")
        assert status == 0, output
    assert docker("inspect", "--format", "{{.State.Running}}", project.container("aero")) == "true"


@pytest.mark.parametrize(
    ("settings", "error"),
    [
        ({"SCENARIO": "nonsense"}, "nonsense: expected a file or one of andrews"),
        ({"STEP": "fast"}, 'coupling.step: expected a number [s]; got "fast"'),
    ],
    ids=["scenario", "step"],
)
def test_bad_input_is_the_status_of_the_run(project: Project, settings: dict[str, str], error: str) -> None:
    status, output = project.up(**settings)
    assert status == 3
    assert error in output


def test_killed_aero_fails_a_run_that_does_not_wait_for_it(project: Project) -> None:
    settings = {"END": "1000", "RECOVERY": "0"}
    up = project.start("up", "--exit-code-from", "dynamics", **settings)
    project.await_steps()
    docker("kill", project.container("aero"))
    assert up.wait(PATIENCE) == 4
    assert '"aero" was lost at step ' in project.do("logs", "dynamics")[1]
    log = open_log(project.folder() / "log.mcap")
    assert not log.complete
    assert log.damage is None
    assert "LostError" in str(log.error)
    assert (project.folder() / "report.html").exists()


def test_containers_are_apart_and_nobody_is_root(project: Project) -> None:
    os.chown(project.folders["runs"], NOBODY, NOBODY)
    up = project.start("up", "--exit-code-from", "dynamics", END="1000")
    project.await_steps()
    names = [project.container(service) for service in ("dynamics", "aero")]
    # Results belong to the owner of the folder; the aero side is the user of the image.
    assert [users(name) for name in names] == [{NOBODY}, {1000}]
    assert project.folder().stat().st_uid == NOBODY
    for name in names:
        host = docker("inspect", "--format", "{{json .HostConfig}}", name)
        assert f'"NetworkMode":"{project.name}_bus"' in host
        assert '"IpcMode":"private"' in host
        assert '"ReadonlyRootfs":true' in host
        deadline = time.monotonic() + PATIENCE
        while docker("inspect", "--format", "{{.State.Health.Status}}", name) != "healthy":
            assert time.monotonic() < deadline
            time.sleep(0.2)
    places = "{{range .Mounts}}{{.Destination}} {{end}}"
    mounts = [sorted(docker("inspect", "--format", places, name).split()) for name in names]
    assert mounts == [["/scenarios", "/work/runs"], []]
    up.send_signal(signal.SIGINT)
    up.communicate(timeout=PATIENCE)
    codes = [docker("inspect", "--format", "{{.State.ExitCode}}", name) for name in names]
    # Interrupted, not killed after the grace period; the dynamics may hear of the aero side's end first.
    assert codes in (["130", "130"], ["4", "130"])
    log = open_log(project.folder() / "log.mcap")
    assert not log.complete
    assert log.damage is None


def test_folder_that_cannot_be_written_is_named(project: Project) -> None:
    os.chown(project.folders["runs"], NOBODY, NOBODY)
    status, output = project.up(USER="1000:1000")
    assert status == 3
    assert "runs: not writable by user 1000" in output
