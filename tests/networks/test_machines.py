"""Several machines: directly, through a router, over TLS; and what a cut cable does."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from linkwind.bus.zenoh import LEASE
from linkwind.credentials.authority import Role, issue
from linkwind.log.reader import open_log
from linkwind.runs.run import run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load
from tests.networks.namespaces import PATIENCE, Machines, finish, reason

if why := reason():
    pytest.skip(why, allow_module_level=True)

SETTINGS = ("time.end=0.3",)


@pytest.fixture
def machines(tmp_path: Path) -> Iterator[Machines]:
    made = Machines(tmp_path)
    yield made
    made.end()


def alone(folder: Path) -> str:
    """Return the final state of the same run in one process."""
    done = run(load("two_link", [*SETTINGS, "bus.transport=inprocess"]), folder, lambda step: None)
    return done.result.final_state_sha256


def options(*settings: str) -> list[str]:
    return ["two_link", "--out", "out", "--json", *(f"--set={setting}" for setting in settings)]


def test_two_machines_give_the_same_bits_as_one(machines: Machines, tmp_path: Path) -> None:
    machines.add("d", "a")
    here, _ = machines.connect("d", "a")
    aero = machines.start("a", "aero", "--connect", f"tcp/{here}:7447")
    dynamics = machines.start("d", "dynamics", "--listen", "tcp/0.0.0.0:7447", *options(*SETTINGS))
    status, output, errors = finish(dynamics)
    assert status == 0, errors
    assert finish(aero)[0] == 0
    assert json.loads(output)["final_state_sha256"] == alone(tmp_path / "alone")


@pytest.mark.parametrize("secure", [False, True], ids=["plain", "tls"])
def test_machines_that_reach_only_a_router_give_the_same_bits(
    machines: Machines, tmp_path: Path, secure: bool
) -> None:
    machines.add("d", "a", "r")
    (at_dynamics, _), (at_aero, _) = machines.connect("r", "d"), machines.connect("r", "a")
    issue(tmp_path / "certs", [Role("router", (at_dynamics, at_aero)), Role("aero")], 2)
    issue(tmp_path / "certs", [Role("dynamics", ("localhost",))], 2)
    protocol, tls = ("tls", ["--tls", "certs"]) if secure else ("tcp", [])
    aero = machines.start("a", "aero", "--connect", f"{protocol}/{at_aero}:7447", *tls)
    dynamics = machines.start(
        "d", "dynamics", "--connect", f"{protocol}/{at_dynamics}:7447", *options(*SETTINGS), *tls
    )
    router = machines.start("r", "router", "--listen", f"{protocol}/0.0.0.0:7447", *tls)
    status, output, errors = finish(dynamics)
    assert status == 0, errors
    assert finish(aero)[0] == 0
    assert json.loads(output)["final_state_sha256"] == alone(tmp_path / "alone")
    router.terminate()
    assert finish(router)[0] == 130


def await_steps(log: Path) -> None:
    """Return as soon as the log shows that the run goes on."""
    deadline = time.monotonic() + PATIENCE
    goal = 200_000 + (log.stat().st_size if log.exists() else 0)
    while not log.exists() or log.stat().st_size < goal:
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.parametrize("cut", [0.2, 3.0 * LEASE])
def test_cut_cable_heals_within_the_lease_or_ends_the_run_with_its_reason(
    machines: Machines, tmp_path: Path, cut: float
) -> None:
    machines.add("d", "a")
    here, _ = machines.connect("d", "a")
    aero = machines.start("a", "aero", "--connect", f"tcp/{here}:7447")
    long = options("time.end=1000", "coupling.timeout=20")
    dynamics = machines.start("d", "dynamics", "--listen", "tcp/0.0.0.0:7447", *long)
    log = tmp_path / "out" / "log.mcap"
    await_steps(log)
    machines.cable("d", 1, "down")
    began = time.monotonic()
    time.sleep(cut)
    machines.cable("d", 1, "up")
    if cut < LEASE:
        await_steps(log)
        assert (dynamics.poll(), aero.poll()) == (None, None)
        dynamics.terminate()
        status, _, errors = finish(dynamics)
        assert status == 130, errors
    else:
        for process, error in ((dynamics, '"aero" was lost at step '), (aero, "the dynamics was lost")):
            status, _, errors = finish(process)
            assert status == 4, errors
            assert error in errors
            assert "or the network was cut" in errors
        assert time.monotonic() - began < cut + 5.0
    assert open_log(log).damage is None
    assert verify(*scenario_of(log)).identical
