"""Force elements of scenarios move what they act on as their equations say, and account for their energy."""

import json
from itertools import pairwise

import numpy as np
import pytest

from linkwind.dynamics.methods import multibody
from linkwind.errors import LinkwindError, MechanismError, ScenarioError, SimulationError
from linkwind.expression import compile_program
from linkwind.mechanism import build
from linkwind.native.expressions import derivatives
from linkwind.native.multibody import Integrator
from linkwind.scenario import from_json
from linkwind.spatial import Motion

ROD = {"name": "arm", "mass": 2.0, "inertia": 0.3}
TIP = {"name": "tip", "mass": 0.7, "inertia": 0.05}
BALL = {"name": "ball", "mass": 2.0, "inertia": 0.1}
PIN = {"name": "pin", "type": "revolute", "parent": "world", "child": "arm", "child_point": [-0.5, 0.0]}
ELBOW = {"name": "elbow", "type": "revolute", "parent": "arm", "child": "tip"} | {
    "parent_point": [0.5, 0.0], "child_point": [-0.3, 0.0], "stiffness": 1.5, "damping": 0.1
}  # fmt: skip
RAIL = {"name": "rail", "type": "prismatic", "parent": "world", "child": "ball", "axis": [1, 0]}
FLAP = {"type": "motion", "name": "flap", "joint": "pin", "position": "0.8*sin(3*t)**2 + 0.1*t"}
NODE = np.zeros(1)


def scenario(bodies, joints, forces, **more):
    data = {"name": "case", "time": {"end": 1.0}, "bodies": bodies, "joints": joints, "forces": forces}
    return from_json(json.dumps(data | more), "case.toml")


class Run:
    """A mechanism that is advanced without fluid, with its work."""

    def __init__(self, case) -> None:
        mechanism = build(case)
        self.core = multibody(mechanism, case)
        self.state = self.core.initial_state(mechanism.q0, mechanism.v0)
        self.time, self.work = 0.0, np.zeros(2)
        self.start = self.energy()

    def energy(self) -> float:
        return sum(self.core.energy(self.state))

    def go(self, end, steps, integrator=Integrator.RK4, **options):
        h = (end - self.time) / steps
        begin, load = self.time, np.zeros((1, self.core.n, 6))
        for k in range(steps):
            self.state, work = self.core.advance(
                self.state, h, NODE, load, None, integrator=integrator, time=begin + k * h, **options
            )
            self.work += work
        self.time = end
        return self

    @property
    def residual(self) -> float:
        """What the balance of energy is off by."""
        return self.energy() - self.start - self.work[0] + self.work[1]

    def evaluate(self):
        return self.core.evaluate(self.state, np.zeros((self.core.n, 6)), time=self.time)

    @property
    def motion(self) -> Motion:
        found = Motion.at_rest(self.core.n)
        self.core.motion(self.state, found)
        return found


def test_an_actuator_drives_a_rail():
    """m a = F sin(w t) - c v from rest, in closed form."""
    motor = {"type": "actuator", "name": "motor", "joint": "rail", "force": "3*sin(2*t) - 0.8*v"}
    run = Run(scenario([BALL], [RAIL], [motor], environment={"gravity": [0, 0]}))
    m, f, w, c, t = 2.0, 3.0, 2.0, 0.8, 1.7
    a, rate = f / (m**2 * w**2 + c**2), c / m
    speed = a * (c * np.sin(w * t) - m * w * np.cos(w * t) + m * w * np.exp(-rate * t))
    run.go(t, 100)
    assert run.core.coordinates(run.state)[1][0] == pytest.approx(speed, abs=1e-8)
    assert run.work[0] == pytest.approx(0.5 * m * speed**2, abs=1e-8)
    effort = f * np.sin(w * t) - c * speed
    assert run.evaluate().effort[0] == pytest.approx(effort, abs=1e-7)
    assert run.evaluate().power[0] == pytest.approx(effort * speed, abs=1e-7)


