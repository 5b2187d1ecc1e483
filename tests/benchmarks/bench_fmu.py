"""A communication step of the FMU of two_link against the core calls that it consists of.

Both are called from the same C program, in turn, the fastest of several rounds: ``fmi3DoStep`` with one
substep of rk4 on one side, four evaluations of the accelerations and the kinematics of the outputs on the
other. Run with ``python -m tests.benchmarks fmu``.
"""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path
from typing import Any

from linkwind.mechanism import build
from linkwind.scenario import load
from tests.fmu.c_model import Compiler, dynamics

STEPS = 5000
TARGET = 1.3


def measure() -> dict[str, float]:
    """Return nanoseconds a step of the core calls, of doStep, and of doStep with its forces and poses."""
    mechanism = build(load("two_link"))
    model = dynamics(mechanism.tables, mechanism.q0, mechanism.v0)
    with tempfile.TemporaryDirectory() as folder:
        compiler = Compiler(Path(folder), ("-D_POSIX_C_SOURCE=200809L",))
        program = compiler.program(model, 3, "two_link", Path(__file__).parent / "fmu_step.c")
        done = subprocess.run([program, str(STEPS)], capture_output=True, text=True, check=True)
    return dict(zip(("core", "doStep", "exchanged"), map(float, done.stdout.split()), strict=True))


def main() -> list[dict[str, Any]]:
    """Return one row for each kind of step; only doStep alone has a target."""
    times = measure()
    rows = (("fmi3DoStep", "doStep", TARGET), ("fmi3DoStep, forces set, poses read", "exchanged", None))
    return [
        {
            "case": f"FMU of two_link: {case}",
            "quantity": "us a step, to 4 evaluations and kinematics",
            "value": times[key] / 1e3,
            "reference": times["core"] / 1e3,
            "ratio": times[key] / times["core"],
            "ok": None if target is None else times[key] <= target * times["core"],
        }
        for case, key, target in rows
    ]
