"""A hosted FMU, and what must hold after every test: no process and no file is left."""

from __future__ import annotations

import gc
import os
import tempfile
from pathlib import Path

import numpy as np
import pytest

from linkwind.aero.fmu import ForceFmu
from linkwind.scenario import loads
from linkwind.spatial import Motion, Wrench
from tests.fmi_host.foreign import Foreign, fmu

HEAD = """
[time]
end = 1.0
[environment]
density = 1.3
wind = [-5.0, 1.0, 0.0]
"""
BODY = """
[[bodies]]
name = "{}"
mass = 1.0
inertia = 1.0
"""


def children() -> set[str]:
    """Processes of this one, living or not yet reaped."""
    lists = Path("/proc/self/task").glob("*/children")
    return {pid for file in lists for pid in file.read_text().split()}


@pytest.fixture(autouse=True)
def nothing_is_left(request, tmp_path, monkeypatch):
    """No zombie, no process, no unpacked file, no open descriptor."""
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    before, files = children(), len(os.listdir("/proc/self/fd"))
    yield
    assert children() == before
    assert list(temporary.iterdir()) == []
    gc.collect()
    if request.module.__name__ != "tests.fmi_host.test_runs":  # zenoh keeps some of its own
        assert len(os.listdir("/proc/self/fd")) <= files


class Host:
    """A force model made of a foreign FMU, stepped like the lock step does."""

    def __init__(self, file: Path, toml: str, bodies: tuple[str, ...], coupling: str) -> None:
        text = (
            HEAD
            + "".join(map(BODY.format, bodies))
            + f'{coupling}\n[aero]\nmodel = "fmu"\n[aero.fmu]\n{toml}'
        )
        self.scenario = loads(text, "scene.toml")
        self.h = self.scenario.coupling.step
        self.model = ForceFmu(self.scenario, self.scenario.providers[0], file)
        self.motion = Motion.at_rest(len(bodies))
        self.wrench = Wrench.zeros(len(bodies), added_inertia=self.model.capabilities.added_inertia)

        if size := self.model.capabilities.response_size:
            n = len(bodies)
            self.wrench.response = np.zeros((6 * n, 6 * n) if size == 36 * n * n else (n, 6, 6))

    def at(self, k: int):
        """Evaluate at communication point k with the present motion; return force and torque of body 0."""
        self.model.evaluate(k * self.h, self.motion, self.wrench)
        return self.wrench.force[0].copy(), self.wrench.torque[0].copy()

    def step(self, k: int):
        """Commit at k - 1 and evaluate at k."""
        if k:
            self.model.commit((k - 1) * self.h, self.motion)
        return self.at(k)


@pytest.fixture
def host(tmp_path):
    """Return a function that hosts a Foreign."""
    opened = []

    def start(
        foreign: Foreign | Path, toml: str = "", bodies: tuple[str, ...] = ("wing",), coupling: str = ""
    ) -> Host:
        file = fmu(tmp_path, foreign, f"foreign{len(opened)}") if isinstance(foreign, Foreign) else foreign
        opened.append(Host(file, toml, bodies, coupling))
        return opened[-1]

    yield start
    for each in opened:
        each.model.close()
    opened.clear()  # with the last reference goes the shared memory
