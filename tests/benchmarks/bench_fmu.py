"""The FMU of two_link: a communication step, the export, the file.

- From C: ``fmi3DoStep`` with one substep of rk4 against the core calls that it consists of, four evaluations
  of the accelerations and the kinematics of the outputs, called from the same program.
- From FMPy: set 12 inputs, doStep, read the poses, against a PythonFMU of the same equations in the same
  loop, the faster of one in plain Python and one with numpy (``slave_plain``, ``slave_numpy``). FMPy's own
  part of the loop is the same on both sides.
- ``linkwind fmu export``, from shell to prompt, and the size of a file with all platforms.

What is compared runs in turn; the fastest of several rounds counts. Run with
``python -m tests.benchmarks fmu``; what is not installed is left out.
"""

from __future__ import annotations

import importlib.util
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi2 import FMU2Slave

from linkwind.fmi.export import export
from linkwind.fmi.toolchain import has_zig
from linkwind.mechanism import build
from linkwind.scenario import load
from tests.fmu.c_model import Compiler, dynamics

STEPS = 5000  # from C
TARGET = 1.3
HERE = Path(__file__).parent

ROUNDS, LOOP_STEPS, STEP = 7, 600, 1e-3
PEER_TARGET = 1 / 40  # of PythonFMU's time
SAME = 1e-9  # between the trajectories [m, -]
EXPORTS, EXPORT_TARGET = 5, 2.0  # s
SIZE_TARGET = 350.0  # kB

Row = dict[str, Any]


def measure() -> dict[str, float]:
    """Return nanoseconds a step of the core calls, of doStep, and of doStep with its forces and poses."""
    mechanism = build(load("two_link"))
    model = dynamics(mechanism.tables, mechanism.q0, mechanism.v0)
    with tempfile.TemporaryDirectory() as folder:
        compiler = Compiler(Path(folder), ("-D_POSIX_C_SOURCE=200809L",))
        program = compiler.program(model, 3, "two_link", HERE / "fmu_step.c")
        done = subprocess.run([program, str(STEPS)], capture_output=True, text=True, check=True)
    return dict(zip(("core", "doStep", "exchanged"), map(float, done.stdout.split()), strict=True))


def row(case: str, quantity: str, value: float | None, reference: float, target: float | None) -> Row:
    """Return a row; ``target`` is the largest ratio that meets it."""
    ratio = None if value is None else value / reference
    ok = None if target is None or ratio is None else ratio <= target
    return {
        "case": f"FMU of two_link: {case}",
        "quantity": quantity,
        "value": value,
        "reference": reference,
        "ratio": ratio,
        "ok": ok,
    }


def from_c() -> list[Row]:
    """Return one row for each kind of step; only doStep alone has a target."""
    times = measure()
    rows = (("fmi3DoStep", "doStep", TARGET), ("fmi3DoStep, forces set, poses read", "exchanged", None))
    return [
        row(case, "us a step, to 4 evaluations and kinematics", times[key] / 1e3, times["core"] / 1e3, target)
        for case, key, target in rows
    ]


class Loop:
    """An FMU in FMPy's plain loop, with the forces of a step given by its number."""

    def __init__(self, file: Path, folder: Path, inputs: list[str], outputs: list[str]) -> None:
        fmpy.extract(file, folder)
        read = fmpy.read_model_description(folder)
        references = {v.name: v.valueReference for v in read.modelVariables}
        self.inputs, self.outputs = ([references[name] for name in names] for names in (inputs, outputs))
        self.fmu = FMU2Slave(
            guid=read.guid,
            unzipDirectory=str(folder),
            modelIdentifier=read.coSimulation.modelIdentifier,
            instanceName="x",
        )
        self.fmu.instantiate()
        self.fmu.setupExperiment()
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.step = 0
        self.poses: list[list[float]] = []

    def run(self, forces: list[list[float]]) -> tuple[float, float]:
        """Return µs a step: of the loop, and of doStep in it."""
        clock, stepping = time.perf_counter_ns, 0
        start = clock()
        for values in forces:
            self.fmu.setReal(self.inputs, values)
            before = clock()
            self.fmu.doStep(self.step * STEP, STEP)
            stepping += clock() - before
            self.poses.append(self.fmu.getReal(self.outputs))
            self.step += 1
        return (clock() - start) / 1e3 / len(forces), stepping / 1e3 / len(forces)

    def close(self) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()


