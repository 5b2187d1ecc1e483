"""What is not wrong in a scenario or in a run, but perhaps not what was meant."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from linkwind.aero.base import item
from linkwind.aero.flow import grid as grids
from linkwind.aero.planform import mean_chord, thin
from linkwind.aero.unsteady import at_start, unsteady
from linkwind.scenario import Provider, Scenario
from linkwind.scenario.providers import BEYOND_DEG, SEPARATES_DEG

WITHOUT_WIND = ("none", "field")  # models that read no wind from the scenario
# Without the response a body wants so many times the mass of fluid that it accelerates, by the number of
# lattice steps in a communication step; measured on free plates.
WANTED = ((2, 1.0), (math.inf, 2.0))
FEW = 10.0  # cells along the shorter side of a plate in space, or the mean width of a wing
COARSE = 2.0  # panels that a wing goes in a step: above, lift after a sudden change is some percent off
MANY_RINGS = 1500  # a step takes 0.6 s, and grows with the third power
SHORT = 4.0  # chords: what a shorter wake leaves out is felt


def doubts(scenario: Scenario) -> Iterator[str]:
    """Yield what to tell the user before a run, a sentence each; the scenario has been checked."""
    yield from _no_wind(scenario)
    yield from unsteady(scenario)
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
        if provider.model == "vortex":
            yield from _advanced(scenario, provider, reported_max.get(provider.name, {}).get("advance", 0.0))
        angle = reported_max.get(provider.name, {}).get("incidence_deg", 0.0)
        if provider.model == "vortex" and angle > BEYOND_DEG:
            yield (
                f"{item(scenario, provider, 'model')}: the largest angle of attack was {angle:.0f}°; from "
                f"some {SEPARATES_DEG:g}° on a real flow separates, which model vortex does not know."
            )


def _advanced(scenario: Scenario, provider: Provider, advance: float) -> Iterator[str]:
    """Yield what was wrong with a wake that nothing told of before the run: its wings were at rest.

    Args:
        scenario: of the run.
        provider: whose wake it is.
        advance: panels that the fastest point of a wing went in a step, at most.
    """
    settings, step = provider.vortex, scenario.coupling.step
    chords = advance * settings.wake / settings.chordwise
    if list(_of_rings(scenario, provider)):
        return
    if advance > COARSE:
        yield (
            f"{scenario.source}: coupling.step: the fastest point of a wing went {advance:.2g} panels of "
            f'"{provider.name}" in a step, and as long are the rings of its wake; one is enough. Use about '
            f"{step / advance:.2g} s."
        )
    elif 0.0 < chords < SHORT and settings.wake < scenario.steps:
        yield (
            f"{item(scenario, provider, 'vortex', 'wake')}: {settings.wake} rows reach {chords:.2g} chords "
            f"behind the fastest point of a wing at most, and what a shorter wake than {SHORT:g} leaves out "
            f"is felt. Use {math.ceil(SHORT / chords * settings.wake)} or more, or a larger coupling.step."
        )


def _no_wind(scenario: Scenario) -> Iterator[str]:
    models = {provider.model for provider in scenario.providers}
    blows = any(scenario.environment.wind) or scenario.environment.gusts
    if blows and "field" in models and models <= set(WITHOUT_WIND):
        yield (
            f"{scenario.source}: environment: the wind moves nothing here: a field is what its expressions "
            "say. Write the wind into them, or use model plate."
        )


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
    for body in grids.moved_by_the_fluid(scenario, provider):
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
            "chord a fruit fly's wings lift 0.75 of what they lift with 15. Use at least "
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
    pairs = zip(at_start(scenario), scenario.bodies, strict=True)
    speeds = [math.dist(air, body.velocity or (0.0, 0.0, 0.0)) for air, body in pairs]
    chord = min(map(mean_chord, thin(scenario, provider)))
    fastest = max(filter(math.isfinite, speeds), default=0.0)
    far = fastest * scenario.coupling.step / chord  # chords in a step, at the start
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
