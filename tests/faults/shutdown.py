"""Every command, brought to where it works or waits, and then told to stop."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import time
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from linkwind.log.reader import open_log
from tests.faults.programs import PATIENCE, Programs
from tests.faults.truth import truthful
from tests.fmi_host.foreign import fmu
from tests.fmi_host.test_matrix import DRAG, WHEN

Process = subprocess.Popen[str]
LONG = "--set=time.end=1000"
PATIENT = "--set=coupling.timeout=60"
HANGING = """
[time]
end = 1.0
[[bodies]]
name = "wing"
mass = 1.0
inertia = 1.0
[coupling]
timeout = 1000.0
[aero]
model = "fmu"
[aero.fmu]
timeout = 1000.0
"""
WAYS = ("SIGTERM", "Ctrl-C", "terminal")  # a terminal gives Ctrl-C to the children as well
WITHIN = 2.0  # s


class Stage(Programs):
    """Where a command is brought to the point at which it is stopped."""

    deaf: socket.socket | None = None

    def end(self) -> None:
        super().end()
        if self.deaf is not None:
            self.deaf.close()

    def command(self, *arguments: str) -> Process:
        """Start a command whose words can be waited for."""
        return self.start(*arguments, said=self.folder / f"said{len(self._started)}.txt")

    def said(self, process: Process) -> str:
        """Return what a command has said so far."""
        return (self.folder / f"said{self._started.index(process)}.txt").read_text(errors="replace")

    def until(self, what: str, done: Callable[[], bool]) -> None:
        """Wait for something."""
        deadline = time.monotonic() + PATIENCE
        while not done():
            every = [self.said(process) for process in self._started]
            assert time.monotonic() < deadline, f"{what}: not within {PATIENCE} s: {every}"
            assert all(process.poll() is None for process in self._started), f"{what}: {every}"
            time.sleep(0.001)

    def hears(self, process: Process, words: str) -> Process:
        """Wait until a command has said so; return it."""
        self.until(words, lambda: words in self.said(process))
        return process

    def steps(self, process: Process) -> Process:
        """Wait until the run goes on; return the command."""
        goal = 200_000 + (self.log().stat().st_size if self.log().exists() else 0)
        self.until("steps", lambda: self.log().exists() and self.log().stat().st_size > goal)
        return process

    def some_log(self, *settings: str) -> str:
        """Make a log; return its name."""
        options = [f"--set={each}" for each in ("bus.transport=inprocess", *(settings or ("time.end=0.05",)))]
        self.start("run", "two_link", "--out", "some", "--json", *options).communicate()
        self.forget_last()
        return "some/log.mcap"


def run(stage: Stage) -> Process:
    return stage.steps(stage.command("run", "two_link", "--out", "out", LONG, PATIENT))


def run_in_view(stage: Stage) -> Process:
    return stage.steps(stage.command("run", "two_link", "--out", "out", LONG, "--view", "--no-open"))


def run_in_one_process(stage: Stage) -> Process:
    return stage.steps(
        stage.command("run", "two_link", "--out", "out", LONG, "--set=bus.transport=inprocess")
    )


def dynamics_waiting(stage: Stage) -> Process:
    process = stage.command("dynamics", "two_link", "--listen", stage.endpoint, "--out", "out")
    stage.until("its log", stage.log().exists)
    time.sleep(0.3)
    return process


def _dynamics(stage: Stage, scenario: str = "two_link", *options: str) -> Process:
    command = ["dynamics", scenario, "--listen", stage.endpoint, "--out", "out", "--json", LONG, PATIENT]
    return stage.command(*command, *options)


def _aero(stage: Stage, *options: str) -> Process:
    return stage.command("aero", "--connect", stage.endpoint, *options)


def dynamics(stage: Stage) -> Process:
    process = _dynamics(stage)
    _aero(stage)
    return stage.steps(process)


def aero_waiting(stage: Stage) -> Process:
    return stage.hears(_aero(stage), "waiting for a dynamics")


def aero_at_a_deaf_port(stage: Stage) -> Process:
    """Somebody listens there who never answers."""
    stage.deaf = socket.create_server(("127.0.0.1", int(stage.endpoint.rpartition(":")[2])))
    process = stage.hears(_aero(stage), "waiting for a dynamics")
    time.sleep(0.5)
    return process


def aero(stage: Stage) -> Process:
    _dynamics(stage)
    return stage.steps(_aero(stage))


def aero_computing(stage: Stage) -> Process:
    """A communication step of many lattice steps on a fine lattice, some seconds of them."""
    fine = ["--set=aero.flow.cells=128", "--set=coupling.step=2e-3", "--set=coupling.timeout=1000"]
    _dynamics(stage, "two_link_flow", "--set=time.end=4", *fine)
    process = stage.hears(_aero(stage), "lattice step")
    time.sleep(1.0)
    return process


def aero_between_runs(stage: Stage) -> Process:
    process = _aero(stage, "--stay")
    stage.command("dynamics", "two_link", "--listen", stage.endpoint, "--out", "out", "--set=time.end=0.05")
    stage.forget_last()
    return stage.hears(process, "step 50 was the last")


def aero_staying(stage: Stage) -> Process:
    return stage.hears(_aero(stage, "--stay"), "waiting for a dynamics")


def force_fmu(stage: Stage) -> Process:
    made = ["fmu", "export", "two_link", "--part", "aero", "-o", "plate.fmu"]
    stage.start(*made).communicate()
    stage.forget_last()
    options = ["--force-fmu", "plate.fmu", "--out", "out", LONG, PATIENT]
    return stage.steps(stage.command("run", "two_link", *options))


def force_fmu_hanging(stage: Stage) -> Process:
    marker = f'fclose(fopen("{stage.folder}/hangs", "w")), sleep(1000), OK'
    fmu(stage.folder, replace(DRAG, code=DRAG.code + "\n" + WHEN.format(marker)))
    (stage.folder / "hangs.toml").write_text(HANGING)
    process = stage.command("run", "hangs.toml", "--force-fmu", "foreign.fmu", "--out", "out")
    stage.until("the FMU hangs", (stage.folder / "hangs").exists)
    return process


def replay_waiting(stage: Stage) -> Process:
    return stage.hears(stage.command("replay", stage.some_log(), "--listen", stage.endpoint), "waiting at")


def replay(stage: Stage) -> Process:
    log = stage.some_log("time.end=1.2")
    process = stage.command("replay", log, "--listen", stage.endpoint, "--rate", "0.001")
    stage.hears(stage.command("record", "--connect", stage.endpoint, "--out", "heard"), "listening to")
    time.sleep(0.5)
    return process


def record_waiting(stage: Stage) -> Process:
    process = stage.command("record", "--connect", stage.endpoint)
    time.sleep(1.5)
    return process


def record(stage: Stage) -> Process:
    _dynamics(stage)
    _aero(stage)
    process = stage.command("record", "--connect", stage.endpoint, "--out", "heard")
    heard = stage.folder / "heard" / "log.mcap"
    stage.hears(process, "listening to")
    stage.until("messages", lambda: heard.exists() and heard.stat().st_size > 100_000)
    return process


def view(stage: Stage) -> Process:
    process = stage.hears(stage.command("view", stage.some_log(), "--no-open"), "ends)")
    with urllib.request.urlopen(stage.said(process).split()[0], timeout=PATIENCE):
        return process


def verify(stage: Stage) -> Process:
    # Of a scheme whose steps cannot be taken many at a time: there has to be something left to stop.
    process = stage.command("verify", stage.some_log("coupling.scheme=explicit", "time.end=80"))
    time.sleep(1.2)
    return process


def resume(stage: Stage) -> Process:
    stage.some_log("time.end=0.5", "log.required=true")
    return stage.steps(
        stage.command("resume", "some/log.mcap", "--from-step", "300", "--out", "out", LONG, PATIENT)
    )


def router(stage: Stage) -> Process:
    return stage.hears(stage.command("router", "--listen", stage.endpoint), "passing messages on")


def validate(stage: Stage) -> Process:
    process = stage.command("validate", "flow", "--short", "--out", "validation")
    time.sleep(2.0)
    return process


@dataclass(frozen=True)
class Command:
    """A command to be stopped.

    Attributes:
        start: starts it and returns it at the moment at which it is to be stopped.
        log: folder of the log that it writes; empty for none.
        verified: whether its forces can be made again from the log alone.
    """

    start: Callable[[Stage], Process]
    log: str = ""
    verified: bool = True


COMMANDS = {
    "run": Command(run, "out"),
    "run --view": Command(run_in_view, "out"),
    "run, in one process": Command(run_in_one_process, "out"),
    "run --force-fmu": Command(force_fmu, "out", verified=False),
    "run --force-fmu, hanging": Command(force_fmu_hanging, "out", verified=False),
    "dynamics, waiting": Command(dynamics_waiting, "out"),
    "dynamics": Command(dynamics, "out"),
    "aero, waiting": Command(aero_waiting),
    "aero, at a deaf port": Command(aero_at_a_deaf_port),
    "aero": Command(aero),
    "aero, in a long step": Command(aero_computing),
    "aero --stay, waiting": Command(aero_staying),
    "aero --stay, between runs": Command(aero_between_runs),
    "replay, waiting": Command(replay_waiting),
    "replay": Command(replay),
    "record, waiting": Command(record_waiting),
    "record": Command(record, "heard"),
    "resume": Command(resume, "out"),
    "verify": Command(verify),
    "view": Command(view),
    "router": Command(router),
    "validate flow": Command(validate),
}


def stop(command: Command, way: str, folder: Path) -> float:
    """Bring a command to its point and stop it; return how long that took [s]."""
    stage = Stage(folder)
    try:
        process = command.start(stage)
        began = time.monotonic()
        if way == "terminal":
            os.killpg(process.pid, signal.SIGINT)
        else:
            process.send_signal(signal.SIGINT if way == "Ctrl-C" else signal.SIGTERM)
        process.wait(PATIENCE)
        took = time.monotonic() - began
        while (left := stage.left_by(process)) and time.monotonic() < began + WITHIN:
            time.sleep(0.01)  # what is killed takes a moment
        said = stage.said(process)
        assert process.returncode == 130, f"status {process.returncode}: {said}"
        assert "Traceback" not in said, said
        assert not left, left
        assert took < WITHIN, f"{way}: expected an end within {WITHIN:g} s; got {took:.2f} s"
        if command.log:
            log = folder / command.log / "log.mcap"
            assert open_log(log).damage is None, open_log(log).damage
            truthful(log, from_recorded_wrenches=not command.verified)
        return took
    finally:
        stage.end()
