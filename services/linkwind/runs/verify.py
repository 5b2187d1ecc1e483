"""Verify a log: run everything again from what the file contains, and compare bit for bit.

Nothing is written: every message of the new run is held against the recorded one of the same number as
soon as it is made, so that memory does not grow with the length of the run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from linkwind import schema
from linkwind.bus.base import DynamicsLink
from linkwind.dynamics.recorder import Recorder, tables_sha256
from linkwind.dynamics.service import DynamicsService
from linkwind.errors import LinkwindError, LogError
from linkwind.frames import FlowFrame
from linkwind.log import grid
from linkwind.log.contents import FLOW, MOTION, STATE, STEP, WRENCH
from linkwind.log.difference import Difference, Finder, between_frames
from linkwind.log.reader import Log, open_log
from linkwind.log.versions import versions
from linkwind.mechanism import Mechanism, build
from linkwind.native.library import library_sha256
from linkwind.runs.recorded import DifferError, LogEndsError, Recorded, RecordedWrenches
from linkwind.scenario import Scenario, from_json
from linkwind.spatial import Motion, Wrench

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
    files: Mapping[str, Path] = MappingProxyType({}),
    *,
    from_recorded_wrenches: bool = False,
) -> Verified:
    """Run a log's scenario again and compare.

    Args:
        log: of the run.
        scenario: of the log (:func:`scenario_of`).
        progress: is told now and then how many steps are done.
        files: of the providers whose model is made from a file, by name.
        from_recorded_wrenches: drive the dynamics with the wrenches of the log; they are not compared.

    Raises:
        LogError: there is nothing to compare.
        InputError: the log's scenario cannot be run here, or a file is missing or another one.
    """
    mechanism = build(scenario)
    service = DynamicsService(scenario, mechanism, log.run)
    comparison = _Comparison(log, scenario, mechanism, wrenches=not from_recorded_wrenches)
    link: DynamicsLink
    link = RecordedWrenches(service.session, log) if from_recorded_wrenches else _providers(service, files)
    remark = "" if log.complete else _why(log)
    difference: Difference | None = None
    with closing(link):
        try:
            recorder = Recorder(comparison, scenario, mechanism, service.multibody)
            digest = service.run(link, recorder, progress).final_state_sha256
            difference = comparison.left_over("none: the run is over") or comparison.end(log, digest)
        except DifferError as found:
            difference = found.difference
        except LogEndsError as end:
            remark = "; ".join(filter(None, (remark, str(end))))
        except LinkwindError as error:
            difference = comparison.left_over(f"none: the run ended with {error}")
            remark = f"{remark}; run again, it ends with {error}".removeprefix("; ")
    if comparison.compared == 0 and difference is None:
        raise LogError(f"{log.path}: expected messages to compare; got none. {remark}.")
    return Verified(difference, comparison.steps, comparison.compared, _changed(log, mechanism), remark)


def scenario_of(log: str | Path) -> tuple[Log, Scenario]:
    """Open a log and return it with the scenario that it contains."""
    opened = open_log(log)
    return opened, from_json(opened.scenario_json)


def _providers(service: DynamicsService, files: Mapping[str, Path]) -> DynamicsLink:
    from linkwind.aero.service import session
    from linkwind.bus.inprocess import InProcessLink

    providers = [session(name, files.get(name)) for name in service.session.providers]
    return InProcessLink(service.session, providers)


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


class _Comparison:
    """Takes the messages of the new run in the place of a log (:class:`~linkwind.dynamics.recorder`)."""

    def __init__(self, log: Log, scenario: Scenario, mechanism: Mechanism, *, wrenches: bool) -> None:
        providers = [provider.name for provider in scenario.providers] if wrenches else []
        topics = [MOTION, *(kind + name for kind in (FLOW, WRENCH) for name in providers), STATE, STEP]
        self._recorded = {topic: Recorded(log, topic) for topic in topics}
        self._complete = log.complete
        self._step_ns = scenario.coupling.step_ns
        self._finder = finder(scenario, mechanism)
        self._wrenches = {name: WRENCH + name for name in providers}
        self.compared = 0
        self.steps = 0

    def motion(self, payload: bytes, time_ns: int) -> None:
        self._compare(MOTION, payload, time_ns)

    def wrench(self, provider: str, payload: bytes, time_ns: int) -> None:
        if provider in self._wrenches:
            self._compare(self._wrenches[provider], payload, time_ns)

    def state(self, payload: bytes, time_ns: int) -> None:
        if self._compare(STATE, payload, time_ns):
            self.steps = time_ns // self._step_ns

    def step(self, payload: bytes, time_ns: int) -> None:
        self._compare(STEP, payload, time_ns)

    def timing(self, payload: bytes, time_ns: int) -> None:
        """Wall-clock times are no result."""

    def scene(self, time_ns: int, motion: Motion, wrench: Wrench) -> None:
        """Pictures follow from the states."""

    def frame(self, provider: str, frame: FlowFrame) -> None:
        if provider in self._wrenches:
            self._compare(FLOW + provider, grid.encode(frame), frame.time_ns)

    def checkpoint(self, provider: str, payload: bytes, time_ns: int) -> None:
        """What a model remembers is its own; what follows from it is compared."""

    def diagnostics(self, names: Mapping[str, Sequence[str]]) -> None:
        """Names follow from the scenario and the program."""

    def _compare(self, topic: str, payload: bytes, time_ns: int) -> bool:
        """Hold a message against the recorded one; False if the file has lost that."""
        found = self._recorded[topic].take()
        if found is None:
            self._missing(topic, time_ns)
            return False
        _, _, recorded_ns, recorded = found
        if recorded != payload:
            if topic.startswith(FLOW):
                raise DifferError(between_frames(topic, self._step_ns, recorded, payload))
            raise DifferError(self._finder.between(topic, time_ns, recorded, payload))
        if recorded_ns != time_ns:
            at = (topic, time_ns // self._step_ns, time_ns, 0)
            raise DifferError(Difference(*at, "log_time", None, None, recorded_ns, time_ns, None))
        self.compared += 1
        return True

    def _missing(self, topic: str, time_ns: int) -> None:
        if self._complete:
            at = (topic, time_ns // self._step_ns, time_ns, 0)
            raise DifferError(Difference(*at, "message", None, None, "none", "one", None))
        if all(recorded.next is None for recorded in self._recorded.values()):
            raise LogEndsError(f"it ends at step {time_ns // self._step_ns}")

    def left_over(self, again: str) -> Difference | None:
        """Return the first recorded message that the new run did not make; ``again`` says why not."""
        left = [(r.next[2], topic) for topic, r in self._recorded.items() if r.next is not None]
        if not left:
            return None
        time_ns, topic = min(left, key=lambda one: one[0])  # of one time: as they follow from each other
        at = (topic, time_ns // self._step_ns, time_ns, 0)
        return Difference(*at, "message", None, None, "one", again, None)

    def end(self, log: Log, again: str) -> Difference | None:
        """Compare the hash of the last state, which the log has at its end."""
        recorded = log.final_state_sha256
        if recorded in (None, again):
            return None
        at = (STATE, self.steps, self.steps * self._step_ns, 0)
        return Difference(*at, "final_state_sha256", None, None, recorded, again, None)


def finder(scenario: Scenario, mechanism: Mechanism) -> Finder:
    """Return what names the places of this scenario's messages."""
    tables = mechanism.tables
    nq, nv = len(mechanism.q0), len(mechanism.v0)
    owners = {}
    for name, first, size in (("q", tables.q_index, nq), ("v", tables.v_index, nv)):
        body = {start: mechanism.bodies[i] for i, start in enumerate(first.tolist())}
        owners[name] = _filled(body, size)
    return Finder(mechanism.bodies, {p.name: p.bodies for p in scenario.providers}, owners)


def _filled(body: dict[int, str], size: int) -> list[str]:
    """Return the body of each coordinate, from the places at which those of a body begin."""
    names: list[str] = []
    for place in range(size):
        names.append(body.get(place, names[-1] if names else ""))
    return names
