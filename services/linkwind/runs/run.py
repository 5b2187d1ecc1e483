"""One run: providers as processes of their own, the dynamics here, then the report."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from linkwind import aero
from linkwind.aero import Own
from linkwind.bus.base import DynamicsLink
from linkwind.credentials import Identity
from linkwind.dynamics import methods
from linkwind.dynamics.published import PublishedLog, topics
from linkwind.dynamics.recorder import MessageLog, Recorder, tables_sha256
from linkwind.dynamics.service import DynamicsService, Result
from linkwind.errors import LostError, ScenarioError
from linkwind.listening import description
from linkwind.log.writer import LogWriter
from linkwind.mechanism import Mechanism, build
from linkwind.mechanism.doubts import doubts
from linkwind.native.library import library_sha256
from linkwind.runs import folder as folders
from linkwind.runs import room
from linkwind.runs.here import providers_here, zenoh_link
from linkwind.runs.keeping import keep
from linkwind.runs.successor import Successor
from linkwind.runs.watch import Watch
from linkwind.scenario import Scenario

_log = logging.getLogger("linkwind")


@dataclass(frozen=True)
class Outcome:
    """A finished run.

    Attributes:
        scenario: its name.
        result: what it came to.
        log: the MCAP file.
        report: the HTML page; None if none was asked for.
        report_trouble: why there is no page; empty if there is one.
        log_trouble: why the log ends before the run does; empty if it does not.
    """

    scenario: str
    result: Result
    log: Path
    report: Path | None
    report_trouble: str = ""
    log_trouble: str = ""

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
            "events": result.events,
            "returns": [back._asdict() for back in result.returns],
            "final_state_sha256": result.final_state_sha256,
            "log": str(self.log),
            "log_trouble": self.log_trouble or None,
            "report": None if self.report_trouble or not self.report else str(self.report),
        }


Progress = Callable[[int], None]
Heard = LogWriter | PublishedLog


@dataclass(frozen=True)
class Ends:
    """Where a dynamics meets providers that are started elsewhere.

    Attributes:
        listen: zenoh endpoints to listen on.
        connect: zenoh endpoints to connect to.
        identity: the dynamics' certificate; None without TLS.
        opened: is called when these are open.
    """

    listen: Sequence[str]
    connect: Sequence[str]
    identity: Identity | None = None
    opened: Callable[[], None] = lambda: None


@dataclass(frozen=True)
class Beginning:
    """What a run made from a log puts in front of the bus and of the new log; the new log says so.

    Attributes:
        metadata: for the new log.
        link: puts something in front of the bus.
        log: puts something in front of the new log; is given what writes it, and what publishes it as well.
        successor: what the new log is until it takes the place of the one in the same folder; None if there
            is none.
    """

    metadata: Mapping[str, str]
    link: Callable[[DynamicsLink], DynamicsLink] = lambda link: link
    log: Callable[[LogWriter, Heard], MessageLog] = lambda writer, heard: heard
    successor: Successor | None = None


NEW = Beginning({})


def run(
    scenario: Scenario,
    out: Path | None = None,
    progress: Progress = lambda step: None,
    own: Mapping[str, Own] = MappingProxyType({}),
    tls: Path | None = None,
    watch: Watch | None = None,
    *,
    report: bool = True,
) -> Outcome:
    """Run ``scenario`` with every provider on this machine.

    Args:
        scenario: what to run.
        out: folder for the results; None for a new one under ``runs/``.
        progress: is told now and then how many steps are done.
        own: models of the user's own, by provider.
        tls: folder with a certificate for each participant; None without TLS.
        watch: shows the run, and holds it; None for nobody.
        report: make the page of the run.

    Raises:
        LinkwindError: the run ended early; its log and report tell as well.
    """
    mechanism = checked(scenario)
    folder = folders.create(scenario.name, out)
    service = DynamicsService(scenario, mechanism, folders.run_id(folder))
    return with_providers(service, folder, progress, own, tls=tls, watch=watch, report=report)


def checked(scenario: Scenario) -> Mechanism:
    """Return the mechanism of a scenario.

    Raises:
        InputError: it makes no mechanism, or no run.
    """
    mechanism = build(scenario)
    methods.check(mechanism, scenario)
    aero.check(scenario)
    for doubt in doubts(scenario):
        _log.warning("note: %s", doubt)
    return mechanism


def with_providers(
    service: DynamicsService,
    folder: Path,
    progress: Progress,
    own: Mapping[str, Own],
    beginning: Beginning = NEW,
    tls: Path | None = None,
    watch: Watch | None = None,
    *,
    report: bool = True,
) -> Outcome:
    """Run a service with every provider on this machine; see :func:`run`."""
    with (
        folders.removed_if_refused(folder),
        providers_here(service.session, service.scenario, folder, own, tls) as (link, poll),
    ):
        return drive(service, folder, progress, link, poll, beginning, watch, report=report)


def dynamics(
    scenario: Scenario,
    out: Path | None,
    progress: Progress,
    ends: Ends,
    *,
    run_id: str = "",
    watch: Watch | None = None,
    listened: bool = False,
) -> Outcome:
    """Run the dynamics alone; the providers come from elsewhere. See :func:`run`.

    Args:
        scenario: what to run.
        out: folder for the results; None for a new one under ``runs/``.
        progress: is told now and then how many steps are done.
        ends: where they meet.
        run_id: id of the run; empty for the folder's name.
        watch: who looks at the run while it goes on, if anybody.
        listened: do not begin before somebody listens to all of the log.

    Raises:
        LostError: nobody listens within bus.start_timeout.
        ScenarioError: the scenario wants everything in one process.
    """
    mechanism = checked(scenario)
    folder = folders.create(scenario.name, out)
    service = DynamicsService(scenario, mechanism, run_id or folders.run_id(folder))
    return with_elsewhere(service, folder, progress, ends, watch=watch, listened=listened)


def with_elsewhere(
    service: DynamicsService,
    folder: Path,
    progress: Progress,
    ends: Ends,
    beginning: Beginning = NEW,
    watch: Watch | None = None,
    *,
    listened: bool = False,
) -> Outcome:
    """Run a service with providers that are started elsewhere; see :func:`dynamics`."""
    scenario = service.scenario
    with folders.removed_if_refused(folder):
        if scenario.bus.transport == "inprocess":
            raise ScenarioError(
                f'{scenario.source}: bus.transport: expected "zenoh", to meet providers that are started '
                'elsewhere; got "inprocess". Use: linkwind run'
            )
        link = zenoh_link(service.session, scenario, ends.listen, ends.connect, ends.identity)
    ends.opened()
    return drive(service, folder, progress, link, beginning=beginning, watch=watch, listened=listened)


def drive(
    service: DynamicsService,
    folder: Path,
    progress: Progress,
    link: DynamicsLink,
    poll: Callable[[], None] = lambda: None,
    beginning: Beginning = NEW,
    watch: Watch | None = None,
    *,
    listened: bool = False,
    report: bool = True,
) -> Outcome:
    """Run the service over an open end of the bus, close that, and keep the log; see :func:`run`."""
    successor = beginning.successor

    def job(writer: LogWriter) -> Result:
        service.returned = lambda back: writer.returned(*back)
        if watch is not None:
            watch.begin(writer)
            service.hold = _holding(watch, service, writer, poll)
        with _heard(writer, link, service, listened=listened) as heard:
            log = beginning.log(writer, heard)
            recorder = Recorder(log, service.scenario, service.mechanism, service.multibody)
            looking = room.looking(progress, writer, service.scenario.steps)
            result = service.run(beginning.link(link), recorder, looking, poll)
            if successor is not None:
                successor.replace(writer)
            writer.close(final_state_sha256=result.final_state_sha256)
        return result

    def new_log(path: Path) -> LogWriter:
        path = path if successor is None else successor.path
        return _new_log(path, service, beginning.metadata)

    kept = keep(folder, link, new_log, job, report=report)
    aero.check_after(service.scenario, kept.result.reported_max)
    return Outcome(
        service.scenario.name, kept.result, kept.log, kept.report, kept.report_trouble, kept.log_trouble
    )


def _heard(
    writer: LogWriter, link: DynamicsLink, service: DynamicsService, *, listened: bool
) -> AbstractContextManager[Heard]:
    """Return a log that others on the bus can listen to, where there are others.

    Raises:
        LostError: somebody must listen, and nobody does within bus.start_timeout.
    """
    session, timeout = service.session, service.scenario.bus.start_timeout
    about = description(session.run, service.scenario.to_json(), writer.records)
    stream = link.listeners(topics(list(session.providers)), about)
    if stream is None:
        return nullcontext(writer)
    if listened and not link.wait(lambda: stream.followed, timeout, lambda: None):
        raise LostError(
            f"nobody listened within {timeout:g} s (bus.start_timeout). Start: linkwind record --connect "
            "ENDPOINT, or leave --await-listener away"
        )
    return PublishedLog(writer, stream, session.run)


def _holding(
    watch: Watch, service: DynamicsService, writer: LogWriter, poll: Callable[[], None]
) -> Callable[[int, Callable[[], None]], None]:
    """Return what lets a step of the service wait as long as those who watch it want."""
    step_ns = service.scenario.coupling.step_ns

    def hold(step: int, write_accepted: Callable[[], None]) -> None:
        def rest() -> None:
            write_accepted()
            writer.flush()

        watch.hold(step * step_ns, rest, poll)

    return hold


def _new_log(path: Path, service: DynamicsService, metadata: Mapping[str, str]) -> LogWriter:
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
        required=service.scenario.log.required,
    )
