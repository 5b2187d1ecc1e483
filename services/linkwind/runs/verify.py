"""Verify a log: run everything again from what the file contains, and compare bit for bit.

Nothing is written: every message of the new run is held against the recorded one of the same number as
soon as it is made, so that memory does not grow with the length of the run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from linkwind import schema
from linkwind.aero import Own
from linkwind.bus.base import DynamicsLink
from linkwind.dynamics.march import RecordedMarch
from linkwind.dynamics.recorder import Recorder, tables_sha256
from linkwind.dynamics.service import DynamicsService
from linkwind.errors import InputError, LinkwindError, LogError, StoppedError
from linkwind.log.contents import DYNAMICS, STATE, SUBSTITUTED
from linkwind.log.difference import Difference
from linkwind.log.reader import Log, open_log
from linkwind.log.scenarios import recorded, recorded_changes
from linkwind.log.versions import versions
from linkwind.mechanism import Mechanism, build
from linkwind.native.library import library_sha256
from linkwind.runs.comparison import Comparison
from linkwind.runs.here import inprocess_link
from linkwind.runs.live_provider import RecordedMotion
from linkwind.runs.own import refuse_missing
from linkwind.runs.recorded import DifferError, LogEndsError, RecordedWrenches
from linkwind.scenario import Scenario

Progress = Callable[[int], None]


@dataclass(frozen=True)
class Verified:
    """What a verification found.

    Attributes:
        difference: the first one, None if there is none.
        steps: communication steps whose accepted state was compared, up to the difference.
        messages: compared.
        changed: what is not as it was when the log was made, by name: then and now.
        remark: why not everything was compared; empty if it was.
    """

    difference: Difference | None
    steps: int
    messages: int
    changed: dict[str, tuple[str, str]]
    remark: str

    @property
    def identical(self) -> bool:
        """Whether everything that was compared has the same bits."""
        return self.difference is None


def verify(
    log: Log,
    scenario: Scenario,
    progress: Progress = lambda step: None,
    own: Mapping[str, Own] = MappingProxyType({}),
    *,
    from_recorded_wrenches: bool = False,
) -> Verified:
    """Run a log's scenario again and compare.

    Args:
        log: of the run.
        scenario: of the log (:func:`scenario_of`).
        progress: is told now and then how many steps are done.
        own: models of the user's own, by provider.
        from_recorded_wrenches: drive the dynamics with the wrenches of the log; they are not compared.

    Raises:
        LogError: there is nothing to compare.
        InputError: the log's scenario cannot be run here, or the user's own model is missing or another one,
            or a program that is not linkwind's answered recorded motion.
        StoppedError: Ctrl-C or SIGTERM.
    """
    live = log.metadata.get(SUBSTITUTED)
    if live in log.foreign:
        raise InputError(
            f'{log.path}: expected forces that linkwind can make again; got those of "{live}" '
            f"({log.foreign[live]}) against recorded motion. Ask it again: linkwind replay --substitute."
        )
    foreign = ", ".join(f'"{name}" ({program})' for name, program in log.foreign.items())
    recorded = from_recorded_wrenches or bool(foreign) or live == DYNAMICS
    if not recorded:
        refuse_missing(scenario, own, list(log.provider_bodies) if live is None else [live])
    mechanism = build(scenario)
    comparison = Comparison(log, scenario, mechanism, wrenches=not recorded)
    link, again = _again(log, scenario, mechanism, comparison, own, recorded=recorded)
    remarks = [] if log.complete else [_why(log)]
    if foreign:
        remarks.append(
            f"the forces of {foreign} were taken as recorded, as by --from-recorded-wrenches: they came from "
            "a program that is not linkwind's"
        )
    remark = "; ".join(remarks)
    difference: Difference | None = None
    with closing(link):
        try:
            digest = again(progress)
            difference = comparison.left_over("none: the run is over") or comparison.end(log, digest)
        except DifferError as found:
            difference = found.difference
        except LogEndsError as end:
            remark = "; ".join(filter(None, (remark, str(end))))
        except StoppedError:
            raise
        except LinkwindError as error:
            difference = comparison.left_over(f"none: the run ended with {error}")
            remark = f"{remark}; run again, it ends with {error}".removeprefix("; ")
    if comparison.compared == 0 and difference is None:
        raise LogError(f"{log.path}: expected messages to compare; got none. {remark}.")
    return Verified(difference, comparison.steps, comparison.compared, _changed(log, mechanism), remark)


def scenario_of(log: str | Path) -> tuple[Log, Scenario]:
    """Open a log and return it with the scenario that it contains."""
    opened = open_log(log)
    return opened, recorded(opened)


def orders_of(log: Log, scenario: Scenario) -> dict[str, int]:
    """Return the events that were commanded, each with the communication point after which it happened."""
    if not scenario.commands or not log.topics.get(STATE):
        return {}
    times = log.columns(STATE)["event_time"][-1]
    step = scenario.coupling.step_ns / 1e9
    happened = {event.name: at for event, at in zip(scenario.events, times.tolist(), strict=False)}
    return {name: int(happened[name] / step + 1e-6) for name in scenario.commands if happened[name] >= 0.0}


def _again(
    log: Log,
    scenario: Scenario,
    mechanism: Mechanism,
    comparison: Comparison,
    own: Mapping[str, Own],
    *,
    recorded: bool,
) -> tuple[DynamicsLink, Callable[[Progress], str]]:
    """Return a bus, and what makes everything again over it and returns the hash of the last state.

    Args:
        log: of the run.
        scenario: of the log.
        mechanism: of the scenario.
        comparison: takes the messages.
        own: models of the user's own, by provider.
        recorded: take the wrenches from the log.
    """
    live = log.metadata.get(SUBSTITUTED, DYNAMICS)
    if live == DYNAMICS:
        service = DynamicsService(
            scenario, mechanism, log.run, recorded_changes(log), orders_of(log, scenario)
        )
        session = service.session
        recorder = Recorder(comparison, scenario, mechanism, service.multibody)
        if recorded:
            link: DynamicsLink = RecordedWrenches(session, log)
        else:
            session.course = replace(session.course, recovery=False)  # nobody is ever lost here
            link = inprocess_link(session, own)
            service.march = RecordedMarch(comparison, link.providers)
        return link, lambda progress: service.run(link, recorder, progress).final_state_sha256
    if recorded:
        raise InputError(
            f"{log.path}: --from-recorded-wrenches: expected a log whose motion follows from its wrenches; "
            f'got one of "{live}" against recorded motion. Leave the option away.'
        )
    motion = RecordedMotion(log, scenario, recorded_changes(log), live)
    bus = inprocess_link(motion.session, own)
    return bus, lambda progress: motion.run(bus, comparison, progress).final_state_sha256


def _why(log: Log) -> str:
    if log.damage is not None:
        return f"the log is not complete: {log.damage.text}"
    return f"the log is not complete: {log.error or 'the run was cut off'}"


def _changed(log: Log, mechanism: Mechanism) -> dict[str, tuple[str, str]]:
    """Return what differs from when the log was made: versions, processor, library, schema, tables."""
    now = versions() | {
        "library_sha256": library_sha256(),
        "schema_sha256": schema.SHA256,
        "tables_sha256": tables_sha256(mechanism),
    }
    hashes = {name: log.metadata[name] for name in now if name in log.metadata}
    then = log.versions | hashes
    return {name: (then[name], now.get(name, "unknown")) for name in then if now.get(name) != then[name]}
