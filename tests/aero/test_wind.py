"""A wind of expressions and tables: its value, its rate along a path, bodies in it, what is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import linkwind
from linkwind import aero
from linkwind.errors import ExpressionError, FaultError, ScenarioError, SimulationError
from linkwind.native.wind import wind_at
from linkwind.scenario import Environment, from_json, loads
from linkwind.scenario.functions import Function
from linkwind.spatial import Motion, Wrench
from linkwind.wind import wind_table
from tests.aero.scenes import PLATE, model, wrench

RNG = np.random.default_rng(31)
SHEAR = "-5*(max(y,0.1)/10)**0.14"
ROWS = "[[0.0, 1.0], [0.5, 2.0], [1.5, -1.0], [2.0, 1.0]]"
MANY = (
    f"environment.wind=['1.5*sin(2*t - x) + exp(-y**2)*z', {{ table = {ROWS}, interpolation = 'spline' }},"
    " 'hypot(x, 2) / (1 + t**2) + atan2(y, 3)*max(z, t) - abs(x)**1.7 + tanh(z)*sqrt(4 + cos(t))']"
)


def wind(*settings: str) -> linkwind.Wind:
    return linkwind.Wind(loads(PLATE, "scene", settings))


# ---- values and rates ----


def test_profiles_over_height() -> None:
    """The power law and the law of the wall; below the limit that keeps them finite they are constant."""
    height = np.array([-1.0, 0.0, 0.1, 3.0, 10.0, 80.0])
    places = np.stack([7.0 + 0.0 * height, height, -2.0 + 0.0 * height], axis=1)
    found = wind(f"environment.wind=['{SHEAR}', '0.4/0.41*log(max(y, 0.03)/0.03)', 0.25]").velocity(
        9.0, places
    )
    np.testing.assert_allclose(found[:, 0], -5.0 * (np.maximum(height, 0.1) / 10.0) ** 0.14, rtol=1e-15)
    law = 0.4 / 0.41 * np.log(np.maximum(height, 0.03) / 0.03)
    np.testing.assert_allclose(found[:, 1], law, rtol=1e-15)
    assert (found[:, 2] == 0.25).all()


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ("", [1.0, 1.5, 2.0, 0.5, -1.0, 1.0, 1.0]),  # piecewise linear, held at its ends
        (", periodic = true", [-1.0, 1.5, 2.0, 0.5, -1.0, 1.0, 1.5]),
    ],
)
def test_a_table_over_time(settings: str, expected: list[float]) -> None:
    air = wind(f"environment.wind=[0, {{ table = {ROWS}{settings} }}, 0]")
    times = np.array([-0.5, 0.25, 0.5, 1.0, 1.5, 2.0, 2.25])
    found = air.velocity(times, RNG.normal(size=(7, 3)))
    np.testing.assert_allclose(found, np.outer(expected, [0.0, 1.0, 0.0]), rtol=0, atol=1e-15)


def test_a_table_from_a_file_beside_the_scenario(tmp_path: Path) -> None:
    (tmp_path / "wind.csv").write_text("t, u  # of an anemometer\n0, 4\n1, 6\n2, 3\n")
    file = tmp_path / "scene.toml"
    file.write_text(PLATE + '\n[environment]\nwind = [{ table = "wind.csv" }, 0, 0]\n')
    scenario = linkwind.load(file)
    assert linkwind.Wind(scenario).velocity(1.5, np.zeros(3)).tolist() == [4.5, 0.0, 0.0]
    (tmp_path / "wind.csv").unlink()  # its numbers are in the scenario
    assert from_json(scenario.to_json()) == scenario


def test_the_rate_is_the_derivative_along_the_path() -> None:
    """Against a five-point difference of the values, along lines in space and time."""
    air = wind(MANY)
    for _ in range(20):
        t, r, v = RNG.uniform(0.1, 1.9), RNG.normal(size=3), RNG.normal(size=3)
        h = 1e-3 * min(1.0, *abs(np.array([t, t - 0.5, t - 1.5, 2.0 - t, r[0], r[2] - t])))  # to the kinks
        along = [air.velocity(t + s * h, r + s * h * v) for s in (-2, -1, 1, 2)]
        difference = (along[0] - 8.0 * along[1] + 8.0 * along[2] - along[3]) / (12.0 * h)
        np.testing.assert_allclose(air.rate(t, r, v), difference, rtol=1e-7, atol=1e-10 / h)


def test_a_sine_gust_written_as_an_expression() -> None:
    """It has another order of operations, but is the same wave: values and rates agree to round-off."""
    gust = "amplitude=[0.3,-0.2,0.1],frequency=1.7,wavenumber=[0.4,-0.3,0.2],phase_deg=40"
    gusts = wind("environment.wind=[2,1,0]", f"environment.gusts=[{{{gust}}}]")
    sine = "sin(2*pi*(1.7*t + 0.4*x - 0.3*y + 0.2*z) + 40*pi/180)"
    written = wind(f"environment.wind=['2 + 0.3*{sine}', '1 - 0.2*{sine}', '0.1*{sine}']")
    r, v, t = RNG.normal(size=(200, 3)), 5.0 * RNG.normal(size=(200, 3)), RNG.uniform(0.0, 3.0, 200)
    np.testing.assert_allclose(written.velocity(t, r), gusts.velocity(t, r), rtol=0, atol=4e-15)
    np.testing.assert_allclose(written.rate(t, r, v), gusts.rate(t, r, v), rtol=0, atol=1e-13)


def test_gusts_blow_on_top_of_functions() -> None:
    one, other = "environment.wind=['t', 2, 0]", "environment.gusts=[{amplitude=[1,1,1],frequency=0.3}]"
    r = np.zeros(3)
    expected = wind(one).velocity(0.7, r) + wind(other).velocity(0.7, r)
    np.testing.assert_allclose(wind(one, other).velocity(0.7, r), expected, rtol=1e-15)


def test_where_a_profile_is_cut_off_it_does_not_change_however_steep_it_is() -> None:
    """sqrt and powers below 1 have an infinite slope at 0, where max(y, 0) stays."""
    air = wind("environment.wind=['sqrt(max(y,0))', 'max(y,0)**0.14', 'asin(min(y + 2, 1))']")
    assert air.rate(0.0, np.array([0.0, -0.5, 0.0]), np.array([1.0, 2.0, 3.0])).tolist() == [0.0, 0.0, 0.0]


def test_a_constant_wind_is_what_it_was() -> None:
    """Numbers stay numbers, in the JSON as well; no program runs."""
    plain = loads(PLATE, "scene", ["environment.wind=[-5, 0.25]"])
    assert plain.environment.wind == (-5.0, 0.25, 0.0)
    assert json.loads(plain.to_json())["environment"]["wind"] == [-5.0, 0.25, 0.0]
    assert len(wind_table(plain.environment, "scene").code) == 0
    found = linkwind.Wind(plain).velocity(1.0, RNG.normal(size=(4, 3)))
    assert (found == [-5.0, 0.25, 0.0]).all()
    assert Environment(wind=(-5.0, 0.25)).wind_functions == {}


def test_functions_survive_json() -> None:
    scenario = loads(PLATE, "scene", [MANY])
    again = from_json(scenario.to_json())
    assert again == scenario
    assert isinstance(again.environment.wind[0], Function)
    assert scenario.environment.uniform_wind == (0.0, 0.0, 0.0)


def test_inputs_are_numbers_that_expressions_use() -> None:
    stated = ["environment.wind=['u + w*t', 0, 0]", "environment.inputs={ w = 2.0, u = 1 }"]
    assert wind(*stated).velocity(3.0, np.zeros(3)).tolist() == [7.0, 0.0, 0.0]
    assert wind(*stated, "environment.inputs.u=-1").velocity(3.0, np.zeros(3)).tolist() == [5.0, 0.0, 0.0]
    assert "inputs" not in json.loads(loads(PLATE, "scene").to_json())["environment"]
    with pytest.raises(
        ExpressionError, match=r'environment\.inputs: expected names that .* got "u", which none'
    ):
        wind("environment.inputs={ u = 1.0 }")
    with pytest.raises(
        ExpressionError, match=r'environment\.inputs: expected a name that is not taken; got "t"'
    ):
        wind("environment.wind=['t', 0, 0]", "environment.inputs={ t = 1.0 }")


@pytest.mark.parametrize("before", ["environment.gravity=[0,0,0]", "environment.wind=[1,2]"])
def test_one_component_at_the_command_line(before: str) -> None:
    changed = loads(PLATE, "scene", [before, f"environment.wind.0={SHEAR}"]).environment
    assert changed.wind_functions == {0: Function(expression=SHEAR)}
    assert changed.uniform_wind[1:] == ((2.0, 0.0) if "wind" in before else (0.0, 0.0))


def test_the_winds_of_the_guide(tmp_path: Path) -> None:
    guide = (Path(__file__).parents[2] / "services" / "guide" / "mechanisms.md").read_text(encoding="utf-8")
    section = guide.partition("\n## Wind\n")[2].partition("\n## ")[0]
    stated = [line.strip() for line in section.splitlines() if line.startswith("    wind = [")]
    (tmp_path / "wind.csv").write_text("0, 3\n1, 4\n")
    places = np.stack(np.meshgrid([-7.0, 0.0, 3.0], [-1.0, 0.0, 20.0], [0.0, 5.0]), axis=-1).reshape(-1, 3)
    found = []
    for number, line in enumerate(stated):
        file = tmp_path / f"{number}.toml"
        file.write_text(f"{PLATE}\n[environment]\n{line}\n")
        air = linkwind.Wind(linkwind.load(file))
        assert np.isfinite(air.rate(0.5, places, places)).all()
        found.append(air.velocity(0.5, places))
    assert len({each.tobytes() for each in found}) == len(found) == 6
    # The vortex: on circles around its centre the air turns with one speed, 2 m/s at most, at its core.
    angle = np.linspace(0.0, 6.0, 9)[:, None]
    around = np.hstack([np.cos(angle), np.sin(angle), 0.0 * angle])
    for radius, fastest in ((0.1, 1.6), (0.2, 2.0), (0.4, 1.6)):
        own = air.velocity(2.0, [6.0, 0.0, 0.0] + radius * around) - [3.0, 0.0, 0.0]
        np.testing.assert_allclose(np.linalg.norm(own, axis=1), fastest, rtol=1e-12)
        np.testing.assert_allclose((own * around).sum(axis=1), 0.0, atol=1e-12)


# ---- bodies in it ----

ACROSS = """
[time]
end = 1.0
[environment]
gravity = [0.0, 0.0]
wind = [0.0, {wind}]
[[bodies]]
name = "plate"
mass = 0.4
inertia = 1.0
shape = {{ type = "plate", length = 0.4, span = 0.7 }}
velocity = [0.0, {start}]
[aero]
model = "plate"
[aero.plate]
strips = {strips}
[coupling]
step = 1e-3
[bus]
transport = "inprocess"
"""
PRESS = 0.5 * 1.225 * 1.9 * 0.4 * 0.7  # of a plate across the air: half density, drag coefficient, area
ADDED = math.pi * 1.225 * 0.2**2 * 0.7


def fly(folder: Path, wind: str, start: float, strips: int = 1) -> np.ndarray:
    """Return the speed of a plate across a wind, step by step."""
    scenario = loads(ACROSS.format(wind=wind, start=start, strips=strips), "across.toml")
    outcome = linkwind.run(scenario, folder, report=False)
    return linkwind.open_log(outcome.log).trajectory().linear[:, 0, 1]


@pytest.mark.parametrize(
    ("ramp", "strips"), [('"2 + 3*t"', 1), ('"2 + 3*t"', 4), ("{ table = [[0, 2], [2, 8]] }", 1)]
)
def test_a_plate_across_a_wind_that_rises(ramp: str, strips: int, tmp_path: Path) -> None:
    """Exact: with W = V - U, (m + m_a) dW/dt = -k |W| W - m dU/dt, so W = -W_e tanh(t / τ) from W = 0."""
    speed = fly(tmp_path / "run", ramp, 2.0, strips)
    t = 1e-3 * np.arange(len(speed))
    end, time = math.sqrt(0.4 * 3.0 / PRESS), (0.4 + ADDED) / math.sqrt(0.4 * 3.0 * PRESS)
    np.testing.assert_allclose(speed, 2.0 + 3.0 * t - end * np.tanh(t / time), rtol=0, atol=3e-7)


def test_a_plate_that_moves_through_a_shear(tmp_path: Path) -> None:
    """Its added mass feels (v·∇)U = V dU/dy. Against Runge-Kutta's steps of the same equation."""
    found = fly(tmp_path / "run", '"3 + 0.8*y"', -1.0)

    def rates(state: np.ndarray) -> np.ndarray:
        y, v = state
        air = v - (3.0 + 0.8 * y)
        return np.array([v, (-PRESS * abs(air) * air + ADDED * 0.8 * v) / (0.4 + ADDED)])

    state, h = np.array([0.0, -1.0]), 1e-3
    speed = [state[1]]
    for _ in range(1000):
        k1 = rates(state)
        k2 = rates(state + 0.5 * h * k1)
        k3 = rates(state + 0.5 * h * k2)
        state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + rates(state + h * k3))
        speed.append(state[1])
    np.testing.assert_allclose(found, speed, rtol=0, atol=3e-7)


