"""A run that waits for a provider that was lost, instead of ending.

Another process of that provider gets its last checkpoint and the motions since, answers them once more, and
takes part from where it was lost (:mod:`linkwind.protocol.past`). Whoever started the first one starts it.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from linkwind.bus.base import DynamicsLink
from linkwind.errors import AnswerTimeoutError, LostError
from linkwind.protocol import DynamicsSession
from linkwind.scenario import Scenario

_log = logging.getLogger("linkwind")

ATTEMPTS = 3  # losses without an answer in between after which a provider is given up
FOREVER = float("inf")


class Return(NamedTuple):
    """A provider that came back.

    Attributes:
        provider: its name.
        step: of the last motion when it was lost.
        after_s: wall clock from when its loss was noticed until it was ready [s].
    """

    provider: str
    step: int
    after_s: float


@dataclass(frozen=True)
class Patience:
    """How long a run waits.

    Attributes:
        hello: until another process of the provider says Hello [s]; 0: a loss ends the run.
        start: until it is ready then [s] …
        answer: … and more for each motion that it has to answer again [s].
    """

    hello: float = 0.0
    start: float = 60.0
    answer: float = 2.0

    @classmethod
    def of(cls, scenario: Scenario) -> Patience:
        """Return what a scenario says."""
        return cls(scenario.bus.recovery, scenario.bus.start_timeout, scenario.coupling.timeout)


@dataclass
class Absence:
    """A provider that is not there.

    Attributes:
        loss: the last one, if another process of it came and was lost as well.
        since: when the first one was noticed [s].
        lost_at: when the last one was noticed [s].
        hello_at: when another process said Hello after that [s]; None: none did.
    """

    loss: LostError
    since: float
    lost_at: float
    hello_at: float | None = None


class Recovery:
    """Waits for providers that were lost.

    Attributes:
        returns: of providers that came back, so far.
        returned: is told of each.
    """

    def __init__(
        self, session: DynamicsSession, link: DynamicsLink, patience: Patience, poll: Callable[[], None]
    ) -> None:
        """Prepare.

        Args:
            session: the protocol's state.
            link: an open end of the bus that answers control requests with it.
            patience: how long to wait.
            poll: is called now and then while waiting; may raise to give up.
        """
        self.returns: list[Return] = []
        self.returned: Callable[[Return], None] = lambda back: None
        self._session, self._link, self._patience, self._poll = session, link, patience, poll
        self._absent: dict[str, Absence] = {}
        self._attempts: dict[str, tuple[bytes, int]] = {}  # last answer at the last loss, losses since then

    def bring_back(self, loss: LostError) -> None:
        """Wait until every provider is there again.

        Args:
            loss: of a provider.

        Raises:
            LostError: it is, or another, and cannot come back, or does not in time.
        """
        self._lose(loss)
        self._await()

    def replace(self, late: AnswerTimeoutError) -> None:
        """Take providers that are alive and do not answer for lost, if they are ended then; wait for others.

        Args:
            late: what they are.

        Raises:
            AnswerTimeoutError: the same; nobody would end them.
            LostError: see :meth:`bring_back`.
        """
        silent = self._session.unanswered
        if not (self._patience.hello and all(self._session.participants[n].replaceable for n in silent)):
            raise late
        _log.warning("%s. It is ended", late)
        for name in silent:
            self._lose(LostError(str(late), name))
        self._await()

    def _await(self) -> None:
        """Wait until nobody is absent any more."""
        while self._absent:
            try:
                self._link.wait(lambda: bool(self._here()), FOREVER, self._look)
            except LostError as another:
                self._lose(another)
            for name in self._here():
                self._back(name)

    def _here(self) -> list[str]:
        """Return who was absent and is ready."""
        return [name for name in self._absent if self._session.participants[name].ready]

    def _lose(self, loss: LostError) -> None:
        if not (loss.provider and self._patience.hello):
            raise loss
        name, now = loss.provider, time.monotonic()
        known, last = self._session.participants[name], self._attempts.get(name)
        if name in self._absent and not known.instance:
            known.here = False
            return  # the same one: its lease was over, it was on the bus again for a moment, and has ended
        answer = known.payload
        attempts = last[1] + 1 if last and last[0] == answer else 1
        self._attempts[name] = answer, attempts
        if attempts == ATTEMPTS:
            raise LostError(f"{loss}. It was lost {ATTEMPTS} times without an answer in between: given up")
        try:
            self._session.lose(name)
        except LostError as never:
            raise LostError(f"{loss}. {never}") from None
        before = self._absent.get(name)
        self._absent[name] = Absence(loss, before.since if before else now, now)
        _log.warning(
            '"%s" was lost at %s; waiting up to %g s for it to come back',
            name,
            self._session.where(),
            self._patience.hello,
        )

    def _back(self, name: str) -> None:
        after = time.monotonic() - self._absent.pop(name).since
        _log.warning('"%s" is back after %.1f s', name, after)
        self.returns.append(Return(name, self._session.motion.at[0], after))
        self.returned(self.returns[-1])

    def _look(self) -> None:
        """Raise LostError when a provider has been away for too long."""
        self._poll()
        now = time.monotonic()
        for name, absence in self._absent.items():
            known = self._session.participants[name]
            if absence.hello_at is None and known.instance:
                absence.hello_at = now
            if absence.hello_at is None:
                if now > absence.lost_at + self._patience.hello:
                    raise LostError(
                        f'{absence.loss}. No other "{name}" came within {self._patience.hello:g} s '
                        f"(bus.recovery). Start it again: linkwind aero --connect ENDPOINT --name {name}, or "
                        "let a supervisor do so (aero --stay, a restart policy); or raise bus.recovery"
                    )
                continue
            motions = len(known.past.answers) if known.past and known.here else 0
            limit = self._patience.start + motions * self._patience.answer
            if now > absence.hello_at + limit:
                raise LostError(
                    f"{absence.loss}. Another one came, but was not ready within {limit:g} s "
                    f"(bus.start_timeout, and coupling.timeout for each of {motions} motions). Look at its "
                    "output; lower log.checkpoint_every"
                )
