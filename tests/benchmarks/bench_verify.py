"""Verifying a log against making it over zenoh, and keeping time in a replay."""

from __future__ import annotations

import statistics
import tempfile
import threading
import time
from contextlib import closing
from pathlib import Path

from linkwind.bus.zenoh import loopback_endpoint, open_session
from linkwind.log.reader import open_log
from linkwind.runs.replay import Selection, replay
from linkwind.runs.run import run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load

ROUNDS = 3
TARGET = 8.0
LATE = 2.0  # ms


def _verify(folder: Path) -> dict[str, object]:
    """Return how much faster a verification is than the steps of the run over zenoh."""
    over_zenoh, verified = [], []
    for i in range(ROUNDS):
        outcome = run(load("two_link"), folder / str(i), lambda step: None)
        over_zenoh.append(outcome.result.wall_s)
        log, scenario = scenario_of(outcome.log)
        start = time.perf_counter()
        assert verify(log, scenario).identical
        verified.append(time.perf_counter() - start)
    value, reference = statistics.median(verified), statistics.median(over_zenoh)
    return {
        "case": "verify two_link in-process",
        "quantity": "wall clock in s, against the run over zenoh",
        "value": value,
        "reference": reference,
        "ratio": reference / value,
        "ok": reference / value >= TARGET,
    }


def _replay(log: Path) -> dict[str, object]:
    """Return the lateness of a replay at rate 1 with a subscriber on the loopback."""
    endpoint, expected = loopback_endpoint(), sum(1 for _ in open_log(log).raw("/motion", "/wrench/aero"))
    count, everything = 0, threading.Event()

    def take(sample: object) -> None:
        nonlocal count
        count += 1
        if count == expected:
            everything.set()

    with closing(open_session([], [endpoint], "observer")) as session:
        subscriber = session.declare_subscriber("linkwind/v1/**", take)
        done = replay(open_log(log), Selection(), listen=[endpoint], connect=[])
        assert everything.wait(10.0)
        subscriber.undeclare()
    assert done.late_ms is not None
    return {
        "case": "replay two_link at rate 1",
        "quantity": "99th percentile of lateness in ms, against 2",
        "value": done.late_ms[1],
        "reference": LATE,
        "ratio": done.late_ms[1] / LATE,
        "ok": done.late_ms[1] <= LATE,
    }


def main() -> list[dict[str, object]]:
    """Run both."""
    with tempfile.TemporaryDirectory() as folder:
        rows = [_verify(Path(folder))]
        rows.append(_replay(Path(folder) / "0" / "log.mcap"))
    return rows
