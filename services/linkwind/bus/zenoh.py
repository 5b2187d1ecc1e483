"""Eclipse zenoh as the transport: two processes find each other without a broker.

Publishers and subscribers carry the lock step, a queryable the control requests, liveliness tokens tell
who is there. Multicast, gossip and shared memory are off: endpoints are explicit, messages small.
"""

from __future__ import annotations

import json
import os
import re
import socket
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import zenoh
from zenoh.handlers import FifoChannel

from linkwind.bus.base import PREFIX
from linkwind.errors import AnswerTimeoutError, InputError, LinkwindError, LostError, ParticipantError
from linkwind.protocol import fault_error, refuse

LEASE = 1.0  # s without a sign of life after which a participant counts as lost
TICK = 0.1  # s between two looks of the watchdog
# s that the dynamics looks for an answer before it sleeps: a processor that is awake answers two to four
# times faster. Only one side may do so, and only if it does not take the other's processor away.
SPIN = 200e-6 if len(os.sched_getaffinity(0)) > 1 else 0.0
FIRST_RESEND = 0.5  # s; the first motion may be lost while declarations still travel

# One runtime for everything: a third less time a round trip than zenoh's separate receive threads.
os.environ.setdefault("ZENOH_RUNTIME", "(rx: (handover: app), acc: (handover: app), tx: (handover: app))")


def open_session(listen: Sequence[str], connect: Sequence[str]) -> zenoh.Session:
    """Open zenoh with linkwind's settings, on and to these endpoints.

    Raises:
        InputError: an endpoint cannot be opened.
    """
    settings = {
        "mode": "peer",
        "listen/endpoints": list(listen),
        "connect/endpoints": list(connect),
        "connect/retry": {"period_init_ms": 50, "period_max_ms": 500, "period_increase_factor": 2},
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False,
        # A lost peer is dialled again until the session closes, and closing waits for that call.
        "transport/unicast/open_timeout": int(LEASE * 1000),
        "transport/link/tx/lease": int(LEASE * 1000),
        "transport/link/tx/keep_alive": 4,
    }
    try:
        config = zenoh.Config()
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
        return zenoh.open(config)
    except zenoh.ZError as error:
        where = f"listen on {', '.join(listen)}" if listen else f"connect to {', '.join(connect)}"
        reason = str(error).split(" at /")[0]  # without the place in zenoh's sources
        raise InputError(
            f"zenoh: cannot {where}: {reason}. Expected a free endpoint such as tcp/127.0.0.1:7448; is "
            "another dynamics running there, is the address this machine's?"
        ) from error


def key_segment(value: str, what: str) -> str:
    """Return ``value`` if it may stand in a bus key.

    Raises:
        InputError: it is empty or has characters that mean something in a key.
    """
    if not re.fullmatch(r"[A-Za-z0-9_.-]+", value):
        raise InputError(f'{what}: expected letters, digits, "_", "-" and "."; got "{value}"')
    return value


def loopback_endpoint() -> str:
    """Return an endpoint of this machine that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


class _Endpoint:
    """What both ends share: a queue of incoming messages whose reader can be woken up by trouble."""

    def __init__(self, listen: Sequence[str], connect: Sequence[str]) -> None:
        self._session = open_session(listen, connect)
        self._trouble: LinkwindError | None = None
        self._reading = False
        self._closing = threading.Event()
        self._look = threading.Event()
        self._watchdog = threading.Thread(target=self._watch, name="linkwind-watchdog", daemon=True)

    def _join(self, incoming: str, outgoing: str, run: str, participant: str) -> None:
        """Declare the lock-step keys, the fault key and the liveliness token; start the watchdog."""
        self._wake_key = incoming.replace("*", "~wake")
        self._fault_key = f"{PREFIX}/{run}/fault"
        declare = self._session
        self._incoming = declare.declare_subscriber(incoming, FifoChannel(256))
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
        if self._trouble is None:
            self._trouble = error
            self._look.set()

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

    def _receive(self, spin: float = 0.0) -> zenoh.Sample:
        """Return the next message that is not empty; look for it for ``spin`` [s], then sleep."""
        while True:
            sample = self._look_for_sample(spin)
            if sample is None:
                self._reading = True
                sample = self._incoming.recv()
                self._reading = False
            if self._trouble is not None:
                raise self._trouble
            if len(sample.payload):
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
        self._session.close()  # type: ignore[no-untyped-call]


class Exchanging(Protocol):
    """What the dynamics' link asks of the session, to know who is missing and where the run is."""

    run: str
    failure: LinkwindError | None

    def control(self, request: bytes) -> bytes: ...
    def where(self) -> str: ...
    @property
    def unanswered(self) -> Sequence[str]: ...
    @property
    def not_gone(self) -> Sequence[str]: ...


