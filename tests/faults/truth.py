"""What a log must be, whatever happened to the run."""

from __future__ import annotations

from pathlib import Path

from linkwind.log.reader import open_log
from linkwind.runs.verify import scenario_of, verify


def truthful(log: Path, *, from_recorded_wrenches: bool = False) -> None:
    """Check that a log says that it is not complete, and that every bit that is there is right.

    Args:
        log: the file.
        from_recorded_wrenches: take these as they are, where the force model is not at hand.
    """
    opened = open_log(log)
    assert not opened.complete
    if opened.steps > 0:
        assert verify(*scenario_of(log), from_recorded_wrenches=from_recorded_wrenches).identical
