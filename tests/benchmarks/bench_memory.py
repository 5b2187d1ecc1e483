"""Resident memory of both processes over a million steps of ``two_link`` over zenoh.

The log (2 GB) goes to a temporary folder; ``LINKWIND_BENCH_STEPS`` shortens the run.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from linkwind.bus.zenoh import loopback_endpoint

STEPS = int(os.environ.get("LINKWIND_BENCH_STEPS", "1000000"))
ALLOWED = 2.0  # MB that memory may grow by from a tenth of the run to its end: noise


def resident_mb(pid: int) -> float:
    """Return the resident memory of a process [MB], 0 if it is gone."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def main() -> list[dict[str, object]]:
    """Watch both processes until the run is over."""
    command = [sys.executable, "-m", "linkwind"]
    endpoint = loopback_endpoint()
    with tempfile.TemporaryDirectory() as folder:
        dynamics = subprocess.Popen(
            [*command, "dynamics", "two_link_field", "--listen", endpoint, "--out", f"{folder}/out", "--json",
             f"--set=time.end={STEPS / 1e5}", "--set=coupling.step=1e-5"],
            stdout=subprocess.DEVNULL,
        )  # fmt: skip
        aero = subprocess.Popen([*command, "aero", "--connect", endpoint])
        samples = []
        while aero.poll() is None:
            samples.append((resident_mb(dynamics.pid), resident_mb(aero.pid)))
            time.sleep(0.05)
        if dynamics.wait() or aero.returncode:
            raise RuntimeError("the run failed")
    used = np.array(samples)
    used = used[(used > 20.0).all(axis=1)][:-20]  # while aero leaves, the dynamics writes its report
    # The log's writer keeps an index entry for every chunk of 256 KiB, some 4 bytes a step.
    growth = used[-len(used) // 20 :].max(axis=0) - used[len(used) // 10 : len(used) // 5].max(axis=0)
    allowed = (ALLOWED + 5e-6 * STEPS, ALLOWED)
    return [
        {
            "case": f"{name}, {STEPS} steps, from a tenth of the run on",
            "quantity": "resident growth / allowed [MB]",
            "value": float(growth[i]),
            "reference": allowed[i],
            "ratio": float(growth[i]) / allowed[i],
            "ok": bool(growth[i] <= allowed[i]),
        }
        for i, name in enumerate(("dynamics", "aero"))
    ]


if __name__ == "__main__":
    print(main())
