"""One line of what the doctor says."""

from __future__ import annotations

from dataclasses import dataclass

OK, WARN, FAIL = "ok", "warn", "fail"


@dataclass(frozen=True)
class Finding:
    """What a check found.

    Attributes:
        check: its name.
        status: ``ok``, ``warn`` (something will not work, or slowly) or ``fail`` (nothing will).
        found: what is there.
        change: what to do about it; empty if nothing.
    """

    check: str
    status: str
    found: str
    change: str = ""
