"""Force providers: which model puts a wrench on which bodies."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema, model_validator

from linkwind.scenario.polars import COLUMNS, Rows
from linkwind.scenario.problems import Problem, ProblemError, choice, nearest, show
from linkwind.scenario.quantities import Name, Section, Vector, numbers, quantity

AeroModel = Literal["none", "field", "plate", "flow", "vortex", "fmu", "python"]
ADDING_INERTIA: tuple[AeroModel, ...] = (
    "plate",
    "flow",
    "vortex",
    "fmu",
    "python",
)  # that may move massless bodies
EXTERNAL = (
    'Use one of these; for a program of your own that keeps to schemas/README.md "none": it takes part under '
    "the provider's name."
)
PlateCoefficients = Literal["ristroph", "andersen", "table"]


def _let(value: Any) -> dict[str, Any]:
    """Return the definitions in their order, from a table or from pairs as JSON carries them."""
    expected = 'a table of expressions, such as { speed = "sqrt(vx*vx + vy*vy)" }'
    if isinstance(value, dict):
        return value
    if isinstance(value, list) and all(isinstance(pair, list) and len(pair) == 2 for pair in value):
        names = [name for name, _ in value]
        if all(isinstance(name, str) for name in names) and len(set(names)) == len(names):
            return dict(value)
    raise ProblemError.value(expected, value, "Write it as a table.")


def _pairs(definitions: dict[str, str]) -> list[list[str]]:
    return [list(pair) for pair in definitions.items()]


Definitions = Annotated[
    dict[Name, str],
    BeforeValidator(_let),
    # Pairs, because the order counts and canonical JSON sorts its keys.
    PlainSerializer(_pairs, when_used="json"),
    WithJsonSchema({"type": "object", "additionalProperties": {"type": "string"}}),
]

_VARIABLES = (
    "of t x y z vx vy vz wx wy wz theta (SI, world, at the centre of mass; theta: angle about z, unwrapped)"
)


def _component(what: str, unit: str) -> Any:
    return Field(default="0", description=f"{what} [{unit}], an expression {_VARIABLES}")


class FieldExpressions(Section):
    """The wrench on one body as expressions of time and of the body's motion, in the world."""

    let: Definitions = Field(
        default_factory=dict,
        description="Named sub-expressions, evaluated in this order; each may use those before it",
    )
    fx: str = _component("Force along x", "N")
    fy: str = _component("Force along y", "N")
    fz: str = _component("Force along z", "N")
    tx: str = _component("Torque about x", "N·m")
    ty: str = _component("Torque about y", "N·m")
    tz: str = _component("Torque about z", "N·m")


class PlateModel(Section):
    """Settings of the quasi-steady flat plate."""

    coefficients: PlateCoefficients = Field(
        default="ristroph",
        description="Coefficients: ristroph (Li et al. 2022), andersen (Andersen, Pesavento & Wang 2005), or "
        "those of table",
    )
    table: Rows | None = quantity(
        "Rows [alpha_deg, cl, cd, cm] over the angle of attack, or a CSV file of these columns: -180 to 180, "
        "or 0 to 180 or 90 for a section with one or two symmetries; cm about the quarter chord, nose up",
        "deg, 1, 1, 1",
        None,
    )
    strips: int = Field(
        default=1,
        ge=1,
        le=1000,
        description="Equal strips of the span; each meets the air with the velocity of its own centre",
    )

    @model_validator(mode="after")
    def _of_the_table(self) -> PlateModel:
        if self.coefficients == "table" and self.table is None:
            expected = f"rows [{', '.join(COLUMNS)}], or a CSV file with these columns"
            raise ProblemError([Problem(("table",), expected, "nothing", "Add table.")])
        if self.table is not None and "coefficients" not in self.model_fields_set:
            advice = 'Add coefficients = "table".'
            raise ProblemError([Problem(("coefficients",), '"table", or another set', "nothing", advice)])
        return self


def _lengths(value: Any) -> tuple[float, ...]:
    expected = "a list of 2 or 3 numbers"
    if not isinstance(value, list | tuple) or len(value) not in (2, 3):
        raise ProblemError.value(expected, value, "Write [width, height], or [width, height, depth].")
    found = numbers(value, expected)
    if min(found) <= 0.0:
        raise ProblemError.value(f"{expected} above 0", value, "Correct it.")
    return found


