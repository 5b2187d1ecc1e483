"""Force elements, laid out as the core reads them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from linkwind.errors import MechanismError
from linkwind.expression import Curve, Program, compile_program, curve, law
from linkwind.mechanism.quaternion import rotate
from linkwind.mechanism.tree import WORLD, Carrier
from linkwind.native.expressions import derivatives
from linkwind.native.multibody import FORCE_TYPES, NQ, Multibody, Tables
from linkwind.scenario import Body, Circle, Ellipse, Ellipsoid, Polygon, Rectangle, Scenario
from linkwind.scenario.forces import Actuator, Buoyancy, Force, PointForce, Spring
from linkwind.scenario.forces import Motion as Prescribed
from linkwind.scenario.shapes import signed_area
from linkwind.spatial import Array, Motion

RESTS = 1e-6  # rate of a motion that rests, in parts of its fastest
SHORTEST = 1e-9  # m between the ends of a spring at the start
ORIGIN = (0.0, 0.0, 0.0)
VARIABLES = {
    "spring": ("length", "rate", "t"),
    "actuator": ("t", "q", "v"),
    "motion": ("t",),
    "point_force": ("t", "x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz", "theta"),
}
COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")
NOTHING = Program((), ())
TOLD = ("effort", "power")  # what an FMU tells of an element by name

Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class Element:
    """A row of the ``force_*`` tables.

    Attributes:
        type: of the element.
        bodies: the two of a spring; else the body, and the number of a joint's coordinate.
        points: on them, in body frames.
        numbers: what the type has.
        program: what its expressions are.
    """

    type: str
    bodies: tuple[int, int]
    points: tuple[Vector3, Vector3] = (ORIGIN, ORIGIN)
    numbers: Vector3 = ORIGIN
    program: Program = NOTHING


def with_forces(
    tables: Tables, scenario: Scenario, carriers: list[Carrier], q: Array, v: Array, *, motions: bool = False
) -> Tables:
    """Return the tables of a mechanism with the scenario's force elements.

    Args:
        tables: bodies and joints.
        scenario: with the elements.
        carriers: joint of each body.
        q: joint coordinates at the start.
        v: joint velocities at the start.
        motions: whether only those, which need no place.

    Raises:
        MechanismError: an element that does not fit its joint or body, leaves the plane of a planar
            mechanism, or has no length; two motions of a coordinate.
        ExpressionError: an expression is wrong.
    """
    chosen = [i for i, force in enumerate(scenario.forces) if force.type == "motion" or not motions]
    if not chosen:
        return tables
    multibody = Multibody(tables)
    start = Motion.at_rest(multibody.n)
    multibody.motion(multibody.initial_state(q, v), start)
    items = [scenario.where("forces", i) for i in chosen]
    elements = [
        _element(scenario.forces[i], scenario, carriers, start, item)
        for i, item in zip(chosen, items, strict=True)
    ]
    _check_once(elements, items)
    code: list[tuple[int, int]] = []
    constants: list[float] = []
    inputs: list[int] = []
    starts = [0]
    for element in elements:
        code += element.program.shifted(len(constants))
        inputs += range(len(constants), len(constants) + element.program.inputs)
        constants += element.program.constants
        starts.append(len(code))
    return replace(
        tables,
        force_type=np.array([FORCE_TYPES[element.type] for element in elements], np.int32),
        force_body=np.array([element.bodies for element in elements], np.int32),
        force_point=np.array([element.points for element in elements], np.float64),
        force_number=np.array([element.numbers for element in elements], np.float64),
        force_start=np.array(starts, np.int32),
        force_code=np.array(code, np.int32).reshape(-1, 2),
        force_constants=np.array(constants, np.float64),
        force_input=np.array(inputs, np.int32),
    )


def _element(force: Force, scenario: Scenario, carriers: list[Carrier], start: Motion, item: str) -> Element:
    index = {body.name: i for i, body in enumerate(scenario.bodies)} | {"world": WORLD}
    if scenario.planar:
        _check_planar(force, item)
    match force:
        case Spring():
            return _spring(force, (index[force.parent], index[force.child]), start, item)
        case Actuator():
            return Element(
                force.type, _coordinate(force, carriers, item), program=_program(force, ("force",), item)
            )
        case Prescribed():
            return Element(
                force.type,
                _coordinate(force, carriers, item),
                program=motion_program(force, scenario.time.end, item),
            )
        case PointForce():
            numbers = (float(force.frame == "body"), 0.0, 0.0)
            program = _program(force, COMPONENTS, item)
            return Element(force.type, (index[force.body], WORLD), (force.point, ORIGIN), numbers, program)
        case Buoyancy():
            body = scenario.bodies[index[force.body]]
            volume = _volume(body, item) if force.volume is None else force.volume
            density = scenario.environment.density if force.density is None else force.density
            return Element(
                force.type, (index[force.body], WORLD), (force.point, ORIGIN), (volume, density, 0.0)
            )


def prescribed(scenario: Scenario, carriers: list[Carrier]) -> dict[str, dict[int, tuple[float, float]]]:
    """Return what motions say about the start: by joint and number of the coordinate, value and rate.

    Raises:
        MechanismError, ExpressionError: a motion is wrong, does not fit its joint, or is not a number.
    """
    found: dict[str, dict[int, tuple[float, float]]] = {}
    for i, force in enumerate(scenario.forces):
        if not isinstance(force, Prescribed):
            continue
        item = scenario.where("forces", i)
        _coordinate(force, carriers, item)
        program = motion_program(force, scenario.time.end, item)
        start = derivatives(program.code, program.constants, 0.0)
        if not all(map(math.isfinite, start)):
            raise MechanismError(
                f"{item}.position: expected a number with a rate and an acceleration at t = 0; got "
                f"{', '.join(f'{number:.9g}' for number in start)}. Does it divide by zero, or leave a "
                "function's domain?"
            )
        found.setdefault(force.joint, {})[force.coordinate] = start[:2]
    return found


# ---- functions ----


def motion_program(motion: Prescribed, end: float, item: str) -> Program:
    """Return the program of a prescribed coordinate.

    Args:
        motion: the element.
        end: of the run [s].
        item: where it stands, for errors.

    Raises:
        ExpressionError: the expression is wrong.
        MechanismError: a table in which the velocity would jump, at its corners or where it ends.
    """
    if motion.position.table is not None:
        if motion.position.interpolation == "linear":
            raise MechanismError(
                f'{item}.position.interpolation: expected "spline", because a motion without kinks is needed '
                'for its acceleration; got "linear". Use "spline".'
            )
        _check_ends(curve(motion.position), end, item)
    return _program(motion, ("position",), item)


def _check_ends(curve: Curve, end: float, item: str) -> None:
    """A table is held beyond its ends, where it has to be at rest."""
    if curve.periodic:
        return
    first, last = curve.points[0][0], curve.points[-1][0]
    fastest = max(abs(b - a) / (after - before) for (before, a), (after, b) in pairwise(curve.points))
    rates = curve.end_rates()
    for held, place, rate in ((first > 0.0, first, rates[0]), (curve.end < end, last, rates[1])):
        if held and abs(rate) > RESTS * fastest:
            raise MechanismError(
                f"{item}.position.table: expected times from 0 to the end of the run, {end!r} s, "
                "because the velocity would jump where the table is held; got "
                f"{first!r} to {last!r} s, with a rate of {rate:.6g} at {place!r} s. Add rows, repeat it "
                "(periodic = true), or let it rest there: two rows with the same value."
            )


def inputs(force: Force) -> dict[str, float]:
    """Return the inputs of an element with their values at the start, in the order of the tables."""
    return dict(sorted(getattr(force, "inputs", {}).items()))


def _program(force: Force, keys: tuple[str, ...], item: str) -> Program:
    functions = {key: getattr(force, key) for key in keys}
    for name in set(TOLD) & inputs(force).keys():
        raise MechanismError(
            f'{item}.inputs: expected names but {" and ".join(TOLD)}; got "{name}", which the FMU tells of '
            f"{force.name}. Rename it."
        )
    return compile_program(
        getattr(force, "let", None),
        {key: law(function) for key, function in functions.items() if function is not None},
        item,
        variables=VARIABLES[force.type],
        components=keys,
        inputs=inputs(force),
    )


# ---- springs ----


def _spring(spring: Spring, bodies: tuple[int, int], start: Motion, item: str) -> Element:
    points = (spring.parent_point, spring.child_point)
    ends = [_place(body, point, start) for body, point in zip(bodies, points, strict=True)]
    length = float(np.linalg.norm(ends[1] - ends[0]))
    if length < SHORTEST:
        raise MechanismError(
            f"{item}: expected ends apart, because {spring.name} pulls from one to the other; got "
            f"{length:.3g} m between them at the start. Move one of the points."
        )
    numbers = (spring.stiffness, spring.damping, length if spring.rest is None else spring.rest)
    return Element(spring.type, bodies, points, numbers, _program(spring, ("force",), item))


def _place(body: int, point: Vector3, start: Motion) -> Array:
    if body == WORLD:
        return np.array(point)
    place: Array = start.position[body] + rotate(start.orientation[body], np.array(point))
    return place


# ---- joints ----


def _coordinate(force: Actuator | Prescribed, carriers: list[Carrier], item: str) -> tuple[int, int]:
    """Return the body that the joint carries, and the number of the coordinate."""
    found = [(i, carrier) for i, carrier in enumerate(carriers) if carrier.name == force.joint]
    if not found:
        raise MechanismError(
            f'{item}.joint: expected a joint that carries a body; got "{force.joint}", which closes a loop. '
            "Name one of the loop's other joints, or state this one before them."
        )
    ((body, carrier),) = found
    if carrier.type not in ("revolute", "prismatic", "planar"):
        raise MechanismError(
            f'{item}.joint: expected a revolute, prismatic or planar joint; got "{force.joint}", which is '
            f"{carrier.type}. Name another, or put revolute joints in a row, bodies without mass between."
        )
    if force.coordinate >= NQ[carrier.type]:
        raise MechanismError(
            f"{item}.coordinate: expected 0, because a {carrier.type} joint has one coordinate; got "
            f"{force.coordinate}. Leave it out."
        )
    return body, force.coordinate


def _check_once(elements: list[Element], items: list[str]) -> None:
    moved: dict[tuple[int, int], str] = {}
    for element, item in zip(elements, items, strict=True):
        if element.type != "motion":
            continue
        if element.bodies in moved:
            raise MechanismError(
                f"{item}.joint: expected a coordinate without another motion; got that of "
                f"{moved[element.bodies]}. Remove one of the two."
            )
        moved[element.bodies] = item


# ---- volumes, the plane ----


def _volume(body: Body, item: str) -> float:
    """Return the volume of a body's shape [m³]."""
    match body.shape:
        case Ellipse(length=length, width=width, span=span):
            return math.pi / 4.0 * length * width * span
        case Circle(diameter=diameter, span=span):
            return math.pi / 4.0 * diameter**2 * span
        case Rectangle(length=length, width=width, radius=radius, span=span):
            return (length * width - (4.0 - math.pi) * radius**2) * span
        case Ellipsoid(size=(x, y, z)):
            return math.pi / 6.0 * x * y * z
        case Polygon(points=points, span=span):
            return abs(signed_area(np.array(points))) * span
    got = "no shape" if body.shape is None else f"a {body.shape.type}"
    raise MechanismError(
        f"{item}.volume: expected a number [m³], because {body.name} has {got}, which encloses nothing; got "
        "nothing. Add volume."
    )


def _check_planar(force: Force, item: str) -> None:
    """Nothing leaves the plane that the mechanism moves in."""
    for key in ("parent_point", "child_point", "point"):
        x, y, z = getattr(force, key, ORIGIN)
        if z:
            raise MechanismError(
                f"{item}.{key}: expected z = 0, because every inertia is a single number; got "
                f"[{x:g}, {y:g}, {z:g}]. Set z to 0, or give 6 numbers for the inertia of each body."
            )
