"""From metres and seconds to cells and steps: resolution, step, window."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from linkwind.aero.base import body_indices, item
from linkwind.aero.flow.drift import first_wind
from linkwind.errors import ScenarioError
from linkwind.native.fluid import shear_rate
from linkwind.scenario import Provider, Scenario
from linkwind.scenario.bodies import Body
from linkwind.scenario.prescribed import prescribed
from linkwind.scenario.shapes import AnyShape, Circle, Ellipse, Ellipsoid, Rectangle, Wing, signed_area
from linkwind.spatial import Array

MAX_SPEED = 0.12  # cells a step that body or wind may go: a Mach number of 0.21
# By dimensions: layers at the border of the window that relax towards the stream; what there is in the
# default window besides the mechanism, in sizes of the largest body; cells that each side is a multiple
# of; most cells.
FRINGE = {2: 24, 3: 12}
MARGIN = {2: (10.0, 8.0), 3: (7.0, 5.0, 5.0)}
MULTIPLE = {2: (16, 16), 3: (16, 8, 8)}
MAX_CELLS = {2: 2**27, 3: 2**25}
SIDES = ("width", "height", "depth")
ASIDE = 0.1  # share of the window by which the mechanism stands upstream of its middle
THINNEST = 4.0  # cells across a closed shape
SHORTEST = 8.0  # cells along a body
VISCOSITY = 1e-7  # cells² a step; what is much less is none in single precision
MAX_SUBSTEPS = 256  # lattice steps in a communication step


@dataclass(frozen=True)
class Grid:
    """A lattice for a scenario.

    Attributes:
        cell: side of a cell [m].
        step: time of a lattice step [s].
        substeps: lattice steps in a communication step.
        length: of the longest body [m].
        place: where the middle of the mechanism stands in the window, as a share of its sides.
        density: of the fluid [kg/m³], in the plane times the span of the bodies [kg/m²].
        viscosity: kinematic [m²/s].
        wind: the part of it that never changes [m/s], in W, as many components as dimensions.
    """

    cell: float
    step: float
    substeps: int
    length: float
    place: tuple[float, ...]
    density: float
    viscosity: float
    wind: tuple[float, ...]

    @property
    def speed(self) -> float:
        """A cell a step [m/s]."""
        return self.cell / self.step

    @property
    def dimensions(self) -> int:
        """Of the flow."""
        return len(self.wind)

    @property
    def fringe(self) -> int:
        """Layers at the border of the window that relax towards the stream."""
        return FRINGE[self.dimensions]

    @property
    def stream(self) -> tuple[float, ...]:
        """The velocity of the fluid far away, in the frame of the lattice [cells/step]."""
        return tuple(component / self.speed for component in self.wind)

    @property
    def lattice_viscosity(self) -> float:
        """The viscosity [cells²/step]."""
        return self.viscosity * self.step / self.cell**2


def bodies(scenario: Scenario, provider: Provider) -> list[Body]:
    """Return the bodies in the flow."""
    return [scenario.bodies[i] for i in body_indices(scenario, provider)]


def moved_by_the_fluid(scenario: Scenario, provider: Provider) -> list[Body]:
    """Return the bodies in the flow whose motion is not stated for all times."""
    stated = prescribed(scenario)
    return [body for body in bodies(scenario, provider) if body.name not in stated]


def plan(scenario: Scenario, provider: Provider) -> Grid:
    """Return the grid for a scenario.

    Raises:
        ScenarioError: it would be too coarse, its steps too many, or its viscosity too small.
    """
    flow, environment, acted = provider.flow, scenario.environment, bodies(scenario, provider)
    dimensions = flow.dimensions
    length = max(extent(body, dimensions) for body in acted)
    cell = length / flow.cells
    _check_resolution(scenario, provider, acted, cell)
    wind = environment.uniform_wind[:dimensions]
    step = scenario.coupling.step_ns / 1e9
    first = first_wind(scenario, dimensions).tolist()
    fastest = max(math.hypot(*wind), math.hypot(*first), *(_speed(body, dimensions) for body in acted))
    substeps = max(1, math.ceil(fastest * step / cell / MAX_SPEED - 1e-9))
    if substeps > MAX_SUBSTEPS:
        raise ScenarioError(
            f"{scenario.source}: coupling.step: expected at most {MAX_SUBSTEPS} lattice steps of {MAX_SPEED} "
            f"cells in it; got {step:g} s, which takes {substeps}. Take at most "
            f"{step * MAX_SUBSTEPS / substeps:.2g} s, "
            "or fewer cells."
        )
    span = next(body.shape.span for body in acted if body.shape) if dimensions == 2 else 1.0
    grid = Grid(
        cell, step / substeps, substeps, length, _place(scenario, dimensions), environment.density * span,
        environment.viscosity, wind,
    )  # fmt: skip
    _check_viscosity(scenario, grid)
    return grid


def extent(body: Body, dimensions: int) -> float:
    """Return the longest extent of a body in the flow [m]."""
    assert body.shape is not None  # the scenario has been checked
    length = body.shape.reference_length
    return length if dimensions == 2 else max(length, body.shape.span)


def _size(body: Body, dimensions: int) -> float:
    """Return the size of a body that its disturbance of the flow goes with [m]: of a long one less."""
    assert body.shape is not None
    length = body.shape.reference_length
    return length if dimensions == 2 else math.sqrt(length * body.shape.span)


def reach(body: Body, dimensions: int) -> float:
    """Return how far a body reaches from its centre of mass [m]."""
    assert body.shape is not None
    if isinstance(body.shape, Wing):
        return float(np.linalg.norm(body.shape.planform, axis=1).max())
    across = body.shape.span if dimensions == 3 else 0.0
    return 0.5 * math.hypot(body.shape.reference_length, across)


def moved(body: Body, grid: Grid) -> float:
    """Return the mass of fluid that a body accelerates with it [kg]: the most that it can be, about.

    That of a plate across its motion, and of a circle.
    """
    shape = body.shape
    assert shape is not None
    length, span = shape.reference_length, shape.span
    volume = length**2 if grid.dimensions == 2 else min(length, span) * max(length, span) * width(shape)
    return 0.25 * math.pi * grid.density * volume


def width(shape: AnyShape) -> float:
    """Return the shorter side of a plate or a cylinder seen along y, and the mean width of a wing [m]."""
    sides = (shape.reference_length, shape.span)
    return signed_area(shape.planform) / max(sides) if isinstance(shape, Wing) else min(sides)


def _speed(body: Body, dimensions: int) -> float:
    """Return the speed of the fastest point of a body at the start, as far as it states it [m/s]."""
    turning = math.hypot(*(body.angular_velocity or (0.0,)))
    return math.hypot(*(body.velocity or (0.0,))) + turning * reach(body, dimensions)


def start_time(scenario: Scenario, provider: Provider, grid: Grid) -> float:
    """Return the time of a smooth start [s]: as stated, or the wind's time along the longest body."""
    if provider.flow.start_time is not None:
        return provider.flow.start_time
    speed = math.hypot(*first_wind(scenario, grid.dimensions).tolist())
    return grid.length / speed if speed else 0.0


