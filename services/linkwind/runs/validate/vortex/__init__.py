"""Vortex lattice against published and exact values, one module a theme."""

from __future__ import annotations

from collections.abc import Callable

from linkwind.runs.validate.rows import Findings
from linkwind.runs.validate.vortex import flutter, section, wings

CASES: dict[str, Callable[[bool], Findings]] = {**section.CASES, **wings.CASES, **flutter.CASES}

__all__ = ["CASES"]
