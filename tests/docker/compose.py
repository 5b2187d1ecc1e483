"""Docker as the tests use it: commands, and one compose project after the other."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import uuid
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
IMAGE = "linkwind-under-test"
PATIENCE = 120.0  # s for a machine under load
# Not by chance: these build an image, which takes minutes, and need Docker. tests/docker/run.sh has it all.
REASON = "" if "LINKWIND_TEST_DOCKER" in os.environ else "builds an image: run tests/docker/run.sh"
COMPOSE = os.environ.get("COMPOSE", "docker-compose")
PROFILES = ("force-fmu", "own-model", "observe", "replay", "view")
NOBODY = 4321  # a user that neither this machine nor the image knows


def docker(*arguments: str) -> str:
    """Return what a docker command prints, without its last line break."""
    done = subprocess.run(
        ["docker", *arguments], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert done.returncode == 0, f"docker {' '.join(arguments)}\n{done.stdout}{done.stderr}"
    return done.stdout.strip()


class Project:
    """One compose project: its containers, its network, its folders."""

    def __init__(self, folder: Path, image: str, *more: str) -> None:
        self._files = [part for name in ("compose.yaml", *more) for part in ("-f", f"docker/{name}")]
        self.name = f"lw{uuid.uuid4().hex[:8]}"
        self.folders = {name: folder / name for name in ("runs", "scenarios", "fmus", "models")}
        for path in self.folders.values():
            path.mkdir(parents=True)
            for above in (path, *path.parents[:3]):  # pytest makes its folders for its own user alone
                above.chmod(0o755)
        self._settings = {f"LINKWIND_{name.upper()}": str(path) for name, path in self.folders.items()}
        self._settings["LINKWIND_IMAGE"] = image
        self._started: list[subprocess.Popen[str]] = []
        self._seen = 0

    def start(self, *arguments: str, **settings: str) -> subprocess.Popen[str]:
        """Start ``docker compose ARGUMENTS`` with LINKWIND_… settings."""
        given = {f"LINKWIND_{name}": value for name, value in settings.items()}
        process = subprocess.Popen(
            [COMPOSE, *self._files, "-p", self.name, "--ansi", "never", *arguments],
            cwd=ROOT,
            env=os.environ | self._settings | given,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._started.append(process)
        return process

    def do(self, *arguments: str, **settings: str) -> tuple[int, str]:
        """Return exit status and output of ``docker compose ARGUMENTS``."""
        process = self.start(*arguments, **settings)
        output, _ = process.communicate(timeout=PATIENCE)
        return process.returncode, output

    def up(self, *services: str, **settings: str) -> tuple[int, str]:
        """Return status and output of a run, the way the README tells to do it."""
        return self.do("up", "--exit-code-from", "dynamics", *services, **settings)

    def container(self, service: str) -> str:
        """Return the id of the container of a service."""
        labels = {"project": self.name, "service": service}
        filters = [f"--filter=label=com.docker.compose.{key}={value}" for key, value in labels.items()]
        return docker("ps", "-a", "-q", *filters)

    def kill(self, service: str, *, by_docker: bool = False) -> None:
        """Kill the first process of a container, from outside or by Docker, for which that is a wish."""
        container = self.container(service)
        if by_docker:
            docker("kill", container)
        else:
            pid = int(docker("inspect", "--format", "{{.State.Pid}}", container))
            assert pid > 0, f"{service} does not run"
            os.kill(pid, signal.SIGKILL)
        self._seen = max(log.stat().st_size for log in self._logs())

    def await_end(self) -> int:
        """Return the status of the dynamics as soon as it is not started again."""
        deadline = time.monotonic() + PATIENCE
        while True:
            said = docker("inspect", "--format", "{{json .State}}", self.container("dynamics"))
            state = json.loads(said)
            if state["Status"] == "exited":
                return int(state["ExitCode"])
            assert time.monotonic() < deadline, self.do("logs")[1]
            time.sleep(0.1)

    def folder(self) -> Path:
        """Return the results of the only run."""
        (folder,) = self.folders["runs"].iterdir()
        return folder

    def await_steps(self, more: int = 1_000_000) -> None:
        """Return as soon as the log has so many more bytes, than at the last kill if there was one."""
        deadline = time.monotonic() + PATIENCE
        goal = self._seen + more
        while max((log.stat().st_size for log in self._logs()), default=0) < goal:
            assert time.monotonic() < deadline, f"the run did not get under way: {self.do('logs')[1]}"
            ended = self._started[-1].poll()
            assert ended in (None, 0), self._started[-1].communicate()[0]
            time.sleep(0.02)

    def _logs(self) -> list[Path]:
        return list(self.folders["runs"].glob("*/log.mcap"))

    def leftovers(self) -> list[str]:
        """Return the containers, networks and volumes of the project that are still there."""
        of_it = ("-q", "--filter", f"label=com.docker.compose.project={self.name}")
        kinds = ["ps", "-a"], ["network", "ls"], ["volume", "ls"]
        return [left for kind in kinds for left in docker(*kind, *of_it).split()]

    def end(self) -> None:
        """Remove everything, whatever happened."""
        for process in self._started:
            if process.poll() is None:
                process.kill()
            process.communicate()
        profiles = [part for name in PROFILES for part in ("--profile", name)]
        self.do(*profiles, "down", "--remove-orphans", "--volumes", "--timeout", "5")


def linkwind(*arguments: str) -> str:
    """Return what a linkwind command prints outside of any container."""
    program = [sys.executable, "-m", "linkwind", *arguments]
    done = subprocess.run(program, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def digest_outside(folder: Path, *arguments: str) -> str:
    """Return the final state of a run outside of any container."""
    return str(json.loads(linkwind("run", *arguments, "--out", str(folder), "--json"))["final_state_sha256"])


def users(container: str) -> set[int]:
    """Return the numbers of the users of a container's processes."""
    numbers = re.findall(r"^\s*\d+\s+(\d+)", docker("top", container, "-o", "pid,uid"), re.MULTILINE)
    return {int(number) for number in numbers}
