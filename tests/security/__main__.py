"""The security table: ``python -m tests.security``."""

from __future__ import annotations

import sys
import tempfile
from contextlib import closing
from pathlib import Path

from tests.security.attacks import ATTACKS, Attempt, everything
from tests.security.bed import Bed, attacker


def main() -> int:
    """Try every attack on one run; print what came of it."""
    through = 0
    print(f"{'attack':<26}{'tried':>7}{'got through':>13}  the attacker saw")
    with tempfile.TemporaryDirectory() as folder, Bed(Path(folder)) as bed:
        for name, attack in ATTACKS.items():
            try:
                attempt = attack(bed)
            except AssertionError as error:
                attempt = Attempt(1, f"GOT THROUGH: {error}")
                through += 1
            if not bed.await_steps():
                print(f"{name:<26}{attempt.tried:>7}{'yes':>13}  the run ended: {bed.stop()}")
                return 1
            print(f"{name:<26}{attempt.tried:>7}{'no':>13}  {attempt.saw}")
        bed.stop()
        same = bed.untouched()
    print(f"the run under attack, verified: {'identical' if same else 'DIFFERENT'}")
    with tempfile.TemporaryDirectory() as folder, Bed(Path(folder), secure=False) as plain:
        with closing(attacker(plain.by_router, None, "client")) as session:
            everything(session)
        ended = not plain.await_steps()
    print(f"the same messages on a bus without TLS: {'end the run' if ended else 'do nothing'}")
    return int(bool(through) or not same or not ended)


sys.exit(main())
