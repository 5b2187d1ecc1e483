"""Checkpoints of 300 MB over zenoh: more than a message may have, and than the dynamics has in memory."""

from __future__ import annotations

import json
import os
import re
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import linkwind
from linkwind import aero
from linkwind.log.reader import open_log
from linkwind.runs.record import checkpoint_steps
from tests.faults.large import SIZE
from tests.faults.programs import Programs
from tests.faults.recovered import child_of, under_way, unharmed

MODEL = f"{Path(__file__).with_name('large.py')}:Large"
SETTINGS = ("time.end=0.012", "log.checkpoint_every=4", "coupling.timeout=30")


@contextmanager
def watched(pid: int) -> Iterator[list[int]]:
    """Keep the largest memory of a process in a list [bytes], without that of files."""
    peak, over = [0], threading.Event()

    def watch() -> None:
        while not over.wait(0.01):
            found = re.search(r"RssAnon:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text())
            peak[0] = max(peak[0], 1000 * int(found[1]) if found else 0)

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        yield peak
    finally:
        over.set()
        thread.join()


def test_killed_and_brought_back_then_cut_and_resumed(tmp_path: Path) -> None:
    """Of three checkpoints the provider is killed behind the first, and the log is cut within the second."""
    scenario = linkwind.load("two_link", [*SETTINGS, "bus.transport=inprocess"])
    undisturbed = linkwind.run(scenario, tmp_path / "alone", models={"aero": MODEL}, report=False)
    final = undisturbed.result.final_state_sha256
    undisturbed.log.unlink()
    programs = Programs(tmp_path)
    try:
        options = [f"--set={setting}" for setting in (*SETTINGS, "bus.recovery=60")]
        began = time.monotonic()
        killed = programs.start("run", "two_link", "--model", MODEL, "--out", "out", "--json", *options)
        with watched(killed.pid) as peak:
            under_way(programs.log(), SIZE + 1_000_000)
            os.kill(child_of(killed), signal.SIGKILL)
            killed.wait()
        print(f"run: {time.monotonic() - began:.1f} s, dynamics {peak[0] / 1e6:.0f} MB at most")
        summary = unharmed(killed, programs.log(), {"aero": aero.own(MODEL)})
        assert summary["returns"]
        assert summary["final_state_sha256"] == final
        assert peak[0] < SIZE
        cut = tmp_path / "cut.mcap"
        with programs.log().open("rb") as log, cut.open("wb") as target:
            target.write(log.read(SIZE + SIZE // 2))
        assert checkpoint_steps(open_log(programs.log()), 1_000_000) == [4, 8, 12]
        assert checkpoint_steps(open_log(cut), 1_000_000) == [4]
        programs.log().unlink()
        began = time.monotonic()
        resumed = programs.start("resume", str(cut), "--model", MODEL, "--out", "again", "--json")
        with watched(resumed.pid) as peak:
            output, errors = resumed.communicate()
        print(f"resume: {time.monotonic() - began:.1f} s, dynamics {peak[0] / 1e6:.0f} MB at most")
        assert resumed.returncode == 0, errors
        again = json.loads(output)
        assert (again["resumed_at"], again["checkpoint"]) == (8, 4)
        assert again["final_state_sha256"] == final
    finally:
        programs.end()
