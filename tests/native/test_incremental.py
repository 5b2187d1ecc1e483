"""The paper's equations, for any number of links, against joint coordinates."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linkwind.errors import MechanismError
from linkwind.native.incremental import Incremental
from linkwind.native.multibody import Integrator, Multibody
from tests.coupling.two_link_reference import START, TwoLink
from tests.native.mechanisms import Body, motion_of, random_added, random_state, tables, two_link

GRAVITY = (0.7, -9.1, 0.3)
FLIPPED = np.diag([1.0, -1.0, -1.0])


def about_z(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def random_links(rng, n):
    """Trees of hinged links in the plane; some hinges count their angle the other way round."""
    bodies = []
    for k in range(n):
        parent = -1 if k == 0 or rng.random() < 0.2 else int(rng.integers(k))
        inertia = rng.uniform(0.1, 1.0) * np.diag([0.5, 0.5, 1.0])
        mass, points = rng.uniform(0.5, 3.0), np.append(rng.normal(size=(2, 2)), np.zeros((2, 1)), axis=1)
        frame = about_z(rng.uniform(0, 6)) @ (FLIPPED if rng.random() < 0.5 else np.eye(3))
        hinge = (points[0], points[1], frame, about_z(rng.uniform(0, 6)) @ frame)
        bodies.append(
            Body(parent, "planar", mass, inertia)
            if parent < 0
            else Body(parent, "revolute", mass, inertia, *hinge)
        )
    return bodies


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.integers(0, 10_000), st.integers(1, 8), st.booleans())
def test_accelerations_and_reactions_on_random_trees(seed, n, with_added):
    """Forces out of the plane, too: what holds the bodies in it."""
    rng = np.random.default_rng(seed)
    multibody = Multibody(tables(random_links(rng, n), GRAVITY))
    paper, state = Incremental(multibody.tables), random_state(rng, multibody)
    wrench, added = rng.normal(size=(n, 6)), random_added(rng, n) if with_added else None
    expected, got = multibody.evaluate(state, wrench, added), paper.evaluate(state, wrench, added)
    size = max(1.0, np.abs(expected.reaction).max(), np.abs(expected.acceleration).max())
    for name in expected._fields:
        np.testing.assert_allclose(getattr(got, name), getattr(expected, name), atol=1e-11 * size, rtol=0)


@pytest.mark.parametrize("integrator", ["euler", "semi_implicit_euler"])
def test_increments_of_the_paper(integrator):
    """Velocities grow by h times the accelerations of t_n; positions move with the old ones, or the new."""
    paper, h = Incremental(tables(two_link())), 1e-3
    plant, z = TwoLink(h, integrator), START
    state = paper.initial_state([0, 0, z[2], z[3] - z[2]], [z[4], z[5], z[6], z[7] - z[6]])
    rng, held = np.random.default_rng(4), np.zeros(1)
    for _ in range(300):
        wrench = np.zeros((1, 2, 6))
        wrench[:, :, [0, 1, 5]] = 10.0 * rng.normal(size=(2, 3))
        state, _ = paper.advance(state, h, held, wrench, None, integrator=Integrator[integrator.upper()])
        z = plant.advance(z, held, wrench, None)
    motion = motion_of(paper, state)
    np.testing.assert_allclose([*motion.position[0, :2], *motion.linear[0, :2]], z[[0, 1, 4, 5]], atol=1e-12)
    np.testing.assert_allclose(motion.angular[:, 2], z[6:], atol=1e-12)
    assert paper.joint_gap(motion) < 1e-14


@pytest.mark.parametrize(
    ("body", "kind"),
    [
        (Body(0, "prismatic"), "prismatic"),
        (Body(0, "revolute", parent_rotation=np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])), "revolute"),
        (Body(0, "revolute", damping=0.1), "revolute"),
        (Body(0, "revolute", parent_rotation=FLIPPED), "revolute"),
        (Body(-1, "revolute"), "revolute"),
        (Body(-1, "planar", child_point=(0.1, 0.0, 0.0)), "planar"),
    ],
)
def test_what_the_paper_does_not_have_is_refused(body, kind):
    with pytest.raises(MechanismError, match=f'joint of body "other": .* got one of type {kind}'):
        Incremental(tables([Body(-1, "planar"), body]), ["first", "other"])