def test_a_prescribed_pendulum_takes_the_torque_of_the_formula():
    """tau = (I + m l²) q'' + m g l cos q, with q'' by hand; q and v are the expression to the last bit."""
    run = Run(scenario([ROD], [PIN], [FLAP])).go(0.9, 50)
    t = 0.9
    q, v = 0.8 * np.sin(3 * t) ** 2 + 0.1 * t, 2.4 * np.sin(6 * t) + 0.1
    turn = 14.4 * np.cos(6 * t)
    got_q, got_v = (values[0] for values in run.core.coordinates(run.state))
    assert (got_q, got_v) == (pytest.approx(q, abs=1e-15), pytest.approx(v, abs=1e-14))
    result = run.evaluate()
    torque = (0.3 + 2.0 * 0.25) * turn + 2.0 * 9.81 * 0.5 * np.cos(q)
    assert result.joint_acceleration[0] == pytest.approx(turn, abs=1e-12)
    assert result.effort[0] == pytest.approx(torque, abs=1e-12)
    assert result.reaction[0, 5] == pytest.approx(torque, abs=1e-12)
    assert result.power[0] == pytest.approx(torque * v, abs=1e-11)


def test_what_hangs_on_a_prescribed_joint_moves_as_under_the_torque_that_it_takes():
    """The mechanism with an actuator in place of the motion, driven by the torque that this reported."""
    moved = Run(scenario([ROD, TIP], [PIN, ELBOW], [FLAP])).go(0.4, 40)
    result = moved.evaluate()
    motor = {"type": "actuator", "name": "motor", "joint": "pin", "force": repr(float(result.effort[0]))}
    free = Run(scenario([ROD, TIP], [PIN, ELBOW], [motor]))
    free.state, free.time = moved.state, moved.time
    driven = free.evaluate()
    for name in ("joint_acceleration", "acceleration", "reaction", "power"):
        np.testing.assert_allclose(getattr(driven, name), getattr(result, name), atol=1e-11)


FORCES = {
    "motion": [FLAP],
    "actuator": [{"type": "actuator", "name": "a", "joint": "elbow", "force": "sin(5*t) - 0.3*q**2*v"}],
    "spring": [
        {"type": "spring", "name": "s", "parent": "world", "child": "tip", "parent_point": [1.5, 1.0]}
        | {"stiffness": 8.0, "damping": 0.4, "force": "2*(length - 1)**3*cos(3*t) + 0.1*rate**2"}
    ],
    "point_force": [
        {"type": "point_force", "name": "p", "body": "tip", "point": [0.2, 0.1], "frame": "body"}
        | {"let": {"wave": "sin(4*t)"}, "fy": "3*wave - 0.2*vx*theta", "tz": "-0.1*wz"}
    ],
    "buoyancy": [{"type": "buoyancy", "name": "b", "body": "tip", "point": [0.1, 0.05]}
        | {"volume": 5e-4, "density": 1000.0}],
}  # fmt: skip
FORCES["all"] = [{**force, "name": f"f{i}"} for i, each in enumerate(FORCES.values()) for force in each]


@pytest.mark.parametrize("kind", FORCES)
def test_every_element_keeps_the_order_of_rk4_and_the_balance_of_energy(kind):
    case = scenario([ROD, TIP], [PIN, ELBOW], FORCES[kind])
    exact = Run(case).go(0.5, 5, Integrator.DOPRI5, rtol=1e-12, atol=1e-13)
    assert abs(exact.residual) < 1e-9
    errors, residuals = [], []
    for steps in (20, 40):
        run = Run(case).go(0.5, steps)
        errors.append(np.abs(run.state - exact.state)[:4].max())
        residuals.append(abs(run.residual))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.5)
    assert residuals[1] < max(residuals[0] / 8.0, 1e-6)


