"""From the file of an FMU and the settings of a scenario to instances that step."""

from __future__ import annotations

import contextlib
import re
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol

import numpy as np

from linkwind.errors import InputError, SimulationError
from linkwind.fmi.host.archive import Archive
from linkwind.fmi.host.description import Abilities, Description, Interface, Variable
from linkwind.fmi.host.mapping import Mapping
from linkwind.fmi.host.plan import Plan, Setting
from linkwind.fmi.host.process import WorkerProcess
from linkwind.scenario.providers import FmuModel
from linkwind.spatial import Array

_WORTH_LOGGING = re.compile(r"error|warn|fatal|discard", re.IGNORECASE)


class Worker(Protocol):
    """What runs a plan: ``WorkerProcess`` or ``InProcess``."""

    memory: Any

    def evaluate(self, time_ns: int, *, save: bool) -> bytes: ...
    def save(self) -> bytes: ...
    def restore(self, blob: bytes) -> None: ...
    def close(self, *, kill: bool = False) -> None: ...


def interface(fmu: Description, settings: FmuModel) -> tuple[Interface, Abilities]:
    """Return the interface that the FMU is used by.

    Raises:
        InputError: it does not have the one asked for.
    """
    wanted: Interface = settings.interface if settings.interface != "auto" else next(iter(fmu.interfaces))
    if wanted not in fmu.interfaces:
        raise InputError(
            f"{fmu.path}: fmu.interface: expected {' or '.join(fmu.interfaces)}; got {wanted}. Change it."
        )
    return wanted, fmu.interfaces[wanted]


def own_step_ns(fmu: Description, settings: FmuModel, step_ns: int) -> int:
    """Return the step of the FMU [ns]: a part of the communication step, equal to it, or a multiple.

    Raises:
        InputError: the two do not fit together.
    """
    _, can = interface(fmu, settings)
    step = settings.step or (0.0 if can.variable_step else can.fixed_step or fmu.default_step)
    own = round(step * 1e9) or step_ns
    if step_ns % own and own % step_ns:
        raise InputError(
            f"{fmu.path}: step of the FMU: expected a part or a multiple of coupling.step = "
            f"{step_ns / 1e9:g} s; got {own / 1e9:g} s. Change coupling.step, or fmu.step if the FMU can "
            "take another one."
        )
    return own


def stepping(fmu: Description, settings: FmuModel, step_ns: int) -> str:
    """Return in words how the FMU is stepped, for the table and the log."""
    kind, can = interface(fmu, settings)
    own = own_step_ns(fmu, settings, step_ns)
    names = {"cs": "Co-Simulation", "me": "Model Exchange, integrated by RK4"}
    state = "with FMU state" if can.get_set_state else "no FMU state: no iterations, no checkpoints"
    each = "one step in each communication step"
    if own < step_ns:
        each = f"{step_ns // own} steps of {own / 1e9:g} s in each communication step, inputs held"
    elif own > step_ns:
        each = (
            f"a step of {own / 1e9:g} s every {own // step_ns} communication steps, outputs held in between"
        )
    return f"FMI {fmu.version}, {names[kind]}; {each}; {state}; from {fmu.tool}"


def plan(
    fmu: Description,
    mapping: Mapping,
    settings: FmuModel,
    instances: tuple[str, ...],
    step_ns: int,
    folder: Path,
) -> Plan:
    """Return what a worker needs to know.

    Raises:
        InputError: a start value does not fit its variable.
    """
    kind, can = interface(fmu, settings)
    given = {name: _setting(fmu, name, value) for name, value in settings.start.items()}
    inputs = {variable.name for variable in fmu.variables if variable.causality == "input"}
    return Plan(
        file=str(fmu.path),
        folder=str(folder),
        version=fmu.version,
        interface=kind,
        identifier=can.identifier,
        token=fmu.token,
        instances=instances,
        structural=tuple(_setting(fmu, name, value) for name, value in settings.structural.items()),
        start=tuple(setting for name, setting in given.items() if name not in inputs),
        held=tuple(setting for name, setting in given.items() if name in inputs),
        inputs=tuple(variable.reference for variable in mapping.input_variables),
        outputs=tuple(variable.reference for variable in mapping.output_variables),
        input_size=len(mapping.inputs),
        output_size=sum(variable.size for variable in mapping.output_variables),
        variable_step=can.variable_step,
        event_mode=can.event_mode,
        states=fmu.states,
        indicators=fmu.indicators,
        completed_step=can.completed_step_needed,
        state="bytes" if can.serialise_state else "process" if can.get_set_state else "none",
        log_categories=tuple(name for name in fmu.log_categories if _WORTH_LOGGING.search(name)),
        step_ns=step_ns,
        own_ns=own_step_ns(fmu, settings, step_ns),
        memory=int(settings.memory),
    )


