"""The dynamics' end."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import zenoh
from zenoh.handlers import FifoChannel

from linkwind.bus.base import PREFIX
from linkwind.bus.zenoh.access import of_hub
from linkwind.bus.zenoh.endpoint import Endpoint
from linkwind.bus.zenoh.session import DYNAMICS, LARGEST_PIECE, LEASE, Security, key_segment
from linkwind.bus.zenoh.stream import ZenohLogStream
from linkwind.credentials import ROUTER, Identity
from linkwind.errors import AnswerTimeoutError, LinkwindError, LostError
from linkwind.frames import Sent

# s that the dynamics looks for an answer before it sleeps: a processor that is awake answers two to four
# times faster. Only one side may do so, and only if it does not take the other's processor away.
SPIN = 200e-6 if len(os.sched_getaffinity(0)) > 1 else 0.0
FRAMES = 64  # that may wait for the dynamics, which takes them at every exchange
PIECES = 64  # of checkpoints, that may wait; behind them the provider waits, up to 5 s (zenoh's)
PAUSE = 0.005  # s between two looks while providers come and go
FIRST_RESEND = 0.5  # s; the first motion to a provider may be lost while declarations still travel


class Exchanging(Protocol):
    """What the dynamics' link asks of the session, to know who is missing and where the run is."""

    run: str
    failure: LinkwindError | None

    def control(self, request: bytes, asker: str) -> bytes: ...
    def refusal(self) -> bytes: ...
    def piece(self, provider: str, payload: bytes) -> None: ...
    def seen(self, name: str, present: bool) -> None: ...
    def where(self) -> str: ...
    @property
    def providers(self) -> Mapping[str, Sequence[str]]: ...
    @property
    def unanswered(self) -> Sequence[str]: ...
    @property
    def taking_part(self) -> Sequence[str]: ...