def test_a_model_of_ones_own_asks_for_the_wind(tmp_path: Path) -> None:
    """A particle with linear drag in U sin ωt: dV/dt = (U sin ωt - V) / T has a solution in closed form."""
    text = PLATE.replace('model = "plate"', 'model = "python"')
    settings = [
        "environment.gravity=[0,0,0]",
        "environment.wind=['2*sin(7*t)',0,0]",
        "bus.transport=inprocess",
    ]
    scenario = loads(text, "scene", [*settings, "coupling.step=1e-3"])
    air = linkwind.Wind(scenario)

    def drag(t: float, motion: Motion, wrench: Wrench) -> None:
        wrench.force[:] = (air.velocity(t, motion.position) - motion.linear) / 0.3

    outcome = linkwind.run(scenario, tmp_path / "run", models={"aero": drag}, report=False)
    path = linkwind.open_log(outcome.log).trajectory()
    phase, size = math.atan(7.0 * 0.3), 2.0 / math.hypot(1.0, 7.0 * 0.3)
    exact = size * (np.sin(7.0 * path.t - phase) + math.sin(phase) * np.exp(-path.t / 0.3))
    np.testing.assert_allclose(path.linear[:, 0, 0], exact, rtol=0, atol=3e-7)


@pytest.mark.parametrize("name", ["plate", "vortex"])
def test_models_meet_a_gust_and_its_expression_alike(name: str) -> None:
    gust = "environment.gusts=[{amplitude=[0.3,-0.2,0.1],frequency=1.7,wavenumber=[0.4,-0.3,0.2]}]"
    sine = "sin(2*pi*(1.7*t + 0.4*x - 0.3*y + 0.2*z))"
    written = f"environment.wind=['5 + 0.3*{sine}', '-0.2*{sine}', '0.1*{sine}']"
    text, found = PLATE.replace('model = "plate"', f'model = "{name}"'), []
    for settings in (["environment.wind=[5,0,0]", gust], [written]):
        made, moving = model(text, *settings), Motion.at_rest(1)
        moving.position[0], moving.linear[0], moving.angular[0] = (
            (0.1, 0.2, 0.3),
            (0.2, -1.0, 0.1),
            (0, 0.1, 2.0),
        )
        for k in range(4):
            made.commit(0.01 * k, moving)
            moving.position[0] += 0.01 * moving.linear[0]
            out = wrench(made, moving, 0.01 * (k + 1))
        found.append(np.hstack([out.force, out.torque]))
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-12 * abs(found[0]).max())
    assert abs(found[0][0, [0, 1, 3, 5]]).min() > 1e-4


