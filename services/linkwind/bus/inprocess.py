"""Both sides in one process: the same messages, handed over by calling."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

from linkwind.errors import FaultError, LinkwindError
from linkwind.frames import Sent
from linkwind.protocol import DynamicsSession, ProviderSession, fault_error


class InProcessLink:
    """The dynamics' end of a bus whose providers live in the same thread.

    Attributes:
        providers: in the scenario's order.
    """

    def __init__(self, session: DynamicsSession, providers: Sequence[ProviderSession]) -> None:
        """Shake hands with every provider.

        Raises:
            LinkwindError: a provider is refused or cannot build its model.
        """
        self._session = session
        self.providers = list(providers)
        self._answers: deque[tuple[str, bytes]] = deque()
        self._frames: list[tuple[str, Sent]] = []
        self._trouble: FaultError | None = None
        try:
            for provider in self.providers:
                provider.welcome(session.control(provider.hello()))
                while (missing := provider.fetch()) is not None:
                    provider.fetched(session.control(missing))
                provider.build()
                provider.started(session.control(provider.ready()))
        except BaseException:
            self.close()
            raise

    def wait(self, done: Callable[[], bool], timeout: float, poll: Callable[[], None]) -> bool:
        """Everything has been said by the time that this is called."""
        if self._trouble is not None:
            raise self._trouble
        return done()

    def post(self, motion: bytes) -> None:
        """Let every provider answer; a failure is heard when the answers are awaited, as over a network."""
        for provider in self.providers:
            try:
                answer = provider.answer(motion)
            except LinkwindError as error:
                self._trouble = self._trouble or fault_error(provider.fault(error))
                self._trouble.__cause__ = self._trouble.__cause__ or error
                continue
            self._frames += [(provider.name, frame) for frame in provider.frames()]
            for piece in provider.pieces():
                self._session.piece(provider.name, piece)
            if answer is None:
                self._session.control(provider.bye())
            else:
                self._answers.append((provider.name, answer))

    def repeat(self, motion: bytes) -> None:
        """Nobody is ever lost here."""

    def receive(self) -> tuple[str, bytes]:
        """Return the next answer.

        Raises:
            FaultError: a provider reported that it cannot go on.
        """
        if not self._answers and self._trouble is not None:
            raise self._trouble
        return self._answers.popleft()

    def frames(self) -> list[tuple[str, Sent]]:
        """Take the frames of the last answers."""
        taken, self._frames = self._frames, []
        return taken

    def listeners(self, topics: Sequence[str], description: bytes) -> None:
        """Nobody else is there."""

    def fault(self, payload: bytes) -> None:
        """Nobody is left to be told."""

    def close(self) -> None:
        """Let every provider end what it holds."""
        for provider in self.providers:
            provider.close()
