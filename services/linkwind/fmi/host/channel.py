"""The messages between host and worker, over a pair of Unix sockets; numbers lie in shared memory instead.

A request is a letter, a number, the length of what follows, and what follows:

====== ========================= ======================
letter meaning                   number, what follows
====== ========================= ======================
``p``  take the plan, load       -, the plan as JSON
``s``  evaluate the next point   time [ns], -
``a``  evaluate it again         time [ns], -
``v``  save                      -, -
``r``  restore                   -, what save returned
``c``  close the instances       -, -
====== ========================= ======================

An answer is ``k`` (it went well) or ``e`` (it did not), a length, and what was asked for or the text of the
error.
"""

from __future__ import annotations

import socket
import struct

REQUEST = struct.Struct("<cqI")
ANSWER = struct.Struct("<cI")


def receive(channel: socket.socket, size: int) -> bytes:
    """Return exactly ``size`` bytes; fewer only at the end of the stream."""
    data = channel.recv(size)
    while 0 < len(data) < size:
        block = channel.recv(size - len(data))
        if not block:
            break
        data += block
    return data
