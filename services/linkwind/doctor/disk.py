"""The disk that results go to."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from linkwind.doctor.finding import FAIL, OK, WARN, Finding

MEGABYTE = 1e6
SAMPLE = 16 * 1024 * 1024  # bytes
SLOWEST = 30.0  # MB/s: what two_link writes as fast as two cores compute it is a third of that
LITTLE, TOO_LITTLE = 2e9, 5e7  # bytes


def check(out: Path) -> Iterator[Finding]:
    """Look at space, rights and speed."""
    there = next(path for path in (out.absolute(), *out.absolute().parents) if path.exists())
    free = shutil.disk_usage(there).free
    found = f"{free / 1e9:.1f} GB free at {there}"
    if free < TOO_LITTLE:
        yield Finding("disk", FAIL, found, "make room, or choose another --out; a run stops when it is full")
        return
    change = "" if free > LITTLE else "a million steps of two_link are 2.3 GB of log"
    yield Finding("disk", OK if free > LITTLE else WARN, found, change)
    try:
        speed = _speed(there)
    except OSError as error:
        yield Finding("disk", FAIL, f"{there}: {error.strerror}", "choose another --out, that can be written")
        return
    slow = "the log will hold runs back; choose another --out" if speed < SLOWEST else ""
    yield Finding("disk", WARN if slow else OK, f"{speed:.0f} MB/s written and synced", slow)


def _speed(folder: Path) -> float:
    """Return how fast a file gets to the disk [MB/s]."""
    data = os.urandom(SAMPLE)
    with tempfile.TemporaryFile(dir=folder) as file:
        start = time.perf_counter()
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
        return SAMPLE / MEGABYTE / (time.perf_counter() - start)
