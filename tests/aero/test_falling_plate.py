"""A plate that falls freely flutters when it is light and tumbles when it is heavy.

Belmonte, Eisenberg & Moses 1998 and Andersen, Pesavento & Wang 2005: the transition goes with the
dimensionless moment of inertia, here as I* = m / (πρ(c/2)² s), mass over added mass. Only the order is
asserted: between the two lies chaos.
"""

import numpy as np
import pytest

from linkwind.native.forces import Coefficients, Plates, PlateTable
from linkwind.native.wind import WindTable
from linkwind.spatial import Motion, Wrench

GRAVITY = 1.0


def fall(i_star, coefficients, duration=60.0, h=0.02):
    """Angles over time of a plate (c = s = ρ = 1) let go at 0.3 rad; classical Runge–Kutta."""
    mass = i_star * np.pi / 4
    calm = WindTable(np.zeros(3), np.zeros((0, 9)))
    plates = Plates(PlateTable(np.zeros(1, dtype=np.int32), np.ones((1, 2)), coefficients, 1.0, calm))
    motion, wrench = Motion.at_rest(1), Wrench.zeros(1, added_inertia=True)

    def rate(state):
        angle, motion.linear[0, :2], motion.angular[0, 2] = state[2], state[3:5], state[5]
        motion.orientation[0, ::3] = np.cos(angle / 2), np.sin(angle / 2)
        plates.evaluate(0.0, motion, wrench)
        along, normal = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        force = wrench.force[0, :2] - (0.0, mass * GRAVITY)
        added = wrench.added_inertia[0]
        linear = force @ along / mass * along + force @ normal / (mass + added[1, 1]) * normal
        return np.array([*state[3:], *linear, wrench.torque[0, 2] / (mass / 12 + added[5, 5])])

    state = np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    angles = []
    for _ in range(int(duration / h)):
        k1 = rate(state)
        k2 = rate(state + h / 2 * k1)
        k3 = rate(state + h / 2 * k2)
        k4 = rate(state + h * k3)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        angles.append(state[2])
    return np.array(angles)


LIGHT_AND_HEAVY = {Coefficients.RISTROPH: (0.2, 6.0), Coefficients.ANDERSEN: (0.6, 1.35)}


@pytest.mark.parametrize("coefficients", list(LIGHT_AND_HEAVY))
def test_a_light_plate_flutters_and_a_heavy_one_tumbles(coefficients):
    light, heavy = LIGHT_AND_HEAVY[coefficients]
    flutter, tumble = (fall(i_star, coefficients)[1500:] for i_star in (light, heavy))
    assert 0.5 < np.ptp(flutter) < np.pi  # swings to and fro, never over
    assert abs(tumble[-1] - tumble[0]) > 4 * np.pi  # more than two turns
    assert np.ptp(tumble) < 1.2 * abs(tumble[-1] - tumble[0])  # in one direction