def loops(folder: Path) -> dict[str, Loop]:
    """Return the FMUs to compare; each has 12 inputs and 14 outputs, in the same order."""
    from pythonfmu.builder import FmuBuilder

    sys.path.insert(0, str(HERE))  # where a slave finds the other
    try:
        theirs = {
            name: FmuBuilder.build_FMU(HERE / f"slave_{name}.py", folder, project_files=others)
            for name, others in (("plain", []), ("numpy", [HERE / "slave_plain.py"]))
        }
        from slave_plain import INPUTS, OUTPUTS
    finally:
        sys.path.remove(str(HERE))
    inputs = [f"link{body}.{kind}[{i}]" for body in (1, 2) for kind in "FT" for i in (1, 2, 3)]
    outputs = [
        f"link{body}.{kind}[{i}]"
        for body in (1, 2)
        for kind, size in (("r", 3), ("orientation", 4))
        for i in range(1, size + 1)
    ]
    ours = export(load("two_link"), folder / "ours.fmu").file
    return {"linkwind": Loop(ours, folder / "ours", inputs, outputs)} | {
        name: Loop(file, folder / name, INPUTS, OUTPUTS) for name, file in theirs.items()
    }


def forces(steps: range) -> list[list[float]]:
    """Return planar forces and torques on both bodies that carry them about and change from step to step."""
    return [
        [3 * math.sin(k / 50), 20.0, 0.0, 0.0, 0.0, 0.3, -1.0, 18 + math.cos(k / 30), 0.0, 0.0, 0.0, -0.2]
        for k in steps
    ]


def difference(ours: Loop, theirs: Loop) -> float:
    """Return the largest difference between the poses of two trajectories."""
    return max(math.dist(a, b) for a, b in zip(ours.poses, theirs.poses, strict=True))


def against_pythonfmu() -> list[Row]:
    """Return rows of the loop in FMPy; none if PythonFMU is not installed."""
    if importlib.util.find_spec("pythonfmu") is None:
        return []
    with tempfile.TemporaryDirectory() as folder:
        every = loops(Path(folder))
        best = dict.fromkeys(every, (math.inf, math.inf))
        for k in range(ROUNDS):
            values = forces(range(k * LOOP_STEPS, (k + 1) * LOOP_STEPS))
            for name, loop in every.items():
                whole, stepping = loop.run(values)
                best[name] = min(best[name][0], whole), min(best[name][1], stepping)
        ours, peers = every["linkwind"], [name for name in every if name != "linkwind"]
        apart = max(difference(ours, every[name]) for name in peers)
        for loop in every.values():
            loop.close()
    return [
        row("trajectory", "difference to PythonFMU / 1e-9", apart, SAME, 1.0),
        *_peer_rows(best, 0, "set 12, doStep, read 14", PEER_TARGET),
        *_peer_rows(best, 1, "doStep alone", None),
    ]


def _peer_rows(
    best: dict[str, tuple[float, float]], which: int, case: str, target: float | None
) -> list[Row]:
    """Return a row for each peer, the target for the fastest of them."""
    peers = sorted((name for name in best if name != "linkwind"), key=lambda name: best[name][which])
    return [
        row(
            f"{case}, FMPy",
            f"us / PythonFMU, {name}",
            best["linkwind"][which],
            best[name][which],
            target if name == peers[0] else None,
        )
        for name in peers
    ]


def exporting() -> list[Row]:
    """Return rows of time and size; the size is left open where zig is missing."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "two_link.fmu"
        command = [sys.executable, "-m", "linkwind", "fmu", "export", "two_link", "-o", str(out)]
        took = min(
            _seconds(lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL))
            for _ in range(EXPORTS)
        )
        size = export(load("two_link"), out, platforms=["all"]).bytes / 1e3 if has_zig() else None
    note = "" if has_zig() else "; needs ziglang"
    return [
        row(
            "export, host alone",
            f"s from shell to prompt, at most {EXPORT_TARGET:g}",
            took,
            EXPORT_TARGET,
            1.0,
        ),
        row("file, all platforms", f"kB, at most {SIZE_TARGET:g}{note}", size, SIZE_TARGET, 1.0),
    ]


def _seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def main() -> list[Row]:
    """Return the rows; peers that are not installed are left out."""
    return from_c() + against_pythonfmu() + exporting()
