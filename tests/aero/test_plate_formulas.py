"""The plate against its formulas, written a second time here in numpy, and against Kirchhoff's equations."""

import numpy as np
import pytest

from linkwind.native.forces import Coefficients, Plates, PlateTable
from linkwind.native.wind import WindTable, wind_at
from linkwind.spatial import Motion, Wrench

RNG = np.random.default_rng(21)
DENSITY, CHORD, SPAN = 1.3, 0.4, 0.7
CALM = WindTable(np.zeros(3), np.zeros((0, 9)))
SETS = [Coefficients.RISTROPH, Coefficients.ANDERSEN]


def ristroph(u, w, omega):
    """Force (along, normal) and torque of a section, in complex numbers: x along the plate, iy normal."""
    v = complex(u, w)
    alpha = np.arctan(abs(w) / abs(u)) if u else np.pi / 2
    f = 0.5 * (1 - np.tanh((np.degrees(alpha) - 14) / 6))
    c_lift = f * 5.2 * np.sin(alpha) + (1 - f) * 0.95 * np.sin(2 * alpha)
    c_drag = f * (0.1 + 5.0 * np.sin(alpha) ** 2) + (1 - f) * 1.9 * np.sin(alpha) ** 2
    ahead = CHORD * (f * (0.3 - 3.5 * alpha**2) + (1 - f) * 0.2 * (1 - 2 * alpha / np.pi))
    q = 0.5 * DENSITY * CHORD * SPAN
    to_the_left = 1j * v  # the velocity turned by +90°: where lift of positive circulation points
    translation = q * abs(v) * (-np.sign(u * w) * c_lift * to_the_left - c_drag * v)
    rotation = q * CHORD * 1.1 * omega * to_the_left
    # Rotational drag by quadrature of the local drag along the chord; two panels, since |x| has a kink.
    nodes, weights = np.polynomial.legendre.leggauss(4)
    x = np.concatenate((nodes - 1, nodes + 1)) * CHORD / 4
    local = -0.5 * DENSITY * SPAN * 1.9 * np.abs(omega * x) * omega * x
    spin = np.sum(np.tile(weights, 2) * CHORD / 4 * x * local)
    force = translation + rotation
    return force.real, force.imag, np.sign(u) * ahead * translation.imag + spin


def andersen(u, w, omega):
    v, a = complex(u, w), CHORD / 2
    circulation = -1.2 * a * abs(v) * np.sin(2 * np.angle(v)) + 2 * np.pi * a * a * omega
    drag = DENSITY * a * (1.4 - 1.0 * np.cos(2 * np.angle(v))) * abs(v) * v
    force = SPAN * (DENSITY * circulation * 1j * v - drag)
    torque = -np.pi * DENSITY * a**4 * (0.2 * abs(v) / a + 0.2 * abs(omega)) * omega
    return force.real, force.imag, SPAN * torque


SECTION = {Coefficients.RISTROPH: ristroph, Coefficients.ANDERSEN: andersen}


