"""The instances of one FMU, and when they step: the same code in a worker process and in the host's own."""

from __future__ import annotations

import math
import mmap
import struct
from collections.abc import Callable, Iterator
from enum import Enum, auto
from pathlib import Path
from typing import Any

from linkwind.fmi.host.binding import Binding
from linkwind.fmi.host.cosimulation import CoSimulation
from linkwind.fmi.host.library import CallError, Log
from linkwind.fmi.host.modelexchange import ModelExchange
from linkwind.fmi.host.plan import Marker, Plan
from linkwind.fmi.host.saved import Saved

_STEPPERS: dict[str, Callable[[Binding, Plan], CoSimulation | ModelExchange]] = {
    "cs": CoSimulation,
    "me": ModelExchange,
}
_HEAD = struct.Struct("<8sBqqI")  # magic, mode, start and present time [ns], instances
_MAGIC = b"LWHOST1\0"


class Mode(Enum):
    """Where the instances are in their life."""

    INSTANTIATED = auto()
    INITIALISATION = auto()
    STEPPING = auto()


class Runner:
    """Runs the instances of a plan. After a CallError nothing else may be called."""

    def __init__(self, plan: Plan, memory: mmap.mmap, log: Log) -> None:
        """Load, instantiate, and set what is set before initialisation."""
        self._plan = plan
        self._memory = memory
        self._log = log
        self._outputs_at, self._derivatives_at = plan.places()[2:]
        self._without_derivatives = False
        self._mark = Marker(memory)
        library = self._elsewhere(plan) if plan.caller else None
        self._bindings = [
            Binding(plan, number, memory, self._mark, log, library) for number in range(len(plan.instances))
        ]
        self._steppers = [_STEPPERS[plan.interface](binding, plan) for binding in self._bindings]
        self._saved = Saved(self._bindings, as_bytes=plan.state == "bytes")
        self._before: tuple[int, list[tuple[Any, list[float]]]] | None = None  # time, states before a step
        self._now = self._start = 0
        self._configure()

    def _elsewhere(self, plan: Plan) -> Any:
        """Return the library in a process of its own."""
        from linkwind.fmi.host.remote import Connection, RemoteLibrary

        self._mark("dlopen")
        path = Path(plan.folder, plan.library)
        connection = Connection(plan.caller, path.parent)
        connection.limit(plan.memory)
        return RemoteLibrary(connection, path)

    def _configure(self) -> None:
        for binding in self._bindings:
            binding.configure(self._plan.structural)
            binding.set(self._plan.start)
        self._mode = Mode.INSTANTIATED

    def evaluate(self, time_ns: int, *, again: bool = False) -> None:
        """Bring the outputs to the time [ns], with the inputs that lie in the shared memory.

        The first call initialises, and reads the outputs in initialisation mode. Later ones step; with an FMU
        that steps more rarely the outputs are held.

        Args:
            time_ns: of the communication point.
            again: whether the last call was for the same point: go back to before it, where the FMU has
                state, else only set the inputs again.
        """
        if again:
            self._rewind()
        else:
            self._forget()
        if self._mode is Mode.INSTANTIATED:
            self._initialise(time_ns)
        elif time_ns == self._now:
            pass
        elif time_ns > self._now:
            self._advance(time_ns)
            return
        else:
            raise CallError(f"expected a time after {self._now / 1e9:.9g} s; got {time_ns / 1e9:.9g} s")
        for binding, stepper in self._each():
            stepper.reread(time_ns / 1e9)
            binding.get_outputs()
        if self._mode is Mode.STEPPING:
            self._differentiate()

    def _initialise(self, time_ns: int) -> None:
        """Enter initialisation mode, and set the inputs that are not exchanged."""
        self._now = self._start = time_ns
        for binding in self._bindings:
            binding.enter_initialisation(time_ns / 1e9)
            binding.set(self._plan.held)
        self._mode = Mode.INITIALISATION

    def _advance(self, time_ns: int) -> None:
        """Step every instance to the time, in steps of its own size."""
        self._begin()
        own = self._plan.own_ns
        if own == self._plan.step_ns:
            own = time_ns - self._now
        elif (time_ns - self._start) % own:
            self._memory[self._derivatives_at :] = bytes(len(self._memory) - self._derivatives_at)
            return  # between its steps: the outputs are held
        if self._before is None and self._plan.state != "none":
            self._before = self._now, [(b.keep(), s.memory()) for b, s in self._each()]
        while self._now < time_ns:
            end_ns = self._now + own
            t, end, h = self._now / 1e9, end_ns / 1e9, own / 1e9
            for stepper in self._steppers:
                stepper.advance(t, end, h)
            self._now = end_ns
        for binding in self._bindings:
            binding.get_outputs()
        self._differentiate()

    def _differentiate(self) -> None:
        """Read the derivatives, if asked to; not-a-number where the FMU fails to give them."""
        if not self._plan.knowns or self._without_derivatives:
            return
        try:
            for binding in self._bindings:
                binding.get_derivatives()
        except CallError as error:
            self._without_derivatives = True
            self._log(str(error))
            count = (len(self._memory) - self._derivatives_at) // 8
            self._memory[self._derivatives_at :] = struct.pack("<d", math.nan) * count

    def _begin(self) -> None:
        """Leave initialisation mode, if not yet done."""
        if self._mode is Mode.INITIALISATION:
            for stepper in self._steppers:
                stepper.begin(self._now / 1e9)
            self._mode = Mode.STEPPING

    # --- memory ---------------------------------------------------------------------------------------

    def _each(self) -> Iterator[tuple[Binding, CoSimulation | ModelExchange]]:
        return zip(self._bindings, self._steppers, strict=True)

    def _rewind(self) -> None:
        """Go back to before the last step, if there was one."""
        if self._before is not None:
            self._now, states = self._before
            for (binding, stepper), (handle, memory) in zip(self._each(), states, strict=True):
                binding.go_back(handle)
                stepper.remember(memory)
                stepper.after_restore()

    def _forget(self) -> None:
        """Drop what ``_rewind`` would go back to."""
        if self._before is not None:
            for binding, (handle, _) in zip(self._bindings, self._before[1], strict=True):
                binding.drop(handle)
            self._before = None

    def save(self) -> bytes:
        """Return all memory: of the instances, and which outputs are held."""
        if self._mode is Mode.INSTANTIATED:
            return _HEAD.pack(_MAGIC, 0, 0, 0, len(self._bindings))
        self._begin()  # so that the state is always one of step mode
        outputs = bytes(self._memory[self._outputs_at : self._derivatives_at])
        parts = [_HEAD.pack(_MAGIC, 1, self._start, self._now, len(self._bindings)), outputs]
        for stepper, state in zip(self._steppers, self._saved.save(), strict=True):
            memory = stepper.memory()
            parts += [struct.pack(f"<II{len(memory)}d", len(memory), len(state), *memory), state]
        return b"".join(parts)

    def restore(self, blob: bytes) -> None:
        """Take back what ``save`` returned.

        Raises:
            CallError: also if the blob is damaged or of another FMU.
        """
        try:
            magic, begun, start, now, count = _HEAD.unpack_from(blob)
        except struct.error:
            raise CallError("the checkpoint is not one of a hosted FMU") from None
        if magic != _MAGIC or count != len(self._bindings):
            raise CallError("the checkpoint is not one of these instances")
        self._forget()
        if not begun:
            self._fresh()
            return
        held = self._derivatives_at - self._outputs_at
        memories, states = self._split(blob[_HEAD.size + held :])
        if self._mode is Mode.INSTANTIATED:
            self._initialise(start)
        self._begin()
        for i in range(len(self._bindings)):
            self._saved.put(i, states[i])
            self._steppers[i].remember(memories[i])
            self._steppers[i].after_restore()
        self._memory[self._outputs_at : self._derivatives_at] = blob[_HEAD.size : _HEAD.size + held]
        self._start, self._now = start, now

    def _split(self, rest: bytes) -> tuple[list[list[float]], list[bytes]]:
        memories, states = [], []
        try:
            for _ in self._bindings:
                numbers, size = struct.unpack_from("<II", rest)
                memories.append(list(struct.unpack_from(f"<{numbers}d", rest, 8)))
                begin = 8 + 8 * numbers
                states.append(rest[begin : begin + size])
                rest = rest[begin + size :]
        except struct.error:
            raise CallError("the checkpoint is cut off") from None
        return memories, states

    def _fresh(self) -> None:
        """Go back to before the first evaluation."""
        if self._mode is Mode.STEPPING:
            for binding in self._bindings:
                binding.reset()
            self._configure()

    def close(self) -> None:
        """Terminate and free every instance."""
        self._forget()
        self._saved.drop()
        for binding in self._bindings:
            binding.free(terminate=self._mode is Mode.STEPPING)