@pytest.mark.parametrize("integrator", [Integrator.EULER, Integrator.SEMI_IMPLICIT_EULER])
def test_first_order_with_expressions_of_time(integrator):
    case = scenario([ROD, TIP], [PIN, ELBOW], FORCES["all"])
    exact = Run(case).go(0.3, 3, Integrator.DOPRI5, rtol=1e-12, atol=1e-13)
    errors = [np.abs(Run(case).go(0.3, n, integrator).state - exact.state)[:4].max() for n in (200, 400)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("substeps", [1, 3])
def test_substeps_are_steps_at_their_times(substeps):
    case = scenario([ROD, TIP], [PIN, ELBOW], FORCES["all"])
    one = Run(case).go(0.25, 4 * substeps)
    many = Run(case).go(0.25, 4, substeps=substeps)
    np.testing.assert_allclose(many.state, one.state, atol=1e-14)


def test_bodies_with_joints_as_forces_move_alike():
    forces = [force for force in FORCES["all"] if force["type"] != "motion"]
    runs = []
    for method in ("reduced", "cfe"):
        run = Run(scenario([ROD, TIP], [PIN, ELBOW], forces, dynamics={"method": method})).go(0.2, 400)
        result = run.evaluate()
        assert abs(run.residual) < 1e-6
        runs.append((run.motion.position, run.motion.linear, result.effort, result.power, run.work))
    for got, expected in zip(*runs, strict=True):
        np.testing.assert_allclose(got, expected, atol=2e-6)


def link(name, parent, child, at, on):
    points = {"parent_point": [at, 0], "child_point": [on, 0]}
    return {"name": name, "parent": parent, "child": child} | points


def test_a_prescribed_crank_drives_a_loop():
    """A four-bar whose crank turns evenly: the loop stays closed, and power is what goes into the energy."""
    bodies = [
        {"name": "crank", "mass": 1.0, "inertia": 0.1},
        {"name": "rod", "mass": 1.0, "inertia": 0.3},
        {"name": "rocker", "mass": 1.0, "inertia": 0.2},
    ]
    joint = {"type": "revolute", "parent": "world"}
    joints = [
        joint | {"name": "a", "child": "crank", "child_point": [-0.5, 0]},
        joint
        | {"name": "b", "parent": "crank", "child": "rod"}
        | {"parent_point": [0.5, 0], "child_point": [-1, 0]},
        joint | {"name": "d", "child": "rocker", "parent_point": [2.0, 0], "child_point": [-0.75, 0]},
        joint
        | {"name": "c", "parent": "rod", "child": "rocker"}
        | {"parent_point": [1, 0], "child_point": [0.75, 0]},
    ]
    drive = {"type": "motion", "name": "drive", "joint": "a", "position": "1.2 + 4*t + 0.2*sin(6*t)"}
    run = Run(scenario(bodies, joints, [drive]))
    assert run.core.coordinates(run.state)[0][0] == pytest.approx(1.2, abs=1e-12)
    run.go(0.5, 100)
    assert run.core.joint_gap(run.motion) < 1e-13
    assert run.core.coordinates(run.state)[0][0] == 1.2 + 4 * 0.5 + 0.2 * np.sin(6 * 0.5)
    assert abs(run.residual) < 1e-7
    assert abs(run.work[0]) > 1.0
    before, h = run.energy(), 1e-5
    power = run.evaluate().power[0]
    after = run.go(run.time + h, 1).energy()
    assert (after - before) / h == pytest.approx(0.5 * (power + run.evaluate().power[0]), rel=1e-5)


def test_a_buoyant_body_bobs_on_its_tether():
    """A ball lighter than the fluid it displaces on a spring above it: w² = k / m about the balance."""
    g, volume, density, k = 9.81, 4e-3, 1000.0, 50.0
    spring = {
        "type": "spring",
        "name": "tether",
        "parent": "world",
        "child": "ball",
        "stiffness": k,
        "rest": 0.5,
    }
    float_ = {"type": "buoyancy", "name": "float", "body": "ball", "volume": volume, "density": density}
    start = BALL | {"position": [0.0, 1.0]}
    run = Run(scenario([start], [], [spring, float_]))
    lifted = (density * volume - 2.0) * g
    balance, t = 0.5 + lifted / k, 0.7
    height = balance + (1.0 - balance) * np.cos(np.sqrt(k / 2.0) * t)
    run.go(t, 400)
    assert run.motion.position[0, 1] == pytest.approx(height, abs=1e-8)
    assert run.evaluate().effort[1] == pytest.approx(density * volume * g)
    assert run.work.tolist() == [0.0, 0.0]
    assert abs(run.residual) < 1e-7


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ({"type": "ellipse", "length": 0.4, "width": 0.1, "span": 2.0}, np.pi * 0.2 * 0.05 * 2.0),
        ({"type": "ellipsoid", "size": [0.4, 0.1, 2.0]}, 4.0 / 3.0 * np.pi * 0.2 * 0.05 * 1.0),
    ],
)
def test_the_volume_is_that_of_the_shape_and_the_fluid_that_of_the_environment(shape, expected):
    case = scenario([BALL | {"shape": shape}], [], [{"type": "buoyancy", "name": "b", "body": "ball"}])
    volume, density, _ = build(case).tables.force_number[0]
    assert (volume, density) == (pytest.approx(expected), 1.225)


