"""What has to hold for a flat plate whatever the coefficients (validation.md, quasi-steady plate)."""

import numpy as np
import pytest

from linkwind import aero
from linkwind.errors import ProtocolError, ScenarioError, SimulationError
from linkwind.scenario import loads
from linkwind.spatial import Motion, Wrench
from tests.aero.scenes import PLATE, model, wrench

RNG = np.random.default_rng(22)
SETS = ("ristroph", "andersen")
CHORD, SPAN, DENSITY = 0.4, 0.7, 1.225
Q = 0.5 * DENSITY * CHORD * SPAN  # times V²: the unit of force


@pytest.fixture(params=SETS)
def plate(request):
    return model(PLATE, f"aero.plate.coefficients={request.param}")


def planar(u, w, omega):
    """A plate that lies along x, moving with (u, w) and turning with omega."""
    motion = Motion.at_rest(1)
    motion.linear[0, :2], motion.angular[0, 2] = (u, w), omega
    return motion


def spatial():
    q = RNG.normal(size=4)
    return Motion(
        RNG.normal(size=(1, 3)), (q / np.linalg.norm(q))[None], 3 * RNG.normal(size=(1, 3)),
        3 * RNG.normal(size=(1, 3)),
    )  # fmt: skip


def circulatory(plate, u, w, omega):
    """The planar wrench (x, y, torque) without the velocity part of the added mass."""
    out = wrench(plate, planar(u, w, omega))
    m_n = out.added_inertia[0, 1, 1]
    return np.array([*out.force[0, :2], out.torque[0, 2]]) - m_n * np.array([omega * w, omega * u, -u * w])


def test_a_plate_that_only_translates_never_gains_energy_from_air_at_rest(plate):
    for u, w in RNG.normal(size=(500, 2)):
        assert circulatory(plate, u, w, 0.0) @ (u, w, 0.0) < 0.0


def test_a_plate_that_only_turns_is_slowed_down(plate):
    for omega in RNG.normal(size=100):
        force_x, force_y, torque = circulatory(plate, 0.0, 0.0, omega)
        assert force_x == force_y == 0.0
        assert torque * omega < 0.0


def test_drag_takes_energy_from_the_motion_of_the_centre_whatever_the_rotation(plate):
    """Lift, translational and rotational, is normal to the velocity; drag is against it."""
    for u, w, omega in RNG.normal(size=(500, 3)):
        force_x, force_y, _ = circulatory(plate, u, w, omega)
        assert force_x * u + force_y * w < 0.0


def test_andersen_takes_energy_in_every_state():
    plate = model(PLATE, "aero.plate.coefficients=andersen")
    for state in RNG.normal(size=(500, 3)):
        assert circulatory(plate, *state) @ state < 0.0


def test_drag_of_a_plate_across_the_stream():
    """C_D2 = 1.9 (Li et al. 2022); A + B = 2.4 on the half chord (Andersen et al. 2005)."""
    for coefficients, expected in (("ristroph", 1.9 * Q * 4), ("andersen", 2.4 * Q * 4)):
        plate = model(PLATE, f"aero.plate.coefficients={coefficients}")
        assert circulatory(plate, 0.0, -2.0, 0.0) == pytest.approx([0.0, expected, 0.0], abs=1e-9)


