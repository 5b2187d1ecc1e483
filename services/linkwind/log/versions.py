"""Which programs and which processor made a log."""

from __future__ import annotations

import functools
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

DISTRIBUTIONS = ("linkwind", "numpy", "eclipse-zenoh", "protobuf", "foxglove-sdk", "mcap", "pydantic")


def versions() -> dict[str, str]:
    """Return the version of Python and of every package that a result may depend on, and the machine."""
    machine = {"python": platform.python_version(), "platform": platform.platform(), "cpu": processor()}
    return machine | {name: _installed(name) for name in DISTRIBUTIONS}


@functools.cache
def _installed(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:  # run from a source tree that is not installed
        return "not installed"


def processor() -> str:
    """Return the model name of the processor, or its architecture where the system tells no name."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.machine())
