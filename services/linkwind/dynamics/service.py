"""The dynamics service: a coupling scheme drives the mechanism over the bus and keeps the log."""

from __future__ import annotations

import hashlib
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from linkwind.bus.base import DynamicsLink
from linkwind.coupling import SCHEMES, Answer, CommunicationPoint, DegreeControl, History, Settings
from linkwind.dynamics.exchanges import Exchanges
from linkwind.dynamics.march import RecordedMarch
from linkwind.dynamics.plant import MechanismPlant, State, acceleration_weight
from linkwind.dynamics.recorder import Recorder
from linkwind.dynamics.recovery import Patience, Return
from linkwind.dynamics.timing import ExchangeTimes
from linkwind.errors import ScenarioError
from linkwind.mechanism import Mechanism, build
from linkwind.protocol import Course, DynamicsSession
from linkwind.scenario import Scenario
from linkwind.spatial import Motion

SILENT = 10_000  # steps at most between two words of progress


@dataclass(frozen=True)
class Result:
    """What a run came to.

    Attributes:
        steps: macro steps done.
        exchanges: motions answered.
        wall_s: wall clock from the first to the last exchange [s].
        exchange_us: wall clock of the exchanges, from posting to the last answer.
        joint_gap_max_m: largest distance of two joint points, from the poses; None without joints [m].
        force_max_N: largest aerodynamic force on a body [N].
        events: when each event happened [s]; None: it did not.
        returns: of providers that were lost and came back.
        reported_max: the largest of each of a provider's own numbers, by provider and name; NaN if it never
            was one.
        final_state_sha256: of the last accepted poses and twists, little-endian float64, body by body.
    """

    steps: int
    exchanges: int
    wall_s: float
    exchange_us: ExchangeTimes
    joint_gap_max_m: float | None
    force_max_N: float  # noqa: N815  the unit's symbol
    events: dict[str, float | None]
    returns: tuple[Return, ...]
    reported_max: dict[str, dict[str, float]]
    final_state_sha256: str


