"""A short run: in one process, whose bits are known, and with two over zenoh, whose bits are the same."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from linkwind.doctor.finding import FAIL, OK, WARN, Finding
from linkwind.dynamics.recorder import Recorder
from linkwind.dynamics.service import DynamicsService, Result
from linkwind.log.writer import LogWriter
from linkwind.mechanism import build
from linkwind.runs.here import providers_here
from linkwind.scenario import load

SETTINGS = ("time.end=0.2", "bus.start_timeout=20")  # of two_link: 200 steps
KNOWN = "73e9ffd351c72cc5cdd0cc7bc79e208e954236bf22a51603c0be75a4b0243819"
SLOW = 2000.0  # µs for an exchange, ten times what two free cores need


def core() -> Iterator[Finding]:
    """Compute a known bit pattern."""
    result = fly("inprocess")
    found = f"final state of 200 steps {result.final_state_sha256[:12]}…"
    if result.final_state_sha256 == KNOWN:
        yield Finding("core", OK, found)
    else:
        yield Finding(
            "core",
            WARN,
            f"{found}, expected {KNOWN[:12]}…",
            "another C library or compiler may round otherwise; runs agree with each other here, but not bit "
            "for bit with those of other machines. Install linkwind again if you did not expect this",
        )


def zenoh() -> Iterator[Finding]:
    """Run in two processes and measure the round trip."""
    result = fly("zenoh")
    if result.final_state_sha256 != fly("inprocess").final_state_sha256:
        change = "this must not be: please report it, with the output of linkwind doctor --json"
        yield Finding("zenoh", FAIL, "two processes give other bits than one", change)
        return
    yield Finding("zenoh", OK, "two processes give the same bits as one")
    median, p99 = (result.exchange_us.quantile_us(share) for share in (0.5, 0.99))
    found = f"{median:.0f} µs median, {p99:.0f} µs p99"
    if median > SLOW:
        yield Finding("round trip", WARN, found, "other programs take the cores; runs will be as much slower")
    else:
        yield Finding("round trip", OK, found)


def fly(transport: str) -> Result:
    """Do the run over a transport."""
    scenario = load("two_link", [*SETTINGS, f"bus.transport={transport}"])
    service = DynamicsService(scenario, build(scenario), "doctor")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log = LogWriter(
            folder / "log.mcap", run="doctor", scenario_json=scenario.to_json(),
            body_names=service.mechanism.bodies, provider_bodies=service.session.providers, metadata={},
        )  # fmt: skip
        with providers_here(service.session, scenario, folder, {}) as (link, poll), closing(link), log:
            recorder = Recorder(log, scenario, service.mechanism, service.multibody)
            result = service.run(link, recorder, lambda step: None, poll)
            log.close(final_state_sha256=result.final_state_sha256)
    return result
