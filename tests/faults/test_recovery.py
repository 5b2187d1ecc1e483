"""Real providers that are lost and come back: the run goes on to the same bits, or says why not, in time."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from linkwind.bus.zenoh import LEASE
from linkwind.credentials.authority import DEFAULT_ROLES, issue
from linkwind.runs.run import run
from linkwind.scenario import load
from tests.faults.recovered import LONG, SIZE, child_of, cut, hit, hit_twice, killed, under_way, unharmed
from tests.faults.test_processes import Programs, finish
from tests.hinged import HINGED, STEP
from tests.networks.namespaces import reason


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Programs]:
    started = Programs(tmp_path)
    yield started
    started.end()


def dynamics(programs: Programs, *settings: str) -> subprocess.Popen[str]:
    options = [f"--set={setting}" for setting in (*LONG, *settings)]
    return programs.start(
        "dynamics", "two_link", "--listen", programs.endpoint, "--out", "out", "--json", *options
    )


def test_a_killed_provider_comes_back(tmp_path: Path) -> None:
    killed(tmp_path, Random(1))


def test_many_are_killed(tmp_path: Path) -> None:
    for seed in range(10):
        (tmp_path / str(seed)).mkdir()
        killed(tmp_path / str(seed), Random(seed))


@pytest.mark.parametrize("after", [0.0, 0.2, 0.35, 0.5, 0.8])
def test_one_that_comes_back_is_killed_on_the_way(after: float, tmp_path: Path) -> None:
    hit_twice(tmp_path, after)


def test_a_flow_comes_back(tmp_path: Path) -> None:
    settings = ("time.end=0.12", "aero.flow.cells=32", "coupling.step=3e-5", "log.checkpoint_every=300")
    hit(tmp_path, signal.SIGKILL, 40_000_000, "two_link_flow", *settings)


def test_a_flow_in_space_comes_back(tmp_path: Path) -> None:
    """Its log of 1,500 steps and five checkpoints has 115 MB; it is killed after 40."""
    scenario = tmp_path / "hinged.toml"
    scenario.write_text(HINGED)
    settings = (f"time.end={1500 * STEP!r}", "aero.flow.frames=10", "log.checkpoint_every=300")
    hit(tmp_path, signal.SIGKILL, 40_000_000, str(scenario), *settings)


def test_a_stopped_provider_is_ended_and_started_again(tmp_path: Path) -> None:
    hit(tmp_path, signal.SIGSTOP, SIZE // 4)


def test_over_tls(tmp_path: Path) -> None:
    issue(tmp_path / "certs", DEFAULT_ROLES, 2)
    programs = Programs(tmp_path)
    try:
        tls = ("--tls", "certs")
        options = [f"--set={setting}" for setting in LONG]
        run = programs.start("run", "two_link", "--out", "out", "--json", *options, *tls)
        under_way(programs.log())
        os.kill(child_of(run), signal.SIGKILL)
        assert unharmed(run, programs.log())["returns"]
    finally:
        programs.end()


def test_another_provider_takes_the_place_of_one_that_is_stopped_and_goes_on_later(
    programs: Programs, tmp_path: Path
) -> None:
    waiting, first = dynamics(programs), programs.aero()
    under_way(programs.log())
    os.kill(first.pid, signal.SIGSTOP)
    time.sleep(2.0 * LEASE)
    programs.aero("--stay")
    time.sleep(2.0)
    os.kill(first.pid, signal.SIGCONT)
    code, errors, _ = finish(first)
    assert code == 4
    assert "the dynamics was lost" in errors
    summary = unharmed(waiting, programs.log())
    assert {back["provider"] for back in summary["returns"]} == {"aero"}
    alone = run(load("two_link", ["time.end=10", "bus.transport=inprocess"]), tmp_path / "alone", print)
    assert summary["final_state_sha256"] == alone.result.final_state_sha256


def test_nobody_comes_back_in_time(programs: Programs) -> None:
    waiting, aero = dynamics(programs, "bus.recovery=1"), programs.aero()
    under_way(programs.log())
    aero.kill()
    code, errors, took = finish(waiting)
    assert code == 4
    assert '"aero" was lost at step ' in errors
    assert 'No other "aero" came within 1 s (bus.recovery). Start it again: linkwind aero --connect' in errors
    assert took < 15.0  # the report included


def test_a_provider_that_always_dies_is_given_up(programs: Programs) -> None:
    options = [f"--set={setting}" for setting in LONG]
    run = programs.start("run", "two_link", "--out", "out", "--json", *options)
    under_way(programs.log())
    killed_before = ""
    deadline = time.monotonic() + 60.0
    while run.poll() is None and time.monotonic() < deadline:
        children = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text().split()
        for child in children:
            if child != killed_before:
                os.kill(int(child), signal.SIGKILL)
                killed_before = child
        time.sleep(0.05)
    code, errors, _ = finish(run)
    assert code == 4
    assert '"aero" ended with status -9' in errors


@pytest.mark.parametrize("gone", [1.0, 1.5, 4.0])
def test_a_cut_network_heals(gone: float, tmp_path: Path) -> None:
    if why := reason():
        pytest.skip(why)
    cut(tmp_path, gone)
