"""Every built-in scenario: verified bit for bit over both transports, and resumed from every checkpoint.

A short form here, each scenario once; all of it, with longer runs, by
``LINKWIND_LOGS=long pytest -m slow tests/scenarios/test_logs.py``.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from linkwind.log.reader import Log, open_log
from linkwind.runs.record import checkpoint_steps
from linkwind.runs.resume import plan, resume
from linkwind.runs.run import run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import builtin_names, load
from tests.coarse import COARSE

LONG = os.environ.get("LINKWIND_LOGS") == "long"
STEPS, CHECKPOINTS = (240, 6) if LONG else (20, 1)
COARSEST = {"falling_plate": 32, "fruit_fly": 24}


def flows(name: str) -> bool:
    return load(name).providers[0].model == "flow"


def fly(name: str, folder: Path, transport: str) -> Log:
    """Run so many steps of a scenario, with checkpoints."""
    step_ns = load(name).coupling.step_ns
    settings = [
        f"time.end={STEPS * step_ns / 1e9!r}",
        f"log.checkpoint_every={STEPS // (CHECKPOINTS + 1) + 1}",
        f"bus.transport={transport}",
        *COARSE.get(name, ()),
        *([f"aero.flow.cells={COARSEST.get(name, 16)}", "aero.flow.frames=0"] if flows(name) else []),
    ]
    return open_log(run(load(name, settings), folder, lambda step: None).log)


@pytest.mark.parametrize("name", builtin_names())
def test_verified_and_resumed(name: str, tmp_path: Path) -> None:
    transports: tuple[str, ...] = ("zenoh", "inprocess")
    if not LONG:  # the other one is as good: `test_runs` holds both together
        transports = transports[1:]
    for transport in transports:
        log = fly(name, tmp_path / transport, transport)
        found = verify(*scenario_of(log.path))
        assert (found.difference, found.remark, found.steps) == (None, "", STEPS)
        steps = checkpoint_steps(log, load(name).coupling.step_ns)
        assert len(steps) == CHECKPOINTS
        for step in steps if LONG else steps[-1:]:
            done = resume(plan(log, step), tmp_path / f"{transport}-{step}")
            assert (done.plan.start, done.plan.last) == (step, step)
            assert done.outcome.result.final_state_sha256 == log.final_state_sha256
            again = open_log(done.outcome.log)
            topics = [topic for topic in log.topics if topic not in ("/timing", "/tf", "/scene")]
            assert list(again.raw(*topics)) == list(log.raw(*topics))
            if LONG:
                assert verify(*scenario_of(done.outcome.log)).identical
