"""The variables of a force model as an FMU: motion in, wrench and added inertia out."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from linkwind.aero.field import field_table
from linkwind.aero.planform import thin
from linkwind.aero.plate import plate_table
from linkwind.fmi import units
from linkwind.fmi.dynamics import ADDED_INERTIA_ELEMENTS, TIME, VECTOR, output, parameter, vector_input
from linkwind.fmi.structure import Dependences
from linkwind.fmi.variables import Dependence, Variable
from linkwind.mechanism import Mechanism
from linkwind.native.expressions import Operation
from linkwind.native.forces import VARIABLES, FieldTable
from linkwind.native.multibody import Multibody
from linkwind.native.wind import VARIABLES as WIND_VARIABLES
from linkwind.scenario import Provider, Scenario
from linkwind.spatial import Motion
from linkwind.wind import inputs, wind_table

# What length and span are, by the type of the shape.
_SIDES = {
    "plate": (
        "Length of the plate {}, chord, along x of the body frame",
        "Span of the plate {}, along z of the body frame",
    ),
    "wing": (
        "Mean chord of the wing {}, along x of the body frame, with which its planform scales",
        "Span of the wing {}, along z of the body frame, with which its planform scales",
    ),
}

# What the parameter wind is, without and with functions in the scenario's wind.
_ABOUT_WIND = (
    "Velocity of the undisturbed fluid, in W",
    "Velocity that is added to the scenario's functions of the wind, in W",
)

# What a variable of a field's expressions is read from.
_READ_FROM = {
    "t": "time", "x": "r", "y": "r", "z": "r", "vx": "v", "vy": "v", "vz": "v",
    "wx": "w", "wy": "w", "wz": "w", "theta": "orientation",
}  # fmt: skip


def variables(scenario: Scenario, provider: Provider, mechanism: Mechanism) -> list[Variable]:
    """Return all variables, arrays as arrays, in the order of the model description."""
    return [
        TIME,
        *_inputs(provider, mechanism),
        *_wind_inputs(scenario, provider),
        *_outputs(scenario, provider),
        *_parameters(scenario, provider),
    ]


def _inputs(provider: Provider, mechanism: Mechanism) -> Iterator[Variable]:
    multibody = Multibody(mechanism.tables)
    motion = Motion.at_rest(multibody.n)
    multibody.motion(multibody.initial_state(mechanism.q0, mechanism.v0), motion)
    for i, body in enumerate(provider.bodies):
        at = mechanism.bodies.index(body)
        for what, section, start, quantity, about in (
            ("r", "POSITION", motion.position[at], units.POSITION, "Centre of mass of {}, in W"),
            ("orientation", "ORIENTATION", motion.orientation[at], units.QUATERNION,
             "Orientation of {}: unit quaternion (w, x, y, z), body to world"),
            ("v", "LINEAR", motion.linear[at], units.VELOCITY, "Velocity of the centre of mass of {}, in W"),
            ("w", "ANGULAR", motion.angular[at], units.ANGULAR_VELOCITY, "Angular velocity of {}, in W"),
        ):  # fmt: skip
            size = len(start)
            yield vector_input(f"{body}.{what}", section, size * i, start, quantity, about.format(body))


def wind_inputs(scenario: Scenario, provider: Provider) -> dict[str, float]:
    """Return the inputs of the wind that a model meets, by the names of their variables, and their values."""
    stated = inputs(scenario.environment) if provider.model == "plate" else {}
    return {f"environment.{name}": value for name, value in stated.items()}


def _wind_inputs(scenario: Scenario, provider: Provider) -> Iterator[Variable]:
    for at, (name, start) in enumerate(wind_inputs(scenario, provider).items()):
        yield Variable(
            name, "WIND_INPUT", at, (), "input", "continuous", "", units.INPUT, "Input of the wind", (start,)
        )


def _outputs(scenario: Scenario, provider: Provider) -> Iterator[Variable]:
    read = _plates_read(scenario, provider) if provider.model == "plate" else _fields_read(scenario, provider)
    for i, body in enumerate(provider.bodies):
        depends = read[i]
        for what, section, quantity in (("F", "FORCE", units.FORCE), ("T", "TORQUE", units.TORQUE)):
            about = f"{quantity.name} of the fluid on {body} at its centre of mass, in W"
            initially = _plate_parameters(body, "density", "wind") if provider.model == "plate" else ()
            yield output(f"{body}.{what}", section, 3 * i, VECTOR, quantity, about, depends, initially)
        if provider.model == "plate":
            yield _added_inertia(body, i)


def _added_inertia(body: str, i: int) -> Variable:
    return Variable(
        f"{body}.A", "ADDED_INERTIA", 36 * i, (6, 6), "output", "continuous", "calculated",
        units.ADDED_INERTIA,
        f"Added inertia of {body} at its centre of mass, in the body frame, force rows first: the fluid adds "
        "the wrench -A a; kg, kg.m, kg.m2",
        initially=_plate_parameters(body, "density"), elements=ADDED_INERTIA_ELEMENTS,
    )  # fmt: skip


def _plate_parameters(body: str, *environment: str) -> Dependences:
    return tuple(map(Dependence, (*environment, f"{body}.length", f"{body}.span")))


def _plates_read(scenario: Scenario, provider: Provider) -> list[Dependences]:
    """A plate meets the wind at its place and time, where gusts or functions depend on them."""
    table = wind_table(scenario.environment, scenario.source)
    pushed = {WIND_VARIABLES[operand] for operation, operand in table.code if operation == Operation.VARIABLE}
    gusty = bool(scenario.environment.gusts)
    time = ("time",) if gusty or "t" in pushed else ()
    place = ("r",) if gusty or pushed & {"x", "y", "z"} else ()
    whats = (*place, "orientation", "v", "w")
    given = tuple(wind_inputs(scenario, provider))
    return [
        tuple(map(Dependence, (*time, *(f"{body}.{what}" for what in whats), *given)))
        for body in provider.bodies
    ]


def _fields_read(scenario: Scenario, provider: Provider) -> list[Dependences]:
    """A field reads the variables that its programs push."""
    table = field_table(scenario, provider)
    return [_reads(table, i, body) for i, body in enumerate(provider.bodies)]


def _reads(table: FieldTable, i: int, body: str) -> Dependences:
    code = table.code[table.start[i] : table.start[i + 1]]
    pushed = {VARIABLES[operand] for operation, operand in code if operation == Operation.VARIABLE}
    sources = sorted({_READ_FROM[name] for name in pushed}, key=list(_READ_FROM.values()).index)
    return tuple(Dependence("time" if source == "time" else f"{body}.{source}") for source in sources)


def _parameters(scenario: Scenario, provider: Provider) -> Iterator[Variable]:
    if provider.model != "plate":
        return
    environment, shapes = scenario.environment, thin(scenario, provider)
    size = plate_table(scenario, provider).size
    density, wind = environment.density, np.array(environment.uniform_wind)
    yield parameter("density", "DENSITY", 0, density, units.DENSITY, "Density of the fluid")
    yield parameter("wind", "WIND", 0, wind, units.VELOCITY, _ABOUT_WIND[bool(environment.wind_functions)])
    for i, body in enumerate(provider.bodies):
        for column, what in enumerate(("length", "span")):
            yield parameter(
                f"{body}.{what}", what.upper(), i, float(size[i, column]), units.LENGTH,
                _SIDES[shapes[i].type][column].format(body),
            )  # fmt: skip
