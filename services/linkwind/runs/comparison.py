"""The messages of a run made again, held against the recorded ones as soon as they are made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from linkwind.frames import Frame
from linkwind.log.contents import FRAMES, MOTION, STATE, STEP, WRENCH
from linkwind.log.difference import Difference, Finder, between_frames
from linkwind.log.frames import encode, topic_of
from linkwind.log.reader import Log
from linkwind.mechanism import Mechanism
from linkwind.native.march import Recording
from linkwind.runs.recorded import DifferError, LogEndsError, Recorded
from linkwind.scenario import Scenario
from linkwind.spatial import Array, Motion


class Comparison:
    """Takes the messages of the new run in the place of a log (:class:`~linkwind.dynamics.recorder`)."""

    def __init__(self, log: Log, scenario: Scenario, mechanism: Mechanism, *, wrenches: bool) -> None:
        providers = [provider.name for provider in scenario.providers] if wrenches else []
        topics = [MOTION, *(kind + name for kind in (*FRAMES, WRENCH) for name in providers), STATE, STEP]
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

    def scene(self, time_ns: int, motion: Motion, force: Array) -> None:
        """Pictures follow from the states."""

    def frame(self, provider: str, frame: Frame) -> None:
        if provider in self._wrenches:
            self._compare(topic_of(frame, provider), encode(frame), frame.time_ns)

    def checkpoint(self, provider: str, payload: bytes, time_ns: int) -> None:
        """What a model remembers is its own; what follows from it is compared."""

    def diagnostics(self, names: Mapping[str, Sequence[str]]) -> None:
        """Names follow from the scenario and the program."""

    def programs(self, programs: Mapping[str, str]) -> None:
        """Here they are linkwind's."""

    def ahead(self, step: int, count: int) -> Recording:
        """Return what the messages of steps have to be; see :class:`linkwind.dynamics.march.Record`."""
        time_ns, topics = step * self._step_ns, [MOTION, *self._wrenches.values(), STATE, STEP]
        found = [self._recorded[topic].ahead(count, time_ns, self._step_ns) for topic in topics]
        least = min(map(len, found))
        motion, *wrenches, state, at_end = (payloads[:least] for payloads in found)
        return Recording(motion, wrenches, state, at_end)

    def passed(self, step: int, count: int) -> None:
        """Take messages as compared; see :class:`linkwind.dynamics.march.Record`."""
        topics = [MOTION, *self._wrenches.values(), STATE, STEP]
        for topic in topics:
            self._recorded[topic].skip(count)
        self.compared += count * len(topics)
        if count:
            self.steps = step + count - 1

    def _compare(self, topic: str, payload: bytes, time_ns: int) -> bool:
        """Hold a message against the recorded one; False if the file has lost that."""
        found = self._recorded[topic].take()
        if found is None:
            self._missing(topic, time_ns)
            return False
        _, _, recorded_ns, recorded = found
        if recorded != payload:
            if topic.startswith(FRAMES):
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
