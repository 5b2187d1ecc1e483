"""In a coupled run the fluid gets the impulse that the bodies lose, to the precision of a float."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from linkwind.log.reader import open_log
from linkwind.native.lattice import Lattice
from linkwind.runs.run import run
from linkwind.scenario import load


@pytest.mark.parametrize("mass", [2.0, 0.02])
def test_bodies_and_fluid_exchange_the_same_impulse(mass, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """What the markers spread on the cells against the momentum of both links, the hinge apart."""
    spread, step = [], Lattice.step

    def watched(self, shift=(0, 0)):
        spread.append(self.force.sum(axis=(1, 2), dtype=float))
        step(self, shift)

    monkeypatch.setattr(Lattice, "step", watched)
    masses = [f"bodies.{name}.mass={mass}" for name in ("link1", "link2")]
    settings = ["time.end=0.02", "bus.transport=inprocess", "aero.flow.frames=0", *masses]
    scenario = load("two_link_flow", settings)
    path = open_log(run(scenario, tmp_path / "out", lambda k: None).log).trajectory()

    h = scenario.coupling.step_ns / 1e9
    cell = scenario.bodies[0].shape.length / scenario.providers[0].flow.cells
    force = -scenario.environment.density * cell**3 / h**2 * np.array(spread)
    gained = mass * np.diff(path.linear[:, :, :2].sum(axis=1), axis=0) / h
    gained[:, 1] += 2.0 * mass * 9.81
    assert len(force) == scenario.steps
    assert np.abs(force - gained).max() < 1e-6 * np.abs(gained).max()
