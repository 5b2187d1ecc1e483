"""The fault table: ``python -m tests.faults [TIMES [PART OF A NAME [SEED]]]``.

Without arguments, all of it 10 times. Every trial has a seed of its own; with the one of a trial that went
wrong, that one is made again. Of the commands that are told to stop, three tenths as many.
"""

from __future__ import annotations

import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from random import Random

from tests.faults import containers, disks
from tests.faults.kinds import KINDS, STOPS, Kind, Trial
from tests.networks import namespaces

SEED = 20210305  # the first day of the paper
AT_ONCE = 3  # most of them wait, most of the time
REASONS: dict[str, Callable[[], str]] = {
    "network": namespaces.reason,
    "read-only": disks.reason,
    "container": containers.reason,
}


def tried(name: str, kind: Kind, seed: int) -> Trial | str:
    """Return how a trial ended, or what went wrong."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            return kind(Path(folder), Random(seed))
        except Exception as error:
            again = f"python -m tests.faults 1 '{name}' {seed}"
            trace = "".join(traceback.format_exception(error)[-2:])
            return f"{name}: {trace}\n  once more: {again}"


def row(name: str, trials: list[Trial | str]) -> str:
    """Return the line of a kind of fault."""
    good = [trial for trial in trials if isinstance(trial, Trial)]
    within = f"{max((trial.within for trial in good), default=0.0):.2f} s"
    losses = [trial.lost for trial in good if trial.lost is not None]
    lost = f"{max(losses):.2f} s" if losses else "-"
    return f"{name:<30}{len(trials):>6}{len(good):>10}{within:>17}{lost:>9}"


def main(times: int, part: str, seed: int | None) -> int:
    """Try everything, print the table."""
    began, failures = time.monotonic(), []
    waiting: dict[str, list[Future[Trial | str]]] = {}
    print(f"{'fault':<30}{'tried':>6}{'survived':>10}{'detected within':>17}{'lost':>9}", flush=True)
    with ThreadPoolExecutor(AT_ONCE) as pool:
        for number, (name, kind) in enumerate((KINDS | STOPS).items()):
            if part in name:
                why = next((reason() for key, reason in REASONS.items() if key in name), "")
                count = 0 if why else times if name in KINDS else max(1, 3 * times // 10)
                seeds = [SEED + 1000 * number + trial for trial in range(count)] if seed is None else [seed]
                waiting[name] = [pool.submit(tried, name, kind, each) for each in seeds]
                if why:
                    failures.append(f"{name}: not tried: {why}")
        for name, futures in waiting.items():
            trials = [future.result() for future in futures]
            print(row(name, trials), flush=True)
            failures += [trial for trial in trials if isinstance(trial, str)]
    print(f"{sum(map(len, waiting.values()))} trials in {time.monotonic() - began:.0f} s")
    print(*failures, sep="\n")
    return int(any("not tried" not in failure for failure in failures))


if __name__ == "__main__":
    times, part, seed = [*sys.argv[1:], *("10", "", "")[len(sys.argv) - 1 :]]
    sys.exit(main(int(times), part, int(seed) if seed else None))
