"""Eqs. 6-9 of Rahmati & Karimi 2021, written here from the paper, hold on random states."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linkwind.native.cfe import Cfe, Stabilisation
from linkwind.native.incremental import Incremental
from linkwind.native.multibody import Multibody
from tests.native.mechanisms import tables, two_link

M1 = M2 = 2.0
I1 = I2 = 1.4
L1 = L2 = 0.25  # joint to centre of mass
G = 9.81

TWO_LINK = {
    "reduced": Multibody(tables(two_link())),
    "cfe": Cfe(tables(two_link()), stabilisation=Stabilisation.NONE, time=1.0),
    "incremental": Incremental(tables(two_link())),
}
angle = st.floats(-20.0, 20.0)
rate = st.floats(-30.0, 30.0)
load = st.floats(-100.0, 100.0)


def largest(*terms):
    return max(abs(t) for t in terms)


@pytest.mark.parametrize("method", TWO_LINK)
@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.tuples(angle, angle), st.tuples(rate, rate), st.tuples(*[load] * 6))
def test_accelerations_and_joint_force(method, angles, rates, loads):
    (theta1, theta2), (omega1, omega2), (R1x, R1y, t1, R2x, R2y, t2) = angles, rates, loads
    multibody = TWO_LINK[method]
    q, v = [0.3, -0.7, theta1, theta2 - theta1], [1.5, -2.5, omega1, omega2 - omega1]
    wrench = np.array([[R1x, R1y, 0, 0, 0, t1], [R2x, R2y, 0, 0, 0, t2]], float)
    result = multibody.evaluate(multibody.initial_state(q, v), wrench)
    (X, Y, alpha1), alpha2 = result.acceleration[0, [0, 1, 5]], result.acceleration[1, 5]

    f = [a * np.sin(t) + w**2 * np.cos(t) for a, t, w in ((alpha1, theta1, omega1), (alpha2, theta2, omega2))]
    h = [a * np.cos(t) - w**2 * np.sin(t) for a, t, w in ((alpha1, theta1, omega1), (alpha2, theta2, omega2))]
    q1 = R2x - M2 * (X + L1 * f[0] - L2 * f[1])
    q2 = R2y - M2 * (Y - L1 * h[0] + L2 * h[1] + G)
    size = largest(R1x, R1y, R2x, R2y, t1, t2, M1 * G, M1 * X, M1 * Y, M2 * L1 * f[0], M2 * L2 * f[1],
                   M2 * L1 * h[0], M2 * L2 * h[1], I1 * alpha1, I2 * alpha2)  # fmt: skip
    residuals = [
        R1x + q1 - M1 * X,  # (6)
        R1y + q2 - M1 * G - M1 * Y,  # (7)
        (q1 * np.sin(theta1) - q2 * np.cos(theta1)) * L1 + t1 - I1 * alpha1,  # (8)
        (-q1 * np.sin(theta2) + q2 * np.cos(theta2)) * L2 + t2 - I2 * alpha2,  # (9)
    ]
    assert np.abs(residuals).max() <= 1e-12 * size
    # (q1, q2) acts on body 1; the reaction of the parent (body 1) on the child (body 2) is its opposite.
    np.testing.assert_allclose(result.reaction[1, :3], [-q1, -q2, 0.0], rtol=0, atol=1e-12 * size)
    np.testing.assert_allclose(result.reaction[1, 3:], 0.0, atol=1e-12 * size)  # a hinge without friction
    np.testing.assert_allclose(result.reaction[0], 0.0, atol=1e-12 * size)  # nothing holds body 1
