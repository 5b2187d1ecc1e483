"""The fluid in space: cells per second against what memory allows.

A step of a lattice with fringe and force, on one thread, against a loop that copies the same bytes, 19 floats
read and 19 written per cell (``copy_volumes.c``), in rounds that take turns; the median of the rounds' ratios
counts. ``memcpy`` writes past the caches; that row has no target, nor has that of two threads.

Run with ``python -m tests.benchmarks flow3``.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from linkwind.native.fluid import shear_rate
from linkwind.native.lattice3 import DIRECTIONS, Lattice3
from tests.benchmarks.bench_flow import Row, copies, paired, rounds

SIDES = (96, 160)
TARGET = 0.6


def lattice(side: int, threads: int = 1) -> Lattice3:
    """Return a cube in a stream, with a force in a hundredth of its rows, as bodies have it."""
    made = Lattice3(side, side, side, shear_rate=shear_rate(1e-3), stream=(0.08, 0.0, 0.0), threads=threads)
    near = slice(side // 2, side // 2 + side // 10)
    made.force[:, near, near, side // 3 : side // 2] = 1e-6
    made.forced[near, near] = 1
    return made


def main() -> list[Row]:
    """Return all rows."""
    rows = []
    for side in SIDES:
        one, two, case = lattice(side), lattice(side, 2), f"{side} x {side} x {side}"
        with tempfile.TemporaryDirectory() as folder:
            timed = copies(Path(folder), "copy_volumes", DIRECTIONS, side**3)
            rates = rounds(timed | {"one": one.step, "two": two.step}, side**3)
        rows += [
            paired(case, "Mcells/s / plain copy, at least 0.6", rates["one"], rates["copy"], TARGET),
            paired(case, "Mcells/s / memcpy", rates["one"], rates["memcpy"], None),
            paired(f"{case}, two threads", "Mcells/s / one thread", rates["two"], rates["one"], None),
        ]
    return rows


if __name__ == "__main__":
    for line in main():
        print(line)
