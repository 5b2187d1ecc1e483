"""Every command that waits for somebody ends at once when it is told to, with nothing left behind.

``python -m tests.faults`` stops all commands, many times.
"""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from linkwind.interrupt import SOON, TooLateError, at_most, stops_as_interrupt, uninterrupted
from tests.faults.shutdown import COMMANDS, WAYS, stop

WAITING = ("dynamics, waiting", "aero, waiting", "aero --stay, waiting", "router", "replay, waiting", "view")


@pytest.mark.parametrize("name", WAITING)
def test_a_command_ends_within_two_seconds(name: str, tmp_path: Path) -> None:
    stop(COMMANDS[name], WAYS[WAITING.index(name) % len(WAYS)], tmp_path)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "SIGTERM"])
def test_what_a_library_calls_back_is_not_interrupted(number: signal.Signals) -> None:
    done = []

    @uninterrupted
    def called_back(item: int) -> int:
        if not done:
            os.kill(os.getpid(), number)
        within(item)
        return item

    def within(item: int) -> None:
        done.append(item)

    def calls() -> None:
        done.extend(sorted([2, 1], key=called_back))
        time.sleep(1000.0 * SOON)
        done.append(3)

    with pytest.raises(KeyboardInterrupt), stops_as_interrupt():
        calls()
    assert done == [2, 1, 1, 2]


def test_a_block_that_is_late_is_ended() -> None:
    with pytest.raises(TooLateError), at_most(0.05):
        time.sleep(10.0)
    with at_most(10.0):
        pass
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0
