"""What is not wrong in a wind that changes, but perhaps not what was meant."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from linkwind.native.wind import WindTable, wind_at
from linkwind.scenario import Scenario
from linkwind.wind import wind_table

STEPS_A_GUST = 8.0  # that tell its shape: with fewer, a sine's largest value is missed by 8 % and more
LOOKS = 400  # steps in which a wind is looked at
STILL = np.zeros(3)


def unsteady(scenario: Scenario) -> Iterator[str]:
    """Yield what to tell the user before a run, a sentence each."""
    yield from _gusts_too_short(scenario)
    yield from _tables_too_short(scenario)
    yield from _winds_too_fast(scenario)


def at_start(scenario: Scenario) -> list[list[float]]:
    """Return the wind without gusts [m/s] that each body meets at the start, shape (n, 3).

    One whose position follows from joints is taken to be at the origin, which is near enough for a note.
    """
    places = np.array([body.position or (0.0, 0.0, 0.0) for body in scenario.bodies])
    wind, _ = wind_at(_functions(scenario), 0.0, places, STILL)
    found: list[list[float]] = wind.tolist()
    return found


def _gusts_too_short(scenario: Scenario) -> Iterator[str]:
    step = scenario.coupling.step
    for index, gust in enumerate(scenario.environment.gusts):
        frequency = abs(gust.frequency)
        if frequency * step * STEPS_A_GUST > 1.0:
            yield (
                f"{scenario.source}: environment.gusts[{index}].frequency: a gust of {frequency:g} Hz takes "
                f"{1.0 / (frequency * step):.2g} steps of {step:g} s, and is not seen as it is. Use a "
                f"coupling.step of {1.0 / (frequency * STEPS_A_GUST):.2g} s or less."
            )


def _tables_too_short(scenario: Scenario) -> Iterator[str]:
    """Two rows with the same value at an end say that it is to be held."""
    end = scenario.time.end
    for index, function in scenario.environment.wind_functions.items():
        table = function.table
        if table is None or function.periodic:
            continue
        (first, one), (last, other) = table[0], table[-1]
        cuts = (
            (first > 0.0 and one != table[1][1], first, one),
            (last < end and other != table[-2][1], last, other),
        )
        for t, value in ((t, value) for cut, t, value in cuts if cut):
            yield (
                f"{scenario.source}: environment.wind[{index}].table: it goes from {first:g} to {last:g} s "
                f"and the run from 0 to {end:g} s; beyond {t:g} s it stays at {value:g} m/s. Add rows (two "
                "of one value say that it is meant), or repeat it with periodic = true."
            )


def _winds_too_fast(scenario: Scenario) -> Iterator[str]:
    """A sine leaves the line between two of its values by 1 - cos(π / steps) amplitudes in the middle."""
    functions, step = scenario.environment.wind_functions, scenario.coupling.step
    if not functions or scenario.steps < STEPS_A_GUST:
        return
    steps = np.unique(np.floor(scenario.steps * (np.arange(LOOKS) * 0.618034 % 1.0)))  # at no period
    place = scenario.bodies[0].position or (0.0, 0.0, 0.0)
    times = step * (steps[:, None] + [0.0, 0.5, 1.0])
    found, _ = wind_at(_functions(scenario), times, np.broadcast_to(place, (*times.shape, 3)), STILL)
    most = 1.0 - math.cos(math.pi / STEPS_A_GUST)
    for index in functions:
        wind = found[..., index][np.isfinite(found[..., index]).all(axis=1)]
        off = np.abs(wind[:, 1] - 0.5 * (wind[:, 0] + wind[:, 2])).max(initial=0.0)
        half = 0.5 * np.ptp(wind) if wind.size else 0.0
        if off > most * half:
            yield (
                f"{scenario.source}: environment.wind[{index}]: within a step of {step:g} s it goes up to "
                f"{off:.2g} m/s off the line between its values at the ends, and is not seen as it is. Use a "
                f"coupling.step of about {step * math.sqrt(most * half / off):.2g} s."
            )


def _functions(scenario: Scenario) -> WindTable:
    """Return the wind without gusts."""
    return wind_table(scenario.environment.model_copy(update={"gusts": ()}), scenario.source)
