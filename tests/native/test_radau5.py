"""The implicit integrator: stiff joints, its stability function, where Newton's method fails."""

import numpy as np
import pytest

from linkwind.errors import SimulationError
from linkwind.native.multibody import Integrator, Multibody
from tests.native.mechanisms import Body, motion_of, random_added, random_tree, tables

HELD = np.zeros(1)
RADAU5 = {"integrator": Integrator.RADAU5}
ROD = np.diag([0.0, 0.01, 0.01])


def fly(multibody, state, h, steps, **options):
    work = np.zeros(2)
    for _ in range(steps):
        state, done = multibody.advance(state, h, HELD, np.zeros((1, multibody.n, 6)), None, **options)
        work += done
    return state, work


def stability(z):
    """R of Radau IIA with three stages: the Padé approximation of exp with degrees 2 and 3."""
    return (1 + 2 / 5 * z + z**2 / 20) / (1 - 3 / 5 * z + 3 / 20 * z**2 - z**3 / 60)


@pytest.mark.parametrize("damping", [1.0, 1e2, 1e5, 1e8])
def test_a_damper_decays_by_the_stability_function(damping):
    """L-stable: however stiff it is, hardly anything is left after a step."""
    multibody = Multibody(tables([Body(-1, "prismatic", 2.0, damping=damping)], (0, 0, 0)))
    start = multibody.initial_state([0.0], [3.0])
    end, (_, dissipated) = fly(multibody, start, 0.1, 1, **RADAU5)
    left = stability(-0.1 * damping / 2.0)
    assert end[1] == pytest.approx(3.0 * left, abs=1e-13)
    assert abs(left) <= 3.1 * 20 / max(damping, 20.0)
    assert end[0] == pytest.approx(2.0 / damping * (3.0 - end[1]), rel=1e-7)  # momentum: m Δv = -c Δx
    if damping == 1.0:  # where the step resolves the decay
        assert dissipated == pytest.approx(9.0 - end[1] ** 2, rel=1e-6)


@pytest.mark.parametrize("stiffness", [1.0, 1e3, 1e8])
def test_a_spring_swings_by_the_stability_function(stiffness):
    multibody = Multibody(tables([Body(-1, "prismatic", 1.0, stiffness=stiffness)], (0, 0, 0)))
    rate, h = np.sqrt(stiffness), 0.01
    end, _ = fly(multibody, multibody.initial_state([0.1], [0.0]), h, 1, **RADAU5)
    turned = 0.1 * stability(1j * h * rate)
    assert end[0] == pytest.approx(turned.real, abs=1e-15)
    assert end[1] == pytest.approx(-rate * turned.imag, abs=1e-14 * rate)


def flail(joint, stiffness, damping):
    """A pendulum of two rods whose middle joint is stiff."""
    bodies = [
        Body(-1, "revolute", 1.0, ROD + np.diag([0, 0, 0.0]), (0, 0, 0), (-0.5, 0, 0)),
        Body(0, joint, 1.0, ROD + np.diag([1e-3, 0, 0]), (0.5, 0, 0), (-0.5, 0, 0)),
    ]
    if joint != "fixed":
        bodies[1].stiffness, bodies[1].damping = stiffness, damping
    return Multibody(tables(bodies))