Lengths = Annotated[
    tuple[float, ...],
    BeforeValidator(_lengths),
    WithJsonSchema({"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 3}),
]


class FlowModel(Section):
    """Settings of the resolved flow around the bodies, on a lattice."""

    dimensions: Literal[2, 3] = Field(
        default=2, description="Of the flow: 2, the same all along the span of planar bodies, or 3"
    )
    cells: float = Field(
        default_factory=lambda known: 24.0 if known.get("dimensions") == 3 else 48.0,
        ge=8.0,
        le=2000.0,
        description="Cells of the lattice along the longest body; default: 48, of three dimensions 24 [1]",
        json_schema_extra={"unit": "1"},
    )
    window: Lengths | None = Field(
        default=None,
        description="Width, height and, of three dimensions, depth of the window that goes with the "
        "mechanism [m]; default: 10 and 8 lengths of its longest body more than the mechanism, of three "
        "dimensions 7, 5 and 5 times the mean of its two longest sides, the geometric one",
        json_schema_extra={"unit": "m"},
    )
    start_time: float | None = quantity(
        "Time in which wind and speeds of the bodies at the start come up for the fluid; default: what the "
        "wind takes along the longest body, 0 in still air",
        "s",
        None,
        ge=0.0,
    )
    frames: int = Field(default=48, ge=0, le=10000, description="Pictures of the flow in the log of a run")
    threads: int = Field(
        default=1, ge=1, le=256, description="Threads that share the work; no bit depends on it"
    )

    @model_validator(mode="after")
    def _window_of_these_dimensions(self) -> FlowModel:
        if self.window is not None and len(self.window) != self.dimensions:
            expected = f"{self.dimensions} lengths, as many as dimensions"
            advice = "Write [width, height, depth] where dimensions is 3, else [width, height]."
            raise ProblemError([Problem(("window",), expected, show(list(self.window)), advice)])
        return self


# Angles of attack [deg]: from about the first on a real flow separates from a thin wing; beyond the second
# the forces of the model vortex are those of no real flow, and the user is told.
SEPARATES_DEG, BEYOND_DEG = 15.0, 20.0


class VortexModel(Section):
    """Settings of the flow around thin wings in three dimensions: vortex rings, and wakes of them."""

    chordwise: int = Field(default=6, ge=1, le=100, description="Rings along the chord of each plate or wing")
    spanwise: int = Field(default=12, ge=1, le=200, description="Rings along the span of each plate or wing")
    wake: int = Field(
        default=100,
        ge=1,
        le=10000,
        description="Rows of rings that each wake keeps; one is shed in a communication step",
    )
    core: float = quantity(
        "Radius of the cores of the wakes' vortices, in mean chords of the shortest plate or wing",
        "1",
        0.05,
        gt=0.0,
        le=1.0,
    )
    suction: float = quantity(
        "Share of the suction of the leading edges that is there: 1 for round ones, 0 for sharp ones, where "
        "the force stands across the wing",
        "1",
        1.0,
        ge=0.0,
        le=1.0,
    )
    trailing_edge: dict[str, Literal["+x", "-x"]] = Field(
        default={},
        description="Which edge of a plate or wing sheds its wake, by body, in its frame; default: the "
        "downstream one at the start",
    )
    frames: int = Field(default=48, ge=0, le=10000, description="Pictures of the wakes in the log of a run")
    threads: int = Field(
        default=1, ge=1, le=256, description="Threads that share the work; no bit depends on it"
    )


def _value(value: Any) -> Any:
    entries = value if isinstance(value, list | tuple) else [value]
    if not all(isinstance(entry, bool | int | float | str) for entry in entries):
        raise ProblemError.value("a number, true, false, a text, or a list of these", value, "Write it so.")
    return tuple(value) if isinstance(value, list) else value


_SCALAR = {"type": ["number", "boolean", "string"]}
Value = Annotated[
    Any,
    BeforeValidator(_value),
    WithJsonSchema({"anyOf": [_SCALAR, {"type": "array", "items": _SCALAR}]}),
]


def _digest(value: Any) -> Any:
    if value is not None and not (isinstance(value, str) and re.fullmatch(r"[0-9a-f]{64}", value)):
        expected = "64 hexadecimal digits"
        raise ProblemError.value(expected, value, "Write what sha256sum prints, or leave it out.")
    return value


def _link(value: Any) -> Any:
    return {"quantity": value} if isinstance(value, str) else value


class FmuVariable(Section):
    """What a variable of an FMU is, where its name does not tell."""

    frame: Literal["world", "body"] | None = Field(default=None, description="Frame of its components")
    point: Vector | None = quantity(
        "Point of the body that it is taken at, in the body frame from the centre of mass", "m", None
    )
    unit: str | None = Field(default=None, description="Unit of the FMU's value; default: what the FMU says")
    scale: float = quantity("Input: SI value given = scale * quantity + offset; output: likewise", "1", 1.0)
    offset: float = quantity("See scale", "SI unit", 0.0)
    quantity: str = Field(
        description="[body.]quantity[.component], such as link1.velocity.x; none: an output that is not used"
    )


class FmuModel(Section):
    """How a foreign FMU is run as a force model. Its file is named on the command line: --force-fmu."""

    sha256: Annotated[str | None, BeforeValidator(_digest)] = Field(
        default=None, description="SHA-256 of the file, to accept no other"
    )
    interface: Literal["auto", "cs", "me"] = Field(
        default="auto", description="Co-Simulation or Model Exchange; auto: cs if the FMU has it"
    )
    isolation: Literal["process", "inprocess"] = Field(
        default="process", description="process: nothing that the FMU does harms the run; inprocess: faster"
    )
    timeout: float | None = quantity(
        "Wait this long for a step of the FMU; default: half of coupling.timeout", "s", None, gt=0.0
    )
    start_timeout: float = quantity("Wait this long for the FMU to be instantiated", "s", 30.0, gt=0.0)
    memory: float = quantity("The most memory that the FMU may take", "B", 2e9, ge=1e7)
    step: float | None = quantity(
        "Step of the FMU: a part or a multiple of coupling.step; default: what the FMU says",
        "s",
        None,
        gt=0.0,
    )
    derivatives: bool | None = Field(
        default=None,
        description="Ask for directional derivatives, by which stiff forces stay stable; default: if the FMU "
        "has them and they can be checked, except for FMUs from linkwind",
    )
    frame: Literal["world", "body"] | None = Field(
        default=None,
        description="Frame of velocities, forces and torques; default: by name, else world",
    )
    point: Vector | None = quantity(
        "Point of the body that motion and force are taken at, in the body frame from the centre of mass",
        "m",
        None,
    )
    structural: dict[str, int] = Field(default={}, description="Values of structural parameters, by name")
    start: dict[str, Value] = Field(
        default={}, description="Start values of parameters and inputs, by name, in the units of the FMU"
    )
    variables: dict[str, Annotated[FmuVariable, BeforeValidator(_link)]] = Field(
        default={}, description="What inputs and outputs are, by name: a quantity, or a table with more"
    )


class PythonModel(Section):
    """Which force model in Python it is. Its file is named on the command line: --model FILE.py:NAME."""

    source: str | None = Field(
        default=None, description="File, without its folder, and name in it; to accept no other name"
    )
    sha256: Annotated[str | None, BeforeValidator(_digest)] = Field(
        default=None, description="SHA-256 of the file, to accept no other"
    )


def _model(value: Any) -> Any:
    words = get_args(AeroModel)
    if value in words:
        return value
    problem = choice((), "one of", words, value)
    near = isinstance(value, str) and nearest(value, words) is not None
    raise ProblemError([problem if near else replace(problem, advice=EXTERNAL)])


class Provider(Section):
    """A participant that answers a motion with the wrench on its bodies."""

    name: Name = Field(description="Name, a letter followed by letters, digits and _")
    model: Annotated[AeroModel, BeforeValidator(_model)] = Field(description="Force model")
    bodies: tuple[Name, ...] = Field(
        default=(), strict=False, min_length=1, description="Names of the bodies it acts on; default: all"
    )
    every: int = Field(
        default=1,
        ge=1,
        description="Steps from one answer of the model to its next; in between its wrench goes on on a line",
    )
    plate: PlateModel = Field(default=PlateModel(), description="Settings of the model plate")
    field: dict[str, FieldExpressions] = Field(
        default={}, description="The model field: a table for each body, by its name"
    )
    flow: FlowModel = Field(default=FlowModel(), description="Settings of the model flow")
    vortex: VortexModel = Field(default=VortexModel(), description="Settings of the model vortex")
    fmu: FmuModel = Field(default=FmuModel(), description="Settings of the model fmu")
    python: PythonModel = Field(default=PythonModel(), description="Settings of the model python")
