"""Runs in a flow of three dimensions: the same bits on both transports, again, resumed, replayed."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import pytest

from linkwind.bus.zenoh import loopback_endpoint
from linkwind.errors import ScenarioError
from linkwind.frames import Sent, VolumeFrame, decode
from linkwind.log.reader import open_log
from linkwind.runs.playback import Steering
from linkwind.runs.record import checkpoint_steps
from linkwind.runs.replay import Selection, replay
from linkwind.runs.resume import plan, resume
from linkwind.runs.run import Outcome, run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load
from tests.hinged import HINGED, STEP
from tests.runs.edit import changed, rewrite
from tests.runs.test_replay import Subscriber
from tests.runs.test_resume import check_same, messages

STEPS = 30
SEVERAL = (f"coupling.step={8 * STEP}", f"time.end={STEPS * 8 * STEP!r}")  # lattice steps in one of these
MODES = pytest.mark.parametrize("mode", [(), SEVERAL], ids=["one lattice step", "several"])


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    (tmp_path / "hinged.toml").write_text(HINGED)
    return tmp_path / "hinged.toml"


def fly(scenario: Path, folder: Path, *settings: str) -> Outcome:
    changes = ["bus.transport=inprocess", *settings]
    return run(load(scenario, changes), folder, lambda step: None, report=False)


@MODES
def test_transport_and_threads_change_no_bit(mode: tuple[str, ...], scenario: Path, tmp_path: Path) -> None:
    logs = []
    for settings in (["bus.transport=zenoh"], ["aero.flow.threads=2"]):
        done = fly(scenario, tmp_path / "run", *mode, *settings)
        logs.append(done.log.rename(tmp_path / f"{len(logs)}.mcap"))
        for path in (tmp_path / "run").iterdir():
            path.unlink()  # the same folder again: the same run id
    topics = ("/motion", "/wrench/aero", "/state", "/step", "/volume/aero", "/checkpoint/aero")
    one, other = (list(open_log(log).raw(*topics)) for log in logs)
    assert {message.topic for message in one} == set(topics)
    assert one == other


@MODES
def test_verified_and_resumed_from_every_checkpoint(
    mode: tuple[str, ...], scenario: Path, tmp_path: Path
) -> None:
    whole = fly(scenario, tmp_path / "whole", *mode)
    opened = open_log(whole.log)
    assert opened.topics["/checkpoint/aero"] > 3  # of several pieces each
    assert checkpoint_steps(opened, load(scenario, mode).coupling.step_ns) == [10, 20, 30]
    assert [frame.step for frame in opened.volume_frames("aero")] == [0, 10, 20, 30]
    assert opened.columns("/wrench/aero")["diagnostics"][-1, 3] == (4 if mode else 1)
    found = verify(*scenario_of(whole.log))
    assert (found.difference, found.remark, found.steps) == (None, "", STEPS)
    assert verify(*scenario_of(whole.log), from_recorded_wrenches=True).identical
    for step in (5, 10, 14, 30):
        check_same(resume(plan(opened, step), tmp_path / str(step), report=False), whole)


def test_one_bit_of_a_force_is_found(scenario: Path, tmp_path: Path) -> None:
    def edit(topic: str, number: int, payload: bytes) -> bytes:
        return changed(topic, payload, "force", 2) if (topic, number) == ("/wrench/aero", 21) else payload

    other = rewrite(fly(scenario, tmp_path / "whole").log, tmp_path / "edited.mcap", edit)
    found = verify(*scenario_of(other)).difference
    assert found is not None
    assert (found.topic, found.step, found.field, found.body) == ("/wrench/aero", 20, "force", "plate")


def test_a_branch_may_have_other_threads_and_no_other_fluid(scenario: Path, tmp_path: Path) -> None:
    whole = fly(scenario, tmp_path / "whole")
    opened = open_log(whole.log)
    done = resume(plan(opened, 20, ["aero.flow.threads=2"]), tmp_path / "threads", report=False)
    topics = ("/motion", "/wrench/aero", "/state", "/volume/aero")
    assert [m for m in messages(done.outcome.log) if m[0] in topics] == [
        m for m in messages(whole.log) if m[0] in topics
    ]
    flat = ["aero.flow.dimensions=2", "aero.flow.window=[0.6, 0.6]"]
    for settings in (["aero.flow.cells=11"], ["aero.flow.window=[0.64, 0.64, 0.56]"], flat):
        with pytest.raises(ScenarioError, match="expected"):
            plan(opened, 20, settings)


def test_a_replay_shows_the_boxes_as_they_were_sent(scenario: Path, tmp_path: Path) -> None:
    opened = open_log(fly(scenario, tmp_path / "whole").log)
    endpoint, key = loopback_endpoint(), "linkwind/v1/whole/observe/volume/*"
    with closing(Subscriber(endpoint, key, enough=4)) as subscriber:
        replay(opened, Selection(), listen=[endpoint], connect=[], steering=Steering(0.0))
        assert subscriber.done.wait(60.0)
    got = [decode(Sent("volume", payload), "whole", "aero")[1] for _, payload in subscriber.got]
    assert all(isinstance(frame, VolumeFrame) for frame in got)
    assert [frame.encode() for frame in got] == [f.encode() for f in opened.volume_frames("aero")]
