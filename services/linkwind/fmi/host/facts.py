"""What an FMU says about itself, in the terms of a host of forces; ``description`` reads it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

Interface = Literal["cs", "me"]


@dataclass(frozen=True)
class Unit:
    """A unit as the FMU defines it: SI value = factor · value + offset.

    Attributes:
        name: as the FMU writes it.
        exponents: of kg, m, s, and of everything else; None where the FMU does not define the unit.
    """

    name: str
    factor: float = 1.0
    offset: float = 0.0
    exponents: tuple[int, int, int, int] | None = None


@dataclass(frozen=True)
class Variable:
    """A variable of the FMU, with its present size.

    Attributes:
        type: of FMI: ``Real``, ``Float64``, ``Integer``, ``Boolean`` …
        shape: of an array, () for a scalar.
    """

    name: str
    reference: int
    type: str
    causality: str
    variability: str
    shape: tuple[int, ...]
    start: str | None
    unit: Unit | None

    @property
    def size(self) -> int:
        """Number of values."""
        return math.prod(self.shape)

    @property
    def real(self) -> bool:
        """Whether its values are doubles."""
        return self.type in ("Real", "Float64")


@dataclass(frozen=True)
class Abilities:
    """What one interface of the FMU can do."""

    identifier: str
    once_per_process: bool
    get_set_state: bool
    serialise_state: bool
    variable_step: bool = True
    fixed_step: float = 0.0
    event_mode: bool = False
    completed_step_needed: bool = True
    derivatives: bool = False


@dataclass(frozen=True)
class Description:
    """An FMU before any of its code has run.

    Attributes:
        path: the file.
        version: of FMI, 2 or 3.
        interfaces: by ``cs`` and ``me``.
        default_step: of its default experiment [s], 0 without.
        log_categories: that it can log.
        states, indicators: number of continuous states and of event indicators.
        remarks: where it departs from the standard, though not too far to be used.
    """

    path: Path
    sha256: str
    version: int
    name: str
    token: str
    tool: str
    interfaces: Mapping[Interface, Abilities]
    variables: tuple[Variable, ...]
    default_step: float
    log_categories: tuple[str, ...]
    states: int
    indicators: int
    remarks: tuple[str, ...]

    def named(self, name: str) -> Variable | None:
        """Return the variable ``name``, or None."""
        return next((variable for variable in self.variables if variable.name == name), None)
