"""How large a message may be: every good one fits, and what does not is refused where it is made, by name.

``python -m tests.faults`` sends far larger ones into a run.
"""

from __future__ import annotations

import pytest

from linkwind.bus.zenoh.dynamics import largest_wrench
from linkwind.bus.zenoh.session import LARGEST_MOTION, LARGEST_PIECE
from linkwind.checkpoints import PIECE, Checkpoint, State
from linkwind.messages import MotionMessage, WrenchMessage

NUMBERS = ["a number"] * 1000
RUN = "r" * 1000


@pytest.mark.parametrize("bodies", [1, 2, 10, 200])
def test_every_wrench_fits(bodies: int) -> None:
    full = WrenchMessage(
        RUN, RUN, bodies, added_inertia=True, response_size=36 * bodies**2, diagnostics=NUMBERS
    )
    assert 8 * 36 * bodies**2 < len(full.payload()) < largest_wrench(bodies)


def test_motion_of_thirty_thousand_bodies_fits() -> None:
    assert len(MotionMessage(RUN, 30_000).payload()) < LARGEST_MOTION


def test_every_piece_of_a_checkpoint_fits() -> None:
    whole = Checkpoint(2**63, 2**63, 2**63, State.of(bytes(2 * PIECE + 1)))
    sizes = [len(piece) for piece in whole.pieces(RUN, RUN)]
    assert len(sizes) == 3
    assert PIECE < max(sizes) < LARGEST_PIECE