class DynamicsService:
    """One run of a scenario, from the dynamics' side.

    Attributes:
        scenario: at the beginning.
        session: the protocol's state.
        mechanism: of the scenario.
        live_from: the first step whose exchange is timed.
        hold: is called before a step with its number, and may wait; what else it is given writes to the log
            what has been accepted. None for nothing.
        returned: is told of each provider that was lost and came back.
        march: takes steps of which there is a record. None for nothing.
    """

    def __init__(
        self,
        scenario: Scenario,
        mechanism: Mechanism,
        run: str,
        changes: Mapping[int, Scenario] = MappingProxyType({}),
        orders: Mapping[str, int] = MappingProxyType({}),
    ) -> None:
        """Build the mechanism and the protocol's state; nothing is sent yet.

        Args:
            scenario: from the beginning on.
            mechanism: of the scenario.
            run: id of the run.
            changes: scenarios that count after the communication point of a step, by step.
            orders: events that were commanded, and the communication points after which they happened.
        """
        self._changes = {step: (changed, build(changed)) for step, changed in sorted(changes.items())}
        self._steps = [scenario, *(changed for changed, _ in self._changes.values())][-1].steps
        self.live_from = 0
        self.hold: Callable[[int, Callable[[], None]], None] | None = None
        self.returned: Callable[[Return], None] = lambda back: None
        self.march: RecordedMarch | None = None
        self.session = DynamicsSession(
            run=run,
            scenario_json=scenario.to_json(),
            step_ns=scenario.coupling.step_ns,
            steps=self._steps,
            bodies=mechanism.bodies,
            providers={p.name: p.bodies for p in scenario.providers},
        )
        texts = {step: changed.to_json() for step, changed in changes.items()}
        recovery = scenario.bus.recovery > 0.0
        self.session.course = Course(scenario.checkpoint_every, changes=texts, recovery=recovery)
        self.scenario = scenario
        self.mechanism = mechanism
        self._plant = MechanismPlant(mechanism, scenario, self.session.where)
        self.multibody = self._plant.multibody
        self.session.commands = scenario.commands
        self._order(orders)
        self._pending: deque[CommunicationPoint] = deque()
        self._times = ExchangeTimes()
        self._exchanged = 0

    def run(
        self,
        link: DynamicsLink,
        recorder: Recorder,
        progress: Callable[[int], None],
        poll: Callable[[], None] = lambda: None,
    ) -> Result:
        """Wait for the providers, do every step, say goodbye.

        Args:
            link: an open end of the bus, answering control requests with :attr:`session`.
            recorder: takes everything that is exchanged and accepted.
            progress: is told now and then how many steps are done.
            poll: is called now and then while waiting for the providers; may raise to give up.

        Raises:
            LostError: a provider did not come, died or was stopped.
            AnswerTimeoutError, FaultError, ProtocolError, SimulationError: as they say.
            StoppedError: Ctrl-C or SIGTERM.
        """
        self._recorder = recorder
        self._exchanges = Exchanges(self.session, link, recorder.log, Patience.of(self.scenario), poll)
        self._exchanges.recovery.returned = self.returned
        # A state that blows up is stopped by the core, with a reason; the log shows the way there.
        with self._exchanges.ended_for_all(), np.errstate(over="ignore", invalid="ignore"):
            self._exchanges.await_providers(self.scenario.bus.start_timeout)
            start = time.perf_counter()
            final = self._march(progress)
            wall = time.perf_counter() - start
            self._say_goodbye(final)
        return Result(
            steps=self._steps,
            exchanges=self._exchanged,
            wall_s=wall,
            exchange_us=self._times,
            joint_gap_max_m=recorder.joint_gap_max if self.mechanism.has_joints else None,
            force_max_N=recorder.force_max,
            events=self._happened(final),
            returns=tuple(self._exchanges.recovery.returns),
            reported_max={
                p.name: dict(zip(p.diagnostics, p.largest.tolist(), strict=True))
                for p in self.session.participants.values()
            },
            final_state_sha256=digest(self.session.motion.accepted),
        )

    def _happened(self, final: State) -> dict[str, float | None]:
        """Return when each event of the scenario happened [s], without the stops."""
        times = final.values[len(final.values) - self.multibody.events :].tolist()
        names = [event.name for event in self.scenario.events]
        return {name: at if at >= 0.0 else None for name, at in zip(names, times, strict=False)}

    def _march(self, progress: Callable[[int], None]) -> State:
        """Let the coupling scheme do every step; return the last state."""
        scenario, mechanism = self.scenario, self.mechanism
        settings = Settings(
            weight=acceleration_weight(mechanism),
            order=scenario.coupling.order,
            adaptive=scenario.coupling.adaptive,
            held=self.session.mean,
            acceleration=scenario.coupling.acceleration,
            tolerance=scenario.coupling.tolerance,
            iterations=scenario.coupling.iterations,
            march=self._go_ahead if self.march else None,
        )
        scheme = SCHEMES[scenario.coupling.scheme]
        if scenario.coupling.scheme == "implicit" and self.session.cannot_go_back:
            names = " and ".join(f'"{name}"' for name in self.session.cannot_go_back)
            raise ScenarioError(
                f"{scenario.source}: coupling.scheme: implicit: expected providers that can go back to the "
                f"start of a step; got {names}, which cannot. Use pec."
            )
        stride, due = min(max(1, self._steps // 200), SILENT), 0
        state = self._plant.initial
        for point in scheme(self._plant, self._exchange, state, self._steps, settings):
            self._pending.append(point)  # written while the next answer is awaited
            state = point.state
            if point.step >= due:
                progress(point.step)
                due = point.step + stride
            while self.session.ordered:
                self._order({self.session.ordered.pop(0): self.session.motion.at[0]})
            if point.step in self._changes:
                self._change(point.step, *self._changes[point.step])
        return state

    def _go_ahead(
        self, step: int, accepted: State, history: History, degree: DegreeControl
    ) -> tuple[int, State]:
        """Take the recorded steps from ``step`` on; see :class:`linkwind.coupling.base.March`."""
        assert self.march is not None
        self._write_pending()
        place = accepted, history, degree
        last = self.march.go(self.session, self._plant, self._recorder, self._alike(step), *place)
        self._exchanged += last.step - accepted.step
        return last.step + 1, last

    def _alike(self, step: int) -> int:
        """Return how many steps from this one on neither are the last nor save, change or order anything."""
        every = self.session.course.checkpoint_every
        others = [self._steps, *(order + 1 for order in self._plant.orders.values())]
        others += [special for changed in self._changes for special in (changed, changed + 1)]
        if every:
            others.append(-(-(step - 1) // every) * every + 1)
        return min(other for other in others if other >= step) - step

    def _order(self, orders: Mapping[str, int]) -> None:
        for event, step in orders.items():
            self._plant.order(self.mechanism.events.index(event), step)

    def _change(self, step: int, scenario: Scenario, mechanism: Mechanism) -> None:
        """Go on under other settings after a communication point that is final."""
        last = self.session.motion.at[0]
        if last != step:
            raise ScenarioError(
                f"step {step}: expected a point behind the start of {scenario.coupling.scheme}; got one of "
                f"the first {last + 1}, which are computed together. Change at step {last} or later."
            )
        self._write_pending()
        self._plant.change(mechanism, scenario)
        self.multibody = self._plant.multibody
        self._recorder.use(self.multibody)

    def _exchange(self, step: int, iteration: int, accepted: State, trial: State) -> Answer:
        """Post both states, write the log, return the sum of the providers' answers."""
        if self.hold is not None and iteration == 0:
            self.hold(step, self._write_pending)
        motion = self.session.motion
        self._plant.multibody.motion(accepted.values, motion.accepted)
        self._plant.multibody.motion(trial.values, motion.trial)
        took = self._exchanges.ask(self.session.post(step, iteration), self._write_pending)
        self._exchanged += 1
        if step >= self.live_from:
            self._times.add(took)
        return Answer(*self.session.total())

    def _write_pending(self) -> None:
        while self._pending:
            self._recorder.point(self._pending.popleft())

    def _say_goodbye(self, final: State) -> None:
        motion = self.session.motion
        self._plant.multibody.motion(final.values, motion.accepted)
        self._plant.multibody.motion(final.values, motion.trial)
        payload = self.session.post(self._steps, 0, final=True)
        self._exchanges.say_goodbye(payload, self._write_pending)


def digest(motion: Motion) -> str:
    """Return the SHA-256 of poses and twists, little-endian float64, body by body."""
    parts = [motion.position, motion.orientation, motion.linear, motion.angular]
    return hashlib.sha256(np.hstack(parts).astype("<f8").tobytes()).hexdigest()
