"""Every command that waits for somebody ends at once when it is told to, with nothing left behind.

The ones that step, with their children and logs, are in test_processes.py.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from linkwind.bus.zenoh import loopback_endpoint
from linkwind.runs.run import run
from linkwind.scenario import load

PATIENCE = 30.0  # s for a machine under load
WITHIN = 2.0  # s; all of them at the same time

WAITING = {  # the command, and what it says when it is ready
    "dynamics": (["dynamics", "two_link", "--listen", "{}", "--out", "out"], "waiting for aero"),
    "aero": (["aero", "--connect", "{}"], "waiting for a dynamics"),
    "aero that stays": (["aero", "--stay", "--connect", "{}"], "waiting for a dynamics"),
    "router": (["router", "--listen", "{}"], "passing messages on"),
    "replay": (["replay", "log/log.mcap", "--listen", "{}"], "waiting at"),
}


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT], ids=["SIGTERM", "Ctrl-C"])
def test_commands_that_wait_end_within_two_seconds(number: signal.Signals, tmp_path: Path) -> None:
    run(load("two_link", ["time.end=0.01", "bus.transport=inprocess"]), tmp_path / "log", lambda step: None)
    processes = {}
    try:
        for name, (command, _) in WAITING.items():
            arguments = [part.format(loopback_endpoint()) for part in command]
            processes[name] = subprocess.Popen(
                [sys.executable, "-u", "-m", "linkwind", *arguments],
                cwd=tmp_path,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
            )
        for name, process in processes.items():
            assert process.stdout is not None
            assert WAITING[name][1] in process.stdout.readline(), name
        time.sleep(0.5)  # they are in the midst of waiting, not on their way there
        began = time.monotonic()
        for process in processes.values():
            process.send_signal(number)
        said = {name: process.communicate(timeout=PATIENCE)[0] for name, process in processes.items()}
        took = time.monotonic() - began
    finally:
        for process in processes.values():
            process.kill()
            process.communicate()
    assert {name: process.returncode for name, process in processes.items()} == dict.fromkeys(WAITING, 130)
    assert not [text for text in said.values() if "Traceback" in text]
    assert took < WITHIN + 3.0  # the dynamics writes its report in this time
    assert "stopped at step" in said["dynamics"]
