"""What happens to joints in flight: release and lock, at a time, on a condition, or on command."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from linkwind.scenario.problems import Problem, ProblemError
from linkwind.scenario.quantities import Name, Section, quantity

Action = Literal["release", "lock"]
Occasion = Literal["force", "torque", "position", "speed", "distance"]
UNITS = "N, N·m, rad, m, per s"


class Event(Section):
    """A joint is released or locked, once: at a time, as soon as a condition holds, or else on command."""

    name: Name = Field(description="Name, a letter followed by letters, digits and _")
    joint: str = Field(description="Name of the joint")
    action: Action = Field(
        description="release: the joint is not there any more; lock: it keeps its coordinates"
    )
    at: float | None = quantity("Time", "s", None, ge=0.0)
    when: Occasion | None = Field(
        default=None,
        description="What is waited for: size of the joint's reaction force or torque, its coordinate "
        "(position) or rate (speed), or the distance of its two points; with above or below",
    )
    above: float | None = quantity(
        "It happens as soon as that is at least this", "N, N·m, rad, m, per s", None
    )
    below: float | None = quantity(
        "It happens as soon as that is at most this", "N, N·m, rad, m, per s", None
    )

    @model_validator(mode="after")
    def _one_occasion(self) -> Event:
        limits = [key for key in ("above", "below") if getattr(self, key) is not None]
        if self.at is not None and (self.when or limits):
            got = f"at besides {(self.when and 'when') or limits[0]}"
            expected = "a time (at) or a condition (when), not both"
            raise ProblemError([Problem(("at",), expected, got, "Write two events, or remove one of them.")])
        if self.when and len(limits) != 1:
            got = "both" if limits else "neither"
            advice = f'Write for example when = "{self.when}", above = 10.0.'
            raise ProblemError([Problem(("when",), "one of above and below with it", got, advice)])
        if limits and not self.when:
            advice = f'Add for example when = "force", or remove {limits[0]}.'
            raise ProblemError([Problem((limits[0],), "when besides it", "nothing", advice)])
        return self
