"""A recorded run on the bus, told apart from a live one by nobody."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence

import zenoh

from linkwind.bus.base import PREFIX
from linkwind.bus.zenoh.access import of_hub
from linkwind.bus.zenoh.diagnosis import Doubt
from linkwind.bus.zenoh.session import DYNAMICS, Security, close_session, open_session
from linkwind.bus.zenoh.stream import ZenohLogStream, matching, reply
from linkwind.credentials import ROUTER, Identity
from linkwind.protocol import refuse

TICK = 0.02  # s between two looks for subscribers


class ZenohPlayer:
    """All ends of a run at once: what a log is played with. Subscribers see keys and tokens of the run.

    Attributes:
        log: the log of the run for listeners.
    """

    def __init__(
        self,
        run: str,
        keys: Mapping[str, str],
        participants: Sequence[str],
        listen: Sequence[str],
        connect: Sequence[str],
        identity: Identity | None = None,
        *,
        topics: Sequence[str],
        description: bytes,
        playback: Callable[[bytes], bytes],
        rename: Callable[[str], str] = lambda key: key,
    ) -> None:
        """Open the bus and be there in the place of every participant.

        Args:
            run: id of the run.
            keys: below that of the run, of the topics that participants published, such as ``/motion``.
            participants: dynamics and providers.
            listen: zenoh endpoints to listen on.
            connect: zenoh endpoints to connect to.
            identity: what this end shows; None without TLS.
            topics: of the log.
            description: what listeners are told of the run.
            playback: answers a query on ``linkwind/v1/<run>/playback``.
            rename: gives the key to use in the place of a usual one.

        Raises:
            InputError: an endpoint cannot be opened.
        """
        security = Security(identity, of_hub(participants[1:], ROUTER)) if identity else None
        self._session = open_session(listen, connect, DYNAMICS, security)
        self._doubt = Doubt(self._session, connect, identity)
        base = f"{PREFIX}/{run}"
        self._declared = [
            self._queryable(rename(f"{base}/control/*"), lambda request: refusal),
            self._queryable(rename(f"{base}/playback"), playback),
        ]
        refusal = refuse(f"run {run} is a replay; nobody can take part in it")
        self._publishers = {
            topic: self._session.declare_publisher(
                rename(f"{base}{key}"), congestion_control=zenoh.CongestionControl.BLOCK, express=True
            )
            for topic, key in keys.items()
        }
        self.log = ZenohLogStream(self._session, run, topics, description, drop=False, rename=rename)
        liveliness = self._session.liveliness()
        self._tokens = [liveliness.declare_token(rename(f"{base}/alive/{name}")) for name in participants]

    def _queryable(self, key: str, answer: Callable[[bytes], bytes]) -> zenoh.Queryable[None]:
        def on_query(query: zenoh.Query) -> None:
            where = str(query.key_expr) if key.endswith("/*") else key
            reply(query, where, answer(query.payload.to_bytes() if query.payload is not None else b""))

        return self._session.declare_queryable(key, on_query, complete=True)

    def wait(self, timeout: float, grace: float) -> bool:
        """Wait until somebody subscribes; messages before that would be lost.

        Args:
            timeout: [s] to wait for a subscriber of any topic.
            grace: [s] more for subscribers of the other topics.

        Returns:
            whether there is one.
        """
        end = time.monotonic() + timeout
        while not (self.heard and self._stays(grace)):
            if time.monotonic() >= end:
                return False
            time.sleep(TICK)
        return True

    def _stays(self, time_s: float) -> bool:
        """Wait so long; tell whether somebody was subscribed all the while."""
        end = time.monotonic() + time_s
        while self.heard and time.monotonic() < end:
            time.sleep(TICK)
        return self.heard

    @property
    def heard(self) -> bool:
        """Whether somebody subscribes to any of the topics now."""
        return self.log.heard or any(map(matching, self._publishers.values()))

    def put(self, topic: str, payload: bytes) -> None:
        """Publish a message as its participant did; waits while a subscriber is behind."""
        self._publishers[topic].put(payload)

    def close(self) -> None:
        """Leave the bus, when everything published is on its way."""
        self.log.linger()
        close_session(self._session)
