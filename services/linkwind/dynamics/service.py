"""The dynamics service: a coupling scheme drives the mechanism over the bus and keeps the log.

What is expensive but not urgent, the log above all, is done between posting a motion and the answer to
it, while the providers compute.
"""

from __future__ import annotations

import hashlib
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from linkwind.bus.base import DynamicsLink
from linkwind.coupling import SCHEMES, Answer, CommunicationPoint, Settings
from linkwind.dynamics.plant import MechanismPlant, State, acceleration_weight
from linkwind.dynamics.recorder import Recorder
from linkwind.dynamics.timing import ExchangeTimes
from linkwind.errors import LostError, ScenarioError, StoppedError
from linkwind.mechanism import Mechanism, build
from linkwind.protocol import Course, DynamicsSession, fault
from linkwind.scenario import Scenario
from linkwind.spatial import Motion

GOODBYE_TIMEOUT = 5.0  # s that a provider may take to commit the last state and say Bye


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
        final_state_sha256: of the last accepted poses and twists, little-endian float64, body by body.
    """

    steps: int
    exchanges: int
    wall_s: float
    exchange_us: ExchangeTimes
    joint_gap_max_m: float | None
    force_max_N: float  # noqa: N815  the unit's symbol
    final_state_sha256: str


class DynamicsService:
    """One run of a scenario, from the dynamics' side.

    Attributes:
        scenario: at the beginning.
        session: the protocol's state.
        mechanism: of the scenario.
        live_from: the first step whose exchange is timed.
    """

    def __init__(
        self,
        scenario: Scenario,
        mechanism: Mechanism,
        run: str,
        changes: Mapping[int, Scenario] = MappingProxyType({}),
    ) -> None:
        """Build the mechanism and the protocol's state; nothing is sent yet.

        Args:
            scenario: from the beginning on.
            mechanism: of the scenario.
            run: id of the run.
            changes: scenarios that count after the communication point of a step, by step.
        """
        self._changes = {step: (changed, build(changed)) for step, changed in sorted(changes.items())}
        self._steps = [scenario, *(changed for changed, _ in self._changes.values())][-1].steps
        self.live_from = 0
        self.session = DynamicsSession(
            run=run,
            scenario_json=scenario.to_json(),
            step_ns=scenario.coupling.step_ns,
            steps=self._steps,
            bodies=mechanism.bodies,
            providers={p.name: p.bodies for p in scenario.providers},
        )
        texts = {step: changed.to_json() for step, changed in changes.items()}
        self.session.course = Course(scenario.log.checkpoint_every, changes=texts)
        self.scenario = scenario
        self.mechanism = mechanism
        self._plant = MechanismPlant(mechanism, scenario, self.session.where)
        self.multibody = self._plant.multibody
        self._pending: deque[CommunicationPoint] = deque()
        self._times = ExchangeTimes()
        self._exchanges = 0

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
        self._link, self._recorder = link, recorder
        try:
            # A state that blows up is stopped by the core, with a reason; the log shows the way there.
            with np.errstate(over="ignore", invalid="ignore"):
                self._await_providers(poll)
                recorder.diagnostics({p.name: p.diagnostics for p in self.session.participants.values()})
                start = time.perf_counter()
                final = self._march(progress)
                wall = time.perf_counter() - start
                self._say_goodbye(final, poll)
        except KeyboardInterrupt:
            stopped = StoppedError(f"stopped at {self.session.where()}")
            link.fault(fault("dynamics", *self.session.motion.at, stopped))
            raise stopped from None
        except BaseException as error:
            link.fault(fault("dynamics", *self.session.motion.at, error))
            raise
        return Result(
            steps=self._steps,
            exchanges=self._exchanges,
            wall_s=wall,
            exchange_us=self._times,
            joint_gap_max_m=recorder.joint_gap_max if self.mechanism.has_joints else None,
            force_max_N=recorder.force_max,
            final_state_sha256=self._digest(final),
        )

    def _await_providers(self, poll: Callable[[], None]) -> None:
        timeout = self.scenario.bus.start_timeout
        if not self._link.wait(lambda: not self.session.not_ready, timeout, poll):
            missing = " and ".join(f'"{name}"' for name in self.session.not_ready)
            raise LostError(
                f"{missing} did not come within {timeout:g} s (bus.start_timeout). Start it with: "
                f"linkwind aero --connect ENDPOINT --name {self.session.not_ready[0]}"
            )

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
        )
        scheme = SCHEMES[scenario.coupling.scheme]
        if scenario.coupling.scheme == "implicit" and self.session.cannot_go_back:
            names = " and ".join(f'"{name}"' for name in self.session.cannot_go_back)
            raise ScenarioError(
                f"{scenario.source}: coupling.scheme: implicit: expected providers that can go back to the "
                f"start of a step; got {names}, which cannot. Use pec."
            )
        stride = max(1, self._steps // 200)
        state = self._plant.initial
        for point in scheme(self._plant, self._exchange, state, self._steps, settings):
            self._pending.append(point)  # written while the next answer is awaited
            state = point.state
            if point.step % stride == 0:
                progress(point.step)
            if point.step in self._changes:
                self._change(point.step, *self._changes[point.step])
        return state

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
        self.multibody = self._recorder.multibody = self._plant.multibody

    def _exchange(self, step: int, iteration: int, accepted: State, trial: State) -> Answer:
        """Post both states, write the log, return the sum of the providers' answers."""
        session, link, motion = self.session, self._link, self.session.motion
        self._plant.multibody.motion(accepted.values, motion.accepted)
        self._plant.multibody.motion(trial.values, motion.trial)
        start, payload = time.perf_counter_ns(), session.post(step, iteration)
        link.post(payload)
        self._write_pending()
        self._recorder.motion(payload, motion.time_ns)
        while not session.answered:
            provider, answer = link.receive()
            if session.accept(provider, answer):
                self._recorder.wrench(provider, answer, motion.time_ns)
        took = time.perf_counter_ns() - start
        self._exchanges += 1
        if step >= self.live_from:
            self._times.add(took)
        self._recorder.timing(step, motion.time_ns, took)
        self._take_shown()
        return Answer(*session.total())

    def _write_pending(self) -> None:
        while self._pending:
            self._recorder.point(self._pending.popleft())

    def _take_shown(self) -> None:
        """Write frames and checkpoints that came with the last answers: after all of these, in one order."""
        for provider, payload in sorted(self._link.checkpoints(), key=lambda sent: sent[0]):
            time_ns = self.session.checkpoint(provider, payload).time_ns
            self._recorder.checkpoint(provider, payload, time_ns)
        for provider, payload in sorted(self._link.frames(), key=lambda sent: sent[0]):
            self._recorder.frame(provider, self.session.frame(provider, payload))

    def _say_goodbye(self, final: State, poll: Callable[[], None]) -> None:
        motion = self.session.motion
        self._plant.multibody.motion(final.values, motion.accepted)
        self._plant.multibody.motion(final.values, motion.trial)
        payload = self.session.post(self._steps, 0, final=True)
        self._link.post(payload)
        self._write_pending()
        self._recorder.motion(payload, motion.time_ns)
        if not self._link.wait(lambda: not self.session.not_gone, GOODBYE_TIMEOUT, poll):
            missing = " and ".join(f'"{name}"' for name in self.session.not_gone)
            raise LostError(f"{missing} did not say Bye within {GOODBYE_TIMEOUT:g} s of the last step")
        self._take_shown()
        self.session.check_frames()

    def _digest(self, final: State) -> str:
        motion = Motion.at_rest(len(self.mechanism.bodies))
        self._plant.multibody.motion(final.values, motion)
        parts = [motion.position, motion.orientation, motion.linear, motion.angular]
        return hashlib.sha256(np.hstack(parts).astype("<f8").tobytes()).hexdigest()
