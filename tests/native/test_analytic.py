"""Motions with a known solution, and what every motion conserves."""

import numpy as np
import pytest
from scipy.special import ellipj

from linkwind.native.multibody import Integrator, Multibody
from tests.native.mechanisms import Body, matrix, motion_of, random_added, random_state, random_tree, tables

TIGHT = {"integrator": Integrator.DOPRI5, "rtol": 1e-12, "atol": 1e-12}


def fly(multibody, state, h, steps, **options):
    """March without wrench; return all states."""
    states = [state]
    for _ in range(steps):
        no_load = np.zeros((1, multibody.n, 6))
        states.append(multibody.advance(states[-1], h, np.zeros(1), no_load, None, **options)[0])
    return states


def test_free_rigid_body_turns_as_jacobi_says():
    """Tennis racket: turning almost about the middle axis. Landau & Lifshitz, Mechanics, section 37."""
    i1, i2, i3 = 1.0, 2.0, 3.5
    multibody = Multibody(tables([Body(-1, "free", 1.3, np.diag([i1, i2, i3]))], (0, 0, 0)))
    w1, w3 = 2.0, 0.9  # omega 2 is zero at the start; close to the separatrix
    energy2, momentum = i1 * w1**2 + i3 * w3**2, (i1 * w1) ** 2 + (i3 * w3) ** 2
    assert momentum > energy2 * i2
    rate = np.sqrt((i3 - i2) * (momentum - energy2 * i1) / (i1 * i2 * i3))
    modulus = (i2 - i1) * (energy2 * i3 - momentum) / ((i3 - i2) * (momentum - energy2 * i1))
    assert modulus > 0.8
    amplitude2 = np.sqrt((energy2 * i3 - momentum) / (i2 * (i3 - i2)))
    state = multibody.initial_state([0, 0, 0, 1, 0, 0, 0], [0.1, 0.2, 0.3, w1, 0.0, w3])
    for k, got in enumerate(fly(multibody, state, 0.25, 80, **TIGHT)):
        sn, cn, dn, _ = ellipj(rate * 0.25 * k, modulus)
        np.testing.assert_allclose(got[10:13], [w1 * cn, amplitude2 * sn, w3 * dn], atol=2e-9)
        body_momentum = matrix(got[3:7]) @ (np.array([i1, i2, i3]) * got[10:13])
        np.testing.assert_allclose(body_momentum, [i1 * w1, 0.0, i3 * w3], atol=2e-9)
        np.testing.assert_allclose(got[:3], 0.25 * k * np.array([0.1, 0.2, 0.3]), atol=1e-9)


def test_spherical_pendulum():
    """Height from Jacobi's elliptic functions, Whittaker, Analytical Dynamics, section 55."""
    mass, length, across, g = 1.5, 0.8, 0.07, 9.81
    body = Body(-1, "spherical", mass, np.diag([across, across, 0.03]), child_point=(0, 0, length))
    multibody = Multibody(tables([body], (0, 0, -g)))
    inertia = across + mass * length**2
    tilt, swing = 0.4, 4.5  # from straight down; rotation about the vertical
    q = [np.cos(tilt / 2), np.sin(tilt / 2), 0.0, 0.0]
    lowest = -np.cos(tilt)  # height of the COM over the pivot, in lengths
    about_up = swing * np.sin(tilt) ** 2  # angular momentum about the vertical, over the inertia
    a = 2.0 * mass * g * length / inertia
    c = swing**2 * np.sin(tilt) ** 2 + a * lowest  # energy; heights solve (1 - u²)(c - a u) = about_up²
    roots = np.sort(np.roots([a, -c, -a, c - about_up**2]).real)
    assert roots[0] == pytest.approx(lowest, abs=1e-12)
    # start at the lowest point, without spin about the rod's own axis
    along, sideways = np.array([0, np.sin(tilt), -np.cos(tilt)]), np.array([0.0, 0.0, swing])
    omega = matrix(q).T @ (sideways - along * (along @ sideways))
    state = multibody.initial_state(q, omega)
    for k, got in enumerate(fly(multibody, state, 0.1, 100, **TIGHT)):
        argument = 0.5 * np.sqrt(a * (roots[2] - roots[0])) * 0.1 * k
        sn = ellipj(argument, (roots[1] - roots[0]) / (roots[2] - roots[0]))[0]
        height = roots[0] + (roots[1] - roots[0]) * sn**2
        assert motion_of(multibody, got).position[0, 2] / length == pytest.approx(height, abs=5e-9)


