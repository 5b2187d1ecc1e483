"""One instance of an FMU with one manner: the same calls for FMI 2 and 3.

The arrays of values lie in the memory that host and worker share, and the FMU reads and writes them there.
"""

from __future__ import annotations

import mmap
from collections.abc import Sequence
from ctypes import c_double, c_uint
from typing import Any

from fmpy import fmi2

from linkwind.fmi.host.library import CLASSES, CallError, Log, callbacks2, logger3
from linkwind.fmi.host.plan import Marker, Plan, Setting

MAX_EVENT_ITERATIONS = 1000


class Binding:
    """One instance of an FMU, before the rules of stepping come in.

    Attributes:
        fmu: FMPy's object, for calls that only one kind of FMU has.
        version: of FMI.
        event_mode: whether the instance uses it (Co-Simulation).
    """

    def __init__(
        self, plan: Plan, number: int, memory: mmap.mmap, mark: Marker, log: Log, library: Any = None
    ) -> None:
        """Load the library, unless it is loaded in another process, and instantiate.

        Raises:
            CallError: the library cannot be loaded, or the FMU refuses.
        """
        self.version = plan.version
        self.event_mode = plan.event_mode
        self._plan = plan
        self._name = plan.instances[number]
        mark("dlopen")
        arguments = {
            "guid": plan.token,
            "modelIdentifier": plan.identifier,
            "unzipDirectory": plan.folder,
            "instanceName": self._name,
        }
        try:
            self.fmu: Any = CLASSES[plan.version, plan.interface](library=library, **arguments)
        except Exception as error:
            raise CallError(" ".join(str(error).split())) from None
        self.fmu.mark = mark
        self._bind(plan, number, memory)
        self._instantiate(plan, log)

    def _bind(self, plan: Plan, number: int, memory: mmap.mmap) -> None:
        """Make the arguments of the calls of every step once."""
        accepted, inputs, outputs, derivatives = plan.places()
        doubles = c_double * plan.input_size
        row = 8 * number * plan.input_size
        self.accepted = doubles.from_buffer(memory, accepted + row)
        self.inputs = doubles.from_buffer(memory, inputs + row)
        out = (c_double * plan.output_size).from_buffer(memory, outputs + 8 * number * plan.output_size)
        vr_in, vr_out = ((c_uint * len(v))(*v) for v in (plan.inputs, plan.outputs))
        self._set = (vr_in, len(vr_in))
        self._get: tuple[Any, ...] = (vr_out, len(vr_out), out)
        if plan.version == 3:
            self._get += (plan.output_size,)
        rows, length = len(plan.seeds), plan.output_size
        begin = derivatives + 8 * number * rows * length
        row_places = [begin + 8 * row * length for row in range(rows)]
        self._rows = [(c_double * length).from_buffer(memory, place) for place in row_places]
        self._seeds = [(c_double * plan.seed_size)() for _ in plan.seeds]
        for seed, place in zip(self._seeds, plan.seeds, strict=True):
            seed[place] = 1.0
        known = (c_uint * len(plan.knowns))(*plan.knowns)
        self._unknown_known = (vr_out, len(vr_out), known, len(known))

    def _instantiate(self, plan: Plan, log: Log) -> None:
        try:
            if plan.version == 2:
                self.fmu.instantiate(callbacks=callbacks2(log), loggingOn=True)
            elif plan.interface == "cs":
                self._instantiate_stepping(log)
            else:
                self.fmu.instantiate(loggingOn=True, logMessage=logger3(log))
        except CallError:
            raise
        except Exception:
            kind = {"cs": "CoSimulation", "me": "ModelExchange"}[plan.interface]
            function = "fmi2Instantiate" if plan.version == 2 else f"fmi3Instantiate{kind}"
            raise CallError(f"{function} returned no instance") from None
        if plan.log_categories:
            self._ask_for(plan.log_categories)

    def _instantiate_stepping(self, log: Log) -> None:
        """Instantiate for Co-Simulation, FMI 3; without event mode where the FMU says it had one but refuses.

        Early return goes with events: without event mode there is nothing to return for.
        """
        used = self.event_mode
        try:
            self.fmu.instantiate(
                loggingOn=True, eventModeUsed=used, earlyReturnAllowed=used, logMessage=logger3(log)
            )
        except CallError:
            raise
        except Exception:
            if not used:
                raise
            self.event_mode = False
            self._instantiate_stepping(log)

    def _ask_for(self, categories: Sequence[str]) -> None:
        names = (fmi2.fmi2String * len(categories))(*(name.encode() for name in categories))
        set_logging = self.fmu.fmi2SetDebugLogging if self.version == 2 else self.fmu.fmi3SetDebugLogging
        set_logging(self.fmu.component, True, len(categories), names)

    # --- before the first step ------------------------------------------------------------------------

    def configure(self, settings: Sequence[Setting]) -> None:
        """Set structural parameters, in configuration mode."""
        if settings:
            self.fmu.enterConfigurationMode()
            self.set(settings)
            self.fmu.exitConfigurationMode()

    def set(self, settings: Sequence[Setting]) -> None:
        """Set values of any type."""
        for setting in settings:
            kind = "Integer" if setting.type == "Enumeration" and self.version == 2 else setting.type
            setter = getattr(self.fmu, "set" + ("Int64" if kind == "Enumeration" else kind))
            setter([setting.reference], list(setting.values))

    def enter_initialisation(self, start: float) -> None:
        """Enter initialisation mode at time ``start`` [s]; without a stop time."""
        if self.version == 2:
            self.fmu.setupExperiment(startTime=start)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=start)

    def exit_initialisation(self) -> None:
        """Leave initialisation mode."""
        self.fmu.exitInitializationMode()

    def reset(self) -> None:
        """Go back to what the FMU was after instantiation."""
        self.fmu.reset()

    # --- every step -----------------------------------------------------------------------------------

    def set_inputs(self, values: Any = None) -> None:
        """Set the inputs, from the shared memory unless given."""
        fmu, values = self.fmu, self.inputs if values is None else values
        if not self._set[1]:
            return
        if self.version == 2:
            fmu.fmi2SetReal(fmu.component, *self._set, values)
        else:
            fmu.fmi3SetFloat64(fmu.component, *self._set, values, len(values))

    def get_outputs(self) -> None:
        """Read the outputs into the shared memory."""
        fmu = self.fmu
        (fmu.fmi2GetReal if self.version == 2 else fmu.fmi3GetFloat64)(fmu.component, *self._get)

    def get_derivatives(self) -> None:
        """Read the derivatives of the outputs by each seed into the shared memory."""
        fmu, asked = self.fmu, self._unknown_known
        for seed, row in zip(self._seeds, self._rows, strict=True):
            if self.version == 2:
                fmu.fmi2GetDirectionalDerivative(fmu.component, *asked, seed, row)
            else:
                fmu.fmi3GetDirectionalDerivative(fmu.component, *asked, seed, len(seed), row, len(row))

    def discrete_states(self) -> tuple[bool, float]:
        """Iterate the discrete states of event mode until they rest.

        Returns:
            whether continuous states have new values, and the time of the next event [s] (infinite: none).
        """
        update = self.fmu.newDiscreteStates if self.version == 2 else self.fmu.updateDiscreteStates
        changed = False
        for _ in range(MAX_EVENT_ITERATIONS):
            again, end, _, states, timed, at = update()
            changed |= states
            self.refuse_end(end)
            if not again:
                return changed, at if timed else float("inf")
        raise CallError(f"its discrete states do not come to rest in {MAX_EVENT_ITERATIONS} iterations")

    def refuse_end(self, end: bool) -> None:
        """Raise CallError if the FMU wants the simulation to end."""
        if end:
            raise CallError("it asked to end the simulation (terminateSimulation)")

    # --- its memory -----------------------------------------------------------------------------------

    def keep(self) -> Any:
        """Return a handle of the FMU's state, to be given back to ``drop``."""
        return self.fmu.getFMUState()

    def go_back(self, handle: Any) -> None:
        """Set the FMU's state."""
        self.fmu.setFMUState(handle)

    def drop(self, handle: Any) -> None:
        """Free a handle."""
        self.fmu.freeFMUState(handle)

    def to_bytes(self, handle: Any) -> bytes:
        """Return a state as bytes."""
        return bytes(self.fmu.serializeFMUState(handle))

    def from_bytes(self, blob: bytes) -> Any:
        """Return the handle of a state that was bytes."""
        return self.fmu.deserializeFMUState(blob)

    def free(self, *, terminate: bool) -> None:
        """Terminate and free the instance; the library stays loaded."""
        if terminate:
            self.fmu.terminate()
        if self.version == 2:
            self.fmu.fmi2FreeInstance(self.fmu.component)
        else:
            self.fmu.fmi3FreeInstance(self.fmu.component)
