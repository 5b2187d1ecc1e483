"""Whether the disk has room for the log of a run that has begun."""

from __future__ import annotations

import logging
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

_log = logging.getLogger("linkwind")

SAMPLE = 5_000  # steps after which it is known how fast a log grows


class Growing(Protocol):
    """A log that is written: the file where it is now, and its size [B]."""

    path: Path

    @property
    def size(self) -> int: ...


def looking(progress: Callable[[int], None], log: Growing, steps: int) -> Callable[[int], None]:
    """Return a progress that also says, once, that the rest of the run will not fit on the disk.

    Args:
        progress: is told now and then how many steps are done.
        log: that grows.
        steps: of the whole run.
    """
    first: tuple[int, int] | None = None  # steps done and size of the file, when looked at first
    looked = False

    def look(step: int) -> None:
        nonlocal first, looked
        progress(step)
        if looked or steps - step < SAMPLE:
            return
        if first is None:
            first = step, log.size
        elif step - first[0] >= SAMPLE:
            looked = True
            _compare(log.path, (log.size - first[1]) / (step - first[0]), steps - step)

    return look


def _compare(log: Path, growth: float, steps: int) -> None:
    wanted, free = growth * steps, shutil.disk_usage(log.parent).free
    if wanted > free:
        _log.warning(
            "note: %s: the log grows by %.0f B a step, so that the %d steps to come ask for %.3g GB; %.3g GB "
            "are free. Is time.end what was meant? Ctrl-C keeps what is there for linkwind resume.",
            log, growth, steps, wanted / 1e9, free / 1e9,
        )  # fmt: skip
