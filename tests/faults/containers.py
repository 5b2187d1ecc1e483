"""A container of a run by compose is killed, started again by Docker, and the run ends in the same bits."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path
from random import Random

from linkwind.log.reader import open_log
from linkwind.runs.run import run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load
from tests.docker.compose import PATIENCE, Project, docker

IMAGE = os.environ.get("LINKWIND_IMAGE", "linkwind")
END = "60"  # s: so long that there is much left when the kill comes, which takes Docker seconds


def reason() -> str:
    """Return why there can be no containers here; empty if there can be."""
    for command, why in (
        (["docker", "info"], "Docker does not run here"),
        (["docker", "image", "inspect", IMAGE], f"no image {IMAGE}: docker compose build makes it"),
    ):
        try:
            if subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False).returncode:
                return why
        except OSError:
            return why
    return ""


def killed(folder: Path, chance: Random) -> float:
    """Kill a container at a random moment; return how long it took until the log had more than before [s]."""
    whole = run(
        load("two_link", [f"time.end={END}", "bus.transport=inprocess"]), folder / "whole", lambda step: None
    )
    project = Project(folder / "compose", IMAGE)
    try:
        status, said = project.do("up", "--detach", END=END, RESTART="on-failure:5")
        assert status == 0, said
        project.await_steps(int(chance.uniform(0.05, 0.3) * whole.log.stat().st_size))
        within = _hit(project, chance.choice(["dynamics", "aero"]))
        status = project.await_end()
        assert status == 0, project.do("logs", "dynamics")[1]
        log = project.folder() / "log.mcap"
        assert open_log(log).final_state_sha256 == whole.result.final_state_sha256
        assert verify(*scenario_of(log)).identical
        return within
    finally:
        project.end()


def _hit(project: Project, service: str) -> float:
    """Kill a container; return how long it took until the run went on [s], 0 if it was over before."""
    if _is_over(project):
        return 0.0
    project.kill(service)
    log = project.folder() / "log.mcap"
    began, seen = time.monotonic(), log.stat().st_size
    while log.stat().st_size <= seen and not _is_over(project):
        assert time.monotonic() < began + PATIENCE, project.do("logs")[1]
        time.sleep(0.1)
    return time.monotonic() - began


def _is_over(project: Project) -> bool:
    said = docker(
        "inspect", "--format", "{{.State.Status}} {{.State.ExitCode}}", project.container("dynamics")
    )
    return said == "exited 0"
