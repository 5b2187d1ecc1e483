"""Whole runs by the methods that are there to be compared with, against the default one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from linkwind.dynamics.methods import check
from linkwind.errors import InputError, MechanismError
from linkwind.fmi.part import dynamics_part
from linkwind.log.reader import open_log
from linkwind.mechanism import build
from linkwind.runs.run import run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import from_json, load
from tests.mechanism.test_loops import four_bar


def fly(folder: Path, method: str, *settings: str):
    """Fly the paper's case for 0.1 s; return the log."""
    overrides = ["time.end=0.1", "bus.transport=inprocess", f"dynamics.method={method}", *settings]
    return run(load("two_link", overrides), folder / method, lambda step: None).log


@pytest.mark.parametrize(("scheme", "size"), [("pec", 1e-9), ("implicit", 1e-5)])
@pytest.mark.parametrize(
    ("method", "settings"),
    [
        ("cfe", ["dynamics.integrator=rk4"]),
        ("cfe", ["dynamics.integrator=rk4", "dynamics.stabilisation=none"]),
        ("incremental", ["dynamics.integrator=euler"]),
    ],
)
def test_same_flight_in_the_log(tmp_path: Path, method: str, settings: list[str], scheme: str, size: float):
    """Joint coordinates, reactions and energies too; ``implicit`` stops at a tolerance."""
    settings = [*settings, f"coupling.scheme={scheme}"]
    one, other = (open_log(fly(tmp_path, name, *settings)).trajectory() for name in ("reduced", method))
    motion = "position", "linear", "angular", "q", "v", "acceleration", "reaction", "wrench"
    for name in (*motion, "kinetic_energy", "potential_energy", "external_work"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=size, err_msg=name)


def test_a_loop_in_the_log(tmp_path: Path):
    """A four-bar linkage; forces of all its joints, the one that closes the loop too."""
    text, paths = four_bar().to_json(), []
    for method in ("reduced", "cfe"):
        settings = ["time.end=0.1", "bus.transport=inprocess", f"dynamics.method={method}"]
        outcome = run(from_json(text, overrides=settings), tmp_path / method, lambda step: None)
        paths.append(open_log(outcome.log).trajectory())
        assert outcome.result.joint_gap_max_m < 1e-13
    for name in ("position", "linear", "q", "v", "acceleration", "reaction", "closure_reaction"):
        one, other = (getattr(path, name) for path in paths)
        np.testing.assert_allclose(one, other, atol=1e-8, err_msg=name)
    assert np.abs(paths[0].closure_reaction).max() > 1.0


def test_stages_that_part(tmp_path: Path):
    """The release of the built-in scenario: at the same time, and the same flight after it."""
    paths = []
    for method in ("reduced", "cfe"):
        settings = ["time.end=0.2", "bus.transport=inprocess", f"dynamics.method={method}"]
        outcome = run(load("stage_separation", settings), tmp_path / method, lambda step: None)
        paths.append(open_log(outcome.log).trajectory())
    for name in ("position", "linear", "angular", "q", "v", "reaction", "event_time", "dissipated_work"):
        one, other = (getattr(path, name) for path in paths)
        np.testing.assert_allclose(one, other, atol=1e-7, err_msg=name)
    assert 0.0 < paths[0].event_time[-1, 0] < 0.2


def test_verify_makes_it_again_bit_for_bit(tmp_path: Path):
    assert verify(*scenario_of(fly(tmp_path, "cfe"))).identical


def test_a_mechanism_that_the_paper_does_not_have(tmp_path: Path):
    settings = ["dynamics.method=incremental", "dynamics.integrator=euler", "bus.transport=inprocess"]
    with pytest.raises(MechanismError, match=r'^vortex_.*\.toml: dynamics\.method: joint of body "cylinder"'):
        run(load("vortex_induced_vibration", settings), tmp_path / "out", lambda step: None)
    assert not (tmp_path / "out").exists()


def test_an_fmu_is_of_the_default_method():
    with pytest.raises(InputError, match=r"dynamics\.method: expected reduced, .* got cfe\. Export with"):
        dynamics_part(load("two_link", ["dynamics.method=cfe"]), native_arrays=True)


def test_what_nothing_can_move_is_refused_at_the_start():
    """A point on a ball joint with a lever turns about the lever without resistance."""
    solid, nothing = [0.1, 0.1, 0.1, 0, 0, 0], [0, 0, 0, 0, 0, 0]
    bodies = [{"name": name, "mass": 1, "inertia": i} for name, i in (("base", solid), ("point", nothing))]
    joint = {"name": "ball", "type": "spherical", "parent": "base", "child": "point"}
    joint["child_point"] = [-0.2, 0, 0]
    data = {"name": "case", "time": {"end": 1.0}, "bodies": bodies, "joints": [joint]}
    scenario = from_json(json.dumps(data))
    line = (
        r'case\.toml: at the start: joint of body "point": expected inertia to move the body; got a singular'
    )
    with pytest.raises(MechanismError, match=line):
        check(build(scenario), scenario)
