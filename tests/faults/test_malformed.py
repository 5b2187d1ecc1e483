"""Malformed and hostile messages are refused by name, and what was refused leaves no trace.

A few thousand here; ``LINKWIND_MESSAGES=1000000 pytest tests/faults/test_malformed.py`` for more.
"""

from __future__ import annotations

import os

from tests.faults.malformed import GROWTH, fuzz

MESSAGES = int(os.environ.get("LINKWIND_MESSAGES", "3000"))
SEED = 20210305  # the first day of the paper


def test_malformed_messages_end_in_named_errors_and_leave_no_trace() -> None:
    done = fuzz(MESSAGES, SEED)
    assert not done.unexpected
    assert done.answers["refused"] + done.answers["refuse"] > MESSAGES // 2
    assert done.answers["taken"] > 0  # some are good by chance
    assert done.grown < GROWTH
