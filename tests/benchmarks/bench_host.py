"""A step of a hosted FMU in a worker, against the same in-process and against FMPy's own calls, in turn.

The FMU is the plate of ``two_link``: 26 numbers in, 84 out. Run with ``python -m tests.benchmarks host``.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi2 import FMU2Slave

from linkwind.fmi.export import export
from linkwind.fmi.host import description, mapping
from linkwind.fmi.host.instances import Instances
from linkwind.scenario import load
from linkwind.scenario.providers import FmuModel

STEPS = 4000
ROUNDS = 7
STEP_NS = 1_000_000
TARGET = 25.0  # µs that a worker may add to a step


def hosted(file: Path, isolation: Any, *, twice: bool = False) -> float:
    """Return the median wall clock of a step of the host [µs], or of one that is done again."""
    read = description.read(file)
    settings = FmuModel(isolation=isolation)
    found = mapping.resolve(read, settings, ("link1", "link2"))
    instances = Instances(read, found, settings, STEP_NS, 10.0)
    try:
        instances.inputs[0, [3, 16]] = 1.0  # the quaternions' w
        instances.evaluate(0)

        def step(k: int) -> None:
            instances.evaluate(k * STEP_NS)
            if twice:
                instances.evaluate(k * STEP_NS, again=True)

        return _median(step)
    finally:
        instances.close()


def plain(file: Path) -> float:
    """Return the median wall clock of FMPy's setReal, doStep, getReal [µs]."""
    with tempfile.TemporaryDirectory() as folder:
        fmpy.extract(file, folder)
        read = fmpy.read_model_description(folder)
        fmu = FMU2Slave(
            guid=read.guid,
            unzipDirectory=folder,
            modelIdentifier=read.coSimulation.modelIdentifier,
            instanceName="x",
        )
        fmu.instantiate()
        fmu.setupExperiment()
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        inputs, outputs = (
            [v.valueReference for v in read.modelVariables if v.causality == kind]
            for kind in ("input", "output")
        )
        values = [
            1.0 if v.name.endswith("orientation[1]") else 0.0
            for v in read.modelVariables
            if v.causality == "input"
        ]

        def step(k: int) -> None:
            fmu.setReal(inputs, values)
            fmu.doStep((k - 1) / 1000, 1 / 1000)
            fmu.getReal(outputs)

        result = _median(step)
        fmu.terminate()
        fmu.freeInstance()
    return result


def _median(step: Any) -> float:
    took = []
    for k in range(1, STEPS + 1):
        start = time.perf_counter_ns()
        step(k)
        took.append(time.perf_counter_ns() - start)
    return statistics.median(took) / 1e3


def main() -> list[dict[str, object]]:
    """Measure in turn; the overhead is the median over the rounds."""
    with tempfile.TemporaryDirectory() as folder:
        file = export(load("two_link"), Path(folder) / "plate.fmu", part="aero").file
        rounds = [
            (
                hosted(file, "process"),
                hosted(file, "process", twice=True),
                hosted(file, "inprocess"),
                plain(file),
            )
            for _ in range(ROUNDS)
        ]
    worker, twice, inprocess, bare = (statistics.median(column) for column in zip(*rounds, strict=True))
    added = statistics.median(row[0] - row[2] for row in rounds)
    return [
        {
            "case": "hosted plate FMU, 26 in, 84 out, a step",
            "quantity": f"added by the worker [µs], at most {TARGET:g}",
            "value": added,
            "reference": TARGET,
            "ratio": added / TARGET,
            "ok": added <= TARGET,
        },
        _row("worker / in-process [µs]", worker, inprocess),
        _row("worker, the step done twice / once [µs]", twice, worker),
        _row("in-process / FMPy's plain loop [µs]", inprocess, bare),
    ]


def _row(quantity: str, value: float, reference: float) -> dict[str, object]:
    case = "hosted plate FMU, 26 in, 84 out, a step"
    return {
        "case": case,
        "quantity": quantity,
        "value": value,
        "reference": reference,
        "ratio": value / reference,
        "ok": None,
    }
