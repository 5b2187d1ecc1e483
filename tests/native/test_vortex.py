"""The vortex lattice itself: Biot and Savart, no flow through a wing, how forces change, the same bits."""

import numpy as np
import pytest
from scipy.integrate import quad_vec

from linkwind.native import vortex as module
from linkwind.native.vortex import SurfaceTable, VortexLattice
from linkwind.native.wind import WindTable
from tests.native.builds import BUILDS, compiled, use

STEP = 0.05
WIND = WindTable(np.array([0.3, -0.1, 0.2]), np.array([[0.1, 0.2, 0.0, 1.5, 0.3, 0.0, 0.2, 0.4, 0.0]]))
CALM = WindTable(np.zeros(3), np.zeros((0, 9)))


def rings(chord, span, chordwise=3, spanwise=4):
    """Corners and collocation points of a plate whose edge trails towards +x."""
    panel, width = chord / chordwise, span / spanwise
    x, z = panel * (np.arange(chordwise + 1) + 0.25), width * np.arange(spanwise + 1)
    corner = np.zeros((chordwise + 1, spanwise + 1, 3))
    corner[..., 0], corner[..., 2] = x[:, None] - 0.5 * chord, z - 0.5 * span
    control = 0.5 * (corner[:-1, :-1] + corner[1:, 1:])
    return corner, control


def wings(n=2, wind=WIND, threads=1, rows=8, core=0.05, panels=(3, 4), suction=1.0):
    corner, control = map(np.array, zip(*(rings(1.0, 1.5 + i, *panels) for i in range(n)), strict=True))
    return VortexLattice(SurfaceTable(corner, control, 1.2, STEP, core, rows, wind, suction), threads)


def turn(axis, angle):
    axis = np.array(axis) / np.linalg.norm(axis)
    return np.array([np.cos(0.5 * angle), *(np.sin(0.5 * angle) * axis)])


def state(t, n=2):
    """Wings one above the other that fly along -x, heave, and turn about all axes."""
    pose, twist = np.zeros((n, 7)), np.zeros((n, 6))
    for i in range(n):
        pose[i, :3] = -t, 1.3 * i + 0.1 * np.sin(3.0 * t), 0.2 * i * t
        pose[i, 3:] = turn([0.2, -0.3, 1.0], -0.15 + 0.2 * np.sin(2.0 * t + i))
        twist[i] = -1.0, 0.3 * np.cos(3.0 * t), 0.2 * i, 0.1, -0.15, 0.4 * np.cos(2.0 * t + i)
    return pose, twist


def fly(lattice, steps, begin=0):
    out = b""
    for k in range(begin, begin + steps):
        assert lattice.evaluate(k * STEP, *state(k * STEP, len(lattice.wrench)))
        out += lattice.wrench.tobytes() + lattice.response.tobytes()
        lattice.commit(k * STEP, *state(k * STEP, len(lattice.wrench)))
    return out


def ring_velocity(corners, strength, point):
    """Biot and Savart's integral around a polygon."""
    total = np.zeros(3)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = b - a

        def element(s, a=a, along=along):
            r = point - (a + s * along)
            return np.cross(along, r) / np.linalg.norm(r) ** 3

        total += quad_vec(element, 0.0, 1.0, epsabs=1e-12)[0]
    return strength / (4.0 * np.pi) * total