def test_a_force_at_a_point_is_a_force_and_its_moment():
    push = {"type": "point_force", "name": "push", "body": "ball", "point": [0.3, -0.2]}
    for frame, angle in (("world", 0.0), ("body", 40.0)):
        forces = [push | {"frame": frame, "fx": 2.0, "fy": "-1", "tz": "0.5 + 0*x"}]
        run = Run(scenario([BALL | {"angle_deg": angle}], [], forces, environment={"gravity": [0, 0]}))
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        force = np.array([[c, -s], [s, c]]) @ [2.0, -1.0]
        result = run.evaluate()
        np.testing.assert_allclose(result.acceleration[0, :2], force / 2.0, atol=1e-14)
        moment = 0.3 * -1.0 - -0.2 * 2.0 + 0.5
        assert result.acceleration[0, 5] == pytest.approx(moment / 0.1, abs=1e-12)
        assert result.effort[0] == pytest.approx(np.sqrt(5.0))


def test_theta_goes_on_beyond_a_turn():
    """The torque that theta gives on a pendulum that has turned twice is that of its coordinate."""
    force = {"type": "point_force", "name": "p", "body": "arm", "tz": "theta"}
    run = Run(scenario([ROD | {"angle_deg": 800.0}], [PIN], [force], environment={"gravity": [0, 0]}))
    turn = run.evaluate().joint_acceleration[0]
    assert turn == pytest.approx(np.radians(800.0) / (0.3 + 0.5), rel=1e-12)


# ---- tables ----

TABLE = [[0.0, 1.0], [0.5, 3.0], [1.0, -2.0], [2.0, 1.0]]


def effort(table, t):
    motor = {"type": "actuator", "name": "motor", "joint": "rail", "force": table}
    run = Run(scenario([BALL], [RAIL], [motor]))
    run.time = t
    return run.evaluate().effort[0]


def test_a_linear_table_is_numpys_interpolation():
    for t in (-1.0, 0.0, 0.2, 0.5, 0.9, 1.7, 2.0, 5.0):
        assert effort({"table": TABLE}, t) == pytest.approx(np.interp(t, *np.array(TABLE).T), abs=1e-14)
        again = {"table": TABLE, "periodic": True}
        assert effort(again, t) == pytest.approx(np.interp(t % 2.0, *np.array(TABLE).T), abs=1e-13)


def test_a_cubic_table_goes_through_its_points_and_never_beyond():
    cubic = {"table": TABLE, "interpolation": "cubic"}
    for t, value in TABLE:
        assert effort(cubic, t) == pytest.approx(value, abs=1e-14)
    for (t0, low), (t1, high) in pairwise(TABLE):
        values = [effort(cubic, t) for t in np.linspace(t0, t1, 20)]
        assert min(low, high) - 1e-12 <= min(values)
        assert max(values) <= max(low, high) + 1e-12
    slopes = [(effort(cubic, t + 1e-6) - effort(cubic, t - 1e-6)) / 2e-6 for t in (0.5 - 1e-5, 0.5 + 1e-5)]
    assert slopes[0] == pytest.approx(slopes[1], abs=2e-3)


