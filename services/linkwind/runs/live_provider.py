"""A live provider against recorded motion: the accepted and trial states of a log are its dynamics.

Everything that the provider is sent has the bytes of the log. In the new log are motions and states as they
were recorded, with the provider's new wrenches; the total wrench in the states is the new one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from linkwind import aero
from linkwind.aero import Own
from linkwind.bus.base import DynamicsLink
from linkwind.credentials import DYNAMICS, identity_in
from linkwind.dynamics.exchanges import Exchanges
from linkwind.dynamics.recorder import MessageLog, tables_sha256
from linkwind.dynamics.recovery import Patience
from linkwind.dynamics.service import digest
from linkwind.errors import LogError
from linkwind.log.contents import MOTION, STATE, STEP, WRENCH
from linkwind.log.reader import Log
from linkwind.log.writer import LogWriter
from linkwind.mechanism import build
from linkwind.native.library import library_sha256
from linkwind.protocol import Course, DynamicsSession
from linkwind.runs import folder as folders
from linkwind.runs.here import providers_here, zenoh_link
from linkwind.runs.keeping import Kept, keep
from linkwind.runs.loads import Loads
from linkwind.runs.recorded_forces import check_fits
from linkwind.runs.substitution import metadata
from linkwind.scenario import Scenario

Progress = Callable[[int], None]


@dataclass(frozen=True)
class Answered:
    """What a live provider was asked.

    Attributes:
        steps: communication steps whose motion was sent.
        exchanges: motions answered.
        missing: why that is not the whole run; empty if it is.
        final_state_sha256: of the last accepted state that was sent.
    """

    steps: int
    exchanges: int
    missing: str
    final_state_sha256: str


class RecordedMotion:
    """The dynamics' side of a recorded run, with one live provider."""

    def __init__(self, log: Log, scenario: Scenario, changes: Mapping[int, Scenario], live: str) -> None:
        """Prepare; nothing is sent yet.

        Args:
            log: of the run.
            scenario: that the live provider gets.
            changes: scenarios that count after the communication point of a step, by step.
            live: name of the provider.

        Raises:
            LogError: the log has no motion.
        """
        self._log, self._scenario, self._live = log, scenario, live
        self._steps = [scenario, *changes.values()][-1].steps
        if not log.topics.get(MOTION):
            raise LogError(f"{log.path}: expected motions; got none. The run ended before its first.")
        self.session = DynamicsSession(
            run=log.run,
            scenario_json=scenario.to_json(),
            step_ns=scenario.coupling.step_ns,
            steps=self._steps,
            bodies=log.bodies,
            providers={live: log.provider_bodies[live]},
        )
        texts = {step: each.to_json() for step, each in changes.items()}
        recovery = scenario.bus.recovery > 0.0
        self.session.course = Course(scenario.checkpoint_every, changes=texts, recovery=recovery)

    def run(
        self, link: DynamicsLink, log: MessageLog, progress: Progress, poll: Callable[[], None] = lambda: None
    ) -> Answered:
        """Wait for the provider, send it every recorded motion, say goodbye.

        Args:
            link: an open end of the bus, answering control requests with :attr:`session`.
            log: takes everything that is exchanged, and what was recorded beside it.
            progress: is told now and then how many steps are done.
            poll: is called now and then while waiting for the provider; may raise to give up.

        Raises:
            LinkwindError: the provider did not come, cannot go on, or was lost.
        """
        session, motion = self.session, self.session.motion
        exchanges = Exchanges(session, link, log, Patience.of(self._scenario), poll)
        loads = Loads(self._log, session)
        asked, stride = 0, max(1, self._steps // 200)
        with exchanges.ended_for_all():
            exchanges.await_providers(self._scenario.bus.start_timeout)
            for topic, time_ns, payload in self._recorded():
                if topic == MOTION:
                    session.repeat(payload)
                    if motion.final or motion.at[0] > self._steps:
                        break
                    exchanges.ask(payload, lambda: None)
                    loads.answered()
                    asked += 1
                    if motion.at[0] % stride == 0:
                        progress(motion.at[0])
                elif topic == STATE:
                    log.state(loads.state(payload), time_ns)
                    log.scene(time_ns, loads.motion, loads.force)
                elif topic == STEP:
                    log.step(payload, time_ns)
                else:
                    loads.recorded(topic.removeprefix(WRENCH), payload)
                    log.wrench(topic.removeprefix(WRENCH), payload, time_ns)
            missing = self._missing()
            exchanges.say_goodbye(session.end())
        return Answered(motion.at[0], asked, missing, digest(motion.accepted))

    def _recorded(self) -> Iterator[tuple[str, int, bytes]]:
        """Yield topic, simulation time [ns] and payload of what was recorded, up to the first loss."""
        others = (name for name in self._log.provider_bodies if name != self._live)
        topics = (MOTION, STATE, STEP, *(WRENCH + name for name in others))
        numbers: dict[int, int] = {}
        for channel, number, time_ns, payload in self._log.messages(*topics):
            numbers[channel] = numbers.get(channel, 0) + 1
            if number != numbers[channel]:
                return
            yield self._log.channels[channel].topic, time_ns, payload

    def _missing(self) -> str:
        motion = self.session.motion
        if motion.final or motion.at[0] > self._steps:
            return ""
        reason = self._log.damage.text if self._log.damage else self._log.error or "the run was cut off"
        return f"the record ends at step {motion.at[0]} of {self._steps}: {reason}"


def live_provider(
    log: Log,
    live: str,
    scenario: Scenario,
    changes: Mapping[int, Scenario],
    out: Path | None,
    progress: Progress,
    *,
    own: Mapping[str, Own] = MappingProxyType({}),
    listen: Sequence[str] = (),
    connect: Sequence[str] = (),
    tls: Path | None = None,
    opened: Callable[[], None] = lambda: None,
) -> Kept[Answered]:
    """Ask a provider again about the motion of a log, with other settings, another model, another program.

    Args:
        log: of the run; may be cut or damaged.
        live: name of the provider.
        scenario: that the provider gets (:func:`linkwind.runs.substitution.changed`).
        changes: scenarios that count for it after the communication point of a step, by step.
        out: folder for the results; None for a new one under ``runs/``.
        progress: is told now and then how many steps are done.
        own: the model of the provider, if it is the user's own, by name.
        listen: zenoh endpoints to listen on, for a provider that comes from elsewhere.
        connect: zenoh endpoints to connect to, likewise; without any, the provider is started here.
        tls: folder with a certificate for each participant here; None without TLS.
        opened: is called when the endpoints for a provider from elsewhere are open.

    Raises:
        InputError: a setting is wrong, or the record does not fit it.
        LinkwindError: the provider ended early; the log and report tell as well.
    """
    check_fits(log, scenario)
    aero.check(scenario)
    recorded = RecordedMotion(log, scenario, changes, live)
    folder = folders.create(scenario.name, out)

    def new_log(path: Path) -> LogWriter:
        hashes = {"tables_sha256": tables_sha256(build(scenario)), "library_sha256": library_sha256()}
        return LogWriter(
            path,
            run=log.run,
            scenario_json=scenario.to_json(),
            body_names=log.bodies,
            provider_bodies=log.provider_bodies,
            metadata=hashes | metadata(log, live, changes),
        )

    def asked(link: DynamicsLink, poll: Callable[[], None]) -> Kept[Answered]:
        def job(writer: LogWriter) -> Answered:
            done = recorded.run(link, writer, progress, poll)
            error = LogError(f"{log.path}: {done.missing}") if done.missing else None
            writer.close(final_state_sha256=done.final_state_sha256, error=error)
            return done

        return keep(folder, link, new_log, job)

    if listen or connect:
        with folders.removed_if_refused(folder):
            link = zenoh_link(recorded.session, scenario, listen, connect, identity_in(tls, DYNAMICS))
        opened()
        return asked(link, lambda: None)
    with providers_here(recorded.session, scenario, folder, own, tls) as (link, poll):
        return asked(link, poll)
