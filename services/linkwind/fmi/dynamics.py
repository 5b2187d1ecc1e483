"""The variables of a mechanism as an FMU; their names are explained in `linkwind.fmi.variables`."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from linkwind.fmi import units
from linkwind.fmi.coordinates import Piece, joint_names, pieces
from linkwind.fmi.elements import Elements
from linkwind.fmi.structure import Dependences, Structure, is_stated
from linkwind.fmi.units import Quantity
from linkwind.fmi.variables import Dependence, Variability, Variable
from linkwind.mechanism import Mechanism
from linkwind.native.multibody import OCCASIONS, Integrator, Multibody
from linkwind.scenario import Scenario
from linkwind.spatial import Array

# Of a 6×6 added inertia: mass, first moment, moment of inertia, by blocks of three rows and columns.
ADDED_INERTIA_ELEMENTS = tuple(
    (units.MASS, units.FIRST_MOMENT, units.INERTIA)[row // 3 + column // 3]
    for row in range(6)
    for column in range(6)
)
VECTOR = (3,)
MAX_SUBSTEPS = 1_000_000


def variables(scenario: Scenario, mechanism: Mechanism) -> list[Variable]:
    """Return all variables, arrays as arrays, in the order of the model description."""
    structure = Structure(mechanism)
    state = Multibody(mechanism.tables).initial_state(mechanism.q0, mechanism.v0)
    every = [piece for joint in pieces(mechanism) for piece in joint]
    return [
        TIME,
        *_inputs(mechanism),
        *_element_inputs(mechanism, structure.elements),
        *_commands(mechanism),
        *(variable for piece in every for variable in _states(piece, state, len(mechanism.q0))),
        *_motion(mechanism, structure),
        *_reactions(mechanism, structure),
        *_closures(mechanism, structure),
        *_events(mechanism, structure),
        *_efforts(structure),
        *_energies(structure),
        *_derivatives(mechanism, structure),
        *_body_parameters(mechanism),
        *_joint_parameters(mechanism),
        *_element_parameters(mechanism, structure.elements),
        *_solver(scenario),
    ]


TIME = Variable("time", "", 0, (), "independent", "continuous", "", units.TIME, "Time")


def parameter(
    name: str, section: str, offset: int, value: Array | float, quantity: Quantity, description: str,
    *, tunable: bool = True,
) -> Variable:  # fmt: skip
    """Return a parameter: an array of numbers, or one number."""
    numbers = tuple(map(float, value)) if not isinstance(value, float) else (value,)
    dimensions = () if isinstance(value, float) else (len(numbers),)
    variability: Variability = "tunable" if tunable else "fixed"
    return Variable(
        name, section, offset, dimensions, "parameter", variability, "exact", quantity, description, numbers
    )


def output(
    name: str, section: str, offset: int, dimensions: tuple[int, ...], quantity: Quantity, description: str,
    depends: Dependences, initially: Dependences,
) -> Variable:  # fmt: skip
    """Return an output that is calculated."""
    return Variable(
        name, section, offset, dimensions, "output", "continuous", "calculated", quantity, description,
        depends=depends, initially=initially,
    )  # fmt: skip


def vector_input(
    name: str, section: str, offset: int, start: Array, quantity: Quantity, about: str
) -> Variable:
    """Return an input that is an array of numbers."""
    return Variable(
        name,
        section,
        offset,
        (len(start),),
        "input",
        "continuous",
        "",
        quantity,
        about,
        tuple(map(float, start)),
    )


def _inputs(mechanism: Mechanism) -> Iterator[Variable]:
    zero = np.zeros(3)
    for i, body in enumerate(mechanism.bodies):
        about = f"on {body} at its centre of mass, in W"
        yield vector_input(f"{body}.F", "FORCE", 3 * i, zero, units.FORCE, f"Force {about}")
        yield vector_input(f"{body}.T", "TORQUE", 3 * i, zero, units.TORQUE, f"Torque {about}")
        yield Variable(
            f"{body}.A", "ADDED_INERTIA", 36 * i, (6, 6), "input", "continuous", "", units.ADDED_INERTIA,
            f"Added inertia of {body} at its centre of mass, in the body frame, force rows first: adds the "
            "wrench -A a; kg, kg.m, kg.m2",
            (0.0,) * 36, elements=ADDED_INERTIA_ELEMENTS,
        )  # fmt: skip


def _element_inputs(mechanism: Mechanism, elements: Elements) -> Iterator[Variable]:
    tables = mechanism.tables
    starts = tables.force_constants[tables.force_input].tolist()
    for at, ((i, name), start) in enumerate(zip(elements.inputs, starts, strict=True)):
        yield Variable(
            name, "FORCE_INPUT", at, (), "input", "continuous", "", units.INPUT,
            f"Input of {elements.names[i]}", (start,),
        )  # fmt: skip


def _commands(mechanism: Mechanism) -> Iterator[Variable]:
    for i, (name, occasion) in enumerate(
        zip(mechanism.events, mechanism.tables.event_occasion.tolist(), strict=True)
    ):
        if occasion == OCCASIONS["command"]:
            yield Variable(
                f"{name}.command", "EVENT_COMMAND", i, (), "input", "discrete", "", units.SWITCH,
                f"Lets {name} happen when it becomes true", (0.0,), boolean=True,
            )  # fmt: skip


def _states(piece: Piece, state: Array, nq: int) -> Iterator[Variable]:
    for what, section, first, count, start in (
        ("q", "Q", piece.q, piece.nq, state[:nq]),
        ("v", "V", piece.v, piece.nv, state[nq:]),
    ):
        name = piece.called(what)
        meaning = "Coordinates" if what == "q" else "Velocities"
        yield Variable(
            name, section, first, () if count == 1 else (count,), "output", "continuous", "exact",
            piece.quantities[what], f"{meaning} of joint {piece.name}{_details(piece, what)}",
            tuple(start[first : first + count].tolist()),
            depends=(Dependence(name, "constant", elementwise=True),),
        )  # fmt: skip


def _details(piece: Piece, what: str) -> str:
    if not piece.turns:
        return ", translation"
    if piece.quaternion and what == "q":
        return ": unit quaternion (w, x, y, z)"
    return ", rotation"


def _motion(mechanism: Mechanism, structure: Structure) -> Iterator[Variable]:
    for i, body in enumerate(mechanism.bodies):
        geometry, inertia = structure.geometry(i), structure.inertia(i)
        acceleration = structure.acceleration(i)
        rows: tuple[tuple[str, str, int, Quantity, str, Dependences, Dependences], ...] = (
            ("r", "POSITION", 3, units.POSITION, "Position of the centre of mass of {}, in W",
             structure.position(i), geometry),
            ("orientation", "ORIENTATION", 4, units.QUATERNION,
             "Orientation of {}: unit quaternion (w, x, y, z), body to world", structure.orientation(i), ()),
            ("v", "LINEAR", 3, units.VELOCITY, "Velocity of the centre of mass of {}, in W",
             structure.linear(i), geometry),
            ("w", "ANGULAR", 3, units.ANGULAR_VELOCITY, "Angular velocity of {}, in W",
             structure.angular(i), ()),
            ("a", "LINEAR_ACCELERATION", 3, units.ACCELERATION,
             "Acceleration of the centre of mass of {}, in W", acceleration, inertia),
            ("alpha", "ANGULAR_ACCELERATION", 3, units.ANGULAR_ACCELERATION,
             "Angular acceleration of {}, in W", acceleration, inertia),
        )  # fmt: skip
        for what, section, size, quantity, about, depends, initially in rows:
            name, description = f"{body}.{what}", about.format(body)
            yield output(name, section, size * i, (size,), quantity, description, depends, initially)


def _reactions(mechanism: Mechanism, structure: Structure) -> Iterator[Variable]:
    for i, (joint, name) in enumerate(zip(mechanism.joints, joint_names(mechanism), strict=True)):
        if is_stated(joint):
            depends, initially = structure.acceleration(i), structure.inertia(i)
            about = f"of parent on child in joint {joint}, at its point on the child, in W"
            for what, section, quantity in (
                ("F", "REACTION_FORCE", units.FORCE),
                ("T", "REACTION_TORQUE", units.TORQUE),
            ):
                description = f"Reaction {quantity.name.lower()} {about}"
                yield output(
                    f"{name}.{what}", section, 3 * i, VECTOR, quantity, description, depends, initially
                )


def _closures(mechanism: Mechanism, structure: Structure) -> Iterator[Variable]:
    for i, joint in enumerate(mechanism.closures):
        body = max(mechanism.tables.closure_body[i].tolist())
        depends, initially = structure.acceleration(body), structure.inertia(body)
        about = f"of parent on child in joint {joint}, which closes a loop, at its point on the child, in W"
        for what, section, quantity in (
            ("F", "CLOSURE_FORCE", units.FORCE),
            ("T", "CLOSURE_TORQUE", units.TORQUE),
        ):
            description = f"Reaction {quantity.name.lower()} {about}"
            yield output(f"{joint}.{what}", section, 3 * i, VECTOR, quantity, description, depends, initially)


def _events(mechanism: Mechanism, structure: Structure) -> Iterator[Variable]:
    n = len(mechanism.bodies)
    for i, (name, joint) in enumerate(
        zip(mechanism.events, mechanism.tables.event_joint.tolist(), strict=True)
    ):
        body = joint if joint < n else max(mechanism.tables.closure_body[joint - n].tolist())
        depends, initially = structure.acceleration(body), structure.inertia(body)
        yield Variable(
            f"{name}.time", "EVENT_TIME", i, (), "output", "discrete", "calculated", units.TIME_OF_EVENT,
            f"When {name} happened; -1: not yet",
        )  # fmt: skip
        yield Variable(
            f"{name}.indicator", "EVENT_INDICATOR", i, (), "local", "continuous", "calculated",
            units.COORDINATE, f"At and above 0 {name} happens", depends=depends, initially=initially,
        )  # fmt: skip


def _efforts(structure: Structure) -> Iterator[Variable]:
    elements = structure.elements
    about = {"spring": "Tension", "actuator": "Force or torque", "motion": "Force or torque that it takes"}
    for i, name in enumerate(elements.names):
        depends, initially = structure.acceleration(elements.bodies[i]), structure.inertia(elements.bodies[i])
        effort = f"{about.get(elements.types[i], 'Size of the force')} of {name}"
        yield output(
            f"{name}.effort", "FORCE_EFFORT", i, (), elements.quantity(i), effort, depends, initially
        )
        power = f"Power that {name} gives to the bodies"
        yield output(f"{name}.power", "FORCE_POWER", i, (), units.POWER, power, depends, initially)


def _energies(structure: Structure) -> Iterator[Variable]:
    yield output(
        "kinetic_energy", "KINETIC_ENERGY", 0, (), units.ENERGY, "Kinetic energy of all bodies",
        structure.kinetic_energy(), structure.moving(),
    )  # fmt: skip
    yield output(
        "potential_energy", "POTENTIAL_ENERGY", 0, (), units.ENERGY,
        "Potential energy: gravity, from the origin of W, springs, buoyancy",
        structure.potential_energy(), structure.stored(),
    )  # fmt: skip


def _derivatives(mechanism: Mechanism, structure: Structure) -> Iterator[Variable]:
    for i, joint in enumerate(pieces(mechanism)):
        for piece in joint:
            q, v = piece.called("q"), piece.called("v")
            if piece.quaternion:
                rate: Dependences = (Dependence(q), Dependence(v))
            else:
                rate = (Dependence(v, "constant", elementwise=True), *structure.moved([i]))
            for what, state, first, count, depends, initially in (
                ("q", q, piece.q, piece.nq, rate, ()),
                ("v", v, piece.v, piece.nv, structure.acceleration(i), structure.inertia(i)),
            ):
                yield Variable(
                    f"der({state})", f"DER_{what.upper()}", first, () if count == 1 else (count,), "local",
                    "continuous", "calculated", piece.quantities[f"der_{what}"], f"Derivative of {state}",
                    derivative_of=state, depends=depends, initially=initially,
                )  # fmt: skip


def _body_parameters(mechanism: Mechanism) -> Iterator[Variable]:
    tables = mechanism.tables
    yield parameter("gravity", "GRAVITY", 0, tables.gravity, units.ACCELERATION, "Gravity, in W")
    for i, body in enumerate(mechanism.bodies):
        mass = float(tables.mass[i])
        yield parameter(f"{body}.mass", "MASS", i, mass, units.MASS, f"Mass of {body}")
        yield parameter(
            f"{body}.inertia", "INERTIA", 6 * i, tables.inertia[i], units.INERTIA,
            f"Inertia Ixx, Iyy, Izz, Ixy, Ixz, Iyz of {body} about its centre of mass, in the body frame",
        )  # fmt: skip


def _joint_parameters(mechanism: Mechanism) -> Iterator[Variable]:
    tables = mechanism.tables
    for i, (name, joint) in enumerate(zip(joint_names(mechanism), pieces(mechanism), strict=True)):
        if not is_stated(mechanism.joints[i]):
            continue
        for side, points in (("parent", tables.parent_point), ("child", tables.child_point)):
            yield parameter(
                f"{name}.{side}_point", f"{side.upper()}_POINT", 3 * i, points[i], units.POSITION,
                f"Point of joint {name} on its {side}, from the centre of mass, in the body frame",
                tunable=False,
            )  # fmt: skip
        for piece in joint:
            yield from _springs(piece, mechanism)


def _springs(piece: Piece, mechanism: Mechanism) -> Iterator[Variable]:
    tables, quantities = mechanism.tables, piece.quantities
    for what, section, first, count, table, about in (
        ("stiffness", "STIFFNESS", piece.v, piece.nv, tables.stiffness, "Spring constants"),
        ("damping", "DAMPING", piece.v, piece.nv, tables.damping, "Damper constants"),
        ("rest", "REST", piece.q, piece.nq, tables.rest, "Coordinates without spring force"),
    ):
        values = table[first : first + count]
        quantity = quantities["q" if what == "rest" else what]
        yield parameter(
            piece.called(what), section, first, values if count > 1 else float(values[0]), quantity,
            f"{about} of joint {piece.name}",
        )  # fmt: skip


def _element_parameters(mechanism: Mechanism, elements: Elements) -> Iterator[Variable]:
    for i, name in enumerate(elements.names):
        for k, (what, quantity, about) in enumerate(elements.parameters(i)):
            value, at = float(mechanism.tables.force_number[i, k]), 3 * i + k
            yield parameter(f"{name}.{what}", "FORCE_NUMBER", at, value, quantity, f"{about} of {name}")


def _solver(scenario: Scenario) -> Iterator[Variable]:
    settings = scenario.dynamics
    own = Integrator[settings.integrator.upper()]
    there = [member for member in Integrator if member == own or member != Integrator.RADAU5]
    names = ", ".join(f"{member.value} {member.name.lower()}" for member in there)
    for name, at, value, about, highest in (
        (
            "integrator",
            0,
            own,
            f"Integrator: {names}",
            len(there) - 1,
        ),
        ("substeps", 1, settings.substeps, "Integrator steps in a communication step", MAX_SUBSTEPS),
    ):
        yield Variable(
            f"solver.{name}", "", at, (), "parameter", "tunable", "exact", units.COUNT,
            f"{about} (Co-Simulation)", (float(value),), limits=(min(at, 1), max(highest, int(value))),
        )  # fmt: skip
    for name, tolerance in (("rtol", settings.rtol), ("atol", settings.atol)):
        kind = "Relative" if name == "rtol" else "Absolute"
        about = f"{kind} tolerance of dopri5 (Co-Simulation)"
        yield parameter(f"solver.{name}", name.upper(), 0, tolerance, units.TOLERANCE, about)