def test_a_motion_may_be_a_table_that_begins_again():
    table = {"table": [[0, 0.0], [0.25, 1.0], [0.5, 0.0], [0.75, -1.0], [1, 0.0]]}
    flap = FLAP | {"position": table | {"interpolation": "cubic", "periodic": True}}
    runs = [Run(scenario([ROD], [PIN], [flap])).go(2.25, steps) for steps in (90, 180)]
    assert runs[0].core.coordinates(runs[0].state)[0][0] == pytest.approx(1.0, abs=1e-14)
    # The acceleration has steps at the points, so that the work is of first order there.
    assert abs(runs[1].residual) < 0.6 * abs(runs[0].residual)


def law(position, end=1.0):
    """What a motion is at a time: value, rate, acceleration."""
    flap = FLAP | {"position": position}
    tables = build(scenario([ROD], [PIN], [flap], time={"end": end})).tables
    return lambda t: derivatives(tables.force_code, tables.force_constants, t)


def sine(count, periodic=True):
    """Rows of a sine over a period, whose last value is not quite 0."""
    t = np.linspace(0.0, 1.0, count)
    return {"table": np.transpose([t, np.sin(2.0 * np.pi * t + 0.3)]).tolist(), "periodic": periodic}


def test_a_motion_by_table_has_the_acceleration_of_the_curve():
    """Peak acceleration of a sine, 4 pi²; a monotone cubic through the 51 rows has more than twice that."""
    times = np.linspace(0.0, 2.0, 4001)
    peaks = []
    for more in ({}, {"interpolation": "cubic"}):
        at = law(sine(51) | more)
        peaks.append(max(abs(at(t)[2]) for t in times) / (4.0 * np.pi**2))
    assert peaks[0] == pytest.approx(1.0, abs=0.005)
    assert peaks[1] > 2.0


@pytest.mark.parametrize("periodic", [True, False])
def test_a_spline_is_of_fourth_order_up_to_its_ends(periodic):
    times = np.linspace(0.0, 1.0, 801)
    exact = np.sin(2.0 * np.pi * times + 0.3)
    errors = []
    for count in (51, 101, 201):
        at = law(sine(count, periodic))
        errors.append(np.abs([at(t)[0] for t in times] - exact).max())
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(4.0, abs=0.25)


def test_a_spline_through_a_cubic_is_the_cubic():
    """Not a knot: no error, with rows at any distances; of three rows the parabola, of two the line."""
    for degree, places in ((3, [0.0, 0.1, 0.4, 0.5, 0.85, 1.0]), (3, [0.0, 0.3, 0.4, 1.0]),
                           (2, [0.0, 0.4, 1.0]), (1, [0.0, 1.0])):  # fmt: skip
        curve = np.polynomial.Polynomial([0.3, -1.0, 2.0, -4.0][: degree + 1])
        at = law({"table": [[t, curve(t)] for t in places]})
        for t in (0.0, 0.05, 0.4, 0.7, 1.0):
            expected = [curve(t), curve.deriv()(t), curve.deriv(2)(t)]
            np.testing.assert_allclose(at(t), expected, atol=1e-11)


def test_a_spline_that_begins_again_has_no_jump():
    """Two derivatives from both sides of each row, at uneven places, and at the seam; also of two pieces."""
    for places in ([0.0, 0.1, 0.45, 0.6, 1.0], [0.0, 0.3, 1.0]):
        values = [*[0.2, 1.0, -0.5, 0.1][: len(places) - 1], 0.2]
        at = law({"table": list(map(list, zip(places, values, strict=True))), "periodic": True})
        for t in (*places[1:], 7.0 + places[1]):
            before, after = at(t - 1e-9), at(t + 1e-9)
            np.testing.assert_allclose(before, after, atol=1e-5)


def test_a_motion_keeps_its_rate_at_the_end_of_the_run():
    """Sums of steps may pass the last row by round-off: 3 * 0.1 > 0.3."""
    at = law({"table": [[0.0, 0.0], [0.1, 0.1], [0.2, 0.2], [0.3, 0.3]]}, end=0.3)
    assert 3 * 0.1 > 0.3
    assert at(3 * 0.1)[1] == pytest.approx(1.0, abs=1e-12)


