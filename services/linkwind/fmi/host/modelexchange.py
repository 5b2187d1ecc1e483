"""Integrating a Model Exchange FMU from one communication point to the next.

The classical Runge-Kutta scheme of order 4 over each internal step; the inputs run linearly from the
accepted motion at the old point to the trial at the new one; if one of them is discrete, all hold the new
value over the step. Time events are met exactly; state events are
noticed at the end of the internal step in which an event indicator changes its sign.
"""

from __future__ import annotations

import math
from ctypes import c_double

from linkwind.fmi.host.binding import Binding
from linkwind.fmi.host.plan import Plan

Values = list[float]


class ModelExchange:
    """One instance for Model Exchange."""

    def __init__(self, binding: Binding, plan: Plan) -> None:
        self._fmu = binding
        self._raw = binding.fmu
        self._completed_step = plan.completed_step
        self._never_back = plan.state == "none"
        self._discrete_inputs = plan.discrete_inputs
        self._sizes = (plan.states, plan.indicators)
        self._event_at = math.inf
        self._begun = False
        self._signs: list[bool] = []

    def begin(self, t: float) -> None:
        """Go from initialisation to continuous time, by way of the first events."""
        self._fmu.exit_initialisation()
        _, self._event_at = self._fmu.discrete_states()
        if self._fmu.version == 3:
            self._sizes = (self._raw.getNumberOfContinuousStates(), self._raw.getNumberOfEventIndicators())
        self._raw.enterContinuousTimeMode()
        self._begun = True
        states, indicators = self._sizes
        self._x, self._dx = (c_double * states)(), (c_double * states)()
        self._z = (c_double * indicators)()
        self._signs = self._indicator_signs()

    def advance(self, t: float, end: float, h: float) -> None:
        """Integrate from t to ``end`` [s]."""
        start = t
        if self._discrete_inputs:
            self._event(set_inputs=True)
        while t < end:
            stop = min(end, self._event_at) if self._event_at > t else end
            self._integrate(t, stop, start, end)
            t = stop
            self._finish(t, timed=self._event_at <= t)

    def _integrate(self, t: float, stop: float, start: float, end: float) -> None:
        """Take one step of Runge-Kutta; the inputs follow the line from start to end."""
        fmu, n, h = self._raw, self._sizes[0], stop - t
        if n:
            fmu.getContinuousStates(self._x, n)
            x = list(self._x)
            total = [0.0] * n
            slope: Values = [0.0] * n
            for part, weight in ((0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
                at = [xi + part * h * ki for xi, ki in zip(x, slope, strict=True)]
                self._place(t + part * h if part < 1.0 else stop, at, start, end)
                slope = self._derivatives()
                total = [ti + weight * ki for ti, ki in zip(total, slope, strict=True)]
            self._place(stop, [xi + h / 6.0 * ti for xi, ti in zip(x, total, strict=True)], start, end)
        else:
            self._place(stop, [], start, end)

    def _place(self, t: float, x: Values, start: float, end: float) -> None:
        """Put the FMU to time, states and inputs of a stage."""
        self._raw.setTime(t)
        if self._discrete_inputs:
            pass  # they have been set, and hold until the next step
        elif t == end:
            self._fmu.set_inputs()
        else:
            part = (t - start) / (end - start)
            old, new = self._fmu.accepted, self._fmu.inputs
            between = [a + part * (b - a) for a, b in zip(old, new, strict=True)]
            self._fmu.set_inputs((c_double * len(between))(*between))
        if x:
            self._x = (c_double * len(x))(*x)
            self._raw.setContinuousStates(self._x, len(x))

    def _derivatives(self) -> Values:
        fmu, n = self._raw, self._sizes[0]
        get = fmu.getDerivatives if self._fmu.version == 2 else fmu.getContinuousStateDerivatives
        get(self._dx, n)
        return list(self._dx)

    def _indicator_signs(self) -> list[bool]:
        if not self._sizes[1]:
            return []
        self._raw.getEventIndicators(self._z, self._sizes[1])
        return [z > 0.0 for z in self._z]

    def _finish(self, t: float, *, timed: bool) -> None:
        """End an internal step: tell the FMU, and go through event mode where something happened."""
        wanted = False
        if self._completed_step:
            wanted, over = self._raw.completedIntegratorStep(self._never_back)
            self._fmu.refuse_end(over)
        signs = self._indicator_signs()
        if timed or wanted or signs != self._signs:
            self._event()
            signs = self._indicator_signs()
        self._signs = signs

    def _event(self, *, set_inputs: bool = False) -> None:
        """Go through event mode, the only one in which discrete inputs can be set."""
        self._raw.enterEventMode()
        if set_inputs:
            self._fmu.set_inputs()
        _, self._event_at = self._fmu.discrete_states()
        self._raw.enterContinuousTimeMode()

    def reread(self, t: float) -> None:
        """Set the inputs again at the time that has been reached."""
        if self._discrete_inputs and self._begun:
            self._event(set_inputs=True)
        else:
            self._fmu.set_inputs()

    def after_restore(self) -> None:
        """Look at the event indicators of the restored state."""
        self._signs = self._indicator_signs()

    def memory(self) -> list[float]:
        """Return what the host remembers about this instance: the time of the next event [s]."""
        return [self._event_at]

    def remember(self, memory: list[float]) -> None:
        """Take back what ``memory`` returned."""
        (self._event_at,) = memory
