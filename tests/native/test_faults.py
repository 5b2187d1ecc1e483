"""What the core refuses, and how it says so."""

import numpy as np
import pytest

from linkwind.errors import MechanismError, SimulationError
from linkwind.native.multibody import Integrator, Multibody, Tables
from linkwind.spatial import Motion
from tests.native.mechanisms import Body, tables, two_link

NODES, NO_LOAD = np.zeros(1), np.zeros((1, 2, 6))


def start():
    multibody = Multibody(tables(two_link()))
    return multibody, multibody.initial_state([0, 0, 0.5, 0.2], [0, 0, 1.0, -1.0])


def with_table(**changes) -> Tables:
    return Tables(**(vars(tables(two_link())) | changes))


@pytest.mark.parametrize("integrator", Integrator)
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_wrench_that_is_not_finite(integrator, bad):
    multibody, state = start()
    wrenches = np.zeros((2, 2, 6))
    wrenches[1, 1, 3] = bad
    with pytest.raises(SimulationError, match=r"wrench on body 1: .*NaN or infinity"):
        multibody.advance(state, 1e-3, np.array([0.0, 1.0]), wrenches, None, integrator=integrator)
    added = np.zeros((2, 6, 6))
    added[0, 2, 2] = bad
    with pytest.raises(SimulationError, match="added inertia of body 0"):
        multibody.advance(state, 1e-3, NODES, NO_LOAD, added, integrator=integrator)
    with pytest.raises(SimulationError, match=r"state\[2\]"):
        multibody.evaluate(np.where(np.arange(9) == 2, bad, state), NO_LOAD[0])


@pytest.mark.parametrize("integrator", Integrator)
def test_singular_inertia_names_the_body(integrator):
    bodies = two_link()
    bodies[1].mass, bodies[1].inertia = 0.0, np.zeros((3, 3))
    multibody = Multibody(tables(bodies))
    state = multibody.initial_state(np.zeros(4), np.zeros(4))
    with pytest.raises(SimulationError, match=r"joint of body 1: .*singular"):
        multibody.advance(state, 1e-3, NODES, NO_LOAD, None, integrator=integrator)
    with pytest.raises(SimulationError, match=r"joint of body 1: .*singular.*0 s into the step"):
        multibody.evaluate(state, NO_LOAD[0])
    added = np.stack([np.zeros((6, 6)), 0.01 * np.eye(6)])  # the wind carries it
    assert np.isfinite(multibody.evaluate(state, NO_LOAD[0], added).joint_acceleration).all()


def test_singular_up_to_round_off():
    """Two hinges at one place: the chain's inertia is left with the rounding of 1 - 1."""
    inertia = np.diag([0.0, 0.0, 0.37])
    bodies = [
        Body(-1, "revolute", 0.0, np.zeros((3, 3)), child_point=(0.13, 0.29, 0)),
        Body(0, "revolute", 1.3, inertia, (0.13, 0.29, 0), (0.31, -0.17, 0)),
    ]
    multibody = Multibody(tables(bodies))
    for angle in np.linspace(0.0, 6.0, 20):
        with pytest.raises(SimulationError, match="joint of body 0"):
            multibody.evaluate(multibody.initial_state([angle, 0.3 + angle], [1.0, 2.0]), NO_LOAD[0])


@pytest.mark.parametrize("integrator", [Integrator.EULER, Integrator.SEMI_IMPLICIT_EULER, Integrator.RK4])
def test_overflow_names_the_time(integrator):
    stiff = Multibody(tables([Body(-1, "prismatic", 1e-200, stiffness=1e200)]))
    state = stiff.initial_state([1.0], [0.0])
    with pytest.raises(SimulationError, match=r"body 0: .*overflow, 0\.\d+ s into the step"):
        stiff.advance(state, 1.0, NODES, np.zeros((1, 1, 6)), None, integrator=integrator, substeps=10)


@pytest.mark.parametrize(
    ("change", "item"),
    [
        ({"h": -1e-3}, "h: .*got -0.001"),
        ({"h": 0.0}, "h: "),
        ({"h": np.nan}, "h: "),
        ({"integrator": 9}, "integrator: .*got 9"),
        ({"substeps": 0}, "substeps: .*got 0"),
        ({"rtol": -1.0}, "rtol, atol: "),
        ({"atol": 0.0}, "rtol, atol: "),
        ({"nodes": np.array([np.nan])}, "nodes: "),
        ({"nodes": np.array([0.5, 0.5]), "wrenches": np.zeros((2, 2, 6))}, "nodes: .*distinct"),
        ({"nodes": np.arange(9.0), "wrenches": np.zeros((9, 2, 6))}, "nodes: expected 1 to 8"),
        ({"nodes": np.zeros(0), "wrenches": np.zeros((0, 2, 6))}, "nodes: "),
        ({"wrenches": np.zeros((1, 3, 6))}, r"wrenches: expected shape \(1, 2, 6\); got \(1, 3, 6\)"),
        ({"added_inertia": np.zeros((2, 6, 5))}, "added_inertia: expected shape"),
        ({"state": np.zeros(8)}, r"state: expected shape \(9,\)"),
    ],
)
def test_arguments(change, item):
    multibody, state = start()
    call = {"state": state, "h": 1e-3, "nodes": NODES, "wrenches": NO_LOAD, "added_inertia": None}
    with pytest.raises(ValueError, match=item):
        multibody.advance(**(call | {"integrator": Integrator.DOPRI5} | change))