@pytest.mark.parametrize("joint", ["revolute", "spherical"])
@pytest.mark.parametrize("damping", [0.0, 1e-5])
def test_a_stiff_joint_at_steps_a_hundred_times_too_long_for_rk4(joint, damping):
    """k = 1e8 N·m/rad bends the pendulum by 1e-7 rad; what is left is the swing of the rigid one."""
    stiffness, h = 1e8, 1e-2
    multibody, rigid = flail(joint, stiffness, damping * stiffness), flail("fixed", 0, 0)
    q = np.zeros(multibody.nq)
    q[0], q[1] = 0.3, float(joint == "spherical")
    start = multibody.initial_state(q, np.eye(multibody.nv)[0] * 2.0)
    still = multibody.evaluate(start, np.zeros((2, 6))).joint_acceleration
    bent = q.copy()
    bent[-1] += 1e-6
    bent = multibody.initial_state(bent, start[multibody.nq : -1])
    pulled = multibody.evaluate(bent, np.zeros((2, 6))).joint_acceleration
    angle = 2e-6 if joint == "spherical" else 1e-6  # twice the part of the quaternion
    square = abs(pulled[-1] - still[-1]) / angle
    assert h > 100 * 2.83 / np.sqrt(square)  # the end of RK4's stability on the imaginary axis
    end, _ = fly(multibody, start, h, 200, **RADAU5)
    exact, _ = fly(rigid, rigid.initial_state(np.array([0.3]), np.array([2.0])), h, 200, **RADAU5)
    assert np.abs(motion_of(multibody, end).position - motion_of(rigid, exact).position).max() < 1e-6
    with pytest.raises(SimulationError):
        fly(multibody, start, h, 200, integrator=Integrator.RK4)


def test_it_agrees_with_dopri5_on_a_stiff_tree_with_every_joint():
    """Springs and dampers a thousand times stiffer than in the other tests, at steps of the slow motion."""
    rng = np.random.default_rng(5)
    bodies = random_tree(rng, 6, springs=True)
    for body in bodies:
        body.stiffness, body.damping = 1e3 * np.asarray(body.stiffness), 1e3 * np.asarray(body.damping)
    multibody, added = Multibody(tables(bodies)), random_added(rng, 6, 0.1)
    rest = np.concatenate([body.rest for body in bodies])
    start = multibody.initial_state(rest, rng.normal(size=multibody.nv))
    wrench = rng.normal(size=(1, 6, 6)) * 10.0
    ends, tight = [], {"integrator": Integrator.DOPRI5, "rtol": 1e-11, "atol": 1e-11}
    for options in (RADAU5 | {"substeps": 2000}, tight):
        state, work = multibody.advance(start, 0.5, HELD, wrench, added, **options)
        change = sum(multibody.energy(state)) - sum(multibody.energy(start))
        ends.append((state[:-1], work))
    assert np.abs(ends[0][0] - ends[1][0]).max() < 1e-7
    assert np.abs(ends[0][1] - ends[1][1]).max() < 1e-4 * np.abs(ends[1][1]).max()
    assert change == pytest.approx(ends[1][1][0] - ends[1][1][1], rel=1e-6)


def test_it_says_where_newton_does_not_converge():
    """A step in which a pendulum would go round several times."""
    bodies = [Body(-1, "revolute", 1.0, ROD, (0, 0, 0), (-0.5, 0, 0)),
              Body(0, "revolute", 1.0, ROD, (0.5, 0, 0), (-0.5, 0, 0))]  # fmt: skip
    multibody = Multibody(tables(bodies), ["arm", "rod"])
    state = multibody.initial_state(np.array([0.3, 1.0]), np.array([20.0, -30.0]))
    message = r'joint of body "(arm|rod)": expected Newton.* to converge; .*Take more substeps'
    with pytest.raises(SimulationError, match=message):
        multibody.advance(state, 1.0, HELD, np.zeros((1, 2, 6)), None, **RADAU5)
    multibody.advance(state, 1.0, HELD, np.zeros((1, 2, 6)), None, **RADAU5, substeps=100)


def test_the_memory_of_its_matrices_is_taken_when_it_is_asked_for():
    multibody = Multibody(tables([Body(i - 1, "revolute", 1.0, ROD + np.eye(3)) for i in range(300)]))
    own = multibody._memory.nbytes
    assert own < 1e6  # less than one matrix of (300 + 300)² would be
    fly(multibody, multibody.initial_state(np.zeros(300), np.zeros(300)), 1e-3, 1, integrator=Integrator.RK4)
    assert multibody._stages.nbytes == 0
