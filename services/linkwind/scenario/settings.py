"""How a scenario is computed: time, surroundings, dynamics, coupling and bus."""

from __future__ import annotations

from decimal import Decimal
from typing import Literal

from pydantic import Field, field_validator

from linkwind.scenario.functions import Components, Function, Inputs
from linkwind.scenario.pictures import Pictures
from linkwind.scenario.problems import ProblemError
from linkwind.scenario.quantities import Section, Vector, Vector3, quantity

Method = Literal["reduced", "cfe", "incremental"]
Stabilisation = Literal["none", "baumgarte", "projection"]
IntegratorName = Literal["euler", "semi_implicit_euler", "rk4", "dopri5", "radau5"]
Scheme = Literal["explicit", "pec", "implicit"]
Acceleration = Literal["aitken", "iqn_ils"]
GustShape = Literal["sine", "one_minus_cosine"]
Transport = Literal["zenoh", "inprocess"]

ZERO = (0.0, 0.0, 0.0)
# Steps between checkpoints where bus.recovery needs them and nobody has said how many. One of a flow takes as
# long as 30 steps, 3 % here; what a provider that comes back does again takes it less time than to start.
RECOVERY_STEPS = 1000


def nanoseconds(seconds: float) -> Decimal:
    """Return a time in ns, from the decimal digits that the user wrote: 0.1 s is exactly 10⁸ ns."""
    return Decimal(repr(seconds)) * 1_000_000_000


class Time(Section):
    """Simulation time, from 0 to end."""

    end: float = quantity("End of the run, a multiple of coupling.step", "s", gt=0.0, le=1e9)


class Gust(Section):
    """A travelling wave on top of the wind: amplitude · shape(2π(frequency·t + wavenumber·r) + phase)."""

    shape: GustShape = Field(
        default="sine",
        description="sine: a wave without end; one_minus_cosine: a single gust, (1 − cos)/2 over one cycle",
    )
    amplitude: Vector = quantity("Amplitude of the wind's change; of a single gust, its peak", "m/s")
    frequency: float = quantity("Frequency at a fixed place", "Hz")
    wavenumber: Vector = quantity("Cycles per metre along x, y, z", "1/m", ZERO)
    phase_deg: float = quantity("Phase at t = 0 at the origin", "deg", 0.0)


class Environment(Section):
    """What surrounds the mechanism."""

    gravity: Vector = quantity("Acceleration of gravity, in the world", "m/s²", (0.0, -9.81, 0.0))
    density: float = quantity("Density of the fluid", "kg/m³", 1.225, ge=0.0)
    viscosity: float = quantity("Kinematic viscosity of the fluid", "m²/s", 1.5e-5, gt=0.0)
    wind: Components = quantity(
        "Velocity of the undisturbed fluid, in the world: each component a number, an expression of t, x, y "
        "and z, or a table over t",
        "m/s",
        ZERO,
    )
    inputs: Inputs | None = quantity(
        "Names that the expressions of the wind may use, and their values, which the FMU of plates takes as "
        "inputs",
        "any unit",
        None,
    )
    gusts: tuple[Gust, ...] = Field(
        default=(), strict=False, description="Waves that travel through the wind"
    )
    picture: Pictures = Field(
        default=(), strict=False, description="What is drawn of what stands still; no force model sees it"
    )

    @property
    def uniform_wind(self) -> Vector3:
        """What of the wind is the same everywhere and always [m/s]: 0 for a component that is a function."""
        x, y, z = (0.0 if isinstance(component, Function) else component for component in self.wind)
        return x, y, z

    @property
    def wind_functions(self) -> dict[int, Function]:
        """The components of the wind that are functions, by their number."""
        return {i: component for i, component in enumerate(self.wind) if isinstance(component, Function)}


class Dynamics(Section):
    """How the mechanism is advanced over a communication step."""

    method: Method = Field(
        default="reduced",
        description="reduced: joint coordinates; to compare with: cfe, bodies with joints as forces between "
        "them; incremental, the equations of Rahmati & Karimi 2021",
    )
    stabilisation: Stabilisation = Field(
        default="projection", description="What cfe does about joints that drift open"
    )
    stabilisation_time: float = quantity(
        "In which baumgarte undoes what a joint is open, as exp(-t/time)", "s", 0.05, gt=0.0
    )
    integrator: IntegratorName = Field(default="rk4", description="Integrator")
    substeps: int = Field(
        default=1, ge=1, description="Integrator steps in a communication step (not for dopri5)"
    )
    rtol: float = quantity("Relative tolerance of dopri5", "1", 1e-9, gt=0.0)
    atol: float = quantity("Absolute tolerance of dopri5", "m, rad, m/s, rad/s", 1e-12, gt=0.0)


class Coupling(Section):
    """When motion and wrench are exchanged, and what happens in between."""

    scheme: Scheme = Field(
        default="pec",
        description="explicit: the wrench is held over the step; pec: predicted, evaluated, corrected; "
        "implicit: iterated until motion and wrench agree, for providers that can go back",
    )
    order: int = Field(default=3, ge=0, le=3, description="Degree of the extrapolated wrench")
    adaptive: bool = Field(default=True, description="Lower the order where the wrench is not smooth")
    acceleration: Acceleration = Field(
        default="iqn_ils",
        description="How the iterations of implicit go on: iqn_ils, quasi-Newton; aitken, relaxation",
    )
    tolerance: float = quantity(
        "Difference of guess and answer at which the iterations of implicit end, relative", "1", 1e-8, gt=0.0
    )
    iterations: int = Field(default=50, ge=2, le=10000, description="Most exchanges in a step of implicit")
    step: float = quantity(
        "Communication step size, a whole number of nanoseconds", "s", 1e-3, gt=0.0, le=1e9
    )
    timeout: float = quantity(
        "Wait this long for an answer from a participant that is alive", "s", 2.0, gt=0.0
    )

    @field_validator("step")
    @classmethod
    def _whole_nanoseconds(cls, step: float) -> float:
        ns = nanoseconds(step)
        if ns % 1:
            near = max(1, round(ns))
            raise ProblemError.value(
                "a whole number of nanoseconds", step, f"Use {float(Decimal(near) / 10**9)!r}."
            )
        return step

    @property
    def step_ns(self) -> int:
        """Communication step size [ns]."""
        return int(nanoseconds(self.step))


class Logging(Section):
    """What the log of a run holds besides the messages."""

    checkpoint_every: int = Field(
        default=0,
        ge=0,
        description="Steps from one checkpoint of the providers to the next, to resume from; 0: none, or "
        "1000 with bus.recovery",
    )
    required: bool = Field(
        default=True,
        description="Whether a full disk, which ends the log, ends the run, too; false: it goes on",
    )


class Bus(Section):
    """How messages travel."""

    transport: Transport = Field(
        default="zenoh", description="zenoh: separate processes; inprocess: everything in one process"
    )
    start_timeout: float = quantity(
        "Wait this long for every participant to be ready, and for its first answer", "s", 60.0, gt=0.0
    )
    recovery: float = quantity(
        "Wait this long for a provider that was lost to come back; 0: its loss ends the run", "s", 0.0, ge=0.0
    )
