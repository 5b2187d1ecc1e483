"""None of the attacks gets through, and the run that they hit is bit for bit what it would have been.

Two of them here; all, with what the attacker saw, by ``python -m tests.security``.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from tests.security.attacks import ATTACKS, everything
from tests.security.bed import Bed, attacker


@pytest.fixture(scope="module")
def bed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bed]:
    with Bed(tmp_path_factory.mktemp("secure")) as started:
        yield started
        started.stop()
        assert started.untouched()


@pytest.mark.parametrize("name", ["observer that publishes", "oversized messages"])
def test_attack_does_not_get_through(bed: Bed, name: str) -> None:
    attempt = ATTACKS[name](bed)
    assert attempt.tried > 0
    assert bed.await_steps(), bed.stop()


def test_same_attack_ends_a_run_without_tls(tmp_path: Path) -> None:
    """Else the table would prove nothing."""
    with Bed(tmp_path, secure=False) as plain:
        with closing(attacker(plain.by_router, None, "client")) as session:
            everything(session)
        assert not plain.await_steps()
