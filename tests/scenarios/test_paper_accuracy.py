"""The paper's accuracy claim (Fig. 7), and what `pec` makes of the same step.

The real core under forces that are written down independently, against Eqs. 6–9 integrated with DOP853 at
rtol 1e-12. The error of a channel is E1 = 100 · Σ|x − x_ref| / Σ|x_ref| over the communication points.
"""

import numpy as np
import pytest

from linkwind.coupling import SCHEMES, Settings
from linkwind.dynamics.plant import MechanismPlant
from linkwind.mechanism import build
from linkwind.scenario import load
from tests.coupling import two_link_reference as two_link

# Mean percentage errors of Vx, Vy, ω of body 1 and of body 2: doi:10.3390/app11031136, Fig. 7.
PAPER = np.array([1.46, 0.84, 1.87, 1.15, 0.82, 0.43])
FIELDS = {"two_link_field": two_link.f0, "two_link_gust": two_link.f1}


class Flight:
    """A built-in scenario flown with its core, without a bus.

    Attributes:
        states: accepted (X1, Y1, θ1, θ2 and rates) at the communication points, shape (steps+1, 8).
        exchanges: answers asked for.
    """

    def __init__(self, name, step, scheme="pec", field=None, **settings):
        integrator = settings.pop("integrator", "rk4")
        scenario = load(name, [f"coupling.step={step!r}", f'dynamics.integrator="{integrator}"'])
        plant = MechanismPlant(build(scenario), scenario, lambda: "the start")
        answer = two_link.exchange(field or FIELDS[name], step)
        self.exchanges = 0

        def exchange(step, iteration, accepted, trial):
            self.exchanges += 1
            return answer(step, iteration, accepted, reference_state(trial))

        run = SCHEMES[scheme](
            plant, exchange, plant.initial, scenario.steps, Settings(two_link.WEIGHT, **settings)
        )
        self.states = np.array([reference_state(point.state) for point in run])


def reference_state(state):
    """The coordinates of the equations: the core's hinge angle is relative to link 1."""
    x, y, angle, hinge, vx, vy, spin, hinge_rate, _ = state.values
    return np.array([x, y, angle, angle + hinge, vx, vy, spin, spin + hinge_rate])


def errors(states, exact):
    velocities, reference = two_link.velocities(states), two_link.velocities(exact)
    return 100 * np.abs(velocities - reference).sum(axis=0) / np.abs(reference).sum(axis=0)


@pytest.fixture(scope="module")
def exact():
    """The reference at every millisecond, by scenario."""
    return {name: two_link.reference(field, 1200) for name, field in FIELDS.items()}


@pytest.mark.parametrize("integrator", ["euler", "semi_implicit_euler"])
@pytest.mark.parametrize("name", FIELDS)
def test_the_paper_s_scheme_at_1_ms_has_the_paper_s_accuracy(name, integrator, exact):
    flight = Flight(name, 1e-3, "explicit", integrator=integrator)
    assert (errors(flight.states, exact[name]) < PAPER).all()


@pytest.mark.parametrize("adaptive", [True, False])
def test_pec_at_1_ms_is_500_times_better_with_as_many_exchanges(adaptive, exact):
    euler = Flight("two_link_field", 1e-3, "explicit", integrator="euler")
    pec = Flight("two_link_field", 1e-3, order=3, adaptive=adaptive)
    better = errors(euler.states, exact["two_link_field"]) / errors(pec.states, exact["two_link_field"])
    assert (better >= 500).all()
    assert pec.exchanges == euler.exchanges == 1201


def test_pec_in_gusts_at_1_ms_is_100_times_better(exact):
    """The gusts push on |u_n| and |u_e|, whose corners no degree sees coming."""
    euler = Flight("two_link_gust", 1e-3, "explicit", integrator="euler")
    pec = Flight("two_link_gust", 1e-3)
    better = errors(euler.states, exact["two_link_gust"]) / errors(pec.states, exact["two_link_gust"])
    assert (better >= 100).all()


@pytest.mark.parametrize(("name", "step"), [("two_link_field", 10e-3), ("two_link_gust", 8e-3)])
def test_pec_has_the_paper_s_accuracy_at_ten_times_its_step(name, step, exact):
    flight = Flight(name, step)
    assert (errors(flight.states, exact[name][:: round(step / 1e-3)]) < PAPER).all()


@pytest.mark.parametrize("order", range(4))
@pytest.mark.parametrize(
    ("field", "fine"), [(two_link.f0, (1200, 2400, 4800)), (two_link.breeze, (120, 240, 480))]
)
def test_observed_orders_with_the_core(order, field, fine):
    reference = two_link.reference(field, fine[0])
    sums = []
    for steps in fine:
        flight = Flight("two_link_field", two_link.END / steps, field=field, order=order)
        sums.append(errors(flight.states[:: steps // fine[0]], reference).sum())
    assert np.log2(np.array(sums[:-1]) / sums[1:]) == pytest.approx((2, 2, 3, 4)[order], abs=0.2)


@pytest.mark.parametrize("integrator", ["euler", "semi_implicit_euler"])
@pytest.mark.parametrize("name", FIELDS)
def test_explicit_with_the_core_is_the_paper_s_update(name, integrator):
    h = 1e-3
    flight = Flight(name, h, "explicit", integrator=integrator)
    z = two_link.START
    for k in range(100):
        velocity = z[4:] + h * two_link.acceleration(z, FIELDS[name](k * h, z))
        z = np.concatenate([z[:4] + h * (z[4:] if integrator == "euler" else velocity), velocity])
        np.testing.assert_allclose(flight.states[k + 1], z, rtol=1e-12, atol=1e-13)
