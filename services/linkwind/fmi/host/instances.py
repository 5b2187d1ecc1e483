"""From the file of an FMU and the settings of a scenario to instances that step."""

from __future__ import annotations

import contextlib
import logging
import math
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol

import numpy as np

from linkwind.errors import InputError, SimulationError
from linkwind.fmi.host import wine
from linkwind.fmi.host.archive import Archive
from linkwind.fmi.host.facts import Description
from linkwind.fmi.host.links import Mapping
from linkwind.fmi.host.plan import Plan
from linkwind.fmi.host.planning import interface, plan
from linkwind.fmi.host.process import WorkerProcess
from linkwind.scenario.providers import FmuModel
from linkwind.spatial import Array

_log = logging.getLogger("linkwind.fmu")


class Worker(Protocol):
    """What runs a plan: ``WorkerProcess`` or ``InProcess``."""

    memory: Any

    def evaluate(self, time_ns: int, *, again: bool) -> None: ...
    def save(self) -> bytes: ...
    def restore(self, blob: bytes) -> None: ...
    def close(self, *, kill: bool = False) -> None: ...


@dataclass
class _Part:
    """A worker and its share of the arrays."""

    worker: Worker
    rows: slice
    accepted: Array
    inputs: Array
    outputs: Array
    derivatives: Array