# ---- what is refused ----


@pytest.mark.parametrize(
    ("setting", "error", "message"),
    [
        ("['5*u', 0]", ExpressionError, '[0]: column 3: expected one of t, x, y, z, pi; got "u"'),
        ("[0, 'y^2']", ExpressionError, "[1]: column 1: expected ** for a power; got ^"),
        ("[0, '']", ExpressionError, "[1]: expected an expression; got nothing."),
        ("[0, true]", ScenarioError, ": expected a list of 2 or 3 numbers; got [0, true]."),
        ("['t', true]", ScenarioError, "[1]: expected a number, an expression or a table; got true."),
        ("['t']", ScenarioError, ": expected a list of 2 or 3 components, each a number, an expression or"),
        ("'t'", ScenarioError, ": expected a list of 2 or 3 components, each a number, an expression or"),
        ("['t', inf]", ScenarioError, "[1]: expected finite numbers; got inf."),
        ("[{tabel='a'}, 0]", ScenarioError, "[0].tabel: expected a key among expression, table, interpo"),
        ("[{table='no.csv'}, 0]", ScenarioError, "[0].table: expected a file with the columns variable and"),
        ("[0, {table=[[0,1],[0,2]]}]", ScenarioError, "[1].table[1]: expected a variable above 0.0"),
        ("[0, {}]", ScenarioError, "[1]: expected an expression or a table; got neither."),
    ],
)  # fmt: skip
def test_what_a_wind_cannot_be(setting: str, error: type[Exception], message: str) -> None:
    with pytest.raises(error) as caught:
        aero.check(loads(PLATE, "scene", [f"environment.wind={setting}"]))
    assert f"environment.wind{message}" in str(caught.value)


