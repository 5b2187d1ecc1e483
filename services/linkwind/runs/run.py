"""One run: providers as processes of their own, the dynamics here, then the report."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType, MappingProxyType
from typing import Any

from linkwind import aero
from linkwind.bus.base import DynamicsLink
from linkwind.dynamics.recorder import MessageLog, Recorder, tables_sha256
from linkwind.dynamics.service import DynamicsService, Result
from linkwind.errors import InputError, LinkwindError, ScenarioError
from linkwind.log.writer import LogWriter
from linkwind.mechanism import build
from linkwind.native.library import library_sha256
from linkwind.runs import folder as folders
from linkwind.runs.children import children
from linkwind.scenario import Scenario

PORTS_TRIED = 5


@dataclass(frozen=True)
class Outcome:
    """A finished run.

    Attributes:
        scenario: its name.
        result: what it came to.
        log: the MCAP file.
        report: the HTML page.
        report_trouble: why there is no page; empty if there is one.
    """

    scenario: str
    result: Result
    log: Path
    report: Path
    report_trouble: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return the outcome with the keys of ``linkwind run --json``."""
        result = self.result
        return {
            "scenario": self.scenario,
            "steps": result.steps,
            "exchanges": result.exchanges,
            "wall_s": result.wall_s,
            "exchange_us": {
                "median": result.exchange_us.quantile_us(0.5),
                "p99": result.exchange_us.quantile_us(0.99),
            },
            "joint_gap_max_m": result.joint_gap_max_m,
            "force_max_N": result.force_max_N,
            "final_state_sha256": result.final_state_sha256,
            "log": str(self.log),
            "report": None if self.report_trouble else str(self.report),
        }


Progress = Callable[[int], None]


@dataclass(frozen=True)
class Beginning:
    """What a run that goes on from a log puts in front of the bus and of the new log; the log says so."""

    link: Callable[[DynamicsLink], DynamicsLink]
    log: Callable[[LogWriter], MessageLog]
    metadata: Mapping[str, str]


def run(
    scenario: Scenario,
    out: Path | None,
    progress: Progress,
    files: Mapping[str, Path] = MappingProxyType({}),
) -> Outcome:
    """Run ``scenario`` with every provider on this machine.

    Args:
        scenario: what to run.
        out: folder for the results; None for a new one under ``runs/``.
        progress: is told now and then how many steps are done.
        files: of the providers whose model is made from a file, by name.

    Raises:
        LinkwindError: the run ended early; its log and report tell as well.
    """
    mechanism = build(scenario)
    aero.check(scenario)
    folder = folders.create(scenario.name, out)
    service = DynamicsService(scenario, mechanism, folders.run_id(folder))
    return with_providers(service, folder, progress, files)


def with_providers(
    service: DynamicsService,
    folder: Path,
    progress: Progress,
    files: Mapping[str, Path],
    beginning: Beginning | None = None,
) -> Outcome:
    """Run a service with every provider on this machine; see :func:`run`."""
    scenario = service.scenario
    if scenario.bus.transport == "inprocess":
        return _drive(service, folder, progress, _inprocess(service, files), lambda: None, beginning)
    link, endpoint = _listen_here(service, scenario)
    with children(folder) as providers:
        for name in service.session.providers:
            arguments = ["aero", "--connect", endpoint, "--name", name, "--run", service.session.run]
            if name in files:
                arguments += ["--force-fmu", str(files[name].resolve())]
            providers.start(name, [*arguments, "--start-timeout", str(scenario.bus.start_timeout)])
        return _drive(service, folder, progress, link, providers.check, beginning)


def dynamics(
    scenario: Scenario,
    out: Path | None,
    progress: Progress,
    *,
    run_id: str,
    listen: Sequence[str],
    connect: Sequence[str],
) -> Outcome:
    """Run the dynamics alone; the providers come from elsewhere. See :func:`run`.

    Raises:
        ScenarioError: the scenario wants everything in one process.
    """
    if scenario.bus.transport == "inprocess":
        raise ScenarioError(
            f'{scenario.source}: bus.transport: expected "zenoh", to meet providers that are started '
            'elsewhere; got "inprocess". Use: linkwind run'
        )
    mechanism = build(scenario)
    aero.check(scenario)
    folder = folders.create(scenario.name, out)
    service = DynamicsService(scenario, mechanism, run_id or folders.run_id(folder))
    try:
        link = zenoh_link(service, scenario, listen, connect)
    except InputError:
        folder.rmdir()
        raise
    return _drive(service, folder, progress, link, lambda: None)


def _drive(
    service: DynamicsService,
    folder: Path,
    progress: Progress,
    link: DynamicsLink,
    poll: Callable[[], None],
    beginning: Beginning | None = None,
) -> Outcome:
    """Run the service, close the log with how it ended, write the report either way."""
    log, report, scenario = folder / "log.mcap", folder / "report.html", service.scenario
    metadata = beginning.metadata if beginning else {}
    try:
        with terminate_as_interrupt(), closing(link), _open_log(log, service, metadata) as writer:
            messages = beginning.log(writer) if beginning else writer
            recorder = Recorder(messages, scenario, service.mechanism, service.multibody)
            result = service.run(beginning.link(link) if beginning else link, recorder, progress, poll)
            writer.close(final_state_sha256=result.final_state_sha256)
    except LinkwindError as error:
        if not log.exists():
            raise
        raise type(error)(f"{error}\nlog: {log}\nreport: {_report(log, report) or report}") from error
    return Outcome(scenario.name, result, log, report, _report(log, report))


def _report(log: Path, report: Path) -> str:
    """Write the report; return what went wrong, which must not hide how the run went."""
    from linkwind.report import write_report

    try:
        write_report(log, report)
    except LinkwindError as error:
        return str(error)
    return ""


def _listen_here(service: DynamicsService, scenario: Scenario) -> tuple[DynamicsLink, str]:
    """Open the dynamics' end on a free port of this machine; return it and its endpoint."""
    from linkwind.bus.zenoh import loopback_endpoint

    for _ in range(PORTS_TRIED):
        endpoint = loopback_endpoint()
        try:
            return zenoh_link(service, scenario, [endpoint], []), endpoint
        except InputError as error:  # somebody took the port between asking and listening
            taken = error
    raise taken


def _open_log(path: Path, service: DynamicsService, metadata: Mapping[str, str]) -> LogWriter:
    return LogWriter(
        path,
        run=service.session.run,
        scenario_json=service.scenario.to_json(),
        body_names=service.mechanism.bodies,
        provider_bodies=service.session.providers,
        metadata={
            "tables_sha256": tables_sha256(service.mechanism),
            "library_sha256": library_sha256(),
            **metadata,
        },
    )


def zenoh_link(
    service: DynamicsService, scenario: Scenario, listen: Sequence[str], connect: Sequence[str]
) -> DynamicsLink:
    """Open the dynamics' end of a zenoh bus."""
    from linkwind.bus.zenoh import ZenohDynamicsLink

    return ZenohDynamicsLink(service.session, listen, connect, scenario.coupling.timeout)


def _inprocess(service: DynamicsService, files: Mapping[str, Path]) -> DynamicsLink:
    from linkwind.aero.service import session
    from linkwind.bus.inprocess import InProcessLink

    return InProcessLink(
        service.session, [session(name, files.get(name)) for name in service.session.providers]
    )


@contextmanager
def terminate_as_interrupt() -> Iterator[None]:
    """Let SIGTERM end the block the way Ctrl-C does, so that the log is closed and nobody is left waiting."""

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
