"""Whether this machine can do what linkwind needs, and what to change where it cannot."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from linkwind.doctor import disk, flight, machine, network, tools
from linkwind.doctor.finding import FAIL, OK, WARN, Finding

__all__ = ["FAIL", "OK", "WARN", "Finding", "examine"]


def examine(out: Path, connect: tuple[str, ...] = (), tls: Path | None = None) -> Iterator[Finding]:
    """Yield what each check finds, as soon as it has.

    Args:
        out: folder that results will go to.
        connect: endpoints elsewhere that shall be reached.
        tls: folder with certificates; None without TLS.
    """
    yield from machine.check()
    yield from guarded("core", flight.core)
    yield from guarded("zenoh", flight.zenoh)
    yield from network.ports()
    yield network.multicast()
    yield from network.certificates(tls)
    for endpoint in connect:
        yield from network.reach(endpoint, tls)
    yield from disk.check(out)
    yield tools.docker()
    yield from tools.fmu_platforms()


def guarded(name: str, check: Callable[[], Iterator[Finding]]) -> Iterator[Finding]:
    """Yield what a check finds; what it dies of is a finding, too."""
    try:
        yield from check()
    except Exception as error:
        yield Finding(
            name, FAIL, f"{type(error).__name__}: {error}".splitlines()[0], "pip install linkwind again"
        )