@pytest.mark.parametrize("name", ["field", "none"])
def test_an_expression_is_read_before_a_run_even_if_no_model_reads_it(name: str) -> None:
    field = '[aero.field.plate]\nfx = "0"' if name == "field" else ""
    text = PLATE.replace('model = "plate"', f'model = "{name}"\n{field}')
    with pytest.raises(ExpressionError, match=r"environment\.wind\[2\]: column 1"):
        aero.check(loads(text, "scene", ["environment.wind.2=gusty"]))


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        (["environment.wind=['t', 'log(y)', 0]", "aero.plate.strips=3"],
         "[1]: expected a finite velocity at t = 0.25 s, x = 1, y = -0.5, z = 2.76666667 m; got nan. Does"),
        (["environment.wind=[0, 0, '1/(t - 0.25)']"],
         "[2]: expected a finite velocity at t = 0.25 s, x = 1, y = -0.5, z = 3 m; got inf. Does it divide"),
        (["environment.wind=['sqrt(y + 0.5)', 0, 0]"],
         "[0]: expected a finite rate of change at t = 0.25 s, x = 1, y = -0.5, z = 3 m, passed with "
         "[0.0, 2.0, 0.0] m/s; got inf."),
    ],
)  # fmt: skip
def test_a_plate_meets_a_wind_that_is_not_finite(settings: list[str], expected: str) -> None:
    motion = Motion.at_rest(1)
    motion.position[0], motion.linear[0] = (1.0, -0.5, 3.0), (0.0, 2.0, 0.0)
    with pytest.raises(SimulationError) as caught:
        wrench(model(PLATE, *settings), motion, 0.25)
    assert f"scene: environment.wind{expected}" in str(caught.value)


