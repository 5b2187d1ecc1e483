"""Go on with a run from its log: to the end that it would have had, to the bit, or with other settings.

The dynamics is run again from the recorded wrenches up to a step K. The providers begin with what they saved
at a checkpoint K0 ≤ K, or at the beginning, and are given the recorded motions up to K (`splice`). From the
step after K on, both are live.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from linkwind import aero
from linkwind.aero import Own
from linkwind.bus.base import DynamicsLink
from linkwind.dynamics.published import PublishedLog
from linkwind.dynamics.service import DynamicsService
from linkwind.errors import InputError, LogError
from linkwind.log.contents import CHANGES, RESUMED_STEP, RETURNS, SUBSTITUTED
from linkwind.log.reader import Log
from linkwind.log.scenarios import recorded, recorded_changes
from linkwind.log.writer import LogWriter
from linkwind.mechanism import build
from linkwind.runs import folder as folders
from linkwind.runs.changes import split
from linkwind.runs.comparison import Comparison, finder
from linkwind.runs.record import Record, checkpoint_steps, last_step, states_at
from linkwind.runs.run import Beginning, Ends, Outcome, Progress, with_elsewhere, with_providers
from linkwind.runs.splice import ContinuedLog, SplicedLink
from linkwind.runs.successor import Successor
from linkwind.runs.verify import orders_of
from linkwind.runs.watch import Watch
from linkwind.scenario import Scenario, from_json


@dataclass(frozen=True)
class Plan:
    """Where a run goes on, and how.

    Attributes:
        log: of the run.
        scenario: from the beginning on.
        changes: scenarios that count after a step, by that step.
        last: K, the last step that is taken from the log; -1 for none.
        start: K0, the step that the providers have a checkpoint of; -1 for the beginning.
    """

    log: Log
    scenario: Scenario
    changes: Mapping[int, Scenario]
    last: int
    start: int

    @property
    def steps(self) -> int:
        """Number of communication steps of the whole run."""
        return [self.scenario, *self.changes.values()][-1].steps


@dataclass(frozen=True)
class Resumed:
    """A run that went on, and where."""

    outcome: Outcome
    plan: Plan

    def as_json(self) -> dict[str, Any]:
        """Return the outcome with the keys of ``linkwind resume --json``."""
        return self.outcome.as_json() | {"resumed_at": self.plan.last, "checkpoint": self.plan.start}


def plan(log: Log, from_step: int | None = None, overrides: Sequence[str] = ()) -> Plan:
    """Find out where a run goes on.

    Args:
        log: of the run; may be cut or damaged.
        from_step: K; None for the last step whose exchange is whole.
        overrides: ``KEY=VALUE`` settings that count from there on.

    Raises:
        LogError: the log has no exchange, or K is behind its last one.
        ScenarioError: a setting is wrong, or may not change in a run.
        InputError: the run is over, and nothing is to be done.
    """
    if SUBSTITUTED in log.metadata:
        raise InputError(
            f"{log.path}: expected a run with both sides live; got one with a recorded side. Make it again "
            "from the record, with linkwind replay --substitute."
        )
    scenario = recorded(log)
    step_ns = scenario.coupling.step_ns
    last = last_step(log, step_ns)
    if from_step is not None and not 0 <= from_step <= last:
        raise LogError(
            f"{log.path}: --from-step: expected a step from 0 to {last}, the last whose exchange is whole; "
            f"got {from_step}."
        )
    if from_step is None and log.complete and not overrides:
        raise InputError(
            f"{log.path}: expected a run that was cut; got one that came to its end. Branch from it with "
            "--from-step K and --set KEY=VALUE, or go on with --set time.end=T."
        )
    last = last if from_step is None else from_step
    changes = {step: each for step, each in recorded_changes(log).items() if step <= last}
    scenario, changes = _settings(scenario, changes, last, overrides)
    found = Plan(log, scenario, changes, last, max(_checkpoints(log, step_ns, last), default=-1))
    if found.steps < last:
        raise InputError(
            f"{log.path}: time.end: expected an end after step {last}, from which the run goes on; got step "
            f"{found.steps}. Use --from-step, or a later end."
        )
    return found


def _checkpoints(log: Log, step_ns: int, last: int) -> list[int]:
    return [step for step in checkpoint_steps(log, step_ns) if step <= last]


def _settings(
    scenario: Scenario, changes: dict[int, Scenario], last: int, overrides: Sequence[str]
) -> tuple[Scenario, dict[int, Scenario]]:
    """Return the scenarios of the resumed run: at the beginning, and by step after which they count."""
    newest = [scenario, *(changes[step] for step in sorted(changes))][-1]
    how, physics = split(newest, overrides)
    scenario = from_json(scenario.to_json(), scenario.source, how)
    if physics:
        changes = changes | {last: from_json(newest.to_json(), newest.source, physics)}
    return scenario, changes


def resume(
    found: Plan,
    out: Path | None,
    progress: Progress = lambda step: None,
    own: Mapping[str, Own] = MappingProxyType({}),
    tls: Path | None = None,
    watch: Watch | None = None,
    *,
    report: bool = True,
) -> Resumed:
    """Go on with a run, with every provider on this machine.

    Args:
        found: where and how.
        out: folder for the results; None for a new one under ``runs/``.
        progress: is told now and then how many steps are done, those from the log included.
        own: models of the user's own, by provider.
        tls: folder with a certificate for each participant; None without TLS.
        watch: shows the run, and holds it; None for nobody.
        report: make the page of the run.

    Raises:
        InputError: a provider was not linkwind's, so that it cannot be started here.
        MismatchError: what was recorded does not come out again here.
        LinkwindError: the run ended early; its log and report tell as well.
    """
    for name, program in found.log.foreign.items():
        raise InputError(
            f'{found.log.path}: provider "{name}": expected a model of linkwind; got {program}. Let it come '
            "from elsewhere: --listen ENDPOINT."
        )
    service, beginning = _continued(found)
    folder = folders.create(found.scenario.name, out)
    done = with_providers(service, folder, progress, own, beginning, tls, watch, report=report)
    return Resumed(done, found)


def resume_elsewhere(
    found: Plan, out: Path | None, progress: Progress, ends: Ends, watch: Watch | None = None
) -> Resumed:
    """Go on with a run, with providers that are started elsewhere; see :func:`resume`.

    Args:
        found: where and how.
        out: folder for the results; None for a new one under ``runs/``.
        progress: is told now and then how many steps are done, those from the log included.
        ends: where they meet.
        watch: shows the run, and holds it; None for nobody.
    """
    service, beginning = _continued(found)
    folder = folders.create(found.scenario.name, out)
    return Resumed(with_elsewhere(service, folder, progress, ends, beginning, watch), found)


def resume_here(
    found: Plan,
    progress: Progress,
    ends: Ends,
    watch: Watch | None = None,
    *,
    listened: bool = False,
    release: Callable[[], None] = lambda: None,
) -> Resumed:
    """Go on with a run in its own folder, with providers that are started elsewhere; see :func:`resume`.

    The new log takes the place of the old one as soon as it holds as much (:mod:`linkwind.runs.successor`).
    """
    successor = Successor(found.log, lambda: watch is None or watch.opened, release)
    service, beginning = _continued(found, successor)
    try:
        folder = found.log.path.parent
        done = with_elsewhere(service, folder, progress, ends, beginning, watch, listened=listened)
        return Resumed(done, found)
    finally:
        successor.end()


def _continued(found: Plan, successor: Successor | None = None) -> tuple[DynamicsService, Beginning]:
    """Return the dynamics of a run that goes on, and what stands in front of it."""
    log, scenario, step_ns = found.log, found.scenario, found.scenario.coupling.step_ns
    mechanism = build(scenario)
    for each in (scenario, *found.changes.values()):
        aero.check(each)
    states = states_at(log, found.start, step_ns) if found.start >= 0 else {}
    before = {name: step for name, step in orders_of(log, scenario).items() if step < found.last}
    service = DynamicsService(scenario, mechanism, log.run, found.changes, before)
    service.live_from = found.last + 1
    session = service.session
    session.course = dataclasses.replace(session.course, start=found.start, states=states)
    record = Record(log, step_ns, found.last)

    def link(live: DynamicsLink) -> DynamicsLink:
        return SplicedLink(session, live, record, found.start, finder(scenario, mechanism))

    def new_log(writer: LogWriter, log: LogWriter | PublishedLog) -> ContinuedLog:
        for back in found.log.record(RETURNS).values():
            writer.returned(**json.loads(back))
        comparison = Comparison(found.log, scenario, mechanism, wrenches=False)
        return ContinuedLog(writer, log, record, comparison, found.last, step_ns, successor)

    return service, Beginning(_metadata(found), link, new_log, successor)


def _metadata(found: Plan) -> dict[str, str]:
    """Return what the new log says of where it comes from."""
    record = {"resumed_run": found.log.run, RESUMED_STEP: str(found.last)} if found.last >= 0 else {}
    if found.changes:
        changes = {str(step): changed.to_json() for step, changed in found.changes.items()}
        record[CHANGES] = json.dumps(changes)
    return record
