"""A provider that is not linkwind's: what it comes to when it fails, and what a log says of its answers."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from linkwind import __version__
from linkwind.bus.zenoh import loopback_endpoint
from linkwind.errors import FaultError, InputError
from linkwind.log.contents import PROGRAMS
from linkwind.log.origin import origin
from linkwind.log.reader import open_log
from linkwind.runs.live_provider import live_provider
from linkwind.runs.resume import plan, resume
from linkwind.runs.run import Ends, Outcome, dynamics, run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import Scenario, load
from tests.runs.edit import rewrite

EXAMPLE = Path(__file__).parents[2] / "schemas" / "examples" / "provider.py"
SCHEMA = EXAMPLE.parents[1] / "linkwind" / "v1" / "linkwind.binpb"
PATIENCE = 30.0  # s for a machine under load


def start(program: Path, endpoint: str) -> subprocess.Popen[str]:
    command = [sys.executable, str(program), endpoint, "--schema", str(SCHEMA)]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True)


def answered(scenario: Scenario, out: Path, program: Path = EXAMPLE) -> Outcome:
    """Return a run whose forces come from a program of its own."""
    endpoint = loopback_endpoint()
    process = start(program, endpoint)
    try:
        return dynamics(scenario, out, lambda step: None, Ends([endpoint], []))
    finally:
        _, printed = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0, printed


def test_an_error_in_the_forces_is_told_and_ends_the_process(tmp_path: Path) -> None:
    """And the dynamics hears which error it was, and where, rather than waiting for coupling.timeout."""
    text = EXAMPLE.read_text()
    old = "    for body in bodies:\n"
    assert text.count(old) == 1
    program = tmp_path / "fails.py"
    program.write_text(text.replace(old, "    1 / (motion.step - 3)\n" + old))
    endpoint, ended = loopback_endpoint(), []
    process = start(program, endpoint)

    def await_end() -> None:
        process.wait()
        ended.append(time.monotonic())

    waiting = threading.Thread(target=await_end)
    waiting.start()
    try:
        told = '"aero" stopped at step 3: ZeroDivisionError: division by zero'
        with pytest.raises(FaultError, match=told):
            dynamics(
                load("two_link", ["time.end=0.01"]), tmp_path / "out", lambda step: None, Ends([endpoint], [])
            )
        over = time.monotonic()
        waiting.join(PATIENCE)
    finally:
        process.kill()
        waiting.join()
    assert ended[0] - over < 2.0
    assert process.returncode == 1
    _, printed = process.communicate()
    assert printed.startswith("Traceback")
    assert printed.endswith("ZeroDivisionError: division by zero\n")


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of plates, as its scenario says, that the example has answered."""
    return answered(load("two_link", ["time.end=0.05"]), tmp_path_factory.mktemp("run") / "out").log


def test_verify_says_that_the_forces_are_anothers(foreign: Path) -> None:
    log, scenario = scenario_of(foreign)
    found = verify(log, scenario)
    assert found.identical
    assert found.steps == 50
    assert 'the forces of "aero" (provider.py 1) were taken as recorded' in found.remark
    assert list(origin(log)) == [
        'the forces of "aero" come from a program that is not linkwind\'s: provider.py 1'
    ]


def test_of_linkwinds_own_nothing_is_said(tmp_path: Path) -> None:
    settings = ["time.end=0.01", "bus.transport=inprocess"]
    log, scenario = scenario_of(run(load("two_link", settings), tmp_path / "out").log)
    assert log.record(PROGRAMS) == {"aero": f"linkwind {__version__}"}
    assert not log.foreign
    assert verify(log, scenario).remark == ""


def test_a_dynamics_that_gives_other_states_is_still_found(foreign: Path, tmp_path: Path) -> None:
    def disturbed(topic: str, number: int, payload: bytes) -> bytes | None:
        return payload[:-1] + bytes([payload[-1] ^ 1]) if (topic, number) == ("/state", 30) else payload

    log, scenario = scenario_of(rewrite(foreign, tmp_path / "log.mcap", disturbed))
    found = verify(log, scenario)
    assert found.difference is not None
    assert found.difference.topic == "/state"


def test_its_answers_to_recorded_motion_cannot_be_made_again(foreign: Path, tmp_path: Path) -> None:
    recorded, endpoint = open_log(foreign), loopback_endpoint()
    process = start(EXAMPLE, endpoint)
    try:
        _, scenario = scenario_of(foreign)
        done = live_provider(
            recorded, "aero", scenario, {}, tmp_path / "out", lambda step: None, listen=[endpoint]
        )
    finally:
        _, printed = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0, printed
    log, scenario = scenario_of(done.log)
    with pytest.raises(InputError, match=r'those of "aero" \(provider.py 1\) against recorded motion'):
        verify(log, scenario)


def test_it_is_not_resumed_with_a_model_of_linkwinds(foreign: Path, tmp_path: Path) -> None:
    found = plan(open_log(foreign), 20, ["environment.gravity=[0, -1.62, 0]"])
    with pytest.raises(InputError, match=r'"aero": expected a model of linkwind; got provider.py 1\. Let it'):
        resume(found, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_copy_without_the_schema_says_what_is_missing(tmp_path: Path) -> None:
    copy = tmp_path / "a" / "b" / "mine.py"
    copy.parent.mkdir(parents=True)
    copy.write_text(EXAMPLE.read_text())
    command = [sys.executable, str(copy), "tcp/127.0.0.1:9"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    missing = tmp_path / "a" / "linkwind" / "v1" / "linkwind.binpb"
    assert f"error: {missing}: expected the compiled schema" in done.stderr
    assert "got No such file or directory. Say where it is: --schema FILE" in done.stderr
