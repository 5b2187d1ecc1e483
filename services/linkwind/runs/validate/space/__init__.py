"""A flow in three dimensions against exact and published values, one module a theme."""

from __future__ import annotations

from collections.abc import Callable

from linkwind.runs.validate.rows import Findings
from linkwind.runs.validate.space import balance, inertia, sphere, wing

CASES: dict[str, Callable[[bool], Findings]] = {
    **balance.CASES,
    **sphere.CASES,
    **wing.CASES,
    **inertia.CASES,
}

__all__ = ["CASES"]
