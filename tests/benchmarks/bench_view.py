"""How soon ten million messages are there in the viewer, and in how much memory, against a small log.

The target is on processor time, so that what else the machine does hardly counts.

The log (about 2.4 GB) goes to a temporary folder; ``LINKWIND_BENCH_MESSAGES`` makes it shorter.
"""

from __future__ import annotations

import os
import re
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from urllib.request import urlopen

import numpy as np

from linkwind.log.contents import STATE
from linkwind.log.reader import open_log
from linkwind.log.writer import LogWriter
from linkwind.runs.run import run
from linkwind.scenario import load

MESSAGES = int(os.environ.get("LINKWIND_BENCH_MESSAGES", "10000000"))
SMALL = 100_000
A_STEP = 5  # messages: motion, wrench, state, step, timing
WITHIN = 3.0  # s
MORE_MEMORY = 1.25  # times that of the small log: the index of the chunks grows


def generate(path: Path, sample: Path, messages: int) -> None:
    """Write a log of so many messages: one step of a run again and again, at its own time."""
    log = open_log(sample)
    step_ns = 1_000_000
    topics = {message.topic: message.payload for message in log.raw()}
    state = bytearray(topics[STATE])
    head = struct.Struct("<BQBQ")  # fields 1 and 2 of a State: step and time
    assert state[0] == 0x09
    assert state[9] == 0x11
    with LogWriter(
        path,
        run="long",
        scenario_json=log.scenario_json,
        body_names=log.bodies,
        provider_bodies=log.provider_bodies,
        metadata={},
    ) as writer:
        motion, wrench, step, timing = (topics[t] for t in ("/motion", "/wrench/aero", "/step", "/timing"))
        for k in range(messages // A_STEP):
            t = k * step_ns
            head.pack_into(state, 0, 0x09, k, 0x11, t)
            writer.motion(motion, t)
            writer.wrench("aero", wrench, t)
            writer.state(bytes(state), t)
            writer.step(step, t)
            writer.timing(timing, t)
        writer.close(final_state_sha256="00")


def opened(path: Path, steps: int) -> tuple[float, float, float]:
    """Return wall and processor time [s] from command to first picture, and the largest memory [MB]."""
    start = time.perf_counter()
    command = [sys.executable, "-m", "linkwind", "view", str(path), "--no-open"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            url = server.stdout.readline().split()[0]
            last = (steps - 1) * 1e-3
            with urlopen(f"{url}facts") as facts, urlopen(f"{url}window?from=0&to={last}") as window:
                assert facts.status == window.status == 200
                window.read()
            took = time.perf_counter() - start
            ticks = Path(f"/proc/{server.pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]
            busy = sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")
            for t in np.linspace(0.0, last, 12):  # somebody looks around
                with urlopen(f"{url}window?from={max(0.0, t - 0.7)}&to={t}") as near:
                    near.read()
            status = Path(f"/proc/{server.pid}/status").read_text()
        finally:
            server.terminate()
    return took, busy, int(re.search(r"VmHWM:\s+(\d+)", status)[1]) / 1e3  # type: ignore[index]


def main() -> list[dict[str, object]]:
    """Open both logs; the reference of the time is what the issue allows, of the memory the small log's."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        settings = ["bus.transport=inprocess", "time.end=0.01"]
        sample = run(load("two_link", settings), folder / "sample", lambda step: None).log
        measured = {}
        for messages in (SMALL, MESSAGES):
            path = folder / f"{messages}.mcap"
            start = time.perf_counter()
            generate(path, sample, messages)
            size, took = path.stat().st_size / 1e6, time.perf_counter() - start
            print(f"{messages} messages, {size:.0f} MB, written in {took:.0f} s", file=sys.stderr)
            measured[messages] = opened(path, messages // A_STEP)
    (seconds, busy, memory), (_, small_busy, small_memory) = measured[MESSAGES], measured[SMALL]
    what, both = f"view {MESSAGES} messages", f"view {MESSAGES} messages, against {SMALL}"
    rows = [
        (what, "processor time to first picture / allowed [s]", busy, WITHIN, 1.0),
        (what, "wall time to first picture / allowed [s]", seconds, WITHIN, None),
        (both, "processor time [s]", busy, small_busy, None),
        (both, "largest memory [MB]", memory, small_memory, MORE_MEMORY),
    ]
    return [
        {
            "case": case,
            "quantity": quantity,
            "value": value,
            "reference": reference,
            "ratio": value / reference,
            "ok": None if target is None else value / reference <= target,
        }
        for case, quantity, value, reference, target in rows
    ]


if __name__ == "__main__":
    for row in main():
        print(row)