def window(scenario: Scenario, provider: Provider, grid: Grid, centres: Array) -> tuple[int, ...]:
    """Return the cells of a window along each axis, for bodies whose centres of mass are at ``centres`` [m].

    Raises:
        ScenarioError: too small or too large.
    """
    mechanism = np.ptp(centres, axis=0) + grid.length
    largest = max(_size(body, grid.dimensions) for body in bodies(scenario, provider))
    margin = largest * np.array(MARGIN[grid.dimensions])
    sides = provider.flow.window or (mechanism + margin).tolist()
    multiples = MULTIPLE[grid.dimensions]
    size = tuple(m * max(1, round(side / grid.cell / m)) for side, m in zip(sides, multiples, strict=True))
    _check_window(scenario, provider, size, grid)
    return size


def _check_resolution(scenario: Scenario, provider: Provider, acted: list[Body], cell: float) -> None:
    for body in acted:
        shape = body.shape
        assert shape is not None
        across = _thickness(shape, provider.flow.dimensions) / cell if shape.closed else math.inf
        along = extent(body, provider.flow.dimensions) / cell
        need = max(THINNEST / across, SHORTEST / along)
        if need > 1.0:
            spanwise = provider.flow.dimensions == 3 and shape.span > shape.reference_length
            got = f"{along:.3g} along" + (f" its span, {shape.span:g} m" if spanwise else "")
            got += f", {across:.3g} across" if shape.closed else ""
            raise ScenarioError(
                f"{item(scenario, provider, 'flow', 'cells')}: expected {SHORTEST:g} cells along and "
                f'{THINNEST:g} across "{body.name}"; got {got}. '
                f"Use at least {math.ceil(need * provider.flow.cells)}."
            )


def _check_viscosity(scenario: Scenario, grid: Grid) -> None:
    if not np.float32(shear_rate(grid.lattice_viscosity)) < 2.0:
        least = VISCOSITY * grid.cell**2 / grid.step
        raise ScenarioError(
            f"{scenario.source}: environment.viscosity: expected at least {VISCOSITY:g} cells² a lattice "
            f"step, here {least:.2g} m²/s; got {grid.viscosity:g} m²/s. Make it larger."
        )


def _thickness(shape: AnyShape, dimensions: int) -> float:
    """Return the least extent of a closed shape [m]; of a polygon, about."""
    along_z = shape.span if dimensions == 3 else math.inf
    match shape:
        case Ellipse() | Rectangle():
            return min(shape.length, shape.width, along_z)
        case Circle():
            return min(shape.diameter, along_z)
        case Ellipsoid():
            return min(shape.size)
    outline = shape.outline()
    return min(signed_area(outline) / float(np.ptp(outline, axis=0).max()), along_z)


def _check_window(scenario: Scenario, provider: Provider, size: tuple[int, ...], grid: Grid) -> None:
    where = item(scenario, provider, "flow", "window")
    for name, multiple, cells in zip(SIDES, MULTIPLE[grid.dimensions], size, strict=False):
        least = math.ceil((2 * grid.fringe + 16) / multiple) * multiple
        if cells < least:
            raise ScenarioError(
                f"{where}: expected a {name} of at least {least * grid.cell:.4g} m, {least} cells; got "
                f"{cells} cells. Make it larger, or leave it out."
            )
    most = MAX_CELLS[grid.dimensions]
    if math.prod(size) > most:
        got = " × ".join(map(str, size))
        raise ScenarioError(
            f"{where}: expected at most {most} cells; got {got}. Make it smaller, or use fewer cells."
        )


def _place(scenario: Scenario, dimensions: int) -> tuple[float, ...]:
    """Return where to put the mechanism: upstream and below, for its wake goes with the wind and upwards."""
    flow = first_wind(scenario, dimensions)
    up = -np.array(scenario.environment.gravity[:dimensions])
    middle = 0.5 + np.zeros(dimensions) - ASIDE * sum(v / math.hypot(*v) for v in (flow, up) if v.any())
    return tuple(middle.tolist())
