"""Inputs of force elements: names of expressions with values that can be set."""

from __future__ import annotations

import json

import numpy as np
import pytest

from linkwind.errors import ExpressionError, MechanismError, ScenarioError, SimulationError
from linkwind.mechanism import build
from linkwind.native.multibody import Integrator, Multibody
from linkwind.scenario import from_json, loads

CART = """
[time]
end = 1.0
[environment]
gravity = [0.0, 0.0, 0.0]
[[bodies]]
name = "cart"
mass = 2.0
inertia = 0.1
[[joints]]
name = "rail"
type = "prismatic"
parent = "world"
child = "cart"
axis = [1.0, 0.0]
[[forces]]
name = "motor"
type = "actuator"
joint = "rail"
inputs = { b = 3.0, a = 0.0 }
force = "2*a + 0*b + 3"
[[forces]]
name = "jet"
type = "point_force"
body = "cart"
inputs = { throttle = 0.0 }
let = { thrust = "throttle**2" }
fx = "thrust"
"""
MOTOR = 'inputs = { b = 3.0, a = 0.0 }\nforce = "2*a + 0*b + 3"'
NODES = np.array([0.0, 0.5, 1.0])


def cart(*changes: str, text: str = CART) -> Multibody:
    return Multibody(build(loads(text, "cart.toml", list(changes))).tables)


def acceleration(multibody: Multibody) -> float:
    state = multibody.initial_state(np.zeros(1), np.zeros(1))
    return float(multibody.evaluate(state, np.zeros((1, 6))).joint_acceleration[0])


def advance(multibody: Multibody, h: float, nodes, inputs, **how) -> np.ndarray:
    state, calm = multibody.initial_state(np.zeros(1), np.zeros(1)), np.zeros((len(nodes), 1, 6))
    how = {"integrator": Integrator.RK4} | how
    return multibody.advance(state, h, nodes, calm, None, inputs=inputs, **how)[0]


def test_a_run_has_the_values_of_the_scenario():
    assert acceleration(cart()) == 1.5
    assert acceleration(cart("forces.motor.inputs.a=2.5")) == 4.0
    assert acceleration(cart("forces.motor.inputs.a=2.5", "forces.jet.inputs.throttle=2")) == 6.0


def test_a_number_of_the_expression_is_not_the_input_of_the_same_value():
    """3 stands in the expression and is the value of b at the start."""
    mechanism = build(loads(CART, "cart.toml"))
    assert mechanism.inputs == ((0, "a"), (0, "b"), (1, "throttle"))
    assert mechanism.tables.force_constants[mechanism.tables.force_input].tolist() == [0.0, 3.0, 0.0]
    assert acceleration(cart("forces.motor.inputs.b=100.0")) == 1.5


@pytest.mark.parametrize("integrator", [Integrator.RK4, Integrator.DOPRI5, Integrator.RADAU5])
def test_inputs_of_a_step_are_a_polynomial_in_time(integrator):
    """Force 3 + 2 a(t) with a = 1 + 2 t + 6 t² on 2 kg from rest."""
    multibody, h = cart(), 0.5
    t = NODES * h
    inputs = np.column_stack([1.0 + 2.0 * t + 6.0 * t**2, 0.0 * t, 0.0 * t])
    state = advance(multibody, h, NODES, inputs, integrator=integrator, rtol=1e-12, atol=1e-12)
    assert state[1] == pytest.approx(1.5 * h + h + h**2 + 2.0 * h**3, rel=1e-12)
    assert state[0] == pytest.approx(0.75 * h**2 + h**2 / 2 + h**3 / 3 + h**4 / 2, rel=1e-12)


def test_a_step_without_inputs_does_not_know_those_of_the_step_before():
    multibody, one = cart(), np.zeros(1)
    calm = advance(multibody, 0.1, one, None)
    pushed = advance(multibody, 0.1, one, np.array([[5.0, 0.0, 1.0]]))
    assert pushed[1] == pytest.approx((3.0 + 10.0 + 1.0) / 2.0 * 0.1)
    assert advance(multibody, 0.1, one, None).tobytes() == calm.tobytes()
    assert acceleration(multibody) == 1.5


def test_inputs_of_a_wrong_shape_or_without_a_value():
    with pytest.raises(ValueError, match=r"inputs: expected shape \(1, 3\); got \(1, 2\)"):
        advance(cart(), 0.1, np.zeros(1), np.zeros((1, 2)))
    with pytest.raises(SimulationError, match="force 0: expected"):
        advance(cart(), 0.1, np.zeros(1), np.array([[np.inf, 0.0, 0.0]]))


def test_the_order_in_which_they_are_written_does_not_count():
    """Canonical JSON sorts its keys."""
    scenario = loads(CART, "cart.toml")
    again = from_json(scenario.to_json(), "log", [])
    assert list(json.loads(scenario.to_json())["forces"][0]["inputs"]) == ["a", "b"]
    assert build(again).inputs == build(scenario).inputs
    assert build(again).tables.force_code.tolist() == build(scenario).tables.force_code.tolist()


@pytest.mark.parametrize(
    ("motor", "error", "words"),
    [
        (
            'inputs = { q = 1.0 }\nforce = "q"',
            ExpressionError,
            'inputs: expected a name that is not taken; got "q"',
        ),
        ('inputs = { sin = 1.0 }\nforce = "1"', ExpressionError, 'got "sin"'),
        ('inputs = { u = 1.0 }\nforce = "v"', ExpressionError, 'got "u", which none does'),
        ("inputs = { u = 1.0 }\nforce = { table = [[0, 1], [1, 2]] }", ExpressionError, 'got "u"'),
        ('inputs = { effort = 1.0 }\nforce = "effort"', MechanismError, 'but effort and power; got "effort"'),
        ('inputs = { u = "1" }\nforce = "u"', ScenarioError, r"inputs\.u: expected a number"),
        ('inputs = { u = nan }\nforce = "u"', ScenarioError, r"inputs\.u: expected a finite number"),
        ('inputs = { 1u = 1.0 }\nforce = "1"', ScenarioError, "expected a name"),
        ('force = "u"', ExpressionError, 'expected one of t, q, v, pi; got "u"'),
        ('inputs = { speed = 1.0 }\nforce = "sped"', ExpressionError, 'Did you mean "speed"'),
    ],
)
def test_wrong_inputs(motor, error, words):
    with pytest.raises(error, match=words):
        build(loads(CART.replace(MOTOR, motor), "cart.toml"))


def test_let_may_not_hide_an_input():
    with pytest.raises(ExpressionError, match=r"let\.throttle: expected a name that is not taken"):
        build(loads(CART.replace("thrust =", "throttle =").replace('"thrust"', '"throttle"'), "cart.toml"))
