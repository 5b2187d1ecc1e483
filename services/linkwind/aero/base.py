"""What a force model is: the wrench that the fluid puts on bodies, asked for state by state."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Literal, Protocol

from linkwind.errors import ProtocolError
from linkwind.scenario import Provider, Scenario
from linkwind.spatial import Motion, Wrench


@dataclass(frozen=True)
class Capabilities:
    """What a force model can do, told to the dynamics before the first exchange.

    Attributes:
        kind: ``point``: the wrench at the time asked for; ``mean``: the mean over the step that ends
            there, its impulse kept.
        rollback: whether a step can be evaluated again, and save and restore bring back every bit of memory.
        added_inertia: whether the wrench comes with ``A``, the part proportional to acceleration.
        response_size: numbers of ``G``, the derivative by the twist at the end of the step, in the message:
            0 without it, 36n for a matrix each body, (6n)² where the model couples the bodies.
        own_step_ns: the model's own step [ns]; 0 if it has none.
        diagnostics: names of further numbers that the model reports each step.
    """

    kind: Literal["point", "mean"] = "point"
    rollback: bool = True
    added_inertia: bool = False
    response_size: int = 0
    own_step_ns: int = 0
    diagnostics: tuple[str, ...] = ()


class ForceModel(Protocol):
    """Forces of a fluid on the bodies of one provider.

    The motion always holds all bodies of the scenario, the wrench those of the provider, both in the
    order of the scenario and of the provider.

    To be derived from, or only to be kept to. What is derived from it and only has ``evaluate`` remembers
    nothing and returns force and torque at the time asked for::

        class Drag(linkwind.ForceModel):
            def evaluate(self, t, motion, wrench):
                wrench.force[:] = -0.5 * motion.linear

    A model whose arithmetic is in ``fmu/aero`` has it as ``forces`` (:mod:`linkwind.native.forces`), which
    is None for no force at all.

    A model may have two methods more. ``frame() -> Frame | None`` is called after each ``evaluate`` and after
    the last ``commit``, and returns the picture of its fluid that is due (:mod:`linkwind.frames`), each once.
    ``close()`` ends what the model holds, such as a process of its own.
    """

    def __init__(self, scenario: Scenario, provider: Provider) -> None:
        """Keep what the model needs of the scenario and of its provider."""

    @property
    def capabilities(self) -> Capabilities:
        """What the model can do."""
        return Capabilities()

    def commit(self, t: float, motion: Motion) -> None:
        """Take the accepted state at time t [s]; called once a step, before ``evaluate``."""
        return

    @abstractmethod
    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        """Fill the wrench for a trial state at time t [s].

        Called again without a commit in between, for another coupling iteration, it starts again from what
        was committed.

        Raises:
            SimulationError: a force is not finite.
        """

    def save(self) -> bytes:
        """Return all memory as an opaque blob; called after a ``commit``, before ``evaluate``.

        Which frames were shown is memory as well.

        Raises:
            SimulationError: the model cannot; then a run has no checkpoints of it.
        """
        return b""

    def restore(self, blob: bytes) -> None:
        """Take back the memory that ``save`` returned, in this process or another; the model may be new.

        What follows is the same as it was after ``save``, to the bit.

        Raises:
            ProtocolError: the blob is not one of this model and these bodies.
        """
        if blob:
            raise ProtocolError(
                f"{type(self).__name__}: expected an empty checkpoint; got {len(blob)} bytes."
            )


def item(scenario: Scenario, provider: Provider, *keys: str) -> str:
    """Return how a user finds a setting of a provider: ``two_link.toml: aero.field.link1``."""
    index = [other.name for other in scenario.providers].index(provider.name)
    short = index == 0 and provider.name == "aero"
    table = f"{scenario.source}: aero" if short else scenario.where("providers", index)
    return ".".join((table, *keys))


def body_indices(scenario: Scenario, provider: Provider) -> list[int]:
    """Return the place of each of the provider's bodies among all bodies of the scenario."""
    names = [body.name for body in scenario.bodies]
    return [names.index(name) for name in provider.bodies]
