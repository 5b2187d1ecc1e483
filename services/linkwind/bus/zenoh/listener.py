"""A listener's end: it hears the log of a run and says nothing."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import NamedTuple

import zenoh
from zenoh.handlers import FifoChannel

from linkwind.bus.base import PREFIX
from linkwind.bus.zenoh.access import of_guest
from linkwind.bus.zenoh.diagnosis import Doubt
from linkwind.bus.zenoh.session import OBSERVER, Security, close_session, key_segment, open_session
from linkwind.bus.zenoh.stream import END
from linkwind.credentials import Identity
from linkwind.errors import LostError, ParticipantError
from linkwind.listening import PLACE

WAITING = 16_384  # messages that may wait for the listener; behind them the run drops what comes for it
ANSWER = 1.0  # s for the answer to a query
PAUSE = 0.1  # s between two queries


class Heard(NamedTuple):
    """A message of the log: topic, its number on it from 1, simulation time [ns], payload."""

    topic: str
    number: int
    time_ns: int
    payload: bytes


class ZenohListener:
    """Listens to one run; the run does not notice whether, or how fast."""

    def __init__(
        self,
        listen: Sequence[str],
        connect: Sequence[str],
        run: str = "*",
        identity: Identity | None = None,
    ) -> None:
        """Open the bus and subscribe; nothing needs to be listening there yet.

        Args:
            listen: zenoh endpoints to listen on.
            connect: zenoh endpoints of the dynamics or a router.
            run: id of the run, ``*`` for the only one that is there.
            identity: what this end shows; None without TLS.

        Raises:
            InputError: an endpoint cannot be opened.
        """
        self._run = run if run == "*" else key_segment(run, "--run")
        self._ends = [*listen, *connect]
        security = Security(identity, of_guest()) if identity else None
        self._session = open_session(listen, connect, OBSERVER, security)
        self._doubt = Doubt(self._session, connect, identity)
        self._log = self._session.declare_subscriber(f"{PREFIX}/{self._run}/log/**", FifoChannel(WAITING))
        self._gone: set[str] = set()
        self._presence = self._session.liveliness().declare_subscriber(
            f"{PREFIX}/{self._run}/alive/dynamics", self._on_presence, history=True
        )

    def _on_presence(self, sample: zenoh.Sample) -> None:
        run = str(sample.key_expr).split("/")[2]
        change = self._gone.discard if sample.kind == zenoh.SampleKind.PUT else self._gone.add
        change(run)

    def find(self, timeout: float) -> bytes:
        """Wait for the run and return its Description.

        Args:
            timeout: [s].

        Raises:
            LostError: there is none.
            ParticipantError: there are several.
            TrustError: the other side's TLS or certificate, or ours, will never do.
        """
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            got = self._session.get(
                f"{PREFIX}/{self._run}/scenario",
                timeout=ANSWER,
                consolidation=zenoh.ConsolidationMode.NONE,
            )
            found = {
                str(r.ok.key_expr).split("/")[2]: r.ok.payload.to_bytes() for r in got if r.ok is not None
            }
            if len(found) > 1:
                raise ParticipantError(
                    f"expected one run; got {', '.join(sorted(found))}. Choose one with --run."
                )
            for self._run, payload in found.items():
                return bytes(payload)
            self._doubt.check()
            time.sleep(PAUSE)
        raise LostError(
            f"no run at {', '.join(self._ends)} within {timeout:g} s. Is a dynamics running and listening "
            "there? Start it with: linkwind dynamics SCENARIO --listen ENDPOINT"
        )

    @property
    def gone(self) -> bool:
        """Whether the dynamics has left, or was lost."""
        return self._run in self._gone

    def receive(self) -> Heard | None:
        """Return the next message of the run's log, None if there is none now; the last one has number 0."""
        while (sample := self._log.try_recv()) is not None:
            _, _, run, _, topic = str(sample.key_expr).split("/", 4)
            if run != self._run:
                continue
            payload = sample.payload.to_bytes()
            if f"/{topic}" == END:
                return Heard(END, 0, 0, payload)
            if sample.attachment is not None:
                number, time_ns = PLACE.unpack(sample.attachment.to_bytes())
                return Heard(f"/{topic}", number, time_ns, payload)
        return None

    def close(self) -> None:
        """Leave the bus."""
        close_session(self._session)
