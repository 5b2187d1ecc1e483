"""The instances of an FMU in the host's own process: fastest, and as safe as the FMU is."""

from __future__ import annotations

import mmap
from collections import deque

from linkwind.errors import SimulationError
from linkwind.fmi.host.library import CallError
from linkwind.fmi.host.plan import Plan
from linkwind.fmi.host.process import last_lines
from linkwind.fmi.host.runner import Runner


class InProcess:
    """Has the methods of ``WorkerProcess``; a crash, a hang or a leak of the FMU is one of this process."""

    def __init__(self, plan: Plan) -> None:
        """Load and instantiate.

        Raises:
            SimulationError: the FMU does not get that far.
        """
        self.memory = mmap.mmap(-1, plan.memory_size)
        self._lines: deque[str] = deque(maxlen=100)
        self._open = True
        try:
            self._runner = Runner(plan, self.memory, self._lines.append)
        except CallError as error:
            raise self._failure(error) from None

    def _failure(self, error: CallError) -> SimulationError:
        self._open = False
        return SimulationError(f"{error}{last_lines(self._lines)}")

    def evaluate(self, time_ns: int, *, again: bool) -> None:
        """Bring the outputs to the time [ns]; see :meth:`Runner.evaluate`."""
        try:
            self._runner.evaluate(time_ns, again=again)
        except CallError as error:
            raise self._failure(error) from None

    def save(self) -> bytes:
        """Return all memory of the instances."""
        try:
            return self._runner.save()
        except CallError as error:
            raise self._failure(error) from None

    def restore(self, blob: bytes) -> None:
        """Take back what ``save`` returned."""
        try:
            self._runner.restore(blob)
        except CallError as error:
            raise self._failure(error) from None

    def close(self, *, kill: bool = False) -> None:
        """Free the instances, unless something went wrong before."""
        if self._open and not kill:
            self._open = False
            self._runner.close()
