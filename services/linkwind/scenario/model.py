"""The scenario as a whole: its tables. Loading checks what they must agree on."""

from __future__ import annotations

import json
from typing import Any

from pydantic import Field, PrivateAttr, ValidationInfo, field_validator

from linkwind.scenario.bodies import Body, Joint
from linkwind.scenario.events import Event
from linkwind.scenario.forces import Force
from linkwind.scenario.problems import item
from linkwind.scenario.providers import Provider
from linkwind.scenario.quantities import Section
from linkwind.scenario.settings import (
    RECOVERY_STEPS,
    Bus,
    Coupling,
    Dynamics,
    Environment,
    Logging,
    Time,
    nanoseconds,
)


class Scenario(Section):
    """Everything that a run needs, and a provider with it: no file paths.

    Made by ``load``, ``loads`` and ``from_json``, which fill in defaults and report errors in terms of
    the file. Providers carry the explicit names of their bodies.
    """

    name: str = Field(
        pattern=r"^\w[\w.-]*$", max_length=128, description="Name of the scenario; default: the file's"
    )
    description: str = Field(default="", description="What the scenario is about, in a line or two")
    time: Time = Field(description="Simulation time")
    environment: Environment = Field(default=Environment(), description="What surrounds the mechanism")
    bodies: tuple[Body, ...] = Field(strict=False, min_length=1, description="The rigid bodies")
    joints: tuple[Joint, ...] = Field(default=(), strict=False, description="The joints between them")
    events: tuple[Event, ...] = Field(
        default=(), strict=False, description="What happens to joints: release and lock"
    )
    forces: tuple[Force, ...] = Field(default=(), strict=False, description="Force elements of the mechanism")
    providers: tuple[Provider, ...] = Field(
        strict=False, min_length=1, description="The force providers; [aero] is short for one named aero"
    )
    dynamics: Dynamics = Field(default=Dynamics(), description="How the mechanism is advanced")
    coupling: Coupling = Field(default=Coupling(), description="When motion and wrench are exchanged")
    bus: Bus = Field(default=Bus(), description="How messages travel")
    log: Logging = Field(default=Logging(), description="What the log holds besides the messages")

    _source: str = PrivateAttr(default="")

    @field_validator("providers")
    @classmethod
    def _all_bodies_by_default(
        cls, providers: tuple[Provider, ...], info: ValidationInfo
    ) -> tuple[Provider, ...]:
        names = tuple(body.name for body in info.data.get("bodies", ()))
        return tuple(
            provider if provider.bodies else provider.model_copy(update={"bodies": names})
            for provider in providers
        )

    @field_validator("*")
    @classmethod
    def _sound(cls, value: Any, info: ValidationInfo) -> Any:
        """Put a table that is right in itself into the context, if there is one, whatever others are."""
        if info.context is not None:
            info.context[info.field_name] = value
        return value

    @property
    def source(self) -> str:
        """What errors call the scenario: the file as the user gave it, where that is known."""
        return self._source or f"{self.name}.toml"

    def where(self, table: str, index: int) -> str:
        """Return what errors call an entry of a list of tables: ``two_link.toml: joints[0] "hinge"``."""
        return f"{self.source}: {item((table, index), getattr(self, table)[index].name)}"

    def called(self, source: str) -> None:
        """Remember the file that the scenario came from; it is no part of the scenario itself."""
        self._source = source

    def __eq__(self, other: object) -> bool:
        """Compare what the scenarios say, not where they came from."""
        return isinstance(other, Scenario) and self.to_json() == other.to_json()

    def __hash__(self) -> int:
        return hash(self.to_json())

    @property
    def end_ns(self) -> int:
        """End of the run [ns]."""
        return int(nanoseconds(self.time.end))

    @property
    def steps(self) -> int:
        """Number of communication steps."""
        return self.end_ns // self.coupling.step_ns

    @property
    def checkpoint_every(self) -> int:
        """Steps from one checkpoint of the providers to the next; 0 for none."""
        return self.log.checkpoint_every or (RECOVERY_STEPS if self.bus.recovery else 0)

    @property
    def commands(self) -> tuple[str, ...]:
        """Names of the events that wait for a command."""
        return tuple(event.name for event in self.events if event.at is None and event.when is None)

    @property
    def planar(self) -> bool:
        """Whether the mechanism moves in the x, y plane: every inertia is a single number."""
        return all(body.planar for body in self.bodies)

    def to_json(self) -> str:
        """Return canonical JSON: keys sorted, floats exact; ``from_json`` gives an equal scenario."""
        data = self.model_dump(mode="json", exclude_none=True)
        return json.dumps(data, sort_keys=True, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
