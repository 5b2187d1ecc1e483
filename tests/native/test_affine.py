"""Wrenches that are affine in the twist at the end of the step."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from linkwind.errors import SimulationError
from linkwind.native.multibody import Integrator, Multibody
from linkwind.spatial import Motion
from tests.native.mechanisms import Body, rest_of, tables

H = 1e-3
HELD = np.zeros(1)
RK4 = {"integrator": Integrator.RK4}


def twist(multibody, state):
    motion = Motion.at_rest(multibody.n)
    multibody.motion(state, motion)
    return np.hstack([motion.linear, motion.angular])


def chain(rng, count=4):
    joints = ["free", "revolute", "spherical", "prismatic"]
    bodies = [
        Body(
            parent=i - 1,
            joint=joints[i % 4],
            mass=rng.uniform(0.5, 2.0),
            inertia=np.diag(rng.uniform(0.2, 0.3, 3)),
            parent_point=tuple(rng.uniform(-0.3, 0.3, 3)),
            child_point=tuple(rng.uniform(-0.3, 0.3, 3)),
        )
        for i in range(count)
    ]
    multibody = Multibody(tables(bodies))
    q = np.concatenate([rest_of(body) for body in bodies])
    return multibody, multibody.initial_state(q, rng.normal(size=multibody.nv))


def positive(rng, size, scale):
    root = rng.normal(size=(size, size)) * np.sqrt(scale / size)
    return root @ root.T


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("nodes", [[0.0], [1.0, 0.0], [1.0, 0.0, -1.0, -2.0]])
@pytest.mark.parametrize("scale", [1.0, 1e3, 1e5])
def test_the_wrench_agrees_with_the_twist_that_it_leads_to(seed, nodes, scale):
    rng = np.random.default_rng(seed)
    multibody, state = chain(rng)
    m = 6 * multibody.n
    response, about = positive(rng, m, scale), rng.normal(size=(multibody.n, 6))
    wrenches = rng.normal(size=(len(nodes), multibody.n, 6))
    nodes = np.array(nodes)
    new, work, met = multibody.advance_affine(state, H, nodes, wrenches, None, response, about, **RK4)
    end = twist(multibody, new)
    expected = wrenches[0].ravel() - response @ (end - about).ravel()
    size = np.abs(response) @ np.abs(end - about).ravel() + 1.0
    np.testing.assert_array_less(np.abs(met.wrench.ravel() - expected), 1e-11 * size)

    wrenches[0] = met.held  # the same step without anything affine in it
    again, work_again = multibody.advance(state, H, nodes, wrenches, met.added_inertia, **RK4)
    assert again.tobytes() == new.tobytes()
    assert work_again.tobytes() == work.tobytes()


@pytest.mark.parametrize("mass", [10.0, 1.0, 0.01, 0.0])
def test_a_body_in_a_viscous_fluid_steps_by_the_implicit_formula(mass):
    """m (v₁ − v₀) = h (F + m g − c (v₁ − v*)) for one body, by hand, down to no mass at all."""
    multibody = Multibody(tables([Body(mass=mass, inertia=mass * np.eye(3))]))
    v0, about, c, force = 2.0, 0.7, 3.0, 5.0
    state = multibody.initial_state(np.array([0, 0, 0, 1.0, 0, 0, 0]), np.array([0, v0, 0, 0, 0, 0.0]))
    response = np.diag([c] * 6)
    wrench, at = np.zeros((1, 1, 6)), np.zeros((1, 6))
    wrench[0, 0, 1], at[0, 1] = force, about
    new, _, met = multibody.advance_affine(state, H, HELD, wrench, None, response, at, **RK4)
    v1 = (mass * v0 + H * (force - 9.81 * mass + c * about)) / (mass + H * c)
    assert twist(multibody, new)[0, 1] == pytest.approx(v1, rel=1e-13)
    assert met.wrench[0, 1] == pytest.approx(force - c * (v1 - about), rel=1e-12)


def lost_impulse(h):
    """Momentum gained in a step less the impulse of its wrench, per unit of time [N]."""
    rng = np.random.default_rng(1)
    multibody = Multibody(tables([Body(mass=0.3, inertia=0.1 * np.eye(3))], gravity=(0.0, 0.0, 0.0)))
    state = multibody.initial_state(np.array([0, 0, 0, 1.0, 0, 0, 0]), rng.normal(size=6) * 10.0)
    response, wrench = positive(rng, 6, 0.1) / h, rng.normal(size=(1, 1, 6)) * 10.0
    start = twist(multibody, state)
    new, _, met = multibody.advance_affine(state, h, HELD, wrench, None, response, start, **RK4)
    return 0.3 * (twist(multibody, new) - start)[0, :3] / h - met.wrench[0, :3]


def test_the_impulse_of_the_wrench_is_kept_to_second_order_on_a_body_that_turns():
    """The own block of G goes with the body over the step as inertia, which is right halfway."""
    lost = [np.linalg.norm(lost_impulse(h)) for h in (2e-3, 1e-3, 5e-4)]
    assert lost[2] < 1e-3
    for coarse, fine in pairwise(lost):
        assert 1.8 < np.log2(coarse / fine) < 2.2


def test_a_response_that_is_not_finite_names_the_body():
    rng = np.random.default_rng(2)
    multibody, state = chain(rng)
    response = np.eye(24)
    response[13, 2] = np.nan
    with pytest.raises(SimulationError, match=r"response of body 2: expected finite numbers"):
        multibody.advance_affine(state, H, HELD, np.zeros((1, 4, 6)), None, response, np.zeros((4, 6)), **RK4)


@pytest.mark.parametrize(
    ("response", "about", "named"),
    [(np.zeros((6, 6)), np.zeros((4, 6)), "response"), (np.zeros((24, 24)), np.zeros((4, 3)), "about")],
)
def test_wrong_shapes_are_refused(response, about, named):
    multibody, state = chain(np.random.default_rng(3))
    with pytest.raises(ValueError, match=f"{named}: expected shape"):
        multibody.advance_affine(state, H, HELD, np.zeros((1, 4, 6)), None, response, about, **RK4)