def rotation_matrix(q):
    """Columns are the body axes in the world, from products of quaternions."""
    w, v = q[0], q[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.outer(v, v) + w * w * np.eye(3) + 2 * w * cross + cross @ cross


def circulatory(coefficients, rotation, relative, omega):
    """The wrench in W without any added-mass term."""
    u, w, _ = rotation.T @ relative
    fx, fy, torque = SECTION[coefficients](u, w, (rotation.T @ omega)[2])
    return rotation @ [fx, fy, 0.0], rotation @ [0.0, 0.0, torque]


def evaluate(coefficients, motion, t=0.0, wind=CALM):
    table = PlateTable(
        np.zeros(1, dtype=np.int32), np.array([[CHORD, SPAN]]), coefficients, DENSITY, wind
    )  # fmt: skip
    wrench = Wrench.zeros(1, added_inertia=True)
    assert Plates(table).evaluate(t, motion, wrench) == 0
    return wrench.force[0], wrench.torque[0], wrench.added_inertia[0]


def state(position, orientation, linear, angular):
    return Motion(*(np.array([part], dtype=float) for part in (position, orientation, linear, angular)))


def random_state():
    q = RNG.normal(size=4)
    scale = 10.0 ** RNG.uniform(-3, 2, size=2)
    return state(RNG.normal(size=3), q / np.linalg.norm(q), scale[0] * RNG.normal(size=3),
                 scale[1] * RNG.normal(size=3))  # fmt: skip


def random_wind():
    """A smooth one: rates are compared with differences."""
    gusts = np.column_stack([RNG.normal(size=(2, 8)), [0.0, 0.0]])
    return WindTable(RNG.normal(size=3), gusts)


@pytest.mark.parametrize("coefficients", SETS)
def test_wrench_is_the_sum_of_the_stated_terms_on_random_states(coefficients):
    m_n = np.pi * DENSITY * (CHORD / 2) ** 2 * SPAN
    i_a = np.pi * DENSITY * (CHORD / 2) ** 4 * SPAN / 8
    for _ in range(200):
        motion, wind, t = random_state(), random_wind(), RNG.normal()
        force, torque, _ = evaluate(coefficients, motion, t, wind)
        rotation = rotation_matrix(motion.orientation[0])
        air, air_rate = wind_at(wind, t, motion.position[0], motion.linear[0])
        relative, omega = motion.linear[0] - air, motion.angular[0]
        normal, axis = rotation[:, 1], rotation[:, 2]
        w = relative @ normal
        turning = np.cross(omega, normal)
        f, m = circulatory(coefficients, rotation, relative, omega)
        force_terms = f, m_n * (air_rate + np.cross(omega, relative)) @ normal * normal, -m_n * w * turning
        moment_terms = m, -i_a * (omega @ axis) * np.cross(omega, axis), -np.cross(relative, m_n * w * normal)
        for got, terms in ((force, force_terms), (torque, moment_terms)):
            size = sum(np.linalg.norm(term) for term in terms)
            np.testing.assert_allclose(got, sum(terms), rtol=0, atol=1e-13 * size)


def test_planar_velocity_terms_of_the_added_mass():
    """F_u = m ω w and τ = −m u w; F_w = −m ẇ with ẇ = a·n − ω u (the body turns under the velocity)."""
    u, w, omega = 0.7, -0.4, 1.1
    m_n = np.pi * DENSITY * (CHORD / 2) ** 2 * SPAN
    motion = state([0, 0, 0], [1, 0, 0, 0], [u, w, 0], [0, 0, omega])
    force, torque, _ = evaluate(Coefficients.ANDERSEN, motion)
    fx, fy, tz = andersen(u, w, omega)
    assert force == pytest.approx([fx + m_n * omega * w, fy + m_n * omega * u, 0.0], rel=1e-13)
    assert torque == pytest.approx([0.0, 0.0, tz - m_n * u * w], rel=1e-13)


class Manoeuvre:
    """A smooth rigid motion with exact derivatives: position a sin, orientation two turns in a row."""

    def __init__(self):
        self.amplitude, self.frequency, self.phase = RNG.normal(size=(3, 3))
        self.axes = [axis / np.linalg.norm(axis) for axis in RNG.normal(size=(2, 3))]
        self.rates = RNG.normal(size=2)

    def position(self, t):
        return self.amplitude * np.sin(self.frequency * t + self.phase)

    def linear(self, t):
        return self.amplitude * self.frequency * np.cos(self.frequency * t + self.phase)

    def linear_acceleration(self, t):
        return -self.amplitude * self.frequency**2 * np.sin(self.frequency * t + self.phase)

    def orientation(self, t):
        (w1, *v1), (w2, *v2) = (
            (np.cos(rate * t / 2), *(np.sin(rate * t / 2) * axis))
            for rate, axis in zip(self.rates, self.axes, strict=True)
        )
        v1, v2 = np.array(v1), np.array(v2)
        return np.array([w1 * w2 - v1 @ v2, *(w1 * v2 + w2 * v1 + np.cross(v1, v2))])

    def first_turn(self, t):
        return rotation_matrix(
            np.array([np.cos(self.rates[0] * t / 2), *(np.sin(self.rates[0] * t / 2) * self.axes[0])])
        )

    def angular(self, t):
        return self.rates[0] * self.axes[0] + self.rates[1] * self.first_turn(t) @ self.axes[1]

    def angular_acceleration(self, t):
        return self.rates[0] * self.rates[1] * np.cross(self.axes[0], self.first_turn(t) @ self.axes[1])

    def motion(self, t):
        return state(self.position(t), self.orientation(t), self.linear(t), self.angular(t))


def added_mass_part(coefficients, manoeuvre, t, wind):
    """What is left of the whole fluid wrench, with −A·a, when the circulatory part is taken out."""
    force, torque, added = evaluate(coefficients, manoeuvre.motion(t), t, wind)
    rotation = rotation_matrix(manoeuvre.orientation(t))
    relative = manoeuvre.linear(t) - wind_at(wind, t, manoeuvre.position(t), manoeuvre.linear(t))[0]
    f, m = circulatory(coefficients, rotation, relative, manoeuvre.angular(t))
    body = rotation.T @ np.array([manoeuvre.linear_acceleration(t), manoeuvre.angular_acceleration(t)]).T
    reaction = added @ body.T.ravel()
    return force - f - rotation @ reaction[:3], torque - m - rotation @ reaction[3:]


def derivative(function, t, h=1e-3):
    """Sixth-order central difference."""
    pairs = ((45, 1), (-9, 2), (1, 3))
    return sum(c * (function(t + k * h) - function(t - k * h)) for c, k in pairs) / (60 * h)


@pytest.mark.parametrize("coefficients", SETS)
@pytest.mark.parametrize("gusty", [False, True])
def test_added_mass_obeys_kirchhoffs_equations(coefficients, gusty):
    """F = −dp/dt and τ = −dL/dt − V × p in the world, p = m_n (V·n) n, L = I_a (ω·z) z, V relative to the
    wind at the centre: differentiated numerically along a three-dimensional motion."""
    m_n = np.pi * DENSITY * (CHORD / 2) ** 2 * SPAN
    i_a = np.pi * DENSITY * (CHORD / 2) ** 4 * SPAN / 8
    for _ in range(10):
        wind, path = random_wind() if gusty else CALM, Manoeuvre()

        def relative(t, wind=wind, path=path):
            return path.linear(t) - wind_at(wind, t, path.position(t), path.linear(t))[0]

        def momenta(t, path=path, relative=relative):
            rotation = rotation_matrix(path.orientation(t))
            normal, axis = rotation[:, 1], rotation[:, 2]
            return np.concatenate(
                (m_n * (relative(t) @ normal) * normal, i_a * (path.angular(t) @ axis) * axis)
            )

        t = RNG.normal()
        force, torque = added_mass_part(coefficients, path, t, wind)
        rate = derivative(momenta, t)
        np.testing.assert_allclose(force, -rate[:3], rtol=0, atol=1e-8)
        expected = -rate[3:] - np.cross(relative(t), momenta(t)[:3])
        np.testing.assert_allclose(torque, expected, rtol=0, atol=1e-8)


@pytest.mark.parametrize("coefficients", SETS)
def test_power_of_the_added_mass_is_the_loss_of_its_energy(coefficients):
    m_n = np.pi * DENSITY * (CHORD / 2) ** 2 * SPAN
    i_a = np.pi * DENSITY * (CHORD / 2) ** 4 * SPAN / 8
    for _ in range(10):
        path, t = Manoeuvre(), RNG.normal()

        def energy(t, path=path):
            rotation = rotation_matrix(path.orientation(t))
            w, omega = path.linear(t) @ rotation[:, 1], path.angular(t) @ rotation[:, 2]
            return 0.5 * m_n * w**2 + 0.5 * i_a * omega**2

        force, torque = added_mass_part(coefficients, path, t, CALM)
        power = force @ path.linear(t) + torque @ path.angular(t)
        assert power == pytest.approx(-derivative(energy, t), abs=1e-8)


@pytest.mark.parametrize("coefficients", SETS)
def test_added_inertia_is_that_of_a_thin_plate(coefficients):
    """πρ(c/2)² s on the normal and πρ(c/2)⁴ s/8 about the span axis; validation.md, exact."""
    *_, added = evaluate(coefficients, random_state())
    expected = np.zeros((6, 6))
    expected[1, 1] = np.pi * DENSITY * (CHORD / 2) ** 2 * SPAN
    expected[5, 5] = np.pi * DENSITY * (CHORD / 2) ** 4 * SPAN / 8
    np.testing.assert_allclose(added, expected, rtol=1e-15, atol=0)
    assert np.trace(added) == pytest.approx(expected[1, 1] + expected[5, 5], rel=1e-15)
