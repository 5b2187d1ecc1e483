"""A bus without a network on which providers die, at any moment that there is, and come back."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

from linkwind.checkpoints import PIECE
from linkwind.errors import LostError, RefusedError
from linkwind.protocol import DynamicsSession, ProviderSession, ProviderState

Make = Callable[[str], ProviderSession]


class Died(Exception):  # noqa: N818  no error: it is what shall happen
    """A provider has died."""


class MortalLink:
    """The dynamics' end; providers live in this thread, and nothing that they have sent is lost with them.

    Attributes:
        moments: at which each provider could have died so far: between any two things that others can see.
        lives: processes of each provider so far.
        told: how often a loss is told: one whose lease is over may be back for a moment before it ends.
        piece: bytes of a checkpoint that a provider gets back at once.
    """

    told = 1
    piece = PIECE

    def __init__(
        self, session: DynamicsSession, make: Make, deaths: Mapping[str, Collection[int]], limit: int = 1000
    ) -> None:
        """Prepare.

        Args:
            session: of the dynamics.
            make: returns a new provider.
            deaths: of each provider, by the number of the moment.
            limit: processes of a provider that come; later nobody does.
        """
        self.moments: Counter[str] = Counter()
        self.lives: Counter[str] = Counter()
        session.course = replace(session.course, piece=self.piece)
        self._session, self._make, self._deaths, self._limit = session, make, deaths, limit
        self._alive: dict[str, ProviderSession] = {}
        self._gone: set[str] = set()
        self._answers: deque[tuple[str, bytes]] = deque()
        self._frames: list[tuple[str, bytes]] = []
        self._losses: deque[LostError] = deque()

    def _moment(self, name: str) -> None:
        self.moments[name] += 1
        if self.moments[name] in self._deaths.get(name, ()):
            raise Died

    def _come(self, name: str) -> None:
        """Let a provider come, as ``linkwind.aero.service.serve`` does."""
        provider = self._make(name)
        self.lives[name] += 1
        seen = False
        answer = provider.answer

        def answer_or_die(payload: bytes) -> bytes | None:
            self._moment(name)  # before it computes
            answered = answer(payload)
            self._moment(name)  # when it has computed, and has told nobody
            return answered

        provider.answer = answer_or_die  # type: ignore[method-assign]
        try:
            provider.welcome(self._session.control(provider.hello()))
            self._moment(name)
            while (missing := provider.fetch()) is not None:
                provider.fetched(self._session.control(missing))
                self._moment(name)
            provider.build()
            seen = True  # its liveliness token is there
            self._moment(name)
            provider.catch_up()
            self._moment(name)
            provider.started(self._session.control(provider.ready()))
            self._alive[name] = provider
            self._moment(name)
        except Died:
            self._alive.pop(name, None)
            if seen:
                self._lost(name)
        except RefusedError:
            assert self._session.failure is not None
            raise self._session.failure from None

    def _lost(self, name: str) -> None:
        self._losses.extend([LostError(f'"{name}" was lost', name)] * self.told)

    def wait(self, done: Callable[[], bool], timeout: float, poll: Callable[[], None]) -> bool:
        while True:
            if self._losses:
                raise self._losses.popleft()
            if done():
                return True
            poll()
            absent = [n for n in self._session.providers if n not in self._alive and n not in self._gone]
            for name in absent:
                if self.lives[name] < self._limit:
                    self._come(name)

    def post(self, motion: bytes) -> None:
        for name in list(self._alive):
            try:
                self._ask(name, self._alive[name], motion)
            except Died:
                del self._alive[name]
                self._lost(name)

    repeat = post

    def _ask(self, name: str, provider: ProviderSession, motion: bytes) -> None:
        answer = provider.answer(motion)
        for frame in provider.frames():
            self._frames.append((name, frame))
            self._moment(name)
        for piece in provider.pieces():
            self._session.piece(name, piece)
            self._moment(name)
        if answer is not None:
            self._answers.append((name, answer))
            self._moment(name)
        elif provider.state is ProviderState.DONE:
            self._session.control(provider.bye())
            del self._alive[name]
            self._gone.add(name)

    def receive(self) -> tuple[str, bytes]:
        if self._losses:
            raise self._losses.popleft()
        return self._answers.popleft()

    def frames(self) -> list[tuple[str, bytes]]:
        taken, self._frames = self._frames, []
        return taken

    def listeners(self, topics: Sequence[str], description: bytes) -> None:
        pass

    def fault(self, payload: bytes) -> None:
        pass

    def close(self) -> None:
        pass
