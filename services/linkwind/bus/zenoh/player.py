"""A recorded run on the bus, told apart from a live one by nobody."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import zenoh

from linkwind.bus.base import PREFIX
from linkwind.bus.zenoh.access import of_hub
from linkwind.bus.zenoh.session import DYNAMICS, Security, open_session
from linkwind.credentials import ROUTER, Identity
from linkwind.protocol import refuse


class ZenohPlayer:
    """All ends of a run at once: what a log is played with. Subscribers see keys and tokens of the run."""

    def __init__(
        self,
        run: str,
        keys: Mapping[str, str],
        participants: Sequence[str],
        listen: Sequence[str],
        connect: Sequence[str],
        identity: Identity | None = None,
    ) -> None:
        """Open the bus and be there in the place of every participant.

        Args:
            run: id of the run.
            keys: of the topics that will be published, below that of the run, such as ``/motion``.
            participants: dynamics and providers.
            listen: zenoh endpoints to listen on.
            connect: zenoh endpoints to connect to.
            identity: what this end shows; None without TLS.

        Raises:
            InputError: an endpoint cannot be opened.
        """
        security = Security(identity, of_hub(participants[1:], ROUTER)) if identity else None
        self._session = open_session(listen, connect, DYNAMICS, security)
        base = f"{PREFIX}/{run}"
        refusal = refuse(f"run {run} is a replay; nobody can take part in it")
        self._control = self._session.declare_queryable(
            f"{base}/control/*", lambda query: _refuse(query, base, refusal), complete=True
        )
        self._publishers = {
            topic: self._session.declare_publisher(
                f"{base}{key}", congestion_control=zenoh.CongestionControl.BLOCK, express=True
            )
            for topic, key in keys.items()
        }
        liveliness = self._session.liveliness()
        self._tokens = [liveliness.declare_token(f"{base}/alive/{name}") for name in participants]

    def wait(self, timeout: float, grace: float) -> bool:
        """Wait until somebody subscribes; messages before that would be lost.

        Args:
            timeout: [s] to wait for a subscriber of any topic.
            grace: [s] more for subscribers of the other topics.

        Returns:
            whether there is one.
        """
        end = time.monotonic() + timeout
        while not self.heard and time.monotonic() < end:
            time.sleep(0.02)
        end = time.monotonic() + grace
        while not self._heard_all and self.heard and time.monotonic() < end:
            time.sleep(0.02)
        return self.heard

    @property
    def heard(self) -> bool:
        """Whether somebody subscribes to any of the topics now."""
        return any(map(_matching, self._publishers.values()))

    @property
    def _heard_all(self) -> bool:
        return all(map(_matching, self._publishers.values()))

    def put(self, topic: str, payload: bytes) -> None:
        """Publish a message; waits while a subscriber is behind."""
        self._publishers[topic].put(payload)

    def close(self) -> None:
        """Leave the bus, when everything published is on its way."""
        self._session.close()  # type: ignore[no-untyped-call]


def _matching(publisher: zenoh.Publisher) -> bool:
    status: Any = publisher.matching_status  # declared as bool, but an object that is always true
    return bool(status.matching)


def _refuse(query: zenoh.Query, base: str, refusal: bytes) -> None:
    with query:
        query.reply(f"{base}/control/{str(query.key_expr).rsplit('/', 1)[1]}", refusal)
