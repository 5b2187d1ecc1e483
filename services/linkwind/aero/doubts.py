"""What is not wrong in a scenario or in a run, but perhaps not what was meant."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from linkwind.aero.base import item
from linkwind.aero.flow import grid as grids
from linkwind.aero.planform import mean_chord, thin
from linkwind.native.wind import WindTable, wind_at
from linkwind.scenario import Provider, Scenario
from linkwind.scenario.providers import BEYOND_DEG, SEPARATES_DEG
from linkwind.wind import wind_table

WITHOUT_WIND = ("none", "field")  # models that read no wind from the scenario
# Without the response a body wants so many times the mass of fluid that it accelerates, by the number of
# lattice steps in a communication step; measured on free plates.
WANTED = ((2, 1.0), (math.inf, 2.0))
FEW = 10.0  # cells along the shorter side of a plate in space, or the mean width of a wing
COARSE = 2.0  # panels that a wing goes in a step: above, lift after a sudden change is some percent off
STEPS_A_GUST = 8.0  # that tell its shape: with fewer, a sine's largest value is missed by 8 % and more
LOOKS = 400  # steps in which a wind is looked at
MANY_RINGS = 1500  # a step takes 0.6 s, and grows with the third power
SHORT = 4.0  # chords: what a shorter wake leaves out is felt


def doubts(scenario: Scenario) -> Iterator[str]:
    """Yield what to tell the user before a run, a sentence each; the scenario has been checked."""
    yield from _no_wind(scenario)
    yield from _gusts_too_short(scenario)
    yield from _tables_too_short(scenario)
    yield from _winds_too_fast(scenario)
    yield from _angles_in_degrees(scenario)
    for provider in scenario.providers:
        if provider.model == "flow":
            yield from _too_light(scenario, provider)
            yield from _few_cells(scenario, provider)
        if provider.model == "vortex":
            yield from _of_rings(scenario, provider)


def doubts_after(scenario: Scenario, reported_max: Mapping[str, Mapping[str, float]]) -> Iterator[str]:
    """Yield what to tell the user after a run, a sentence each.

    Args:
        scenario: of the run.
        reported_max: the largest of each of a provider's own numbers, by provider and name.
    """
    for provider in scenario.providers:
        angle = reported_max.get(provider.name, {}).get("incidence_deg", 0.0)
        if provider.model == "vortex" and angle > BEYOND_DEG:
            yield (
                f"{item(scenario, provider, 'model')}: the largest angle of attack was {angle:.0f}°; from "
                f"some {SEPARATES_DEG:g}° on a real flow separates, which model vortex does not know."
            )


def _no_wind(scenario: Scenario) -> Iterator[str]:
    models = {provider.model for provider in scenario.providers}
    blows = any(scenario.environment.wind) or scenario.environment.gusts
    if blows and "field" in models and models <= set(WITHOUT_WIND):
        yield (
            f"{scenario.source}: environment: the wind moves nothing here: a field is what its expressions "
            "say. Write the wind into them, or use model plate."
        )


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
        held = [
            (table[0], "first", "up to then") if table[0][0] > 0.0 and table[0][1] != table[1][1] else None,
            (table[-1], "last", "from then on")
            if table[-1][0] < end and table[-1][1] != table[-2][1]
            else None,
        ]
        for (t, value), which, when in filter(None, held):
            yield (
                f"{scenario.source}: environment.wind[{index}].table: its {which} row is at {t:g} s of the "
                f"run's {end:g} s, and its value, {value:g} m/s, holds {when}. Add rows (two of one value say "
                "that it is meant), repeat it with periodic = true, or change time.end."
            )


def _winds_too_fast(scenario: Scenario) -> Iterator[str]:
    """A sine leaves the line between two of its values by 1 - cos(π / steps) amplitudes in the middle."""
    functions, step = scenario.environment.wind_functions, scenario.coupling.step
    if not functions:
        return
    steps = np.unique(np.floor(scenario.steps * (np.arange(LOOKS) * 0.618034 % 1.0)))  # at no period
    place = scenario.bodies[0].position or (0.0, 0.0, 0.0)
    times = step * (steps[:, None] + [0.0, 0.5, 1.0])
    found, _ = wind_at(_functions(scenario), times, np.broadcast_to(place, (*times.shape, 3)), np.zeros(3))
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


def _angles_in_degrees(scenario: Scenario) -> Iterator[str]:
    for index, joint in enumerate(scenario.joints):
        if joint.type != "revolute":
            continue
        angles = [("rest", joint.rest), *(("stop", limit) for limit in joint.stop or ())]
        for key, angle in angles:
            if isinstance(angle, float) and abs(angle) > 2.0 * math.pi:
                yield (
                    f"{scenario.where('joints', index)}.{key}: {angle:g} rad is {math.degrees(angle):.0f}°, "
                    f"more than a turn. If it is meant in degrees, write {math.radians(angle):.4g}."
                )


def _too_light(scenario: Scenario, provider: Provider) -> Iterator[str]:
    grid = grids.plan(scenario, provider)
    if grid.substeps == 1:
        return
    wanted = next(ratio for count, ratio in WANTED if grid.substeps <= count)
    for body in grids.bodies(scenario, provider):
        fluid = grids.moved(body, grid)
        if body.mass < wanted * fluid:
            yield (
                f'{item(scenario, provider, "flow", "cells")}: "{body.name}", {body.mass:g} kg, accelerates '
                f"about {fluid:.2g} kg of fluid; with {grid.substeps} lattice steps in a coupling.step of "
                f"{scenario.coupling.step:g} s, as here, that is stable for bodies of {wanted:g} times that "
                f"mass and more. Should the run diverge, use at most {grid.step:.2g} s."
            )


def _few_cells(scenario: Scenario, provider: Provider) -> Iterator[str]:
    if provider.flow.dimensions == 2:
        return
    cell = grids.plan(scenario, provider).cell
    shapes = {body.name: body.shape for body in grids.bodies(scenario, provider)}
    sides = {
        name: grids.width(shape) / cell
        for name, shape in shapes.items()
        if shape is not None and not shape.closed
    }
    name = min(sides, key=sides.__getitem__, default="")
    if name and sides[name] < FEW:
        yield (
            f'{item(scenario, provider, "flow", "cells")}: the mean width of "{name}" has '
            f"{sides[name]:.3g} cells, and with less than {FEW:g} forces are far off: with 8 along their "
            "chord a fruit fly's wings lift 0.7 of what they lift with 15. Use at least "
            f"{math.ceil(FEW / sides[name] * provider.flow.cells - 1e-9)}."
        )


def _of_rings(scenario: Scenario, provider: Provider) -> Iterator[str]:
    settings = provider.vortex
    rings = settings.chordwise * settings.spanwise * len(provider.bodies)
    if rings > MANY_RINGS:
        yield (
            f"{item(scenario, provider, 'vortex', 'chordwise')}: a step asks for {rings} equations to be "
            f"solved, which takes seconds, and coupling.timeout is {scenario.coupling.timeout:g} s. Raise "
            "that, or use fewer rings."
        )
    places = np.array([body.position or (0.0, 0.0, 0.0) for body in scenario.bodies])
    wind, _ = wind_at(_functions(scenario), 0.0, places, np.zeros(3))
    pairs = zip(wind.tolist(), scenario.bodies, strict=True)
    speeds = [math.dist(air, body.velocity or (0.0, 0.0, 0.0)) for air, body in pairs]
    chord = min(map(mean_chord, thin(scenario, provider)))
    far = (
        max(filter(math.isfinite, speeds), default=0.0) * scenario.coupling.step / chord
    )  # chords in a step, at the start
    if far * settings.chordwise > COARSE:
        yield (
            f"{scenario.source}: coupling.step: at the start the air passes {far * settings.chordwise:.2g} "
            f'panels of "{provider.name}" in a step, and as long are the rings of its wake; one is enough. '
            f"Use about {scenario.coupling.step / (far * settings.chordwise):.2g} s."
        )
    elif 0.0 < far * settings.wake < SHORT:
        yield (
            f"{item(scenario, provider, 'vortex', 'wake')}: at the start {settings.wake} rows reach "
            f"{far * settings.wake:.2g} chords behind the wings, and what a shorter wake than {SHORT:g} "
            f"leaves out is felt. Use {math.ceil(SHORT / far)} or more, or a larger coupling.step."
        )
