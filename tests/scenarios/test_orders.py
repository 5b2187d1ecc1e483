"""Events on command: over the bus into a run, and the same bits again from its log."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from linkwind.bus.zenoh import loopback_endpoint, order
from linkwind.dynamics.service import DynamicsService
from linkwind.errors import LostError, RefusedError
from linkwind.log.reader import open_log
from linkwind.mechanism import build
from linkwind.protocol.control import Control, parse
from linkwind.runs.resume import plan, resume
from linkwind.runs.run import with_providers
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import loads

TEXT = """
[time]
end = {end}
[[bodies]]
name = "a"
mass = 2.0
inertia = 1.4
[[bodies]]
name = "b"
mass = 2.0
inertia = 1.4
angular_velocity = 4.0
[[joints]]
name = "hinge"
type = "revolute"
parent = "a"
child = "b"
parent_point = [0.25, 0.0]
child_point = [-0.25, 0.0]
[[events]]
name = "part"
joint = "hinge"
action = "release"
[aero]
model = "field"
[aero.field.b]
fy = "sin(t)"
"""


def ordered(event: str) -> bytes:
    return Control(order={"event": event}).SerializeToString()


def test_an_order_counts_from_the_next_step_on_and_is_found_in_the_log(tmp_path: Path) -> None:
    here = '[bus]\ntransport = "inprocess"\n'
    scenario = loads(TEXT.format(end=0.2) + here, "parting.toml")
    service = DynamicsService(scenario, build(scenario), "parting")
    answers = []

    def progress(step: int) -> None:
        if step == 120:
            answers.append(parse(service.session.control(ordered("part"), "order"), "start", "refuse"))

    (tmp_path / "run").mkdir()
    outcome = with_providers(service, tmp_path / "run", progress, {})
    assert answers[0].HasField("start")
    at = outcome.result.events["part"]
    assert at == pytest.approx(0.120, abs=2e-3)
    assert at is not None
    assert at * 1000 == pytest.approx(round(at * 1000), abs=1e-9)  # at a communication point
    log = open_log(outcome.log)
    times = log.trajectory().event_time[:, 0]
    assert (times[: round(at * 1000) + 1] == -1.0).all()
    assert (times[round(at * 1000) + 1 :] == at).all()
    assert np.abs(log.trajectory().reaction[150:, 1]).max() < 1e-12
    checked = verify(*scenario_of(outcome.log))
    assert checked.identical
    assert checked.steps == 200
    later = resume(plan(log, 150, ["environment.density=1.5"]), tmp_path / "later")
    assert later.outcome.result.events["part"] == at
    never = resume(plan(log, 50, ["environment.density=1.5"]), tmp_path / "never")
    assert never.outcome.result.events["part"] is None


def test_an_unknown_event_is_refused() -> None:
    scenario = loads(TEXT.format(end=0.2), "parting.toml")
    session = DynamicsService(scenario, build(scenario), "parting").session
    answer = parse(session.control(ordered("parting"), "order"), "refuse")
    assert answer.refuse.reason == 'event "parting": expected one that waits for a command: part'


def test_an_order_over_the_bus(tmp_path: Path) -> None:
    file, endpoint = tmp_path / "parting.toml", loopback_endpoint()
    file.write_text(TEXT.format(end=6.0))
    linkwind = [sys.executable, "-m", "linkwind"]
    run = [*linkwind, "dynamics", str(file), "--listen", endpoint, "--out", str(tmp_path / "out")]
    with (
        subprocess.Popen(run) as dynamics,
        subprocess.Popen([*linkwind, "aero", "--connect", endpoint]) as aero,
    ):
        with pytest.raises(RefusedError, match='event "lock": expected one that waits for a command: part'):
            order("lock", [endpoint], timeout=30.0)
        order("part", [endpoint], timeout=30.0)
        assert dynamics.wait(60) == 0
        assert aero.wait(60) == 0
    at = open_log(tmp_path / "out" / "log.mcap").trajectory().event_time[-1, 0]
    assert 0.0 <= at < 6.0


def test_nobody_there_is_said() -> None:
    with pytest.raises(LostError, match=r"no run at tcp/127.0.0.1:\d+ within 0.2 s"):
        order("part", [loopback_endpoint()], timeout=0.2)
