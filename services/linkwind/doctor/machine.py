"""Python and the processor."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Iterator

from linkwind.doctor.finding import FAIL, OK, WARN, Finding
from linkwind.log.versions import processor, versions

OLDEST = (3, 11)
MISSING = "not installed"


def check() -> Iterator[Finding]:
    """Look at Python, its packages, the operating system and the number of cores."""
    found = f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    if sys.version_info < OLDEST:
        yield Finding("Python", FAIL, found, f"install Python {OLDEST[0]}.{OLDEST[1]} or newer")
    elif platform.system() != "Linux":
        yield Finding("Python", WARN, found, "only Linux is tested; use the Docker image elsewhere")
    else:
        yield Finding("Python", OK, found)
    packages = {
        name: number for name, number in versions().items() if name not in ("python", "platform", "cpu")
    }
    missing = [name for name, number in packages.items() if number == MISSING]
    listed = ", ".join(f"{name} {number}" for name, number in packages.items() if number != MISSING)
    yield Finding(
        "packages", WARN if missing else OK, listed, f"pip install {' '.join(missing)}" if missing else ""
    )
    cores = len(os.sched_getaffinity(0))
    change = "" if cores > 1 else "give it a second core: both sides then need not take turns on one"
    yield Finding("cores", OK if cores > 1 else WARN, f"{cores} of {processor()}", change)
