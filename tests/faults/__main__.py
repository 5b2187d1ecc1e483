"""The fault table: ``python -m tests.faults [TIMES [PART OF A NAME]]``, all 10 times if nothing is given."""

from __future__ import annotations

import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from random import Random

from tests.faults.kinds import KINDS, Kind, Trial
from tests.networks.namespaces import reason

SEED = 20210305  # the first day of the paper
AT_ONCE = 2


def tried(kind: Kind, seed: int) -> Trial | str:
    """Return how a trial ended, or what went wrong."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            return kind(Path(folder), Random(seed))
        except Exception as error:
            return f"seed {seed}: {type(error).__name__}: {error}"


def main(times: int, part: str) -> int:
    """Try everything, print the table."""
    failures = []
    print(f"{'fault':<26}{'tried':>6}{'survived':>10}{'detected within':>17}{'lost':>9}", flush=True)
    for number, (name, kind) in enumerate(KINDS.items()):
        if part not in name:
            continue
        if kind is KINDS["network cut, 0.1 to 10 s"] and (why := reason()):
            print(f"{name:<26}{'-':>6}  {why}")
            continue
        seeds = [SEED + 1000 * number + trial for trial in range(times)]
        # Malformed messages are measured by memory of this process: one after the other.
        with ThreadPoolExecutor(1 if "malformed" in name else AT_ONCE) as pool:
            trials = list(pool.map(tried, [kind] * times, seeds))
        good = [trial for trial in trials if isinstance(trial, Trial)]
        failures += [f"{name}: {trial}" for trial in trials if isinstance(trial, str)]
        within = f"{max((trial.within for trial in good), default=0.0):.2f} s"
        losses = [trial.lost for trial in good if trial.lost is not None]
        lost = f"{max(losses):.2f} s" if losses else "-"
        print(f"{name:<26}{len(trials):>6}{len(good):>10}{within:>17}{lost:>9}", flush=True)
    print(*failures, sep="\n")
    return int(bool(failures))


times, part, *_ = [*sys.argv[1:], *("10", "")[len(sys.argv) - 1 :]]
sys.exit(main(int(times), part))
