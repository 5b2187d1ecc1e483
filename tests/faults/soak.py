"""A long run with flat memory, files and threads on both sides: ``python -m tests.faults.soak [SECONDS]``."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from linkwind.log.reader import open_log
from tests.faults.programs import Programs

STEPS = 1_000_000
WARM = 0.2  # share of the steps, or of the time, after which nothing may grow
STEP_BYTES = 2170  # of the log
POOL = 2  # threads that zenoh may have more or less of at a time
LOOK = 1.5  # s between two looks; meanwhile the log grows
INDEX = 10  # bytes that the log's index holds in memory for each step of the dynamics


@dataclass
class Use:
    """What a process holds."""

    memory: int  # bytes, resident
    files: int
    threads: int


def use(pid: int) -> Use:
    """Look at a process."""
    memory = int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return Use(memory, len(os.listdir(f"/proc/{pid}/fd")), len(os.listdir(f"/proc/{pid}/task")))


def main(seconds: float) -> int:
    """Run a million steps, or as many as there is time for; print what both sides held."""
    with tempfile.TemporaryDirectory() as folder:
        programs = Programs(Path(folder))
        try:
            dynamics = programs.dynamics(f"time.end={STEPS // 1000}")
            sides = {"dynamics": dynamics, "aero": programs.aero()}
            programs.await_steps()
            began, before, after, seen, size = time.monotonic(), {}, {}, {}, 0
            while dynamics.poll() is None and (passed := time.monotonic() - began) < seconds:
                size, last = programs.log().stat().st_size, size
                if not before and max(passed / seconds, size / (STEPS * STEP_BYTES)) > WARM:
                    before = {name: use(process.pid) for name, process in sides.items()}
                    first = size
                if before and size > last:  # it went on after that look
                    after = seen
                seen = {name: use(process.pid) for name, process in sides.items()}
                time.sleep(LOOK)
            dynamics.send_signal(signal.SIGINT)
            _, said = dynamics.communicate()
            assert dynamics.returncode in (0, 130), said
            log = open_log(programs.log())
            warm = round(log.steps * first / programs.log().stat().st_size)
            steps = log.steps - warm
            print(f"{log.steps:,} steps; what was held after {warm:,}, and at the end")
            flat = True
            for name, start in before.items():
                end = after[name]
                more = end.memory - start.memory
                allowed = 2e6 + (INDEX * steps if name == "dynamics" else 0.0)
                good = more < allowed and end.files <= start.files and end.threads <= start.threads + POOL
                flat = flat and good
                memory = f"memory {start.memory / 1e6:.1f} → {end.memory / 1e6:.1f} MB"
                files = f"files {start.files} → {end.files}, threads {start.threads} → {end.threads}"
                print(f"{name:>9}  {memory}, {files}  {'flat' if good else 'GROWS'}")
        finally:
            programs.end()
    return int(not flat)


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0))
