"""Sessions with linkwind's settings, and the names that may stand in keys and endpoints."""

from __future__ import annotations

import json
import os
import re
import socket
from collections.abc import Sequence

import zenoh

from linkwind.errors import InputError

LEASE = 1.0  # s without a sign of life after which a participant counts as lost

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
