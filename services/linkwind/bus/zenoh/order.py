"""A command from outside: an event of a run that waits for it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import closing

import zenoh

from linkwind.bus.base import PREFIX
from linkwind.bus.zenoh.access import of_guest
from linkwind.bus.zenoh.diagnosis import Doubt
from linkwind.bus.zenoh.session import OBSERVER, Security, key_segment, open_session
from linkwind.credentials import Identity
from linkwind.errors import LostError, RefusedError
from linkwind.protocol.control import Control, parse

ANSWER = 1.0  # s for the answer to a query
PAUSE = 0.1  # s between two queries


def order(
    event: str,
    connect: Sequence[str],
    run: str = "*",
    timeout: float = 5.0,
    identity: Identity | None = None,
) -> str:
    """Let an event of a run happen at the start of its next step; return the id of the run.

    Args:
        event: name of the event.
        connect: zenoh endpoints of the dynamics or a router.
        run: id of the run, ``*`` for the only one that is there.
        timeout: wait this long for the run [s].
        identity: what we show; None without TLS.

    Raises:
        InputError: an endpoint cannot be opened.
        LostError: there is no run.
        RefusedError: the run has no such event, it does not wait for a command, or we may not command it.
        TrustError: the other side's TLS or certificate, or ours, will never do.
    """
    where = run if run == "*" else key_segment(run, "--run")
    request, end = Control(order={"event": event}).SerializeToString(), time.monotonic() + timeout
    security = Security(identity, of_guest()) if identity else None
    # Who may not command gets no answer, but may ask why.
    keys = ("control/order", "refusal") if identity else ("control/order",)
    with closing(open_session([], connect, OBSERVER, security)) as session:
        doubt = Doubt(session, connect, identity)
        while time.monotonic() < end:
            for key in keys:
                for reply in session.get(f"{PREFIX}/{where}/{key}", payload=request, timeout=ANSWER):
                    if reply.ok is not None:
                        return _taken(reply.ok)
            doubt.check()
            time.sleep(PAUSE)
    raise LostError(
        f"no run at {', '.join(connect)} within {timeout:g} s. Is a dynamics running and listening there? "
        "Start it with: linkwind dynamics SCENARIO --listen ENDPOINT"
    )


def _taken(reply: zenoh.Sample) -> str:
    answer = parse(reply.payload.to_bytes(), "start", "refuse")
    if answer.HasField("refuse"):
        raise RefusedError(answer.refuse.reason)
    return str(reply.key_expr).split("/")[2]
