"""A command from outside: an event of a run that waits for it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import closing

import zenoh

from linkwind.bus.base import PREFIX
from linkwind.bus.zenoh.session import OBSERVER, key_segment, open_session
from linkwind.errors import LostError, RefusedError
from linkwind.protocol.control import Control, parse

ANSWER = 1.0  # s for the answer to a query
PAUSE = 0.1  # s between two queries


def order(event: str, connect: Sequence[str], run: str = "*", timeout: float = 5.0) -> str:
    """Let an event of a run happen at the start of its next step; return the id of the run.

    Args:
        event: name of the event.
        connect: zenoh endpoints of the dynamics or a router.
        run: id of the run, ``*`` for the only one that is there.
        timeout: wait this long for the run [s].

    Raises:
        InputError: an endpoint cannot be opened.
        LostError: there is no run.
        RefusedError: the run has no such event, or it does not wait for a command.
    """
    where = run if run == "*" else key_segment(run, "--run")
    request, end = Control(order={"event": event}).SerializeToString(), time.monotonic() + timeout
    with closing(open_session([], connect, OBSERVER, None)) as session:
        while time.monotonic() < end:
            replies = session.get(f"{PREFIX}/{where}/control/order", payload=request, timeout=ANSWER)
            for reply in replies:
                if reply.ok is not None:
                    return _taken(reply.ok)
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
