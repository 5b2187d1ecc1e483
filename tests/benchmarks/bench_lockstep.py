"""A whole lock-step step against a bare zenoh ping-pong of the same payload and settings, in turn.

The step encodes, sends, evaluates the plates, answers, decodes, corrects, predicts and logs; the ping-pong
only sends bytes there and back. It comes in two kinds: one that sleeps until the answer is there, as
anybody would write it, and one that looks for it first, as linkwind's dynamics does. Run with
``python -m tests.benchmarks lockstep``.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import zenoh
from zenoh.handlers import FifoChannel

from linkwind.bus.zenoh import SPIN, loopback_endpoint, open_session
from linkwind.messages import MotionMessage, WrenchMessage
from linkwind.runs.run import run
from linkwind.scenario import load

STEPS = 4000
ROUNDS = 5
MOTION = len(MotionMessage("lockstep", 2).payload())
WRENCH = len(WrenchMessage("lockstep", "aero", 2, added_inertia=True).payload())


def _channel(session: zenoh.Session, out: str, into: str) -> tuple[zenoh.Publisher, Any]:
    publisher = session.declare_publisher(out, congestion_control=zenoh.CongestionControl.BLOCK, express=True)
    return publisher, session.declare_subscriber(into, FifoChannel(256))


def pong(endpoint: str) -> None:
    """Answer every ping with as many bytes as a wrench has, until one is empty."""
    session = open_session([], [endpoint], "observer")
    publisher, subscriber = _channel(session, "bench/pong", "bench/ping")
    answer = bytes(WRENCH)
    publisher.put(answer)
    while len(subscriber.recv().payload.to_bytes()):
        publisher.put(answer)
    session.close()


def _receive(subscriber: Any, spin: float) -> bytes:
    end = time.perf_counter() + spin
    while time.perf_counter() < end:
        if (sample := subscriber.try_recv()) is not None:
            return sample.payload.to_bytes()
    return subscriber.recv().payload.to_bytes()


def ping_pong(spin: float) -> float:
    """Return the wall clock of a bare exchange that looks for the answer for ``spin`` [s] [µs]."""
    endpoint = loopback_endpoint()
    session = open_session([endpoint], [], "dynamics")
    publisher, subscriber = _channel(session, "bench/ping", "bench/pong")
    command = [sys.executable, "-c", f"from {__name__} import pong; pong('{endpoint}')"]
    with subprocess.Popen(command) as process:
        subscriber.recv()
        while not publisher.matching_status.matching:
            time.sleep(0.001)
        message = bytes(MOTION)
        for _ in range(200):
            publisher.put(message)
            _receive(subscriber, spin)
        start = time.perf_counter()
        for _ in range(STEPS):
            publisher.put(message)
            _receive(subscriber, spin)
        took = time.perf_counter() - start
        publisher.put(b"")
        process.wait(10)
    session.close()
    return took / STEPS * 1e6


def lock_step() -> float:
    """Return the wall clock of a step of ``two_link`` [µs], from the first to the last."""
    scenario = load("two_link", [f"time.end={STEPS / 1000}"])
    with tempfile.TemporaryDirectory() as folder:
        outcome = run(scenario, Path(folder) / "lockstep", lambda step: None)
    return outcome.result.wall_s / STEPS * 1e6


def main() -> list[dict[str, object]]:
    """Measure all three in turn; ratios are medians over the rounds."""
    rounds = [(lock_step(), ping_pong(0.0), ping_pong(SPIN)) for _ in range(ROUNDS)]
    step, *bare = (statistics.median(column) for column in zip(*rounds, strict=True))
    rows: list[dict[str, object]] = []
    for i, kind in enumerate(("that sleeps", "that looks first")):
        ratio = statistics.median(measured[0] / measured[1 + i] for measured in rounds)
        rows.append(
            {
                "case": f"two_link over zenoh, {STEPS} steps, {MOTION} B there, {WRENCH} B back",
                "quantity": f"step / bare ping-pong {kind} [µs]",
                "value": step,
                "reference": bare[i],
                "ratio": ratio,
                "ok": ratio <= 1.3 if i == 0 else None,
            }
        )
    return rows
