"""The paper made again: the equations apart, its Fig. 7, and the page of all of it."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

from linkwind.errors import InputError
from linkwind.log.reader import open_log
from linkwind.runs.reproduce import accuracy, reproduce
from linkwind.runs.reproduce.equations import EXACT, ODE45, Equations
from linkwind.runs.run import run
from linkwind.scenario import load
from tests.coupling import two_link_reference as two_link

FIELDS = {"two_link_field": two_link.f0, "two_link_gust": two_link.f1}


@pytest.mark.parametrize("name", FIELDS)
def test_equations_are_those_of_the_other_derivation(name, tmp_path):
    """Two derivations of Eqs. 6-9 and two ways to write the field down, integrated to 1e-12."""
    overrides = ['bus.transport="inprocess"', "coupling.step=0.1", "coupling.order=0"]
    outcome = run(load(name, overrides), tmp_path / "out", lambda step: None)
    path = open_log(outcome.log).trajectory()
    found, steps = Equations(load(name), path).solve(path.t, **EXACT)
    expected = two_link.velocities(two_link.reference(FIELDS[name], len(path.t) - 1))
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-9)
    _, rough = Equations(load(name), path).solve(path.t, **ODE45)
    assert steps.sum() == pytest.approx(1.2)
    assert len(rough) < len(steps)


def test_mean_error_is_relative_to_the_mean_size():
    exact = np.array([[1.0, -2.0], [3.0, 2.0]])
    off = np.array([[0.1, 0.0], [0.1, -0.4]])
    assert accuracy.mean_error(exact + off, exact) == pytest.approx([5.0, 10.0])


@pytest.mark.parametrize(("most", "step"), [(0.0205, 0.02), (1e-3, 1e-3), (0.7, 0.6)])
def test_a_step_that_divides(most, step):
    assert accuracy._dividing(1.2, most) == pytest.approx(step, rel=1e-12)


def test_a_folder_that_exists_is_kept(tmp_path):
    with pytest.raises(InputError, match="expected a new folder; got one that exists"):
        reproduce(tmp_path)


def test_the_paper(tmp_path):
    """All of it from the command line, with the flow coarse."""
    command = [
        sys.executable,
        "-m",
        "linkwind",
        "reproduce",
        "--short",
        "--json",
        "--out",
        str(tmp_path / "paper"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert set(found) == {"fig7", "verdicts", "page"}
    errors = [found["fig7"][body][name] for body in ("body1", "body2") for name in ("Vx", "Vy", "omega")]
    assert (np.array(errors) < accuracy.PAPER).all()
    verdicts = {verdict["claim"]: verdict for verdict in found["verdicts"]}
    assert len(verdicts) == 12
    certain = ("incremental scheme follows", "one step old", "keep together", "drift apart")
    for claim, verdict in verdicts.items():
        if any(words in claim for words in certain):
            assert verdict["holds"], verdict
    page = (tmp_path / "paper" / "paper.html").read_text()
    assert page.count("data:image/png;base64,") == 2 + 3 + 1 + 6  # Figs. 3 and 4, 5, 6, 7
    assert page.count("<tr>") >= 12
    assert open_log(tmp_path / "paper" / "two_link_flow" / "log.mcap").complete
