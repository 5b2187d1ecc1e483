"""What a worker has to know to run the instances of one FMU, and the memory that it shares with its host."""

from __future__ import annotations

import json
import mmap
from dataclasses import asdict, dataclass
from typing import Any, Literal

_NAME = 48  # bytes for the name of the FMI function under way


@dataclass(frozen=True)
class Setting:
    """Values for one variable before initialisation; ``type`` is FMI's."""

    name: str
    reference: int
    type: str
    values: tuple[Any, ...]


@dataclass(frozen=True)
class Plan:
    """How to run an FMU; goes to the worker as JSON.

    Attributes:
        file: what errors call it.
        folder: where it is unpacked.
        version: of FMI, 2 or 3.
        interface: ``cs`` or ``me``.
        instances: names of the instances, which all do the same.
        caller: the command of a process that calls the library for the worker; () for the worker itself.
        library: path of the shared library below the folder.
        structural, start, held: values to set in configuration mode, before initialisation, and in
            initialisation mode (those of inputs that are not exchanged).
        inputs, outputs: value references of the variables that are exchanged.
        input_size, output_size: number of their values (more than variables where there are arrays).
        knowns: value references of the inputs by which the outputs are differentiated; empty: they are not.
        seeds: places of the elements among the values of these.
        seed_size: number of these values.
        variable_step: whether communication steps may differ; else they are all the same number.
        discrete_inputs: whether an input changes at events only (Model Exchange).
        event_mode: whether it has one (Co-Simulation, FMI 3).
        states, indicators: number of continuous states and event indicators (Model Exchange).
        completed_step: whether it wants to be told about the end of integrator steps (Model Exchange).
        state: how its memory can be kept: not at all, inside its process, or as bytes.
        log_categories: to ask for; empty for all.
        step_ns: communication step of the run [ns].
        own_ns: step of the FMU [ns]; equal to, a part of, or a multiple of ``step_ns``.
        memory: the most that the FMU may take besides what the worker had at first [B].
    """

    file: str
    folder: str
    version: int
    interface: Literal["cs", "me"]
    identifier: str
    token: str
    caller: tuple[str, ...]
    library: str
    instances: tuple[str, ...]
    structural: tuple[Setting, ...]
    start: tuple[Setting, ...]
    held: tuple[Setting, ...]
    inputs: tuple[int, ...]
    outputs: tuple[int, ...]
    input_size: int
    output_size: int
    knowns: tuple[int, ...]
    seeds: tuple[int, ...]
    seed_size: int
    variable_step: bool
    event_mode: bool
    discrete_inputs: bool
    states: int
    indicators: int
    completed_step: bool
    state: Literal["none", "process", "bytes"]
    log_categories: tuple[str, ...]
    step_ns: int
    own_ns: int
    memory: int

    def to_json(self) -> bytes:
        """Return the plan for the worker."""
        return json.dumps(asdict(self)).encode()

    @classmethod
    def from_json(cls, text: bytes) -> Plan:
        """Return the plan that ``to_json`` wrote."""
        data = json.loads(text)
        for key in ("structural", "start", "held"):
            data[key] = tuple(Setting(**{**entry, "values": tuple(entry["values"])}) for entry in data[key])
        for key in ("caller", "instances", "inputs", "outputs", "knowns", "seeds", "log_categories"):
            data[key] = tuple(data[key])
        return cls(**data)

    @property
    def memory_size(self) -> int:
        """Bytes that host and worker share."""
        return self.places()[3] + 8 * len(self.instances) * len(self.seeds) * self.output_size

    def places(self) -> tuple[int, int, int, int]:
        """Return where accepted inputs, inputs, outputs and derivatives begin in the shared memory [B].

        Derivatives of an instance: a row for each seed, a column for each output value.
        """
        inputs, outputs = (8 * len(self.instances) * size for size in (self.input_size, self.output_size))
        return _NAME, _NAME + inputs, _NAME + 2 * inputs, _NAME + 2 * inputs + outputs


class Marker:
    """Writes the FMI function under way into the shared memory, for who comes to look after a crash."""

    def __init__(self, memory: mmap.mmap) -> None:
        self._memory = memory
        self._padded: dict[str, bytes] = {}

    def __call__(self, function: str) -> None:
        padded = self._padded.get(function)
        if padded is None:
            padded = self._padded[function] = function.encode()[:_NAME].ljust(_NAME, b"\0")
        self._memory[:_NAME] = padded

    def read(self) -> str:
        """Return the function that was called last."""
        return bytes(self._memory[:_NAME]).rstrip(b"\0").decode(errors="replace")
