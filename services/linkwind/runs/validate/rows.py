"""What a validation case says: a value, what it should be, who says so, and the time that it took."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Literal

from linkwind.spatial import Array


@dataclass(frozen=True)
class Row:
    """One number against its reference.

    Attributes:
        case: what was computed.
        quantity: what was measured of it, with its unit in brackets where it has one.
        value: as computed.
        reference: as published, or exact; for ``most`` the bound.
        tolerance: relative, of the reference; absolute for ``near``; None where the number is only reported.
        source: of the reference: author, year, DOI; or "exact".
        kind: ``equal``, ``near``: the value is the reference within the tolerance; ``most``: at most the
            reference.
        seconds: that the computation has taken; None where nobody asks.
    """

    case: str
    quantity: str
    value: float
    reference: float
    tolerance: float | None
    source: str
    kind: Literal["equal", "near", "most"] = "equal"
    seconds: float | None = None

    @property
    def ratio(self) -> float | None:
        """Value over reference; None where that is 0."""
        return self.value / self.reference if self.reference else None

    @property
    def ok(self) -> bool | None:
        """Whether the value is right; None where it is only reported."""
        if self.tolerance is None:
            return None
        if self.kind == "most":
            return bool(self.value <= self.reference)
        size = 1.0 if self.kind == "near" else abs(self.reference)
        return bool(abs(self.value - self.reference) <= self.tolerance * size)

    @property
    def error(self) -> float:
        """Difference of value and reference; of a bound the value itself, which should be 0."""
        return self.value if self.kind == "most" else self.value - self.reference

    def as_json(self) -> dict[str, Any]:
        """Return the keys of ``rows`` in ``linkwind validate --json``, and what else is known."""
        return {
            "case": self.case,
            "quantity": self.quantity,
            "value": self.value,
            "reference": self.reference,
            "ratio": self.ratio,
            "error": self.error,
            "ok": self.ok,
            "kind": self.kind,
            "tolerance": self.tolerance,
            "source": self.source,
            "seconds": self.seconds,
        }


def most(case: str, quantity: str, value: float, bound: float, source: str = "exact: 0") -> Row:
    """Return a row that holds if ``value`` is at most ``bound``."""
    return Row(case, quantity, value, bound, 0.0, source, "most")


def near(case: str, quantity: str, value: float, reference: float, within: float, source: str) -> Row:
    """Return a row that holds if ``value`` is not further than ``within`` from the reference."""
    return Row(case, quantity, value, reference, within, source, "near")


@dataclass(frozen=True)
class Curve:
    """A line, or points, of a plot.

    Attributes:
        label: for the legend; who published it.
        x, y: shape (m,).
        published: whether it is drawn as points: values of others.
    """

    label: str
    x: Array
    y: Array
    published: bool = False


@dataclass(frozen=True)
class Plot:
    """A picture of a case beside its published values; ``scale``: which axes are logarithmic."""

    title: str
    x: str
    y: str
    curves: tuple[Curve, ...]
    scale: Literal["linear", "log", "loglog"] = "linear"


@dataclass
class Findings:
    """What a case has found; its rows say in how many seconds, if given."""

    rows: list[Row] = field(default_factory=list)
    plots: list[Plot] = field(default_factory=list)
    seconds: float | None = None

    def __post_init__(self) -> None:
        """Put the time into the rows."""
        if self.seconds is not None:
            self.rows = [replace(row, seconds=self.seconds) for row in self.rows]

    def add(self, other: Findings) -> None:
        """Take what another one has found as well."""
        self.rows += other.rows
        self.plots += other.plots
