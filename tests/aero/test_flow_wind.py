"""Flows in a wind that changes with time, and is the same everywhere."""

import numpy as np
import pytest

import linkwind
from linkwind.errors import ScenarioError
from linkwind.runs.record import checkpoint_steps
from linkwind.runs.resume import plan, resume
from linkwind.scenario import load, loads
from tests.aero import flows, flows3
from tests.aero.flows import STEP

AREA, CIRCLE = np.pi / 4.0, '{ type = "circle", diameter = 1.0 }'
RATE, SPEED, FAST = 2.0 * np.pi / (120 * STEP), 0.4, 8.0
SWELL = f"environment.wind=['{SPEED}*sin({RATE!r}*t)', 0]"


def swell(t):
    """Where the fluid has gone to, and how fast it goes."""
    return SPEED / RATE * (1.0 - np.cos(RATE * t)), SPEED * np.sin(RATE * t)


def still(t):
    return np.zeros(3), np.zeros(3)


def against(t):
    """A body in fluid at rest that sees it go as the swell does."""
    way, speed = swell(t)
    return np.array([-way, 0.0, 0.0]), np.array([-speed, 0.0, 0.0])


@pytest.mark.parametrize("steps", [1, 2], ids=["one lattice step", "two"])
def test_a_swell_on_a_body_is_a_body_that_sways_and_the_force_on_its_volume(steps):
    settings = {"shape": CIRCLE, "step": steps * STEP, "wind": (0.0, 0.0)}
    count = 60 // steps
    swaying = flows.driven(**settings).go(against, count)
    resting = flows.driven(SWELL, **settings).go(still, count)
    h = steps * STEP
    faster = np.diff(swell(h * np.arange(count + 1))[1]) / h  # density and span are 1
    pushed = resting.wrench[:, 0, 0] - swaying.wrench[:, 0, 0]
    assert pushed == pytest.approx(AREA * faster, abs=2e-3 * np.abs(swaying.wrench).max())
    # What is left is that of a flow: mostly added mass, about that of the volume.
    assert np.abs(swaying.wrench[10:, 0, 0]).max() > 0.5 * AREA * SPEED * RATE


def carried(*settings: str):
    return loads(
        f"""
        [time]
        end = {round(100 * STEP, 9)!r}
        [environment]
        gravity = [0.0, 0.0]
        density = 1.0
        viscosity = 1e-2
        wind = ["{FAST}*sin({RATE!r}*t)", 0.1]
        gusts = [{{ amplitude = [0.0, 0.2], frequency = {RATE / 2 / np.pi!r}, shape = "one_minus_cosine" }}]
        [[bodies]]
        name = "ball"
        mass = {AREA!r}
        inertia = {AREA / 8!r}
        shape = {CIRCLE}
        velocity = [0.0, 0.1]
        [coupling]
        step = {STEP!r}
        [bus]
        transport = "inprocess"
        [aero]
        model = "flow"
        [aero.flow]
        cells = 16
        window = [6.0, 6.0]
        frames = 4
        """,
        "carried",
        settings,
    )


def test_a_body_as_dense_as_the_fluid_goes_with_it(tmp_path):
    log = linkwind.open_log(linkwind.run(carried(), tmp_path / "run", report=False).log)
    path = log.trajectory()
    way, speed = (FAST / SPEED * of_swell for of_swell in swell(path.t))
    rise = 0.1 * (1.0 - np.cos(RATE * path.t))  # of the gust
    assert path.linear[:, 0, 0] == pytest.approx(speed, abs=1e-5 * FAST)
    assert path.linear[:, 0, 1] == pytest.approx(0.1 + rise, abs=1e-5 * FAST)
    assert path.position[:, 0, 0] == pytest.approx(way, abs=1e-3 * way.max())
    assert way.max() > 0.6
    assert not np.abs(path.angular).max() > 1e-4 * RATE
    frames = list(log.frames("aero"))
    assert [frame.step for frame in frames] == [0, 25, 50, 75, 100]
    for frame in frames:  # they are of the world
        moving = frame.velocity - [path.linear[frame.step, 0, :2]]
        assert np.abs(moving).max() < 1e-5 * FAST
        behind = path.position[frame.step, 0, :2] - frame.origin
        assert behind == pytest.approx([3.0, 2.4], abs=0.05)  # the mechanism stands upstream of the middle


def test_made_again_and_resumed(tmp_path):
    log = linkwind.open_log(
        linkwind.run(carried("log.checkpoint_every=40", "bodies.ball.mass=2.0"), tmp_path / "run").log
    )
    assert linkwind.verify(log).identical
    assert checkpoint_steps(log, round(STEP * 1e9)) == [40, 80]
    for step in (40, 80):
        done = resume(plan(log, step), tmp_path / str(step), report=False)
        assert done.outcome.result.final_state_sha256 == log.final_state_sha256


def test_in_space_the_volume_is_pushed_as_the_fluid_is():
    """A body that goes with the fluid has no other force on it."""
    h, gain = flows3.STEP, np.array([0.3, -0.2, 0.1])
    rate = 2.0 * np.pi / (40 * h)
    components = [
        f"'{first!r} + {more!r}*sin({rate!r}*t)'"
        for first, more in zip(flows3.WIND, gain.tolist(), strict=True)
    ]
    flow = flows3.driven(f"environment.wind=[{', '.join(components)}]", shape=flows3.BALL)

    def along(t):
        more = gain * np.sin(rate * t)
        way = np.array(flows3.WIND) * t + gain * (1.0 - np.cos(rate * t)) / rate
        return np.array([*way, 0.0, 0.0, 0.0]), np.array([*(flows3.WIND + more), 0.0, 0.0, 0.0])

    found = flow.go(along, 12)[:, 0]
    faster = np.diff(np.sin(rate * h * np.arange(13)))[:, None] * gain / h
    volume = np.pi / 6.0 * 1.0 * 0.8 * 0.6
    assert found[:, :3] == pytest.approx(volume * faster, abs=2e-3 * volume * np.abs(faster).max())
    assert np.abs(found[:, 3:]).max() < 1e-3 * volume * np.abs(faster).max()


@pytest.mark.parametrize(("setting", "message"), [
    ("environment.wind=['sin(y) + t*x', 0]",
     r'environment.wind\[0\]: expected a function of t alone: in the model flow the wind is the same '
     r'everywhere; got "sin\(y\) \+ t\*x". Leave out x and y, or use'),
    ("environment.gusts=[{ amplitude = [1.0, 0.0], frequency = 1.0, wavenumber = [0.1, 0.0] }]",
     r"environment.gusts\[0\].wavenumber: expected 0 along each axis: in the model flow the wind is"),
    ("environment.gusts=[{ amplitude = [0.0, 0.0, 1.0], frequency = 1.0 }]",
     r"environment.gusts\[0\].amplitude: expected no component along z: .*; got 1.0"),
    ("environment.wind=[1, 0, 't']", "environment.wind: expected no component along z.*got a function"),
])  # fmt: skip
def test_a_wind_that_differs_from_place_to_place_is_refused(setting, message):
    with pytest.raises(ScenarioError, match=message):
        load("two_link_flow", [setting])
