"""Who may command events of a run on a secure bus: an operator, and nobody else."""

from __future__ import annotations

from pathlib import Path

import pytest

from linkwind.bus.zenoh import order
from linkwind.credentials import Identity
from linkwind.errors import RefusedError
from tests.security.bed import Bed


def test_only_an_operator_commands(tmp_path: Path) -> None:
    """The run has no event: the one who may ask is told so, the others that they may not."""
    with Bed(tmp_path) as bed:
        for endpoint in (bed.direct, bed.by_router):
            for role in ("operator", "observer", "aero"):
                expected = "expected one that waits for a command: none"
                if role != "operator":
                    expected = "expected the certificate of"
                with pytest.raises(RefusedError, match=expected):
                    order("part", [endpoint], timeout=30.0, identity=Identity(role, bed.certs / role))
        assert bed.await_steps(), bed.stop()
        bed.stop()
        assert bed.untouched()
