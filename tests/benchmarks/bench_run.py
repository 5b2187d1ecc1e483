"""From the shell to the prompt, and memory over a million steps.

``python -m tests.benchmarks run memory``; the memory part takes a few minutes.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time

ROUNDS = 3
TARGET = 5.0  # s


def _wall(*arguments: str, cwd: str) -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, "-m", "linkwind", *arguments], cwd=cwd, check=True, capture_output=True)
    return time.perf_counter() - start


def main() -> list[dict[str, object]]:
    """Time whole commands; the reference of ``run`` is its target, of ``--help`` a bare interpreter."""
    with tempfile.TemporaryDirectory() as folder:
        run = statistics.median(_wall("run", "two_link", cwd=folder) for _ in range(ROUNDS))
        helped = statistics.median(_wall("--help", cwd=folder) for _ in range(ROUNDS))
    return [
        {
            "case": "linkwind run two_link, shell to prompt",
            "quantity": "wall clock / target [s]",
            "value": run,
            "reference": TARGET,
            "ratio": run / TARGET,
            "ok": run <= TARGET,
        },
        {
            "case": "linkwind --help",
            "quantity": "wall clock / target [s]",
            "value": helped,
            "reference": 0.3,
            "ratio": helped / 0.3,
            "ok": helped <= 0.3,
        },
    ]
