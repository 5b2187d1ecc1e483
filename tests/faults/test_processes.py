"""What happens to real processes: killed, stopped, never started, started twice, of another version."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from linkwind.bus.zenoh import LEASE, ZenohProviderLink
from linkwind.log.reader import open_log
from linkwind.schema import MESSAGES
from tests.faults.programs import PATIENCE, Programs


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Programs]:
    started = Programs(tmp_path)
    yield started
    started.end()


def finish(process: subprocess.Popen[str]) -> tuple[int, str, float]:
    """Return exit code, errors and how long the process took to end."""
    start = time.monotonic()
    _, errors = process.communicate(timeout=PATIENCE)
    return process.returncode, errors, time.monotonic() - start


@pytest.mark.parametrize(
    ("number", "within"),
    # A killed process closes its connection; a stopped one is found out by the lease.
    [(signal.SIGKILL, 5.0), (signal.SIGSTOP, 5.0 + LEASE)],
    ids=["killed", "stopped"],
)
def test_aero_lost_ends_the_run_with_a_readable_log(programs: Programs, number: int, within: float) -> None:
    dynamics, aero = programs.dynamics("coupling.timeout=20"), programs.aero()
    programs.await_steps()
    os.kill(aero.pid, number)
    code, errors, took = finish(dynamics)
    assert code == 4
    assert '"aero" was lost at step ' in errors
    assert took < within
    log = open_log(programs.log())
    assert not log.complete
    assert log.damage is None
    assert "LostError" in str(log.error)
    assert log.steps > 0
    assert (programs.folder / "out" / "report.html").exists()


@pytest.mark.parametrize(
    ("number", "within"), [(signal.SIGKILL, 5.0), (signal.SIGSTOP, 5.0 + LEASE)], ids=["killed", "stopped"]
)
def test_dynamics_lost_ends_the_provider_and_leaves_a_readable_log(
    programs: Programs, number: int, within: float
) -> None:
    dynamics, aero = programs.dynamics(), programs.aero()
    programs.await_steps()
    os.kill(dynamics.pid, number)
    code, errors, took = finish(aero)
    assert code == 4
    assert "the dynamics was lost" in errors
    assert took < within
    os.kill(dynamics.pid, signal.SIGKILL)
    dynamics.wait()
    log = open_log(programs.log())
    assert not log.complete
    assert log.steps > 0


def test_aero_never_started_ends_the_run_after_the_start_timeout(programs: Programs) -> None:
    code, errors, _ = finish(programs.dynamics("bus.start_timeout=0.5"))
    assert code == 4
    assert '"aero" did not come within 0.5 s (bus.start_timeout)' in errors
    assert "LostError" in str(open_log(programs.log()).error)


def test_dynamics_never_started_ends_the_provider(programs: Programs) -> None:
    code, errors, _ = finish(programs.aero("--start-timeout", "0.5"))
    assert code == 4
    assert f"no dynamics answered at {programs.endpoint} within 0.5 s" in errors


def test_aero_started_twice_is_refused_and_the_run_goes_on(programs: Programs) -> None:
    dynamics, aero = programs.dynamics(), programs.aero()
    programs.await_steps()
    code, errors, _ = finish(programs.aero())
    programs.forget_last()
    assert code == 4
    assert 'a participant named "aero" already takes part in run out' in errors
    programs.await_steps()
    assert dynamics.poll() is None
    assert aero.poll() is None


def test_dynamics_started_twice_is_refused_and_the_run_goes_on(programs: Programs) -> None:
    dynamics, aero = programs.dynamics(), programs.aero()
    programs.await_steps()
    twice = programs.start("dynamics", "two_link", "--listen", programs.endpoint, "--out", "second")
    code, errors, _ = finish(twice)
    programs.forget_last()
    assert code == 3
    assert f"cannot listen on {programs.endpoint}" in errors
    programs.await_steps()
    assert dynamics.poll() is None
    assert aero.poll() is None


def test_other_schema_version_ends_the_run(programs: Programs) -> None:
    dynamics = programs.dynamics("bus.start_timeout=20")
    link = ZenohProviderLink([programs.endpoint], [], name="aero")
    hello = {"name": "aero", "schema_sha256": "0" * 64, "version": "0.0.1", "instance": "x"}
    reply = link.request(MESSAGES["Control"](hello=hello).SerializeToString(), PATIENCE)
    link.close()
    assert "Install the same version on both sides" in MESSAGES["Control"].FromString(reply).refuse.reason
    code, errors, _ = finish(dynamics)
    assert code == 4
    assert 'participant "aero": expected schema' in errors
    assert "RefusedError" in str(open_log(programs.log()).error)


@pytest.mark.parametrize("expression", ["1/(t-0.05)**2", "log(0.05-t)"], ids=["infinite", "not a number"])
def test_forces_that_are_not_finite_end_the_run(programs: Programs, expression: str) -> None:
    field = (f"aero.field.link1.fx='{expression}'", "coupling.step=0.01")
    dynamics = programs.start(
        "run", "two_link_field", "--out", "out", *(f"--set={setting}" for setting in field), "--json"
    )
    code, errors, _ = finish(dynamics)
    assert code == 4
    assert '"aero" stopped at step 5: SimulationError' in errors
    assert "link1" in errors
    assert "step 5" in str(open_log(programs.log()).error)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "SIGTERM"])
def test_interrupted_run_closes_its_log_and_ends_its_children(programs: Programs, number: int) -> None:
    run = programs.start("run", "two_link", "--out", "out", "--set=time.end=1000")
    programs.await_steps()
    children = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text().split()
    assert len(children) == 1
    run.send_signal(number)
    code, errors, took = finish(run)
    assert code == 130
    assert "stopped at step " in errors
    assert (programs.folder / "out" / "report.html").exists()
    assert took < 5.0
    assert not Path(f"/proc/{children[0]}").exists()
    log = open_log(programs.log())
    assert not log.complete
    assert "StoppedError" in str(log.error)
    assert log.damage is None


def test_run_that_is_killed_leaves_no_process(programs: Programs) -> None:
    run = programs.start("run", "two_link", "--out", "out", "--set=time.end=1000")
    programs.await_steps()
    (child,) = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text().split()
    run.kill()
    deadline = time.monotonic() + PATIENCE
    while Path(f"/proc/{child}").exists():
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert "the dynamics was lost" in (programs.folder / "out" / "aero.log").read_text()


def test_json_is_one_object_with_the_promised_keys(programs: Programs) -> None:
    run = programs.start("run", "two_link", "--out", "out", "--json", "--set=time.end=0.05")
    output, errors = run.communicate(timeout=PATIENCE)
    assert run.returncode == 0, errors
    summary = json.loads(output)
    assert set(summary) >= {
        "scenario", "steps", "exchanges", "wall_s", "exchange_us", "joint_gap_max_m", "force_max_N",
        "final_state_sha256", "log", "report",
    }  # fmt: skip
    assert (summary["steps"], summary["exchanges"]) == (50, 51)