def test_a_motion_that_diverged_is_not_put_down_to_the_wind() -> None:
    motion = Motion.at_rest(1)
    motion.position[0] = np.nan
    with pytest.raises(SimulationError, match=r"Has the motion diverged\?"):
        wrench(model(PLATE, f"environment.wind=['{SHEAR}',0,0]"), motion)


@pytest.mark.parametrize(
    ("function", "step"), [("5 + 0*log(0.375 - x)", 4), ("5 + log(0.025 - t)", 2), ("5 + 0*log(0.1 - x)", 0)]
)
def test_a_wing_or_its_wake_meets_a_wind_that_is_not_finite(function: str, step: int) -> None:
    """At 5 m/s the wake goes 50 mm a step from the edge at x = 0.2; the wing from -0.2 is met at once."""
    text = PLATE.replace('model = "plate"', 'model = "vortex"')
    made = model(text, f"environment.wind=['{function}',0,0]", "coupling.step=0.01")
    motion, taken = Motion.at_rest(1), []

    def take(k: int) -> None:
        taken.append(k)
        made.commit(0.01 * k, motion)
        wrench(made, motion, 0.01 * (k + 1))

    with pytest.raises(SimulationError, match=r"environment\.wind\[0\]: expected a finite velocity at t = "):
        any(map(take, range(20)))
    assert taken[-1] == step