@pytest.mark.parametrize(
    ("change", "item"),
    [
        ({"parent": np.array([-1, 2])}, r"tables.parent\[1\]: .*got 2"),
        ({"parent": np.array([-2, 0])}, r"tables.parent\[0\]: .*got -2"),
        ({"parent": np.array([-1, 1])}, "tables.order: .*its parent before it"),
        ({"parent": np.array([1, 0])}, "tables.order: "),
        ({"order": np.array([1, 0])}, r"tables.order: .*got \[1, 0\]"),
        ({"order": np.array([0, 0])}, "tables.order: "),
        ({"joint_type": np.array([3, 6])}, r"tables.joint_type\[1\]: expected one of 0 \(fixed\).*got 6"),
        ({"q_index": np.array([0, 2])}, r"tables.q_index\[1\]: "),
        ({"v_index": np.array([0, 4])}, r"tables.v_index\[1\]: "),
        ({"mass": np.array([2.0, -1.0])}, r"tables.mass\[1\]: expected zero or more; got -1.0"),
        ({"inertia": np.full((2, 6), np.nan)}, r"tables.inertia\[0\]: "),
        ({"parent_rotation": np.ones((2, 3, 3))}, r"tables.parent_rotation\[0\]: expected a rotation"),
        ({"child_rotation": -np.tile(np.eye(3), (2, 1, 1))}, r"tables.child_rotation\[0\]: "),
        ({"parent_point": np.full((2, 3), np.inf)}, r"tables.parent_point\[0\]: "),
        ({"child_point": np.full((2, 3), np.nan)}, r"tables.child_point\[0\]: "),
        ({"gravity": np.array([0, np.nan, 0])}, "tables.gravity: "),
        ({"stiffness": np.array([0, 0, np.nan, 0])}, r"tables.stiffness\[2\]: "),
        ({"damping": np.array([0, 0, 0, np.inf])}, r"tables.damping\[3\]: "),
        ({"rest": np.array([0, 0, 0, np.inf])}, r"tables.rest\[3\]: "),
        ({"mass": np.ones(3)}, r"tables.mass: expected shape \(2,\).*got \(3,\)"),
        ({"gravity": np.zeros(2)}, r"tables.gravity: expected shape \(3,\)"),
    ],
)
def test_tables(change, item):
    with pytest.raises(MechanismError, match=item):
        Multibody(with_table(**change))


def test_no_bodies():
    empty = {name: np.zeros((0, *np.shape(value)[1:])) for name, value in vars(tables(two_link())).items()}
    with pytest.raises(MechanismError, match="at least one body"):
        Multibody(Tables(**(empty | {"gravity": np.zeros(3), "force_start": np.zeros(1, np.int32)})))


def test_rest_quaternion_of_zero_length():
    with pytest.raises(MechanismError, match=r"tables.rest\[0\]: .*quaternions not zero"):
        Multibody(tables([Body(-1, "spherical", rest=np.zeros(4))]))


def test_initial_state():
    free = Multibody(tables([Body(-1, "free")]))
    with pytest.raises(ValueError, match=r"q\[3:7\]: expected a quaternion"):
        free.initial_state(np.zeros(7), np.zeros(6))
    with pytest.raises(ValueError, match=r"v: expected shape \(6,\)"):
        free.initial_state(np.ones(7), np.zeros(5))
    with pytest.raises(ValueError, match="q: expected finite"):
        free.initial_state(np.full(7, np.nan), np.zeros(6))
    np.testing.assert_allclose(
        free.initial_state([1, 2, 3, 2, 0, 0, 0], np.zeros(6))[:7], [1, 2, 3, 1, 0, 0, 0]
    )


def test_motion_of_another_size():
    multibody, state = start()
    with pytest.raises(ValueError, match="Motion of 2 bodies; got 3"):
        multibody.motion(state, Motion.at_rest(3))


def test_dopri5_gives_up_rather_than_run_for_ever():
    """A tolerance below round-off over a stiff spring: about 1e8 substeps would fit into the step."""
    stiff = Multibody(tables([Body(-1, "prismatic", 1.0, stiffness=1e14)]))
    state = stiff.initial_state([1.0], [0.0])
    options = {"integrator": Integrator.DOPRI5, "rtol": 1e-3, "atol": 1e-6}
    with pytest.raises(SimulationError, match=r"dopri5: .*or a million of them"):
        stiff.advance(state, 10.0, NODES, np.zeros((1, 1, 6)), None, **options)