class ZenohDynamicsLink(_Endpoint):
    """The dynamics' end."""

    def __init__(
        self, session: Exchanging, listen: Sequence[str], connect: Sequence[str], timeout: float
    ) -> None:
        """Open the bus and answer control requests from now on.

        Args:
            session: the protocol's state machine.
            listen: zenoh endpoints to listen on, such as ``tcp/127.0.0.1:7447``.
            connect: zenoh endpoints to connect to, such as a router's.
            timeout: [s] that a living provider may take to answer.

        Raises:
            InputError: an endpoint cannot be opened.
        """
        base = f"{PREFIX}/{key_segment(session.run, '--run')}"
        super().__init__(listen, connect)
        self._exchanging = session
        self._timeout = timeout
        self._posted_at = float("inf")
        self._waiting_since = float("inf")
        self._first_motion = b""
        self._resend_at: float | None = None
        self._changed = threading.Condition()
        self._join(f"{base}/wrench/*", f"{base}/motion", session.run, "dynamics")
        self._control = self._session.declare_queryable(f"{base}/control", self._on_control, complete=True)

    def _on_control(self, query: zenoh.Query) -> None:
        with query, self._changed:
            request = query.payload.to_bytes() if query.payload is not None else b""
            query.reply(f"{PREFIX}/{self._exchanging.run}/control", self._exchanging.control(request))
            if self._exchanging.failure is not None:
                self._fail(self._exchanging.failure)
            self._changed.notify_all()

    def _seen(self, name: str, present: bool) -> None:
        if not present and name in self._exchanging.not_gone:
            self._fail(
                LostError(
                    f'"{name}" was lost at {self._exchanging.where()}: its process ended, was stopped for '
                    f"more than {LEASE:g} s, or the network was cut. Look at its output"
                )
            )

    def _check(self) -> None:
        now, resend_at = time.monotonic(), self._resend_at
        if resend_at is not None and now > resend_at:
            self._resend_at = now + 2.0 * (now - self._posted_at)
            self._outgoing.put(self._first_motion)
        if now - self._waiting_since > self._timeout:
            late = " and ".join(f'"{name}"' for name in self._exchanging.unanswered)
            self._fail(
                AnswerTimeoutError(
                    f"no Wrench from {late} for {self._exchanging.where()} within {self._timeout:g} s; it is "
                    "alive. Is it still computing? Raise coupling.timeout, or look at its output"
                )
            )

    def wait(self, done: Callable[[], bool], timeout: float, poll: Callable[[], None]) -> bool:
        """Wait until ``done`` holds; see :class:`linkwind.bus.base.DynamicsLink`."""
        end = time.monotonic() + timeout
        with self._changed:
            while not done():
                if self._trouble is not None:
                    raise self._trouble
                if time.monotonic() > end:
                    return False
                self._changed.wait(TICK)
                poll()
        return True

    def post(self, motion: bytes) -> None:
        """Send a motion message to every provider."""
        self._resend_at = None
        if not self._first_motion:
            self._first_motion = motion
            self._posted_at = time.monotonic()
            self._resend_at = self._posted_at + FIRST_RESEND
        self._outgoing.put(motion)

    def fault(self, payload: bytes) -> None:
        """Tell every provider that the run is over, and why."""
        self._session.put(self._fault_key, payload, congestion_control=zenoh.CongestionControl.BLOCK)

    def receive(self) -> tuple[str, bytes]:
        """Return the next wrench message and its provider; see :class:`~linkwind.bus.base.DynamicsLink`."""
        # The provider's time to answer runs while the dynamics waits, not while it writes its log.
        self._waiting_since = time.monotonic()
        sample = self._receive(SPIN)
        self._waiting_since = float("inf")
        return str(sample.key_expr).rsplit("/", 1)[1], sample.payload.to_bytes()


