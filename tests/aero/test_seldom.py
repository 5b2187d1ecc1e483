"""A model that is asked at every n-th point: what it sees, and what stands in for it in between."""

from __future__ import annotations

import math

import numpy as np
import pytest

import linkwind
from linkwind import aero
from linkwind.aero import Capabilities
from linkwind.errors import InputError, ScenarioError
from linkwind.runs.record import checkpoint_steps
from linkwind.runs.resume import plan, resume
from linkwind.spatial import Motion, Wrench

STEP, EVERY = 0.001, 4
MASS, STIFFNESS = 2.0, 50.0
BLOCK = f"""
[time]
end = 0.04
[environment]
gravity = [0.0, 0.0, 0.0]
[[bodies]]
name = "block"
mass = {MASS}
inertia = 1.0
position = [0.1, 0.0]
[bus]
transport = "inprocess"
[aero]
model = "field"
every = {EVERY}
[aero.field.block]
fx = "FX"
"""


def block(force: str = "0", *settings: str):
    return linkwind.loads(BLOCK.replace("FX", force), "block", settings)


def fly(scenario, folder, **options):
    return linkwind.run(scenario, folder, report=False, **options)


def forces(log) -> np.ndarray:
    return linkwind.table(log, "wrench_aero")["block.force.x [N]"]


class Watched(linkwind.ForceModel):
    """Remembers what it was told."""

    capabilities = Capabilities(rollback=False)

    def __init__(self, scenario, provider):
        self.step = scenario.coupling.step
        self.told = []
        Watched.last = self

    def commit(self, t, motion):
        self.told.append(("commit", t, motion.position[0, 0]))

    def evaluate(self, t, motion, wrench):
        self.told.append(("evaluate", t, motion.position[0, 0]))
        wrench.force[0, 0] = 1.0


def test_the_model_sees_a_run_of_longer_steps(tmp_path):
    outcome = fly(block(), tmp_path / "run", models={"aero": Watched})
    model, path = Watched.last, linkwind.open_log(outcome.log).trajectory()
    times = [m * EVERY * STEP for m in range(11)]
    assert model.step == EVERY * STEP
    assert [t for what, t, _ in model.told if what == "evaluate"] == pytest.approx(times, abs=1e-15)
    accepted = [(t, x) for what, t, x in model.told if what == "commit"]
    assert [t for t, _ in accepted] == pytest.approx(times, abs=1e-15)
    assert [x for _, x in accepted] == path.position[::EVERY, 0, 0].tolist()


@pytest.mark.parametrize("settings", [(), ("coupling.scheme=implicit",)])
def test_between_two_answers_the_force_is_on_a_line(tmp_path, settings):
    log = fly(block("3 + 5*t", *settings), tmp_path / "run").log
    t = np.arange(41) * STEP
    expected = 3 + 5 * t
    expected[:EVERY] = 3.0  # there is one answer only
    steps = linkwind.table(log, "wrench_aero")["step"].tolist()
    by_step = dict(zip(steps, forces(log), strict=True))  # the last iteration's
    assert [by_step[k] for k in range(41)] == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("setting", ["coupling.scheme=explicit", "coupling.order=0"])
def test_without_an_order_the_force_is_held(tmp_path, setting):
    got = forces(fly(block("3 + 5*t", setting), tmp_path / "run").log)
    assert got == pytest.approx(3 + 5 * STEP * EVERY * (np.arange(41) // EVERY), abs=1e-14)


class Impulse(linkwind.ForceModel):
    """The mean of 3 + 5 t over its own step."""

    capabilities = Capabilities(kind="mean")

    def __init__(self, scenario, provider):
        self.step = scenario.coupling.step

    def evaluate(self, t, motion, wrench):
        wrench.force[0, 0] = 3 + 5 * (t - self.step / 2)


def test_means_are_held(tmp_path):
    got = forces(fly(block(), tmp_path / "run", models={"aero": Impulse}).log)
    middle = STEP * EVERY * (np.arange(41) // EVERY) - STEP * EVERY / 2
    assert got == pytest.approx(3 + 5 * middle, abs=1e-14)


def test_the_error_is_of_second_order_in_the_distance_of_two_answers(tmp_path):
    """A block on a spring, which is a force of the model: x = x0 cos(ω t)."""
    exact = 0.1 * math.cos(math.sqrt(STIFFNESS / MASS) * 1.0)
    errors = []
    for n in (10, 20, 40):
        settings = (f"aero.every={n}", "time.end=1.0")
        outcome = fly(block(f"-{STIFFNESS}*x", *settings), tmp_path / str(n))
        x = linkwind.open_log(outcome.log).trajectory().position[-1, 0, 0]
        errors.append(abs(x - exact))
    assert np.diff(np.log2(errors)) == pytest.approx([2.0, 2.0], abs=0.2)


def test_every_point_is_what_it_was_without(tmp_path):
    hashes = [
        fly(
            linkwind.load("two_link", [*settings, "time.end=0.02", "bus.transport=inprocess"]),
            tmp_path / name,
        ).result.final_state_sha256
        for name, settings in (("one", ["aero.every=1"]), ("none", []))
    ]
    assert hashes[0] == hashes[1]


@pytest.mark.parametrize("scenario", ["two_link", "flapper"])
def test_made_again_and_resumed_beside_its_points(tmp_path, scenario):
    """Both transports, a plate with its added inertia and diagnostics."""
    settings = ["aero.every=4", "log.checkpoint_every=7", "time.end=0.03"]
    logs = [
        linkwind.open_log(
            fly(linkwind.load(scenario, [*settings, f"bus.transport={bus}"]), tmp_path / bus).log
        )
        for bus in ("inprocess", "zenoh")
    ]
    log = logs[0]
    assert log.final_state_sha256 == logs[1].final_state_sha256
    assert linkwind.verify(log).identical
    steps = checkpoint_steps(log, 1_000_000)
    assert steps == [7, 14, 21, 28]
    for step in [*steps, 10]:
        done = resume(plan(log, step), tmp_path / str(step), report=False)
        assert done.outcome.result.final_state_sha256 == log.final_state_sha256


def test_a_checkpoint_of_something_else_is_refused():
    scenario = block("1")
    model = aero.build(scenario, scenario.providers[0])
    with pytest.raises(linkwind.LinkwindError, match="Seldom: expected 105 bytes and more; got 3"):
        model.restore(b"abc")


@pytest.mark.parametrize("model", ["flow", "vortex"])
def test_models_of_one_step(model):
    scenario = "two_link_flow" if model == "flow" else "flapper_wake"
    with pytest.raises(
        ScenarioError, match=f"every: expected 1 for the model {model}, .*; got 2. Leave it out"
    ):
        linkwind.load(scenario, ["aero.every=2"])


class Responsive(linkwind.ForceModel):
    """Says what the twist at the end of the step does."""

    capabilities = Capabilities(response_size=36)

    def __init__(self, scenario, provider):
        pass

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        wrench.force[:] = 0.0


def test_a_response_is_that_of_one_step(tmp_path):
    with pytest.raises(InputError, match=r"aero\.every: expected 1 for a model that returns the response"):
        fly(block(), tmp_path / "run", models={"aero": Responsive})