class ZenohDynamicsLink(Endpoint):
    """The dynamics' end."""

    def __init__(
        self,
        session: Exchanging,
        listen: Sequence[str],
        connect: Sequence[str],
        timeout: float,
        identity: Identity | None = None,
        first: float = 0.0,
    ) -> None:
        """Open the bus and answer control requests from now on.

        Args:
            session: the protocol's state machine.
            listen: zenoh endpoints to listen on, such as ``tcp/127.0.0.1:7447``.
            connect: zenoh endpoints to connect to, such as a router's.
            timeout: [s] that a living provider may take to answer.
            identity: what this end shows, and by whose authority it lets others in; None without TLS.
            first: [s] that it may take for the first answer, if that is more: a model may be made with it.

        Raises:
            InputError: an endpoint cannot be opened.
        """
        base = f"{PREFIX}/{key_segment(session.run, '--run')}"
        security = Security(identity, of_hub(session.providers, ROUTER)) if identity else None
        bodies = max(map(len, session.providers.values()), default=0)
        limits = {f"{base}/wrench/*": largest_wrench(bodies), f"{base}/checkpoint/*": LARGEST_PIECE}
        super().__init__(listen, connect, DYNAMICS, security, limits)
        self._exchanging = session
        self._timeout, self._first = timeout, max(timeout, first)
        self._patience = self._first
        self._posted_at = float("inf")
        self._waited = 0.0  # s, for the answers to the last motion
        self._unsure_motion = b""
        self._resend_at: float | None = None
        self._asking = threading.Lock()
        # Before the wrenches' own: whoever can send a wrench can send a frame, and a checkpoint.
        self._observed = self._session.declare_subscriber(f"{base}/observe/*/*", FifoChannel(FRAMES))
        self._pieces = self._session.declare_subscriber(f"{base}/checkpoint/*", FifoChannel(PIECES))
        self._join(f"{base}/wrench/*", f"{base}/motion", session.run, "dynamics")
        self._control = self._session.declare_queryable(f"{base}/control/*", self._on_control, complete=True)
        # After the other: whoever has seen this one has seen that, too, unless it may not.
        self._refusal = self._session.declare_queryable(f"{base}/refusal", self._on_refusal, complete=True)

    def _on_control(self, query: zenoh.Query) -> None:
        with query, self._asking:
            request = query.payload.to_bytes() if query.payload is not None else b""
            asker = str(query.key_expr).rsplit("/", 1)[1]
            reply = self._exchanging.control(request, asker)
            if "*" not in asker:
                query.reply(f"{PREFIX}/{self._exchanging.run}/control/{asker}", reply)
            if self._exchanging.failure is not None:
                self._fail(self._exchanging.failure)

    def _on_refusal(self, query: zenoh.Query) -> None:
        with query:
            query.reply(f"{PREFIX}/{self._exchanging.run}/refusal", self._exchanging.refusal())

    def _seen(self, name: str, present: bool) -> None:
        if present or name not in self._exchanging.taking_part:
            self._exchanging.seen(name, present)
        else:
            self._fail(
                LostError(
                    f'"{name}" was lost at {self._exchanging.where()}: its process ended, was stopped for '
                    f"more than {LEASE:g} s, or the network was cut. Look at its output",
                    name,
                )
            )

    def _check(self) -> None:
        now, resend_at = time.monotonic(), self._resend_at
        if resend_at is not None and now > resend_at:
            self._resend_at = now + 2.0 * (now - self._posted_at)
            self._outgoing.put(self._unsure_motion)

    def wait(self, done: Callable[[], bool], timeout: float, poll: Callable[[], None]) -> bool:
        """Wait until ``done`` holds; see :class:`linkwind.bus.base.DynamicsLink`."""
        end = time.monotonic() + timeout
        while not done():
            if self._troubles:
                self._raise()
            if time.monotonic() > end:
                return False
            # Not a condition variable: a signal in the middle of one leaves it in pieces.
            time.sleep(PAUSE)
            self._take_pieces()
            self._doubt.check()
            poll()
        self._take_pieces()
        return True

    def post(self, motion: bytes) -> None:
        """Send a motion message to every provider."""
        self._resend_at, self._waited = None, 0.0
        if not self._unsure_motion:
            self.repeat(motion)
        else:
            self._patience = self._timeout
            self._outgoing.put(motion)

    def repeat(self, motion: bytes) -> None:
        """Send a motion that may have to be sent once more; see :class:`~linkwind.bus.base.DynamicsLink`."""
        self._unsure_motion, self._waited = motion, 0.0
        self._posted_at = time.monotonic()
        self._outgoing.put(motion)
        self._resend_at = self._posted_at + FIRST_RESEND

    def listeners(self, topics: Sequence[str], description: bytes) -> ZenohLogStream:
        """Let others listen to the log; see :class:`~linkwind.bus.base.DynamicsLink`."""
        return ZenohLogStream(self._session, self._exchanging.run, topics, description, drop=True)

    def fault(self, payload: bytes) -> None:
        """Tell every provider that the run is over, and why."""
        self._session.put(self._fault_key, payload, congestion_control=zenoh.CongestionControl.BLOCK)

    def receive(self) -> tuple[str, bytes]:
        """Return the next wrench message and its provider; see :class:`~linkwind.bus.base.DynamicsLink`."""
        # A provider's time to answer runs while the dynamics waits, not while it writes its log; it does not
        # begin again when something else comes: an old answer, or that of another provider. It does with each
        # piece of a checkpoint: a large one takes its time.
        since = time.monotonic() - self._waited
        while self._waited < self._patience:
            sample = self._receive(SPIN)
            if self._take_pieces():
                since = time.monotonic()
                self._look.set()  # more are on their way: do not sleep for a tick
            self._waited = time.monotonic() - since
            if sample is not None:
                return _named(sample)
        late = " and ".join(f'"{name}"' for name in self._exchanging.unanswered)
        raise AnswerTimeoutError(
            f"no Wrench from {late} for {self._exchanging.where()} within {self._patience:g} s; it is alive. "
            f"Is it still computing? Raise {self._setting}, or look at its output"
        )

    @property
    def _setting(self) -> str:
        return "coupling.timeout" if self._patience == self._timeout else "bus.start_timeout"

    def frames(self) -> list[tuple[str, Sent]]:
        """Take the frames that have come; see :class:`~linkwind.bus.base.DynamicsLink`.

        One session sends frame and wrench over one link, with one priority: zenoh keeps their order.
        """
        frames = []
        while (sample := self._observed.try_recv()) is not None:
            name, payload = _named(sample)
            frames.append((name, Sent(str(sample.key_expr).rsplit("/", 2)[1], payload)))
        return frames

    def _take_pieces(self) -> bool:
        """Give the session what has come of checkpoints, without waiting; tell whether there was anything.

        They come in order, like :meth:`frames`.
        """
        came = False
        while (sample := self._pieces.try_recv()) is not None:
            self._exchanging.piece(*_named(sample))
            came = True
        return came


def largest_wrench(bodies: int) -> int:
    """Return what the wrench on so many bodies may need, every matrix included [bytes]."""
    return 2**16 + 8 * (6 * bodies + 36 * bodies + 36 * bodies**2)


def _named(sample: zenoh.Sample) -> tuple[str, bytes]:
    """Return the provider that a sample comes from, and its payload."""
    return str(sample.key_expr).rsplit("/", 1)[1], sample.payload.to_bytes()