class ZenohProviderLink(_Endpoint):
    """A provider's end."""

    def __init__(self, connect: Sequence[str], listen: Sequence[str], run: str = "*") -> None:
        """Open the bus; nothing needs to be listening there yet.

        Args:
            connect: zenoh endpoints of the dynamics or a router.
            listen: zenoh endpoints to listen on.
            run: id of the run to take part in, ``*`` for the only one that is there.
        """
        self._run = run if run == "*" else key_segment(run, "--run")
        super().__init__(listen, connect)
        self._connect = connect
        self._dynamics_seen = False
        self._joined_at = float("inf")

    def request(self, payload: bytes, timeout: float) -> bytes:
        """Send a control request and return the answer; see :class:`~linkwind.bus.base.ProviderLink`."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            replies = [r for r in self._ask(payload, min(1.0, timeout)) if r.ok is not None]
            if len(replies) > 1:
                runs = ", ".join(sorted(str(r.ok.key_expr).split("/")[2] for r in replies))
                raise ParticipantError(f"expected one dynamics; got runs {runs}. Choose one with --run")
            if replies:
                return bytes(replies[0].ok.payload.to_bytes())
            self._closing.wait(0.02)
        where = ", ".join(self._connect) or "any endpoint"
        raise LostError(
            f"no dynamics answered at {where} within {timeout:g} s. Is it running and listening there? "
            "Start it with: linkwind dynamics SCENARIO --listen ENDPOINT"
        )

    def _ask(self, payload: bytes, timeout: float) -> list[Any]:
        replies = self._session.get(
            f"{PREFIX}/{self._run}/control",
            payload=payload,
            timeout=timeout,
            consolidation=zenoh.ConsolidationMode.NONE,
        )
        return list(replies)

    def join(self, run: str, name: str) -> None:
        """Take part in ``run``: from now on motion messages come in."""
        self._run = key_segment(run, "--run")
        self._joined_at = time.monotonic()
        self._join(
            f"{PREFIX}/{run}/motion", f"{PREFIX}/{run}/wrench/{key_segment(name, '--name')}", run, name
        )

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
        return self._receive().payload.to_bytes()

    def reply(self, wrench: bytes) -> None:
        """Send a wrench message to the dynamics."""
        self._outgoing.put(wrench)


class ZenohPlayer:
    """All ends of a run at once: what a log is played with. Subscribers see keys and tokens of the run."""

    def __init__(
        self,
        run: str,
        topics: Sequence[str],
        participants: Sequence[str],
        listen: Sequence[str],
        connect: Sequence[str],
    ) -> None:
        """Open the bus and be there in the place of every participant.

        Args:
            run: id of the run.
            topics: that will be published, such as ``/motion``.
            participants: dynamics and providers.
            listen: zenoh endpoints to listen on.
            connect: zenoh endpoints to connect to.

        Raises:
            InputError: an endpoint cannot be opened.
        """
        self._session = open_session(listen, connect)
        base = f"{PREFIX}/{run}"
        refusal = refuse(f"run {run} is a replay; nobody can take part in it")
        self._control = self._session.declare_queryable(
            f"{base}/control", lambda query: _reply(query, f"{base}/control", refusal), complete=True
        )
        self._publishers = {
            topic: self._session.declare_publisher(
                f"{base}{topic}", congestion_control=zenoh.CongestionControl.BLOCK, express=True
            )
            for topic in topics
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


def _reply(query: zenoh.Query, key: str, payload: bytes) -> None:
    with query:
        query.reply(key, payload)