def test_iftomm_a01_simple_pendulum():
    """IFToMM benchmark library A01: released horizontally, 1 m; at t = 9.99 s."""
    body = Body(-1, "revolute", 1.0, np.zeros((3, 3)), child_point=(1.0, 0.0, 0.0))
    multibody = Multibody(tables([body]))
    state = multibody.initial_state([0.0], [0.0])
    np.testing.assert_allclose(motion_of(multibody, state).position[0], [-1.0, 0.0, 0.0], atol=1e-15)
    states = fly(multibody, state, 9.99 / 100, 100, **TIGHT)
    position = motion_of(multibody, states[-1]).position[0]
    np.testing.assert_allclose(position, [-0.3164364699, -0.9486137046, 0.0], atol=2e-9)


def momenta(bodies, motion):
    linear = sum(b.mass * v for b, v in zip(bodies, motion.linear, strict=True))
    angular = np.zeros(3)
    for i, body in enumerate(bodies):
        rotation = matrix(motion.orientation[i])
        angular += rotation @ body.inertia @ rotation.T @ motion.angular[i]
        angular += np.cross(motion.position[i], body.mass * motion.linear[i])
    return np.concatenate([linear, angular])


def floating_tree():
    """Six bodies with one free root."""
    rng = np.random.default_rng(21)
    bodies = [Body(-1, "free", 1.0, np.diag([0.2, 0.3, 0.4]))]
    for k, body in enumerate(random_tree(rng, 6)):
        body.parent = int(rng.integers(k + 1))
        bodies.append(body)
    return bodies, rng


@pytest.mark.parametrize(("integrator", "order"), [(Integrator.RK4, 4), (Integrator.DOPRI5, 5)])
def test_energy_and_momentum_are_conserved_to_the_order(integrator, order):
    bodies, rng = floating_tree()
    multibody = Multibody(tables(bodies, (0, 0, 0)))
    start = random_state(rng, multibody)
    before = np.append(momenta(bodies, motion_of(multibody, start)), sum(multibody.energy(start)))
    drift = []
    for steps in (50, 100):
        end = fly(multibody, start, 0.5 / steps, steps, integrator=integrator, rtol=1e9, atol=1e9)[-1]
        after = np.append(momenta(bodies, motion_of(multibody, end)), sum(multibody.energy(end)))
        drift.append(np.abs(after - before).max())
    assert drift[1] < 1e-5
    assert np.log2(drift[0] / drift[1]) > order - 0.3


def test_energy_balance_with_springs_dampers_and_added_inertia():
    """Change of energy = work of the whole wrench - what the dampers took."""
    rng = np.random.default_rng(4)
    bodies = random_tree(rng, 8, springs=True)
    multibody = Multibody(tables(bodies))
    state, added = random_state(rng, multibody), random_added(rng, 8, 0.3)
    wrenches, nodes = rng.normal(size=(2, 8, 6)), np.array([0.0, 1.0])
    end, (work, dissipated) = multibody.advance(state, 0.4, nodes, wrenches, added, **TIGHT)
    change = sum(multibody.energy(end)) - sum(multibody.energy(state))
    assert dissipated > 0.1
    assert change == pytest.approx(work - dissipated, abs=1e-9)


def test_chain_keeps_its_energy_over_a_long_run():
    links = [Body(k - 1, "revolute", 1.0, np.diag([0, 0, 0.1]), (0.5, 0, 0), (-0.5, 0, 0)) for k in range(5)]
    multibody = Multibody(tables(links))
    start = multibody.initial_state(np.zeros(5), np.zeros(5))
    end = fly(multibody, start, 1e-3, 5000, integrator=Integrator.RK4)[-1]
    size = multibody.energy(end)[0]
    assert sum(multibody.energy(end)) == pytest.approx(
        sum(multibody.energy(start)), abs=1e-6 * max(size, 1.0)
    )
