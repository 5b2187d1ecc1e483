"""Which programs and which processor made a log."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

DISTRIBUTIONS = ("linkwind", "numpy", "eclipse-zenoh", "protobuf", "foxglove-sdk", "mcap", "pydantic")


def versions() -> dict[str, str]:
    """Return the version of Python and of every package that a result may depend on, and the machine."""
    found = {"python": platform.python_version(), "platform": platform.platform(), "cpu": processor()}
    for name in DISTRIBUTIONS:
        try:
            found[name] = version(name)
        except PackageNotFoundError:  # run from a source tree that is not installed
            found[name] = "not installed"
    return found


def processor() -> str:
    """Return the model name of the processor, or its architecture where the system tells no name."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.machine())