@pytest.mark.parametrize("velocity", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
def test_no_lift_and_no_torque_along_and_across_the_stream(plate, velocity):
    u, w = velocity
    force_x, force_y, torque = circulatory(plate, u, w, 0.0)
    assert force_y * u - force_x * w == pytest.approx(0.0, abs=1e-16)
    assert torque == pytest.approx(0.0, abs=1e-16)


def test_the_side_that_is_called_up_does_not_matter(plate):
    """Half a turn about the chord or about the span gives the same plate."""
    for _ in range(50):
        motion = spatial()
        first = wrench(plate, motion)
        w, x, y, z = motion.orientation[0]
        for turned in ((-x, w, z, -y), (-z, y, -x, w)):  # q times (0, 1, 0, 0) and (0, 0, 0, 1)
            second = wrench(plate, Motion(motion.position, np.array([turned]), motion.linear, motion.angular))
            np.testing.assert_allclose(second.force, first.force, rtol=0, atol=1e-12)
            np.testing.assert_allclose(second.torque, first.torque, rtol=0, atol=1e-12)


def test_the_four_quadrants_mirror_each_other(plate):
    for u, w, omega in np.abs(RNG.normal(size=(100, 3))):
        x, y, torque = wrench_of = circulatory(plate, u, w, omega)
        fore_aft = circulatory(plate, -u, w, -omega)
        up_down = circulatory(plate, u, -w, -omega)
        scale = np.abs(wrench_of).max()
        np.testing.assert_allclose(fore_aft, (-x, y, -torque), rtol=0, atol=1e-14 * scale)
        np.testing.assert_allclose(up_down, (x, -y, -torque), rtol=0, atol=1e-14 * scale)


@pytest.mark.parametrize(("u", "w"), [(1e-9, 1.0), (1e-9, -1.0), (1.0, 1e-9), (-1.0, 1e-9)])
def test_forces_do_not_jump_between_quadrants(plate, u, w):
    """Across the stream (u through 0) and along it (w through 0)."""
    beyond = (-u, w) if abs(u) < abs(w) else (u, -w)
    difference = circulatory(plate, *beyond, 0.3) - circulatory(plate, u, w, 0.3)
    np.testing.assert_allclose(difference, 0.0, rtol=0, atol=1e-8)


def test_no_force_on_a_plate_that_moves_with_the_wind(plate):
    """At zero relative speed there is no angle of attack; the wrench is zero, not NaN."""
    out = wrench(plate, Motion.at_rest(1))
    assert not out.force.any()
    assert not out.torque.any()
    windy = model(PLATE, "environment.wind=[3.0, -1.0, 2.0]")
    motion = Motion.at_rest(1)
    motion.linear[0] = 3.0, -1.0, 2.0
    assert not wrench(windy, motion).force.any()


@pytest.mark.parametrize("speed", [1e-300, 1e-160, 1e-9])
def test_the_smallest_speeds_are_harmless(plate, speed):
    out = circulatory(plate, speed, -0.3 * speed, 0.0)
    assert np.isfinite(out).all()
    assert np.abs(out).max() <= 10 * Q * speed**2


def test_motion_along_the_span_changes_no_force(plate):
    motion = planar(1.0, -0.4, 0.0)
    before = wrench(plate, motion)
    motion.linear[0, 2] = 5.0
    after = wrench(plate, motion)
    np.testing.assert_allclose(after.force, before.force, rtol=0, atol=1e-15)
    # The couple about the chord is that of the added momentum p carried sideways, −V × p.
    m_n, w = before.added_inertia[0, 1, 1], -0.4
    assert after.torque[0] - before.torque[0] == pytest.approx([m_n * w * 5.0, 0.0, 0.0], abs=1e-15)


GUSTY = """
[environment]
wind = [{wx}, {wy}, {wz}]
gusts = [
  {{ amplitude = [0.5, 1.0, -0.2], frequency = {f1}, wavenumber = [0.3, -0.8, 0.5], phase_deg = 30 }},
  {{ amplitude = [0.1, -0.7, 0.4], frequency = {f2}, wavenumber = [-1.1, 0.2, 0.0] }},
]
"""


@pytest.mark.parametrize("coefficients", SETS)
def test_two_observers_in_uniform_motion_find_the_same_forces(coefficients):
    """Seen by one who moves with V, wind and plate lose V and a gust f turns into f + k·V."""
    V = np.array([2.0, -1.5, 0.7])
    waves = np.array([[0.3, -0.8, 0.5], [-1.1, 0.2, 0.0]])
    wind, frequencies = np.array([-4.0, 1.0, 0.5]), np.array([1.3, -0.4])

    def scene(velocity):
        f1, f2 = frequencies + waves @ velocity
        wx, wy, wz = wind - velocity
        gusts = GUSTY.format(f1=f1, f2=f2, wx=wx, wy=wy, wz=wz)
        return model(PLATE + gusts, f"aero.plate.coefficients={coefficients}")

    at_rest, moving = scene(np.zeros(3)), scene(V)
    for t in RNG.normal(size=20):
        motion = spatial()
        seen = Motion(motion.position - V * t, motion.orientation, motion.linear - V, motion.angular)
        first, second = wrench(at_rest, motion, t), wrench(moving, seen, t)
        np.testing.assert_allclose(second.force, first.force, rtol=0, atol=1e-12 * np.abs(first.force).max())
        np.testing.assert_allclose(second.torque, first.torque, rtol=0, atol=1e-11)


def test_a_diverged_motion_is_reported_with_plate_time_and_state(plate):
    motion = planar(np.inf, 0.0, 0.0)
    with pytest.raises(SimulationError, match=r'scene: plate "plate": .* t = 0\.25 s.*velocity \[inf'):
        plate.evaluate(0.25, motion, Wrench.zeros(1, added_inertia=True))


def test_a_body_that_is_no_plate_is_refused():
    scenario = loads(PLATE, "scene")
    body = scenario.bodies[0].model_copy(update={"shape": None})
    broken = scenario.model_copy(update={"bodies": (body,)})
    expected = r'scene: bodies\[0\] "plate"\.shape: expected type "plate" or "wing".*got none'
    with pytest.raises(ScenarioError, match=expected):
        aero.build(broken, broken.providers[0])


def test_there_is_nothing_to_remember(plate):
    assert plate.save() == b""
    plate.restore(b"")
    with pytest.raises(ProtocolError, match="expected an empty checkpoint; got 3 bytes"):
        plate.restore(b"abc")
