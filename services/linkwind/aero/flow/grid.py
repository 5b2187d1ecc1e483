"""From metres and seconds to cells and steps: resolution, step, window."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from linkwind.aero.base import body_indices, item
from linkwind.errors import ScenarioError
from linkwind.scenario import Provider, Scenario
from linkwind.scenario.bodies import Body
from linkwind.scenario.shapes import Circle, Ellipse, Rectangle, signed_area
from linkwind.spatial import Array

MAX_SPEED = 0.12  # cells a step that body or wind may go: a Mach number of 0.21
FRINGE = 24  # layers at the border of the window that relax towards the stream
MARGIN = (10.0, 8.0)  # default window: what there is besides the mechanism, in lengths of the longest body
ASIDE = 0.1  # share of the window by which the mechanism stands upstream of its middle
THINNEST = 4.0  # cells across a closed shape
SHORTEST = 8.0  # cells along a body
MAX_SUBSTEPS = 256  # lattice steps in a communication step
MAX_CELLS = 2**27


@dataclass(frozen=True)
class Grid:
    """A lattice for a scenario.

    Attributes:
        cell: side of a cell [m].
        step: time of a lattice step [s].
        substeps: lattice steps in a communication step.
        length: of the longest body [m].
        place: where the middle of the mechanism stands in the window, as a share of its width and height.
        density: of the fluid times the span of the bodies [kg/m²].
        viscosity: kinematic [m²/s].
        wind: [m/s], in W.
    """

    cell: float
    step: float
    substeps: int
    length: float
    place: tuple[float, float]
    density: float
    viscosity: float
    wind: tuple[float, float]

    @property
    def speed(self) -> float:
        """A cell a step [m/s]."""
        return self.cell / self.step

    @property
    def stream(self) -> tuple[float, float]:
        """The wind [cells/step]."""
        return self.wind[0] / self.speed, self.wind[1] / self.speed

    @property
    def lattice_viscosity(self) -> float:
        """The viscosity [cells²/step]."""
        return self.viscosity * self.step / self.cell**2


def bodies(scenario: Scenario, provider: Provider) -> list[Body]:
    """Return the bodies in the flow."""
    return [scenario.bodies[i] for i in body_indices(scenario, provider)]


def plan(scenario: Scenario, provider: Provider) -> Grid:
    """Return the grid for a scenario.

    Raises:
        ScenarioError: it would be too coarse, or its steps too many.
    """
    flow, environment, acted = provider.flow, scenario.environment, bodies(scenario, provider)
    length = max(body.shape.reference_length for body in acted if body.shape)
    cell = length / flow.cells
    _check_resolution(scenario, provider, acted, cell)
    wind = environment.wind[:2]
    step = scenario.coupling.step_ns / 1e9
    fastest = max(math.hypot(*wind), *(_speed(body) for body in acted))
    substeps = max(1, math.ceil(fastest * step / cell / MAX_SPEED - 1e-9))
    if substeps > MAX_SUBSTEPS:
        raise ScenarioError(
            f"{scenario.source}: coupling.step: expected at most {MAX_SUBSTEPS} lattice steps of {MAX_SPEED} "
            f"cells in it; got {step:g} s, which takes {substeps}. Take at most "
            f"{step * MAX_SUBSTEPS / substeps:.2g} s, "
            "or fewer cells."
        )
    span = next(body.shape.span for body in acted if body.shape)
    return Grid(
        cell, step / substeps, substeps, length, _place(scenario), environment.density * span,
        environment.viscosity, (wind[0], wind[1]),
    )  # fmt: skip


def _speed(body: Body) -> float:
    """Return the speed of the fastest point of a body at the start, as far as it states it [m/s]."""
    assert body.shape is not None
    turning = abs((body.angular_velocity or (0.0, 0.0, 0.0))[2])
    return math.hypot(*(body.velocity or (0.0,))) + turning * 0.5 * body.shape.reference_length


def window(scenario: Scenario, provider: Provider, grid: Grid, centres: Array) -> tuple[int, int]:
    """Return the columns and rows of a window for bodies whose centres of mass are at ``centres`` [m].

    Raises:
        ScenarioError: too small or too large.
    """
    reach = np.ptp(centres, axis=0) + grid.length
    sides = provider.flow.window or (reach + grid.length * np.array(MARGIN)).tolist()
    columns, rows = (16 * max(1, round(side / grid.cell / 16)) for side in sides)
    _check_window(scenario, provider, (columns, rows), grid.cell)
    return columns, rows


def _check_resolution(scenario: Scenario, provider: Provider, acted: list[Body], cell: float) -> None:
    for body in acted:
        shape = body.shape
        assert shape is not None
        across = _thickness(shape) / cell if shape.closed else math.inf
        along = shape.reference_length / cell
        need = max(THINNEST / across, SHORTEST / along)
        if need > 1.0:
            got = f"{along:.3g} along" + (f", {across:.3g} across" if shape.closed else "")
            raise ScenarioError(
                f"{item(scenario, provider, 'flow', 'cells')}: expected {SHORTEST:g} cells along and "
                f'{THINNEST:g} across "{body.name}"; got {got}. '
                f"Use at least {math.ceil(need * provider.flow.cells)}."
            )


def _thickness(shape: object) -> float:
    """Return the least extent of a closed shape [m]; of a polygon, about."""
    if isinstance(shape, Ellipse | Rectangle):
        return min(shape.length, shape.width)
    if isinstance(shape, Circle):
        return shape.diameter
    outline = shape.outline()  # type: ignore[attr-defined]
    return signed_area(outline) / float(np.ptp(outline, axis=0).max())


def _check_window(scenario: Scenario, provider: Provider, size: tuple[int, int], cell: float) -> None:
    least = 2 * FRINGE + 16
    where = item(scenario, provider, "flow", "window")
    for name, cells in zip(("width", "height"), size, strict=True):
        if cells < least:
            raise ScenarioError(
                f"{where}: expected a {name} of at least {least * cell:.4g} m, {least} cells; got {cells} "
                f"cells. "
                "Make it larger, or leave it out."
            )
    if size[0] * size[1] > MAX_CELLS:
        raise ScenarioError(
            f"{where}: expected at most {MAX_CELLS} cells; got {size[0]} × {size[1]}. Make it smaller, or "
            f"use "
            "fewer cells."
        )


def _place(scenario: Scenario) -> tuple[float, float]:
    """Return where to put the mechanism: upstream and below, for its wake goes with the wind and upwards."""
    flow = np.array(scenario.environment.wind[:2])
    up = -np.array(scenario.environment.gravity[:2])
    x, y = 0.5 + np.zeros(2) - ASIDE * sum(v / np.hypot(*v) for v in (flow, up) if v.any())
    return float(x), float(y)
