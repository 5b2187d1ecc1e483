"""The fluid on a lattice: cells per second against what memory allows, and a step against OpenFOAM's.

- A step of a lattice with fringe and force, on one thread, against a loop that copies the same bytes, nine
  floats read and nine written per cell (``copy_planes.c``), in rounds that take turns; the median of the
  rounds' ratios counts. It may be above 1: one thread steps a lattice in a single memory. One size is that of
  the paper's case, the other is far outside of the caches. There ``memcpy`` is faster than any loop, because
  it writes past the caches; that row has no target.
- The same number of cells in icoFoam (``openfoam_case.py``), on one thread, processor time per step. With the
  lattice's own time step, and with eight times as long a one, per time that passes in the flow: an implicit
  solver may take it.

Run with ``python -m tests.benchmarks flow``.
"""

from __future__ import annotations

import ctypes
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from linkwind.native.fluid import shear_rate
from linkwind.native.lattice import Lattice
from tests.benchmarks import openfoam_case
from tests.fmu.c_model import build_hook

PAPER, LARGE = (512, 448), (2048, 2048)
ROUNDS, ROUND_CELLS = 9, 2e7
TARGET = 0.6
OPENFOAM_STEPS = 12

Row = dict[str, Any]


def row(case: str, quantity: str, value: float | None, reference: float | None, least: float | None) -> Row:
    """Return a row; ``least`` is the smallest ratio that meets the target."""
    ratio = None if value is None or reference is None else value / reference
    ok = None if least is None or ratio is None else ratio >= least
    return {
        "case": f"lattice {case}",
        "quantity": quantity,
        "value": value,
        "reference": reference,
        "ratio": ratio,
        "ok": ok,
    }


def lattice(size: tuple[int, int], threads: int = 1) -> Lattice:
    """Return a lattice in a stream, with a force in a tenth of its rows, as bodies have it."""
    nx, ny = size
    made = Lattice(nx, ny, shear_rate=shear_rate(1e-3), stream=(0.08, 0.0), threads=threads)
    made.force[:, ny // 2 : ny // 2 + ny // 10, nx // 3 : nx // 2] = 1e-6
    made.force_rows = (ny // 2, ny // 2 + ny // 10)
    return made


def copies(folder: Path, name: str, directions: int, cells: int) -> dict[str, Callable[[], object]]:
    """Return copies of what a step moves: by a plain loop, compiled for this processor, and by memcpy."""
    file, source, hook = folder / "copy.so", Path(__file__).with_name(f"{name}.c"), build_hook()
    command = [*hook.compiler(), *hook.FLAGS, "-O3", "-march=native", "-fvisibility=default", "-shared"]
    subprocess.run([*command, "-o", str(file), str(source)], check=True)
    loop = getattr(ctypes.CDLL(str(file)), name)
    loop.argtypes, loop.restype = [ctypes.c_int64, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p], None
    plane = -(-cells // 16) * 16 + 112  # as in a lattice
    memory = np.ones((2, directions * plane), dtype=np.float32)  # zeros never written lie in a single page
    at = [int(half.__array_interface__["data"][0]) for half in memory]
    return {"copy": lambda: loop(cells, plane, *at), "memcpy": lambda: np.copyto(memory[1], memory[0])}


def rounds(timed: dict[str, Callable[[], object]], cells: int) -> dict[str, list[float]]:
    """Return cells per second [millions] of each, round by round."""
    count = max(3, int(ROUND_CELLS / cells))
    rates: dict[str, list[float]] = {name: [] for name in timed}
    for _ in range(ROUNDS):
        for name, once in timed.items():
            start = time.perf_counter()
            for _ in range(count):
                once()
            rates[name].append(1e-6 * cells * count / (time.perf_counter() - start))
    return rates


def paired(case: str, quantity: str, ours: list[float], theirs: list[float], least: float | None) -> Row:
    """Return a row with the median rate, and the median of the ratios as such."""
    ratio = statistics.median(a / b for a, b in zip(ours, theirs, strict=True))
    value = statistics.median(ours)
    return row(case, quantity, value, value / ratio, least)


def against_copies() -> list[Row]:
    """Return rows of the step against the copies, and of two threads against one."""
    rows = []
    for size in (PAPER, LARGE):
        one, two, case = lattice(size), lattice(size, 2), "{} x {}".format(*size)
        with tempfile.TemporaryDirectory() as folder:
            cells = size[0] * size[1]
            timed = copies(Path(folder), "copy_planes", 9, cells) | {"one": one.step, "two": two.step}
            rates = rounds(timed, cells)
        rows += [
            paired(case, "Mcells/s / plain copy, at least 0.6", rates["one"], rates["copy"], TARGET),
            paired(case, "Mcells/s / memcpy", rates["one"], rates["memcpy"], None),
            paired(f"{case}, two threads", "Mcells/s / one thread", rates["two"], rates["one"], None),
        ]
    return rows


def call() -> Row:
    """Return a row of a lattice of a few cells: what remains is the call from Python."""
    small = Lattice(16, 10, shear_rate=1.9, fringe=1)
    rate = statistics.median(rounds({"step": small.step}, 1600)["step"])
    return row("16 x 10", "us a step, called from Python", 1600 / rate, None, None)


def against_openfoam() -> list[Row]:
    """Return rows against icoFoam; the value is left open, with the reason, where it is not installed."""
    case = "{} x {}".format(*PAPER)
    reason = openfoam_case.missing()
    if reason:
        return [row(case, f"steps/s / OpenFOAM icoFoam: {reason}", None, None, None)]
    cells, rows = PAPER[0] * PAPER[1], []
    for step in (1, 8):
        with tempfile.TemporaryDirectory() as folder:
            openfoam_case.write(Path(folder), *PAPER, OPENFOAM_STEPS, step)
            seconds = statistics.median(openfoam_case.run(Path(folder)))
        ours = 1e6 * statistics.median(rounds({"one": lattice(PAPER).step}, cells)["one"]) / cells
        courant = (openfoam_case.SPEED + openfoam_case.VORTEX) * step
        quantity = f"steps/s / OpenFOAM icoFoam, Courant number {courant:.1f}"
        rows.append(
            row(case, quantity if step == 1 else f"{quantity}, per flow time", ours, step / seconds, 1.0)
        )
    return rows


def main() -> list[Row]:
    """Return all rows."""
    return [*against_copies(), call(), *against_openfoam()]


if __name__ == "__main__":
    for line in main():
        print(line)
