"""One exchange after the other with the providers: they come, answer motion after motion, and leave.

What is expensive but not urgent, the log above all, is done between posting a motion and the answer to it,
while the providers compute.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from linkwind.bus.base import DynamicsLink
from linkwind.dynamics.recorder import MessageLog
from linkwind.dynamics.recovery import Patience, Recovery
from linkwind.errors import AnswerTimeoutError, LostError, StoppedError
from linkwind.log.state import TimingEncoder
from linkwind.protocol import DynamicsSession, fault

GOODBYE_TIMEOUT = 5.0  # s that a provider may take to commit the last state and say Bye, if not for an answer


class Exchanges:
    """The providers of a run, behind a link; everything that is exchanged goes to the log.

    Attributes:
        recovery: of providers that are lost on the way.
    """

    def __init__(
        self,
        session: DynamicsSession,
        link: DynamicsLink,
        log: MessageLog,
        patience: Patience,
        poll: Callable[[], None] = lambda: None,
    ) -> None:
        """Prepare.

        Args:
            session: the protocol's state.
            link: an open end of the bus that answers control requests with it.
            log: takes everything that is exchanged.
            patience: with providers that are lost.
            poll: is called now and then while waiting for providers to come and go; may raise to give up.
        """
        self._session, self._link, self._log, self._poll = session, link, log, poll
        self.recovery = Recovery(session, link, patience, poll)
        self._goodbye = max(GOODBYE_TIMEOUT, patience.answer)
        self._timing = TimingEncoder()

    @contextmanager
    def ended_for_all(self) -> Iterator[None]:
        """Tell every provider why, if the block ends early.

        Raises:
            StoppedError: Ctrl-C or SIGTERM.
        """
        try:
            yield
        except KeyboardInterrupt:
            stopped = StoppedError(f"stopped at {self._session.where()}")
            self._link.fault(fault("dynamics", *self._session.motion.at, stopped))
            raise stopped from None
        except BaseException as error:
            self._link.fault(fault("dynamics", *self._session.motion.at, error))
            raise

    def await_providers(self, timeout: float) -> None:
        """Wait until every provider is ready; [s].

        Raises:
            LostError: a provider did not come.
        """
        session = self._session
        if not self._wait(lambda: not session.not_ready, timeout):
            missing = " and ".join(f'"{name}"' for name in session.not_ready)
            raise LostError(
                f"{missing} did not come within {timeout:g} s (bus.start_timeout). Start it with: "
                f"linkwind aero --connect ENDPOINT --name {session.not_ready[0]}"
            )
        self._log.diagnostics({p.name: p.diagnostics for p in session.participants.values()})
        self._log.programs({p.name: p.program for p in session.participants.values()})

    def ask(self, payload: bytes, meanwhile: Callable[[], None]) -> int:
        """Send a motion that the session has, take every answer; return how long that took [ns].

        Args:
            payload: the motion.
            meanwhile: is done while the providers compute.
        """
        session, link, log, time_ns = self._session, self._link, self._log, self._session.motion.time_ns
        start = time.perf_counter_ns()
        link.post(payload)
        meanwhile()
        log.motion(payload, time_ns)
        while not session.answered:
            provider, answer = self._receive(payload)
            if session.accept(provider, answer):
                log.wrench(provider, answer, time_ns)
        took = time.perf_counter_ns() - start
        log.timing(self._timing.encode(session.motion.at[0], took), time_ns)
        self._take_shown()
        return took

    def _receive(self, payload: bytes) -> tuple[str, bytes]:
        """Return the next wrench message and its provider; a loss on the way is made good."""
        while True:
            try:
                return self._link.receive()
            except LostError as loss:
                self.recovery.bring_back(loss)
            except AnswerTimeoutError as late:
                self.recovery.replace(late)
            self._link.repeat(payload)

    def _wait(self, done: Callable[[], bool], timeout: float, payload: bytes = b"") -> bool:
        """Wait until ``done`` holds, like the link; a loss on the way is made good, with the last motion."""
        while True:
            try:
                return self._link.wait(done, timeout, self._poll)
            except LostError as loss:
                self.recovery.bring_back(loss)
                if payload:
                    self._link.repeat(payload)

    def _take_shown(self) -> None:
        """Write frames and checkpoints that came with the last answers: after all of these, in one order."""
        for provider, checkpoint in sorted(self._session.checkpoints(), key=lambda taken: taken[0]):
            for piece in checkpoint.pieces(self._session.run, provider):
                self._log.checkpoint(provider, piece, checkpoint.time_ns)
        for provider, sent in sorted(self._link.frames(), key=lambda shown: shown[0]):
            frame = self._session.frame(provider, sent)
            if frame is not None:
                self._log.frame(provider, frame)

    def say_goodbye(self, payload: bytes, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Send the last motion and wait for every Bye; see :meth:`ask`.

        Raises:
            AnswerTimeoutError: a provider did not say it.
        """
        session = self._session
        self._link.post(payload)
        meanwhile()
        self._log.motion(payload, session.motion.time_ns)
        while not self._wait(lambda: not session.not_gone, self._goodbye, payload):
            missing = " and ".join(f'"{name}"' for name in session.not_gone)
            late = f"{missing} did not say Bye within {self._goodbye:g} s of the last step; it is alive"
            self.recovery.replace(AnswerTimeoutError(late))
            self._link.repeat(payload)
        self._take_shown()
        session.check_frames()