def test_the_velocity_is_that_of_biot_and_savart():
    lattice = wings(n=1, wind=CALM, core=1e-6)
    fly(lattice, 2)
    lattice.evaluate(2 * STEP, *state(2 * STEP, 1))
    point = np.array([0.4, 0.5, 0.3])
    wake, strength = lattice.wake
    surface, expected = lattice.surface[0], np.zeros(3)
    behind = np.concatenate([surface[-1:], wake[:, 0]])
    for corner, values in ((surface, lattice.trial_strength[0]), (behind, strength[:, 0])):
        for i, j in np.ndindex(values.shape):
            around = corner[[i, i, i + 1, i + 1], [j, j + 1, j + 1, j]]
            expected += ring_velocity(around, values[i, j], point)
    np.testing.assert_allclose(lattice.velocity(2 * STEP, point[None])[0], expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("panels", [(3, 4), (7, 9)])  # the second are solved for in blocks
def test_nothing_passes_a_wing(panels):
    lattice = wings(core=1e-6, panels=panels)
    fly(lattice, 6)
    pose, twist = state(6 * STEP)
    lattice.evaluate(6 * STEP, pose, twist)
    for i, (w, x, y, z) in enumerate(pose[:, 3:]):
        matrix = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        arm = lattice.table.control[i].reshape(-1, 3) @ matrix.T
        body = twist[i, :3] + np.cross(twist[i, 3:], arm)
        through = (lattice.velocity(6 * STEP, pose[i, :3] + arm) - body) @ matrix[:, 1]
        np.testing.assert_allclose(through, 0.0, atol=1e-7)


@pytest.mark.parametrize("suction", [1.0, 0.3])
def test_the_response_is_the_derivative_of_the_wrench(suction):
    """The wrench is a polynomial of second degree in the twists, whose central differences are exact."""
    lattice = wings(suction=suction)
    fly(lattice, 5)
    pose, twist = state(5 * STEP)

    def wrench(change):
        lattice.evaluate(5 * STEP, pose, twist + change.reshape(2, 6))
        return lattice.wrench.ravel().copy()

    response = [(wrench(-change) - wrench(change)) / 0.2 for change in 0.1 * np.eye(12)]
    lattice.evaluate(5 * STEP, pose, twist)
    expected = np.transpose(response)
    np.testing.assert_allclose(lattice.response, expected, rtol=0, atol=1e-11 * abs(expected).max())


def test_without_suction_the_force_stands_across_the_plate():
    """With it a wing that glides in its own wake is pulled forward; the share counts once."""
    pulls = []
    for suction in (0.0, 0.5, 1.0):
        lattice = wings(n=1, wind=CALM, suction=suction)
        angle = -0.1
        for k in range(8):
            pose = np.array([[-k * STEP, 0.0, 0.0, *turn([0, 0, 1], angle)]])
            lattice.evaluate(k * STEP, pose, np.array([[-1.0, 0.0, 0.0, 0.0, 0.0, 0.0]]))
            lattice.commit(k * STEP, pose, np.array([[-1.0, 0.0, 0.0, 0.0, 0.0, 0.0]]))
        pulls.append(lattice.wrench[0, :3] @ [np.cos(angle), np.sin(angle), 0.0])
        assert lattice.wrench[0, 1] > 0.02
    assert abs(pulls[0]) < 1e-15
    assert pulls[2] < -1e-3
    assert pulls[1] == pytest.approx(0.5 * pulls[2], rel=1e-12)


def test_the_strengths_follow_the_accepted_twist():
    """They are linear in it: accepted with another twist, they are those of an evaluation with it."""
    one, other = wings(), wings()
    for lattice in (one, other):
        fly(lattice, 4)
    pose, twist = state(4 * STEP)
    accepted = twist + np.random.default_rng(1).normal(scale=0.1, size=(2, 6))
    one.evaluate(4 * STEP, pose, twist)
    one.commit(4 * STEP, pose, accepted)
    other.evaluate(4 * STEP, pose, accepted)
    np.testing.assert_allclose(one.strength, other.trial_strength, rtol=0, atol=1e-12)


def test_only_motion_relative_to_the_air_counts():
    flying, standing = (
        wings(n=1, wind=CALM),
        wings(n=1, wind=WindTable(np.array([1.0, 0, 0]), np.zeros((0, 9)))),
    )
    for k in range(8):
        pose, twist = state(k * STEP, 1)
        flying.evaluate(k * STEP, pose, twist)
        flying.commit(k * STEP, pose, twist)
        pose[:, 0] += k * STEP
        twist[:, 0] += 1.0
        standing.evaluate(k * STEP, pose, twist)
        standing.commit(k * STEP, pose, twist)
    np.testing.assert_allclose(flying.wrench, standing.wrench, rtol=0, atol=1e-11)


def test_a_mirrored_flight_has_mirrored_forces():
    """In the plane of symmetry z = 0 of a wing, forces along z and torques about x and y are zero."""
    lattice = wings(n=1, wind=CALM)
    for k in range(8):
        t = k * STEP
        pose = np.array([[-t, 0.1 * np.sin(t), 0.0, *turn([0, 0, 1], -0.2 * np.cos(t))]])
        twist = np.array([[-1.0, 0.1 * np.cos(t), 0.0, 0.0, 0.0, 0.2 * np.sin(t)]])
        lattice.evaluate(t, pose, twist)
        lattice.commit(t, pose, twist)
    assert abs(lattice.wrench[0, 1]) > 0.1
    np.testing.assert_allclose(lattice.wrench[0, [2, 3, 4]], 0.0, atol=1e-14)


def test_wakes_keep_as_many_rows_as_are_wanted():
    lattice = wings(rows=5)
    for k in range(8):
        fly(lattice, 1, k)
        assert lattice.rows == min(k + 1, 5)
    short, long = wings(rows=5), wings(rows=8)
    for each in (short, long):
        fly(each, 5)
    assert (short.wake[0] == long.wake[0]).all()


@pytest.mark.parametrize("threads", [2, 3])
def test_bits_do_not_depend_on_the_number_of_threads(threads):
    assert fly(wings(threads=threads), 6) == fly(wings(), 6)


@pytest.mark.parametrize("name", BUILDS)
def test_bits_do_not_depend_on_instructions_and_compiler(name, monkeypatch):
    expected = fly(wings(panels=(7, 9)), 6)
    use(monkeypatch, module, compiled(name))
    assert fly(wings(panels=(7, 9)), 6) == expected


def test_what_is_restored_goes_on_alike():
    lattice = wings()
    fly(lattice, 5)
    blob = lattice.save()
    on = fly(lattice, 6, 5)
    lattice.restore(blob)
    assert fly(lattice, 6, 5) == on
    fresh = wings()
    fresh.restore(blob)
    assert fly(fresh, 6, 5) == on


def test_a_blob_of_other_wings_is_refused():
    lattice = wings()
    for blob in (b"abc", bytes(80), bytes(8 * 10_000_001)):
        with pytest.raises(ValueError, match=f"288 bytes and 304 for each row, up to 2720; got {len(blob)}"):
            lattice.restore(blob)
    lattice.restore(b"")
    assert lattice.rows == 0