class Instances:
    """The running instances of an FMU.

    Attributes:
        accepted, inputs: shape (instances, inputs), to be filled before ``evaluate``.
        outputs: shape (instances, outputs), filled by it.
        derivatives: of outputs by inputs, shape (instances, inputs that depend on a twist, outputs); zero
            where there was no step.
        can_save: whether the FMU has state.
    """

    def __init__(
        self,
        fmu: Description,
        mapping: Mapping,
        settings: FmuModel,
        step_ns: int,
        timeout: float,
    ) -> None:
        """Unpack, start and instantiate.

        Args:
            fmu: what to run.
            mapping: of its variables.
            settings: of the scenario.
            step_ns: communication step [ns].
            timeout: for one evaluation [s].

        Raises:
            InputError: the archive or a start value is wrong.
            SimulationError: the FMU cannot be instantiated.
        """
        self._fmu, self._step_ns = fmu, step_ns
        names = mapping.bodies if mapping.per_body else (fmu.name or "fmu",)
        self._closing = contextlib.ExitStack()
        try:
            folder = Path(self._closing.enter_context(TemporaryDirectory(prefix="linkwind-fmu-")), "fmu")
            library, caller = self._unpack(settings, folder)
            whole = plan(fmu, mapping, settings, tuple(names), step_ns, folder, library, caller)
            self.can_save = whole.state != "none"
            self._parts = [
                self._start(part, settings, timeout, first) for first, part in _shares(fmu, settings, whole)
            ]
        except SimulationError as error:
            self._closing.close()
            raise SimulationError(f"{fmu.path}: {error}") from None
        except BaseException:
            self._closing.close()
            raise
        shape = (len(names), whole.input_size), (len(names), whole.output_size)
        if len(self._parts) == 1:
            only = self._parts[0]
            self.accepted, self.inputs, self.outputs = only.accepted, only.inputs, only.outputs
            self.derivatives = only.derivatives
        else:
            self.accepted, self.inputs = np.zeros(shape[0]), np.zeros(shape[0])
            self.outputs = np.zeros(shape[1])
            self.derivatives = np.zeros((len(names), len(whole.seeds), whole.output_size))

    def _unpack(self, settings: FmuModel, folder: Path) -> tuple[str, tuple[str, ...]]:
        """Unpack; return the library's place below the folder, and the command that calls it elsewhere."""
        _, can = interface(self._fmu, settings)
        archive = Archive(self._fmu.path)
        try:
            library, windows = archive.library(self._fmu.version, can.identifier)
            archive.unpack(self._fmu.version, folder, windows=windows)
        finally:
            archive.close()
        return library, self._wine(settings, folder.parent) if windows else ()

    def _wine(self, settings: FmuModel, folder: Path) -> tuple[str, ...]:
        """Set up Wine for a library that only Windows can load; return the command that calls it."""
        if settings.isolation == "inprocess":
            raise InputError(
                f"{self._fmu.path}: fmu.isolation: expected process, because the FMU has only Windows "
                "binaries; got inprocess. Remove it."
            )
        found = wine.Wine(folder)
        self._closing.callback(found.close)
        _log.info("%s: only Windows binaries, run by %s", self._fmu.path, found.command[0])
        return found.command

    def _start(self, part: Plan, settings: FmuModel, timeout: float, first: int) -> _Part:
        worker: Worker
        if settings.isolation == "inprocess":
            from linkwind.fmi.host.inprocess import InProcess

            worker = InProcess(part)
        else:
            worker = WorkerProcess(part, timeout, settings.start_timeout)
        self._closing.callback(worker.close)
        count = len(part.instances)
        inputs, outputs = (part.input_size,), (part.output_size,)
        shapes = (inputs, inputs, outputs, (len(part.seeds), part.output_size))
        arrays = [
            np.frombuffer(worker.memory, np.float64, count * math.prod(shape), place).reshape(count, *shape)
            if math.prod(shape)
            else np.zeros((count, *shape))
            for place, shape in zip(part.places(), shapes, strict=True)
        ]
        return _Part(worker, slice(first, first + count), *arrays)

    def evaluate(self, time_ns: int, *, again: bool = False) -> None:
        """Bring the outputs to the time [ns]; see :meth:`Runner.evaluate`.

        Raises:
            SimulationError: naming the file, the step, the call, and what the FMU logged last.
        """
        several = len(self._parts) > 1
        try:
            for part in self._parts:
                if several:
                    part.inputs[:], part.accepted[:] = self.inputs[part.rows], self.accepted[part.rows]
                part.worker.evaluate(time_ns, again=again)
                if several:
                    self.outputs[part.rows] = part.outputs
                    self.derivatives[part.rows] = part.derivatives
        except SimulationError as error:
            raise self._failure(time_ns, error) from None

    def _failure(self, time_ns: int, error: SimulationError) -> SimulationError:
        self.close(kill=True)
        step = time_ns / self._step_ns
        return SimulationError(f"{self._fmu.path}: step {step:g} (t = {time_ns / 1e9:g} s): {error}")

    def save(self) -> list[bytes]:
        """Return all memory, a blob for each worker."""
        try:
            return [part.worker.save() for part in self._parts]
        except SimulationError as error:
            raise SimulationError(f"{self._fmu.path}: saving its state: {error}") from None

    def restore(self, blobs: list[bytes]) -> None:
        """Take back what ``save`` returned."""
        try:
            for part, blob in zip(self._parts, blobs, strict=True):
                part.worker.restore(blob)
                self.outputs[part.rows] = part.outputs
        except SimulationError as error:
            raise SimulationError(f"{self._fmu.path}: restoring its state: {error}") from None

    def close(self, *, kill: bool = False) -> None:
        """Free the instances, end the workers, remove the unpacked files; harmless when repeated."""
        if kill:
            for part in self._parts:
                part.worker.close(kill=True)
        self._closing.close()


def _shares(fmu: Description, settings: FmuModel, whole: Plan) -> list[tuple[int, Plan]]:
    """Divide the instances among workers: one for all, or one each if the FMU wants a process to itself."""
    _, can = interface(fmu, settings)
    if not can.once_per_process or len(whole.instances) == 1:
        return [(0, whole)]
    if settings.isolation == "inprocess":
        raise InputError(
            f"{fmu.path}: fmu.isolation: expected process, because the FMU can be instantiated only once per "
            f"process and {len(whole.instances)} instances are needed; got inprocess. Remove it."
        )
    return [(i, replace(whole, instances=(name,))) for i, name in enumerate(whole.instances)]
