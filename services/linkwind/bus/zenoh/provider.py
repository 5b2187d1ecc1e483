"""A provider's end."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import zenoh

from linkwind.bus.base import PREFIX
from linkwind.bus.zenoh.access import of_guest
from linkwind.bus.zenoh.endpoint import Endpoint
from linkwind.bus.zenoh.session import LARGEST_MOTION, LEASE, PROVIDER, Security, key_segment
from linkwind.credentials import Identity
from linkwind.errors import LostError, ParticipantError
from linkwind.frames import KINDS, Sent

ANSWER = 5.0  # s for the answer to a request, which may carry a piece of a checkpoint


class ZenohProviderLink(Endpoint):
    """A provider's end."""

    def __init__(
        self,
        connect: Sequence[str],
        listen: Sequence[str],
        run: str = "*",
        *,
        name: str,
        identity: Identity | None = None,
    ) -> None:
        """Open the bus; nothing needs to be listening there yet.

        Args:
            connect: zenoh endpoints of the dynamics or a router.
            listen: zenoh endpoints to listen on.
            run: id of the run to take part in, ``*`` for the only one that is there.
            name: of the provider.
            identity: what this end shows; None without TLS.
        """
        self._run = run if run == "*" else key_segment(run, "--run")
        self._name = key_segment(name, "--name")
        security = Security(identity, of_guest()) if identity else None
        super().__init__(listen, connect, PROVIDER, security, {f"{PREFIX}/*/motion": LARGEST_MOTION})
        self._dynamics_seen = False
        self._joined_at = float("inf")

    def request(self, payload: bytes, timeout: float) -> bytes:
        """Send a control request and return the answer; see :class:`~linkwind.bus.base.ProviderLink`."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            key = f"control/{self._name}"
            # Nobody answers, but there is a dynamics: it may have come this moment, or we may not ask it.
            replies = self._ask(key, payload, min(ANSWER, timeout)) or (
                self._ask("refusal", b"", 1.0)
                and (self._ask(key, payload, min(ANSWER, timeout)) or self._ask("refusal", b"", 1.0))
            )
            if len(replies) > 1:
                runs = ", ".join(sorted(str(r.ok.key_expr).split("/")[2] for r in replies))
                raise ParticipantError(f"expected one dynamics; got runs {runs}. Choose one with --run")
            if replies:
                return bytes(replies[0].ok.payload.to_bytes())
            self._doubt.check()
            time.sleep(0.02)
        where = ", ".join(self._connect) or "any endpoint"
        raise LostError(
            f"no dynamics answered at {where} within {timeout:g} s. Is it running and listening there? "
            "Start it with: linkwind dynamics SCENARIO --listen ENDPOINT"
        )

    def _ask(self, key: str, payload: bytes, timeout: float) -> list[Any]:
        replies = self._session.get(
            f"{PREFIX}/{self._run}/{key}",
            payload=payload,
            timeout=timeout,
            consolidation=zenoh.ConsolidationMode.NONE,
        )
        return [reply for reply in replies if reply.ok is not None]

    def join(self, run: str) -> None:
        """Take part in ``run``: from now on motion messages come in."""
        self._run = key_segment(run, "--run")
        self._joined_at = time.monotonic()
        base, name = f"{PREFIX}/{run}", self._name
        self._observed = {kind: self._publisher(f"{base}/observe/{kind}/{name}") for kind in KINDS}
        self._kept = self._publisher(f"{base}/checkpoint/{name}")
        self._join(f"{base}/motion", f"{base}/wrench/{name}", run, name)

    def _publisher(self, key: str) -> zenoh.Publisher:
        return self._session.declare_publisher(key, congestion_control=zenoh.CongestionControl.BLOCK)

    def _seen(self, name: str, present: bool) -> None:
        if name == "dynamics":
            self._dynamics_seen = self._dynamics_seen or present
            if not present:
                self._fail(LostError(f"the dynamics was lost: {self._lost()}"))

    def _lost(self) -> str:
        return f"its process ended, was stopped for more than {LEASE:g} s, or the network was cut"

    def _check(self) -> None:
        if not self._dynamics_seen and time.monotonic() - self._joined_at > 3.0 * LEASE:
            self._fail(LostError(f"the dynamics was lost during the hand-shake: {self._lost()}"))

    def receive(self) -> bytes:
        """Return the next motion message; see :class:`~linkwind.bus.base.ProviderLink`."""
        while (sample := self._receive()) is None:
            pass
        return sample.payload.to_bytes()

    def show(self, frame: Sent) -> None:
        """Send a frame to the dynamics."""
        self._observed[frame.kind].put(frame.payload)

    def keep(self, piece: bytes) -> None:
        """Send a piece of a checkpoint to the dynamics."""
        self._kept.put(piece)

    def reply(self, wrench: bytes) -> None:
        """Send a wrench message to the dynamics."""
        self._outgoing.put(wrench)
