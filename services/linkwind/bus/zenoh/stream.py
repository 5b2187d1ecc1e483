"""The log of a run on the bus, for whoever listens: a recorder, a viewer."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import zenoh

from linkwind.bus.base import PREFIX
from linkwind.listening import PLACE

END = "/end"
LINGER = 1.0  # s
TICK = 2e-3  # s between two looks whether the listeners have gone


class ZenohLogStream:
    """Publishes log messages on ``linkwind/v1/<run>/log<topic>`` and tells who asks what the run is.

    What nobody subscribes to is not sent.
    """

    def __init__(
        self,
        session: zenoh.Session,
        run: str,
        topics: Sequence[str],
        description: bytes,
        *,
        drop: bool,
        rename: Callable[[str], str] = lambda key: key,
    ) -> None:
        """Declare a publisher for each topic.

        Args:
            session: to publish on.
            run: id of the run.
            topics: that there will be messages of.
            description: the answer to a query on ``linkwind/v1/<run>/scenario``.
            drop: what a listener is too slow for is lost to it; else everybody waits.
            rename: gives the key to use in the place of a usual one.
        """
        base = f"{PREFIX}/{run}"
        how = zenoh.CongestionControl.DROP if drop else zenoh.CongestionControl.BLOCK
        self._wanted = dict.fromkeys([*topics, END], False)
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._listeners: list[Any] = []
        for topic in self._wanted:
            publisher = session.declare_publisher(
                rename(f"{base}/log{topic}"),
                congestion_control=zenoh.CongestionControl.BLOCK if topic == END else how,
                priority=zenoh.Priority.DATA_LOW,
            )
            self._publishers[topic] = publisher
            self._listeners.append(publisher.declare_matching_listener(self._noting(topic)))
            self._wanted[topic] = matching(publisher)
        where = rename(f"{base}/scenario")
        self._scenario = session.declare_queryable(
            where, lambda query: reply(query, where, description), complete=True
        )

    def _noting(self, topic: str) -> Any:
        def note(status: Any) -> None:
            self._wanted[topic] = bool(status.matching)

        return note

    def wants(self, topic: str) -> bool:
        """Tell whether somebody listens to a topic."""
        return self._wanted[topic]

    @property
    def heard(self) -> bool:
        """Whether somebody listens to anything."""
        return any(self._wanted.values())

    @property
    def followed(self) -> bool:
        """Whether every topic has a listener."""
        return all(self._wanted.values())

    def put(self, topic: str, number: int, time_ns: int, payload: bytes) -> None:
        """Send a message, the ``number``-th of its topic, at its simulation time."""
        self._publishers[topic].put(payload, attachment=PLACE.pack(number, time_ns))

    def end(self, payload: bytes) -> None:
        """Send the last message."""
        if self._wanted[END]:
            self._publishers[END].put(payload)

    def linger(self) -> None:
        """Stay a moment while there are listeners: a recorder leaves when it has everything."""
        end = time.monotonic() + LINGER
        while self._wanted[END] and time.monotonic() < end:
            time.sleep(TICK)


def matching(publisher: zenoh.Publisher) -> bool:
    """Tell whether somebody subscribes to what is published."""
    status: Any = publisher.matching_status  # declared as bool, but an object that is always true
    return bool(status.matching)


def reply(query: zenoh.Query, key: str, payload: bytes) -> None:
    """Answer a query."""
    with query:
        query.reply(key, payload)
