"""The panel of the drives: effort, power, and the mean of that."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest

from linkwind.report.data import Run, read
from linkwind.report.panels import panels
from linkwind.runs.run import run
from linkwind.scenario import load

from .test_page import unpack

RIG = Path(__file__).with_name("rig.toml")


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return read(run(load(str(RIG)), tmp_path_factory.mktemp("drives") / "out", report=False).log)


def drives(shown: Run) -> dict:
    return next(panel for panel in panels(shown) if panel["title"] == "Drives")


def test_effort_and_power_of_an_actuator_and_a_motion(rig: Run) -> None:
    """A constant force F on m does F²t²/2m of work; a wheel at constant speed takes what its damper does."""
    rows = {row["label"]: {curve["name"]: curve for curve in row["curves"]} for row in drives(rig)["rows"]}
    assert {label: list(curves) for label, curves in rows.items()} == {
        "torque [N·m]": ["turn"],
        "force [N]": ["pull"],
        "power [W]": ["pull", "turn"],
    }
    np.testing.assert_allclose(unpack(rows["force [N]"]["pull"]["y"]), 4.0)
    np.testing.assert_allclose(unpack(rows["torque [N·m]"]["turn"]["y"]), 0.5 * 3.0)
    pull, turn = (rows["power [W]"][name] for name in ("pull", "turn"))
    np.testing.assert_allclose(unpack(turn["y"]), 0.5 * 3.0**2)
    np.testing.assert_allclose(unpack(pull["y"]), 8.0 * rig.trajectory.t, rtol=1e-6, atol=1e-9)
    assert (pull["colour"], turn["colour"]) == (0, 1)  # of the bodies that they move
    # 4² / 2 · 2 s / 2 = 8 W in the mean, and 4.5 W.
    assert "Mean power from 0 to 2 s: pull 8 W, turn 4.5 W; together 12.5 W." in drives(rig)["note"]


def test_a_window_has_the_mean_of_its_own(rig: Run) -> None:
    half = slice(1000, None)  # from 1 s on: 8 t W has the mean 12 W
    path = rig.trajectory._replace(**{f: getattr(rig.trajectory, f)[half] for f in rig.trajectory._fields})
    shown = dataclasses.replace(rig, trajectory=path)
    assert "Mean power from 1 to 2 s: pull 12 W, turn 4.5 W; together 16.5 W." in drives(shown)["note"]


def test_the_drives_of_the_flapper_take_what_the_guide_says(tmp_path: Path) -> None:
    done = run(load("flapper", ["bus.transport=inprocess"]), tmp_path / "out", report=False)
    shown = read(done.log)
    path, guide = shown.trajectory, Path(__file__).parents[2] / "services" / "guide" / "mechanisms.md"
    (said,) = re.findall(r"mean power of the drives .* W; ([\d.]+) W with 8 strips", guide.read_text())
    assert f"together {said} W." in drives(shown)["note"]
    mean = np.trapezoid(path.force_power.sum(axis=1), path.t) / path.t[-1]
    assert math.isclose(mean, float(said), abs_tol=0.05)


def test_without_drives_there_is_no_panel(rig: Run) -> None:
    springs = [force for force in rig.scenario["forces"] if force["type"] == "spring"]
    bare = dataclasses.replace(rig, scenario={**rig.scenario, "forces": springs})
    assert "Drives" not in [panel["title"] for panel in panels(bare)]
