"""Teams of threads that share the work of a call (``fmu/flow/lw_threads.h``)."""

from __future__ import annotations

import ctypes
import weakref

from linkwind.errors import LinkwindError
from linkwind.native.library import declare


def team(owner: object, count: int) -> int:
    """Start a team that ends when its owner is gone; return its address.

    Args:
        owner: whose calls it helps.
        count: threads, the caller's included.

    Raises:
        LinkwindError: the system has no room for so many.
    """
    at = declare("lw_threads_create", [ctypes.c_int32], ctypes.c_void_p)(count)
    if not at:
        raise LinkwindError(f"threads: expected to start {count}; the system refused. Use fewer.")
    weakref.finalize(owner, declare("lw_threads_destroy", [ctypes.c_void_p], None), at)
    return int(at)