def test_a_run_stops_with_the_reason(tmp_path: Path) -> None:
    settings = ["environment.wind=['log(0.0105 - t)',0,0]", "bus.transport=inprocess", "coupling.step=1e-3"]
    with pytest.raises(FaultError, match=r"step 11: .*environment\.wind\[0\]: expected a finite velocity"):
        linkwind.run(loads(PLATE, "scene", settings), tmp_path / "run", report=False)


# ---- the same bits ----


def test_transports_verification_and_resumption_keep_every_bit(tmp_path: Path) -> None:
    settings = [
        MANY,
        "time.end=0.05",
        "bodies.0.inertia=[1,1,1,0,0,0]",
        "coupling.step=1e-3",
        "aero.plate.strips=2",
    ]
    logs = {}
    for transport in ("zenoh", "inprocess"):
        scenario = loads(PLATE, "scene", [*settings, f"bus.transport={transport}"])
        logs[transport] = linkwind.run(scenario, tmp_path / transport, report=False).log
    log = logs["inprocess"]
    one, other = (linkwind.open_log(log).trajectory() for log in logs.values())
    for a, b in zip(one, other, strict=True):
        assert a.tobytes() == b.tobytes()
    assert abs(one.wrench[-1]).min() > 0.0
    assert linkwind.verify(log).identical
    resumed = linkwind.resume(log, tmp_path / "resumed", from_step=20, report=False).log
    again = linkwind.open_log(resumed).trajectory()
    assert again.wrench.tobytes() == one.wrench.tobytes()
    changed = linkwind.resume(
        log, tmp_path / "changed", from_step=20, overrides=["environment.wind.0=-3*t"], report=False
    ).log
    assert linkwind.verify(changed).identical
    after = linkwind.open_log(changed).trajectory()
    assert (after.wrench[:20] == one.wrench[:20]).all()
    assert (after.wrench[-1] != one.wrench[-1]).any()


def test_wind_at_takes_one_point_or_many() -> None:
    table = wind_table(loads(PLATE, "scene", [MANY]).environment, "scene")
    t, r, v = RNG.uniform(size=(2, 3)), RNG.normal(size=(2, 3, 3)), RNG.normal(size=(2, 3, 3))
    velocity, rate = wind_at(table, t, r, v)
    for i in np.ndindex(2, 3):
        one = wind_at(table, t[i], r[i], v[i])
        assert (one[0] == velocity[i]).all()
        assert (one[1] == rate[i]).all()