_TYPES: dict[str, tuple[type, ...]] = {"Boolean": (bool,), "String": (str,), "Enumeration": (int,)}


def _setting(fmu: Description, name: str, value: Any) -> Setting:
    """Return a start value as the calls of FMI want it."""
    variable = fmu.named(name)
    item = f'{fmu.path}: fmu.start."{name}"'
    if variable is None or variable.causality in ("independent", "calculatedParameter"):
        settable = [v.name for kind in ("parameter", "input") for v in fmu.variables if v.causality == kind]
        near = ", ".join(get_close_matches(name, settable, 5, 0.3) or settable[:5]) or "none (it has none)"
        raise InputError(f"{item}: expected a parameter or an input, such as {near}; got another.")
    values = value if isinstance(value, tuple) else (value,)
    if len(values) != variable.size:
        raise InputError(
            f"{item}: expected {variable.size} values; got {len(values)}. Write them as a flat list."
        )
    return Setting(name, variable.reference, variable.type, tuple(_typed(item, variable, v) for v in values))


def _typed(item: str, variable: Variable, value: Any) -> Any:
    is_float = variable.type in ("Real", "Float64", "Float32")
    allowed: tuple[type, ...] = (int, float) if is_float else _TYPES.get(variable.type, (int,))
    fits = isinstance(value, allowed) and (bool in allowed or not isinstance(value, bool))
    if not fits:
        raise InputError(f"{item}: expected a value of type {variable.type}; got {value!r}. Change it.")
    return float(value) if is_float else value


@dataclass
class _Part:
    """A worker and its share of the arrays."""

    worker: Worker
    rows: slice
    accepted: Array
    inputs: Array
    outputs: Array


class Instances:
    """The running instances of an FMU.

    Attributes:
        accepted, inputs: shape (instances, inputs), to be filled before ``evaluate``.
        outputs: shape (instances, outputs), filled by it.
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
            self._unpack(settings, folder)
            whole = plan(fmu, mapping, settings, tuple(names), step_ns, folder)
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
        else:
            self.accepted, self.inputs = np.zeros(shape[0]), np.zeros(shape[0])
            self.outputs = np.zeros(shape[1])

    def _unpack(self, settings: FmuModel, folder: Path) -> None:
        _, can = interface(self._fmu, settings)
        archive = Archive(self._fmu.path)
        try:
            archive.library(self._fmu.version, can.identifier)
            archive.unpack(self._fmu.version, folder)
        finally:
            archive.close()

    def _start(self, part: Plan, settings: FmuModel, timeout: float, first: int) -> _Part:
        worker: Worker
        if settings.isolation == "inprocess":
            from linkwind.fmi.host.inprocess import InProcess

            worker = InProcess(part)
        else:
            worker = WorkerProcess(part, timeout, settings.start_timeout)
        self._closing.callback(worker.close)
        count = len(part.instances)
        arrays = [
            np.frombuffer(worker.memory, np.float64, count * size, place).reshape(count, size)
            for place, size in zip(
                part.places(), (part.input_size, part.input_size, part.output_size), strict=True
            )
        ]
        return _Part(worker, slice(first, first + count), *arrays)

    def evaluate(self, time_ns: int, *, save: bool) -> list[bytes]:
        """Bring the outputs to the time [ns]; return all memory afterwards if asked to.

        Raises:
            SimulationError: naming the file, the step, the call, and what the FMU logged last.
        """
        several = len(self._parts) > 1
        blobs = []
        try:
            for part in self._parts:
                if several:
                    part.inputs[:], part.accepted[:] = self.inputs[part.rows], self.accepted[part.rows]
                blobs.append(part.worker.evaluate(time_ns, save=save))
                if several:
                    self.outputs[part.rows] = part.outputs
        except SimulationError as error:
            raise self._failure(time_ns, error) from None
        return blobs

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