def test_a_motion_that_rests_is_held():
    """Half a cosine and a last row for the rest: flat there and after, of fourth order before."""
    errors = []
    for count in (11, 21, 41):
        t = np.linspace(0.0, 0.5, count)
        rows = np.transpose([t, 1.0 - np.cos(2.0 * np.pi * t)]).tolist()
        at = law({"table": [*rows, [0.6, 2.0]]}, end=5.0)
        for after in (0.5, 0.55, 0.6, 3.0):
            assert at(after)[:2] == (2.0, 0.0)
        inside = np.linspace(0.2, 0.4999, 300)
        errors.append(max(abs(at(s)[0] - 1.0 + np.cos(2.0 * np.pi * s)) for s in inside))
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(4.0, abs=0.3)


def test_what_should_begin_again_does_but_for_round_off():
    """sin(2 pi) is -2e-16: the last value becomes the first; what is more than round-off is refused."""
    t = np.linspace(0.0, 1.0, 21)
    rows = np.transpose([t, np.sin(2.0 * np.pi * t)]).tolist()
    assert rows[-1][1] != rows[0][1]
    case = scenario([ROD], [PIN], [FLAP | {"position": {"table": rows, "periodic": True}}])
    assert case.forces[0].position.table[-1] == (1.0, 0.0)
    assert case.forces[0].position.table[:-1] == tuple(map(tuple, rows[:-1]))
    assert from_json(case.to_json()) == case
    rows[-1][1] = 1e-8
    with pytest.raises(ScenarioError, match=r"table\[20\]: expected the first value again, 0\.0"):
        scenario([ROD], [PIN], [FLAP | {"position": {"table": rows, "periodic": True}}])


@pytest.mark.parametrize(
    ("table", "got"),
    [
        ([[0.0, 0.0], [0.5, 1.0]], r"got 0\.0 to 0\.5 s, with a rate of 2 at 0\.5 s\. Add rows, repeat it"),
        ([[0.2, 0.0], [1.0, 1.6]], r"got 0\.2 to 1\.0 s, with a rate of 2 at 0\.2 s\."),
        ([[0.0, 0.0], [0.4, 0.2], [0.8, 0.8]], r"with a rate of 2 at 0\.8 s\."),
    ],
)
def test_a_motion_that_would_stop_dead_is_refused(table, got):
    with pytest.raises(MechanismError, match=r'forces\[0\] "flap"\.position\.table: expected times .*' + got):
        build(scenario([ROD], [PIN], [FLAP | {"position": {"table": table}}]))


def test_a_spring_by_table_is_the_spring():
    spring = {"type": "spring", "name": "s", "parent": "world", "child": "ball"}
    start = BALL | {"position": [1.0, 0.5]}
    table = {"table": [[0.0, -10.0], [3.0, 20.0]]}  # 10 (length - 1)
    ends = []
    for more in ({"stiffness": 10.0, "rest": 1.0}, {"force": table}):
        run = Run(scenario([start], [], [spring | more])).go(0.3, 60)
        assert abs(run.residual) < 1e-7
        ends.append(run.motion.position)
    np.testing.assert_allclose(*ends, atol=1e-13)


# ---- derivatives ----


@pytest.mark.parametrize(
    "text",
    ["sin(t)*cos(2*t) + tan(t/3)", "exp(-t)*log(1 + t)", "sqrt(1 + t**2)/(2 + t)", "asin(t/3) + acos(t/4)",
     "atan(t) - atan2(t, 1 + t*t)", "sinh(t/2)*cosh(t/3) + tanh(t)", "t**5 - t**-2 + (1 + t)**1.5",
     "(1 + t)**sin(t)", "hypot(t, 1 + t**2)", "min(t, 2)*max(t**2, 0.1)", "abs(-t)*t - -t", "2**t"],
)  # fmt: skip
def test_derivatives_of_expressions_are_those_of_differences(text):
    program = compile_program({}, {"f": text}, "item", variables=("t",), components=("f",))
    for t in (0.4, 1.3):
        value, rate, change = derivatives(program.code, program.constants, t)
        h = 1e-3
        f = [derivatives(program.code, program.constants, t + k * h)[0] for k in (-2, -1, 0, 1, 2)]
        assert value == f[2]
        assert rate == pytest.approx((f[0] - 8 * f[1] + 8 * f[3] - f[4]) / (12 * h), rel=1e-8, abs=1e-8)
        second = (-f[0] + 16 * f[1] - 30 * f[2] + 16 * f[3] - f[4]) / (12 * h**2)
        assert change == pytest.approx(second, rel=1e-6, abs=1e-6)


