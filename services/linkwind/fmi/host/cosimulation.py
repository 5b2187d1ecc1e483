"""Stepping a Co-Simulation FMU from one communication point to the next.

The inputs are those of the new point, set before the step and held over it; the outputs are read after it.
For a force without memory that is the force at the new point.
"""

from __future__ import annotations

from linkwind.fmi.host.binding import MAX_EVENT_ITERATIONS, Binding
from linkwind.fmi.host.library import CallError
from linkwind.fmi.host.plan import Plan

_TIME_EPSILON = 1e-12  # of the time: round-off in the times that an FMU reports


class CoSimulation:
    """One instance for Co-Simulation."""

    def __init__(self, binding: Binding, plan: Plan) -> None:
        self._fmu = binding
        self._event_mode = binding.event_mode
        self._variable_step = plan.variable_step
        self._never_back = plan.state == "none"

    def begin(self, t: float) -> None:
        """Go from initialisation to stepping."""
        self._fmu.exit_initialisation()
        if self._event_mode:
            self._settle()

    def _settle(self) -> None:
        self._fmu.discrete_states()
        self._fmu.fmu.enterStepMode()

    def advance(self, t: float, end: float, h: float) -> None:
        """Step from t to ``end`` [s], the inputs held; ``h`` is the step's nominal size [s].

        Raises:
            CallError: the FMU did not get there.
        """
        self._fmu.set_inputs()
        # end − t is exact, so t + (end − t) is end to the last bit; an FMU that knows one step only wants h.
        size = end - t if self._variable_step else h
        if self._fmu.version == 2:
            self._fmu.fmu.doStep(t, size, self._never_back)
        else:
            self._advance3(t, end, size)

    def _advance3(self, t: float, end: float, size: float) -> None:
        slack = _TIME_EPSILON * max(1.0, abs(end))
        for _ in range(MAX_EVENT_ITERATIONS):
            event, over, early, last = self._fmu.fmu.doStep(t, size, self._never_back)
            self._fmu.refuse_end(over)
            # The time is only worth something after an early return: many FMUs do not fill it in otherwise.
            reached = last if early else end
            if not t - slack <= reached <= end + slack:
                raise CallError(f"fmi3DoStep from {t:.17g} s to {end:.17g} s came back at {reached:.17g} s")
            if event and self._event_mode:
                self._fmu.fmu.enterEventMode()
                self._settle()
            if reached >= end - slack:
                return
            t, size = reached, end - reached
        raise CallError(f"fmi3DoStep returned early {MAX_EVENT_ITERATIONS} times before {end:.17g} s")

    def reread(self, t: float) -> None:
        """Set the inputs again at the time that has been reached."""
        self._fmu.set_inputs()

    def after_restore(self) -> None:
        """Do nothing: all memory is the FMU's."""

    def memory(self) -> list[float]:
        """Return what the host remembers about this instance: nothing."""
        return []

    def remember(self, memory: list[float]) -> None:
        """Take back what ``memory`` returned."""
