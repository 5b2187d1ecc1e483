"""``linkwind aero --stay``: one process, one run after the other."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

from linkwind.bus.zenoh import loopback_endpoint
from linkwind.log.reader import open_log

PATIENCE = 60.0  # s for a machine under load


def test_aero_that_stays_serves_run_after_run_until_it_is_told_to_stop(tmp_path: Path) -> None:
    endpoint = loopback_endpoint()
    program = [sys.executable, "-m", "linkwind"]
    aero = subprocess.Popen(
        [*program, "aero", "--stay", "--connect", endpoint], stderr=subprocess.PIPE, text=True
    )
    try:
        # The second run fails, by an expression that the aero side cannot evaluate; the third does not mind.
        for name, fx, status in (("one", "1.0", 0), ("two", "log(0.05-t)", 4), ("three", "1.0", 0)):
            settings = ["time.end=0.1", f"aero.field.link1.fx='{fx}'"]
            options = [f"--set={setting}" for setting in settings]
            dynamics = [*program, "dynamics", "two_link_field", "--listen", endpoint, "--out", name, *options]
            done = subprocess.run(
                dynamics, cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE, check=False
            )
            assert done.returncode == status, done.stderr
            assert open_log(tmp_path / name / "log.mcap").complete == (status == 0)
        aero.send_signal(signal.SIGTERM)
        _, errors = aero.communicate(timeout=PATIENCE)
        assert aero.returncode == 130
        assert "error: " in errors
        assert "SimulationError" in errors or "finite" in errors
    finally:
        if aero.poll() is None:
            aero.kill()
            aero.communicate()