# ---- refusals ----

MOTOR = {"type": "actuator", "name": "motor", "joint": "pin", "force": "0"}


@pytest.mark.parametrize(
    ("forces", "message"),
    [
        ([MOTOR | {"joint": "pim"}], r'forces\[0\] "motor"\.joint: expected one of the joints .*Use "pin"'),
        ([MOTOR | {"force": {}}], r'forces\[0\] "motor"\.force: expected an expression or a table; got '
         r'neither'),
        ([MOTOR | {"force": {"table": [[0, 0], [0, 1]]}}], r"force\.table\[1\]: expected a variable above"),
        ([MOTOR | {"force": {"table": [[0, 0]]}}], r"force\.table: expected at least one entry"),
        ([MOTOR | {"force": {"table": [[0, 0], [1, 1]], "periodic": True}}], r"\[1\]: expected the first"),
        ([MOTOR | {"coordinate": 1}], r'forces\[0\] "motor"\.coordinate: expected 0, because a revolute'),
        ([MOTOR | {"force": "2*x"}], r'forces\[0\] "motor"\.force: column 3: expected one of t, q, v'),
        ([FLAP | {"position": "sin(x)"}], r'expected one of t, pi; got "x"\. Use one of these\.'),
        ([FLAP | {"position": "sin(t"}], r'forces\[0\] "flap"\.position: expected an expression'),
        ([FLAP | {"position": "log(t)"}], r'forces\[0\] "flap"\.position: expected a number with a rate'),
        ([FLAP | {"position": {"table": [[0, 0], [1, 1]], "interpolation": "linear"}}],
         r'interpolation: expected "spline"'),
        ([FLAP, FLAP | {"name": "g"}], r'forces\[1\] "g"\.joint: expected a coordinate without another '
         r'motion'),
        ([{"type": "buoyancy", "name": "b", "body": "arm"}], r'forces\[0\] "b"\.volume: .*arm has no shape'),
        ([{"type": "sprung", "name": "b"}], r'forces\[0\] "b"\.type: expected one of spring, actuator'),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused(forces, message):
    with pytest.raises(LinkwindError, match=message):
        build(scenario([ROD], [PIN], forces))


def test_a_motion_of_a_joint_without_single_coordinates_is_refused():
    ball, flight = PIN | {"type": "spherical"}, PIN | {"type": "free", "child_point": [0.0, 0.0]}
    solid = ROD | {"inertia": [0.1, 0.2, 0.3, 0, 0, 0]}
    for joint in (ball, flight):
        with pytest.raises(
            MechanismError, match=r'forces\[0\] "flap"\.joint: expected a revolute, .*which is (sph|free)'
        ):
            build(scenario([solid], [joint], [FLAP]))


def test_a_motion_against_the_stated_start_is_refused():
    with pytest.raises(MechanismError, match="expected an orientation at which pin stands at 0°"):
        build(scenario([ROD | {"angle_deg": 30.0}], [PIN], [FLAP]))


def test_a_motion_of_a_joint_with_a_stop_is_refused():
    with pytest.raises(ScenarioError, match=r"\.joint: expected a joint to which nothing else"):
        scenario([ROD], [PIN | {"stop": [-1.0, 1.0]}], [FLAP])


def test_cfe_refuses_a_motion():
    case = scenario([ROD], [PIN], [FLAP], dynamics={"method": "cfe"})
    with pytest.raises(MechanismError, match=r'force "flap": expected a spring, an actuator.*got a motion'):
        multibody(build(case), case)


def test_an_expression_without_a_value_names_its_element():
    run = Run(scenario([ROD], [PIN], [MOTOR | {"force": "1/(t - 0.5)"}]))
    with pytest.raises(SimulationError, match=r'force "motor": expected a finite number.* 0\.05 s into'):
        run.go(0.45, 9).go(0.55, 1)
