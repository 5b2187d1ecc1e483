"""The paper's case in a resolved flow: two links at 48 cells each, 512 × 448 cells, 1.2 s in 12,000 steps.

- Processor time of the whole run in one process and one thread: both sides, messages, log with 48 pictures,
  no report. At most 12 s.
- Of the aero side, the share of time that is not in the lattice's kernel. At most a quarter.
- From the command to the end of its first step, report and all. At most 3 s.

Run with ``python -m tests.benchmarks paper``.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from linkwind import report
from linkwind.native.lattice import Lattice
from linkwind.protocol import ProviderSession
from linkwind.runs.run import run
from linkwind.scenario import load

SCENARIO = "two_link_flow"
CPU_S, OUTSIDE, FIRST_STEP_S = 12.0, 0.25, 3.0

Row = dict[str, Any]


def row(quantity: str, value: float, most: float) -> Row:
    """Return a row; the reference is the target."""
    ratio = value / most
    return {
        "case": SCENARIO,
        "quantity": quantity,
        "value": value,
        "reference": most,
        "ratio": ratio,
        "ok": ratio <= 1.0,
    }


@contextmanager
def timed(owner: type, name: str) -> Iterator[list[float]]:
    """Add up the processor time in a method, [s] as the only item of a list."""
    method: Callable[..., Any] = getattr(owner, name)
    total = [0.0]

    def wrapper(*args: Any, **kwargs: Any) -> Any:
        start = time.process_time()
        try:
            return method(*args, **kwargs)
        finally:
            total[0] += time.process_time() - start

    setattr(owner, name, wrapper)
    try:
        yield total
    finally:
        setattr(owner, name, method)


@contextmanager
def without_report() -> Iterator[None]:
    """Leave the report out of a run."""
    write, report.write_report = report.write_report, lambda log, out: None
    try:
        yield
    finally:
        report.write_report = write


def whole_case() -> list[Row]:
    """Return rows of the whole case in one process."""
    scenario = load(SCENARIO, ["bus.transport=inprocess"])
    with (
        tempfile.TemporaryDirectory() as folder,
        timed(ProviderSession, "answer") as aero,
        timed(Lattice, "step") as kernel,
        without_report(),
    ):
        start = time.process_time()
        run(scenario, Path(folder) / "run", lambda step: None)
        used = time.process_time() - start
    print(f"kernel {kernel[0]:.2f} s, aero side {aero[0]:.2f} s, all {used:.2f} s", file=sys.stderr)
    return [
        row("CPU s of 12,000 steps", used, CPU_S),
        row("share of the aero side outside of the kernel", 1.0 - kernel[0] / aero[0], OUTSIDE),
    ]


def first_step() -> Row:
    """Return a row of the wall clock of a run of one step."""
    walls = []
    for _ in range(3):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "linkwind", "run", SCENARIO, "--set", "time.end=1e-4"]
            start = time.perf_counter()
            subprocess.run([*command, "--out", f"{folder}/run"], check=True, capture_output=True)
            walls.append(time.perf_counter() - start)
    return row("s from the command to the end of its only step", statistics.median(walls), FIRST_STEP_S)


def main() -> list[Row]:
    """Return all rows."""
    return [*whole_case(), first_step()]
