"""What both ends of the lock step share: reading, a watchdog, presence."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from typing import NoReturn

import zenoh
from zenoh.handlers import FifoChannel

from linkwind.bus.base import PREFIX
from linkwind.bus.zenoh.diagnosis import Doubt
from linkwind.bus.zenoh.session import LARGEST_FAULT, Security, close_session, open_session
from linkwind.errors import LinkwindError, LostError
from linkwind.protocol import fault_error

TICK = 0.1  # s between two looks of the watchdog
WAITING = 256  # messages that may wait for the reader


class Endpoint:
    """What both ends share: a queue of incoming messages whose reader can be woken up by trouble."""

    def __init__(
        self,
        listen: Sequence[str],
        connect: Sequence[str],
        region: str,
        security: Security | None,
        limits: Mapping[str, int],
    ) -> None:
        limits = {f"{PREFIX}/*/fault": LARGEST_FAULT, **limits}
        self._session = open_session(listen, connect, region, security, limits)
        self._connect = connect
        self._doubt = Doubt(self._session, connect, security.identity if security else None)
        self._troubles: deque[LinkwindError] = deque()
        self._reading = False
        self._closing = threading.Event()
        self._look = threading.Event()
        self._watchdog = threading.Thread(target=self._watch, name="linkwind-watchdog", daemon=True)

    def _join(self, incoming: str, outgoing: str, run: str, participant: str) -> None:
        """Declare the lock-step keys, the fault key and the liveliness token; start the watchdog."""
        self._wake_key = incoming.replace("*", "~wake")
        self._fault_key = f"{PREFIX}/{run}/fault"
        declare = self._session
        self._incoming = declare.declare_subscriber(incoming, FifoChannel(WAITING))
        self._faults = declare.declare_subscriber(
            self._fault_key, self._on_fault, allowed_origin=zenoh.Locality.REMOTE
        )
        self._outgoing = declare.declare_publisher(
            outgoing, congestion_control=zenoh.CongestionControl.BLOCK, express=True
        )
        liveliness = self._session.liveliness()
        self._presence = liveliness.declare_subscriber(
            f"{PREFIX}/{run}/alive/*", self._on_presence, history=True
        )
        self._token = liveliness.declare_token(f"{PREFIX}/{run}/alive/{participant}")
        self._watchdog.start()

    def _on_fault(self, sample: zenoh.Sample) -> None:
        try:
            self._fail(fault_error(sample.payload.to_bytes()))
        except LinkwindError as error:
            self._fail(error)

    def _on_presence(self, sample: zenoh.Sample) -> None:
        name = str(sample.key_expr).rsplit("/", 1)[1]
        self._seen(name, sample.kind == zenoh.SampleKind.PUT)

    def _seen(self, name: str, present: bool) -> None:
        raise NotImplementedError

    def _fail(self, error: LinkwindError) -> None:
        """Let the reader raise an error: of several the first one, but for losses that may be made good."""
        if not any(_final(trouble) for trouble in tuple(self._troubles)):
            self._troubles.append(error)
            self._look.set()

    def _raise(self) -> NoReturn:
        """Raise what was told first; only once what may be made good."""
        trouble = self._troubles[0]
        if not _final(trouble):
            self._troubles.popleft()
        raise trouble

    def _watch(self) -> None:
        """Look around every tick; wake the reader up so that it sees trouble, or a signal."""
        while not self._closing.is_set():
            self._look.wait(TICK)
            self._look.clear()
            if not self._closing.is_set():
                self._check()
                if self._reading:  # else nobody would take it away, and a full queue blocks
                    self._wake()

    def _check(self) -> None:
        raise NotImplementedError

    def _wake(self) -> None:
        self._session.put(
            self._wake_key,
            b"",
            allowed_destination=zenoh.Locality.SESSION_LOCAL,
            congestion_control=zenoh.CongestionControl.DROP,
        )

    def _receive(self, spin: float = 0.0) -> zenoh.Sample | None:
        """Return the next message that is not empty; look for it for ``spin`` [s], then sleep.

        None, every tick, if there is none.
        """
        sample = self._look_for_sample(spin)
        if sample is None:
            self._reading = True
            try:
                sample = self._incoming.recv()
            finally:  # Ctrl-C as well: else the watchdog fills the queue, and close() would wait for it
                self._reading = False
        if self._troubles:
            self._raise()
        # Of a reader that was not given time for long, several calls to wake up may stand before a message.
        left = WAITING
        while sample is not None and not len(sample.payload):
            left -= 1
            sample = self._incoming.try_recv() if left else None
        return sample

    def _look_for_sample(self, spin: float) -> zenoh.Sample | None:
        end = time.perf_counter() + spin
        while time.perf_counter() < end:
            if (sample := self._incoming.try_recv()) is not None:
                return sample
        return None

    def close(self) -> None:
        """Leave the bus."""
        self._closing.set()
        self._look.set()
        if self._watchdog.is_alive():
            self._watchdog.join()
        close_session(self._session)


def _final(trouble: LinkwindError) -> bool:
    return not (isinstance(trouble, LostError) and trouble.provider)
