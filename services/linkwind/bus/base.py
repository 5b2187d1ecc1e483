"""What a transport has to offer: the two ends of the bus.

A transport moves ``(key, bytes)`` and tells who is there; it knows no message but Fault. Keys are
``linkwind/v1/<run>/motion``, ``…/wrench/<provider>``, ``…/checkpoint/<provider>``,
``…/observe/<kind>/<provider>`` with the kind of a frame, ``…/control/<provider>``, ``…/refusal``, ``…/fault``
and ``…/alive/<participant>``, and for listeners ``…/scenario`` and ``…/log/**``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from linkwind.frames import Sent

PREFIX = "linkwind/v1"


class LogStream(Protocol):
    """The log of a run, as listeners get it; none of them can hold the run up."""

    def wants(self, topic: str) -> bool:
        """Tell whether somebody listens to a topic."""
        ...

    @property
    def followed(self) -> bool:
        """Whether every topic has a listener."""
        ...

    def put(self, topic: str, number: int, time_ns: int, payload: bytes) -> None:
        """Send a message, the ``number``-th of its topic, at its simulation time [ns]."""
        ...

    def end(self, payload: bytes) -> None:
        """Send the last message: how the run ended."""
        ...

    def linger(self) -> None:
        """Wait a moment for listeners that are behind; leaving the bus takes away what they do not have."""
        ...


class DynamicsLink(Protocol):
    """The dynamics' end: providers come to it.

    Pieces of checkpoints go to the dynamics' session as they come; one that was sent before a wrench, or
    before a Bye, is there when that is.
    """

    def wait(self, done: Callable[[], bool], timeout: float, poll: Callable[[], None]) -> bool:
        """Wait until ``done`` holds, which control requests bring about.

        Args:
            done: is asked after each control request.
            timeout: [s] of wall clock.
            poll: is called now and then; may raise to give up.

        Returns:
            whether ``done`` holds.

        Raises:
            LostError: see :meth:`receive`.
        """
        ...

    def post(self, motion: bytes) -> None:
        """Send a motion message to every provider."""
        ...

    def repeat(self, motion: bytes) -> None:
        """Send the last motion message again, for a provider that came back."""
        ...

    def receive(self) -> tuple[str, bytes]:
        """Return the next wrench message and the provider that it came from.

        Raises:
            LostError: a provider died or was stopped; told once, here or by :meth:`wait`.
            AnswerTimeoutError: a provider is alive but has not answered in time.
            FaultError: a provider reported that it cannot go on.
        """
        ...

    def frames(self) -> list[tuple[str, Sent]]:
        """Take the frames that have come, each with its provider, without waiting.

        A frame that was sent before a wrench, or before a Bye, is there when that is.
        """
        ...

    def fault(self, payload: bytes) -> None:
        """Tell every provider that the run is over, and why."""
        ...

    def listeners(self, topics: Sequence[str], description: bytes) -> LogStream | None:
        """Let others listen to the log from now on; None where there are no others.

        Args:
            topics: of the log.
            description: what they are told first.
        """
        ...

    def close(self) -> None:
        """Leave the bus."""
        ...


class ProviderLink(Protocol):
    """A provider's end: it goes to the dynamics."""

    def request(self, payload: bytes, timeout: float) -> bytes:
        """Send a control request and return the answer, trying until ``timeout`` [s] is over.

        Raises:
            LostError: nobody answered.
            TrustError: the other side's TLS or certificate, or ours, will never do.
        """
        ...

    def join(self, run: str) -> None:
        """Take part in ``run``: from now on motion messages come in."""
        ...

    def receive(self) -> bytes:
        """Return the next motion message.

        Raises:
            LostError: the dynamics died or was stopped.
            FaultError: a participant reported that it cannot go on.
        """
        ...

    def show(self, frame: Sent) -> None:
        """Send a frame to the dynamics."""
        ...

    def keep(self, piece: bytes) -> None:
        """Send a piece of a checkpoint to the dynamics."""
        ...

    def reply(self, wrench: bytes) -> None:
        """Send a wrench message to the dynamics."""
        ...

    def close(self) -> None:
        """Leave the bus."""
        ...
