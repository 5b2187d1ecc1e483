"""What the paper says, and whether it comes out here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Claim:
    """One statement of the paper against what was computed.

    Attributes:
        claim: what the paper says, and where.
        measure: what ``value`` is, with its unit, and what makes the statement hold.
        value: as computed.
        holds: whether the statement does.
    """

    claim: str
    measure: str
    value: float
    holds: bool

    def as_json(self) -> dict[str, Any]:
        """Return the keys of ``verdicts`` in ``linkwind reproduce --json``."""
        return {"claim": self.claim, "measure": self.measure, "value": self.value, "holds": self.holds}
