"""Bodies in the lattice in space: against full matrices in double precision, and what must hold exactly."""

import numpy as np
import pytest

from linkwind.native import boundary3 as module
from linkwind.native.boundary import Placement
from linkwind.native.boundary3 import Boundary3, Markers3
from linkwind.native.lattice3 import Lattice3
from linkwind.spatial import Motion
from tests.native.builds import BUILDS, compiled, use
from tests.native.flows3 import WEIGHTS, C, smooth_noise

SOFTNESS = 1e-5
SIZE = (34, 30, 32)
POSES = np.array([[14.3, 13.1, 15.2, 0.9, 0.3, 0.1, -0.2], [17.8, 15.6, 15.1, 0.6, -0.2, 0.5, 0.3]])
POSES[:, 3:] /= np.linalg.norm(POSES[:, 3:], axis=1)[:, None]
TWISTS = np.array([[0.05, 0.02, -0.01, 0.003, 0.002, -0.001], [-0.03, 0.01, 0.02, -0.002, 0.004, 0.001]])


def plate(chord, span, spacing=1.1):
    """A grid of markers about its middle, in the plane of x and z, and the quads between them."""
    x, z = ((np.arange(n) - (n - 1) / 2) * spacing for n in (chord, span))
    number = np.arange(chord * span).reshape(span, chord)
    corners = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    return np.array([(a, 0.0, b) for b in z for a in x]), np.stack(corners, axis=-1).reshape(-1, 4)


def ball(radius, count):
    """Markers on a spiral around a ball."""
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    around = np.sqrt(1 - z * z)
    return radius * np.column_stack([around * np.cos(turn), around * np.sin(turn), z])


def alone(point, face=()):
    """The markers of a single body."""
    face = np.array(face, np.int32).reshape(-1, 4)
    return Markers3(np.zeros(len(point), np.int32), point, face, np.eye(1, dtype=np.int32))


def one_plate():
    return alone(*plate(7, 9))


def plate_and_ball(joined=1):
    """Close enough for their stencils to meet; 63 + 60 markers, no whole number of blocks."""
    (point, face), other = plate(7, 9), ball(2.3, 60)
    body = np.repeat([0, 1], [len(point), len(other)]).astype(np.int32)
    may = np.array([[0, joined], [joined, 0]], np.int32)
    return Markers3(body, np.vstack([point, other]), face.astype(np.int32), may)


def fluid(threads=1, size=SIZE):
    lattice = Lattice3(*size, shear_rate=1.9, stream=(0.03, -0.02, 0.01), fringe=4, threads=threads)
    smooth_noise(lattice, 0.04, np.random.default_rng(3))
    lattice.populations[:] += np.random.default_rng(4).normal(scale=1e-3, size=lattice.populations.shape)
    return lattice


def streamed(lattice):
    """Density and velocity of every cell after streaming, without force; periodic."""
    f = lattice.populations.astype(float) + WEIGHTS[:, None, None, None]
    f = np.array([np.roll(f[q], C[q][::-1], (0, 1, 2)) for q in range(19)])
    density = f.sum(0)
    return density, np.tensordot(C.T, f, 1) / density


def three_points(r):
    """The weights of the cells at -1, 0 and 1 for a marker at r from the middle one.

    From what defines them: their sum is 1, their mean r, the sum of their squares 1/2.
    """
    middle = (1 + np.sqrt(1 - 3 * r * r)) / 3
    return np.array([(1 - middle - r) / 2, middle, (1 - middle + r) / 2])


def interpolation(at, shape):
    """Weights of all cells of a window (nz, ny, nx) at points (k, 3), shape (k, cells)."""
    out = np.zeros((len(at), *shape))
    for row, point in zip(out, at, strict=True):
        cell = np.floor(point + 0.5).astype(int)
        x, y, z = (three_points(r) for r in point - cell)
        i, j, k = cell
        row[k - 1 : k + 2, j - 1 : j + 2, i - 1 : i + 2] = z[:, None, None] * y[:, None] * x
    return out.reshape(len(at), -1)


class Oracle:
    """The equations as they are written down, with full matrices."""

    def __init__(self, lattice, markers, poses, twists):
        motion = Motion.at_rest(len(poses))
        motion.orientation[:] = poses[:, 3:]
        turn = motion.rotation()[markers.body]
        arm = np.einsum("kab,kb->ka", turn, markers.point)
        self.at = poses[markers.body, :3] + arm
        density, velocity = streamed(lattice)
        self.weights = interpolation(self.at, density.shape)
        self.lightness = 1 / (2 * density.ravel())
        self.fluid = velocity.reshape(3, -1)
        self.wall = np.zeros((3, len(arm), 6 * len(poses)))  # velocity along each axis by the twists
        for k, (b, r) in enumerate(zip(markers.body, arm, strict=True)):
            for part, axis in enumerate(np.eye(3)):
                self.wall[:, k, 6 * b + part] = axis
                self.wall[:, k, 6 * b + 3 + part] = np.cross(axis, r)
        mobility = (self.weights * self.lightness) @ self.weights.T
        self.mobility = mobility + SOFTNESS * np.diag(np.diag(mobility))
        self.lack = self.wall @ twists.ravel() - self.fluid @ self.weights.T
        self.force = np.linalg.solve(self.mobility, self.lack.T)  # of each marker on the fluid
        self.wrench = -np.einsum("akd,ka->d", self.wall, self.force).reshape(-1, 6)
        self.response = sum(of.T @ np.linalg.solve(self.mobility, of) for of in self.wall)

    def spread(self, shape):
        return (self.force.T @ self.weights).reshape(3, *shape)


def placed(lattice, markers, poses=POSES):
    poses = np.atleast_2d(poses)
    boundary = Boundary3(len(poses), markers)
    assert boundary.place(lattice, poses)[0] is Placement.PLACED
    return boundary


def acted(boundary, lattice, twists):
    """The forces of a step, caught before they are set to zero again, and what it says of leaks."""
    caught = []
    lattice.step = lambda shift=None: caught.append((lattice.force.copy(), lattice.forced.copy()))
    leak = boundary.step(lattice, twists)
    del lattice.step
    return *caught[0], leak


def test_wrench_response_and_forces_are_those_of_the_equations():
    lattice, markers = fluid(), plate_and_ball()
    boundary, oracle = placed(lattice, markers), Oracle(lattice, markers, POSES, TWISTS)
    np.testing.assert_allclose(boundary.at, oracle.at, rtol=0, atol=1e-13)
    boundary.evaluate(TWISTS)
    scale = np.abs(oracle.wrench).max()
    np.testing.assert_allclose(boundary.wrench, oracle.wrench, rtol=0, atol=1e-9 * scale)
    scale = np.abs(oracle.response).max()
    np.testing.assert_allclose(boundary.response, oracle.response, rtol=0, atol=1e-9 * scale)
    assert np.abs(oracle.response[:6, 6:]).max() > 1e-3 * scale  # the bodies feel each other
    force, forced, _ = acted(boundary, lattice, TWISTS)
    expected = oracle.spread(force.shape[1:])
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
    assert np.array_equal(forced, expected.any(axis=(0, 3)))
    assert not lattice.force.any()
    assert not lattice.forced.any()


def test_at_every_marker_the_fluid_moves_with_the_body():
    lattice, markers = fluid(), plate_and_ball()
    boundary, oracle = placed(lattice, markers), Oracle(lattice, markers, POSES, TWISTS)
    force = acted(boundary, lattice, TWISTS)[0].astype(float).reshape(3, -1)
    velocity = (oracle.fluid + force * oracle.lightness) @ oracle.weights.T
    missed = velocity - oracle.wall @ TWISTS.ravel()
    softness = SOFTNESS * np.diag(oracle.mobility) * np.abs(oracle.force).max()
    assert np.abs(missed).max() < softness.max() + 1e-7
    assert np.abs(oracle.lack).max() > 1000 * np.abs(missed).max()


def test_the_fluid_gets_what_the_bodies_lose():
    lattice = fluid()
    boundary = placed(lattice, plate_and_ball())
    boundary.evaluate(TWISTS)
    force = acted(boundary, lattice, TWISTS)[0].astype(float)
    z, y, x = np.mgrid[tuple(map(slice, force.shape[1:]))]
    given = force.sum(axis=(1, 2, 3))
    np.testing.assert_allclose(given, -boundary.wrench[:, :3].sum(axis=0), rtol=0, atol=1e-6)
    turned = np.cross(np.moveaxis([x, y, z], 0, -1), np.moveaxis(force, 0, -1)).sum(axis=(0, 1, 2))
    about = boundary.wrench[:, 3:] + np.cross(POSES[:, :3], boundary.wrench[:, :3])
    np.testing.assert_allclose(turned, -about.sum(axis=0), rtol=0, atol=2e-5)


def test_a_step_of_the_fluid_takes_the_forces_in():
    """In a fluid at rest the momentum after a step is the impulse, until it reaches the border."""
    lattice = Lattice3(*SIZE, shear_rate=1.5, fringe=4)
    boundary = placed(lattice, one_plate(), POSES[0])
    boundary.evaluate(TWISTS[:1])
    boundary.step(lattice, TWISTS[:1])
    momentum = np.tensordot(C.T, lattice.populations.astype(float), 1).sum(axis=(1, 2, 3))
    np.testing.assert_allclose(momentum, -boundary.wrench[0, :3], rtol=0, atol=1e-6)
    assert not lattice.force.any()


def test_the_response_is_symmetric_and_takes_energy():
    boundary = placed(fluid(), plate_and_ball())
    boundary.evaluate(TWISTS)
    assert np.array_equal(boundary.response, boundary.response.T)
    assert np.linalg.eigvalsh(boundary.response).min() > 0.0


def test_the_wrench_is_affine_in_the_twists():
    boundary = placed(fluid(), plate_and_ball())
    boundary.evaluate(TWISTS)
    first, response, change = boundary.wrench.copy(), boundary.response.copy(), TWISTS[::-1]
    boundary.evaluate(TWISTS + change)
    expected = first.ravel() - response @ change.ravel()
    np.testing.assert_allclose(boundary.wrench.ravel(), expected, rtol=0, atol=1e-12)


def test_the_axes_of_the_world_are_alike():
    """Fluid, body and twist turned by x → y → z → x give the wrench turned likewise."""
    size = (30, 30, 30)
    one, other, markers = fluid(size=size), fluid(size=size), one_plate()
    turn = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    to = [np.flatnonzero((turn @ c == C).all(1))[0] for c in C]
    for q, there in enumerate(to):  # what was at (x, y, z) comes to (z, x, y): arrays are (z, y, x)
        other.populations[there] = np.transpose(one.populations[q], (1, 2, 0))
    half = np.array([0.5, 0.5, 0.5, 0.5])  # the quaternion of that turn
    pose = POSES[0]
    turned = np.concatenate([turn @ pose[:3], _product(half, pose[3:])])
    wrenches = []
    for lattice, at, twist in ((one, pose, TWISTS[0]), (other, turned, np.kron(np.eye(2), turn) @ TWISTS[0])):
        boundary = placed(lattice, markers, at)
        boundary.evaluate(twist[None])
        wrenches.append(boundary.wrench[0].copy())
    expected = np.kron(np.eye(2), turn) @ wrenches[0]
    np.testing.assert_allclose(wrenches[1], expected, rtol=0, atol=1e-11)


def _product(a, b):
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.array([w, *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


def test_cells_and_the_order_of_the_markers_are_alike():
    """In a fluid at rest a shift by whole cells, or another order of markers, changes rounding only."""
    lattice, markers = Lattice3(*SIZE, shear_rate=1.5, fringe=4), one_plate()
    order = np.random.default_rng(5).permutation(len(markers.body))
    mixed = markers._replace(point=markers.point[order], face=markers.face[:0])
    shift = np.array([2.0, -1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    one, other = placed(lattice, markers, POSES[0]), placed(lattice, mixed, POSES[0] + shift)
    for boundary in (one, other):
        boundary.evaluate(TWISTS[:1])
    np.testing.assert_allclose(other.wrench, one.wrench, rtol=0, atol=1e-10)
    np.testing.assert_allclose(other.response, one.response, rtol=0, atol=1e-9)


def test_what_leaks_is_what_passes_between_the_markers():
    lattice, markers = fluid(), one_plate()
    boundary, oracle = placed(lattice, markers, POSES[0]), Oracle(lattice, markers, POSES[:1], TWISTS[:1])
    force, _, leak = acted(boundary, lattice, TWISTS[:1])
    middle = boundary.at[markers.face].mean(axis=1)
    weights = interpolation(middle, force.shape[1:])
    velocity = (oracle.fluid + force.reshape(3, -1) * oracle.lightness) @ weights.T
    wall = TWISTS[0, :3] + np.cross(TWISTS[0, 3:], middle - POSES[0, :3])
    motion = Motion.at_rest(1)
    motion.orientation[:] = POSES[:1, 3:]
    through = (velocity.T - wall) @ motion.rotation()[0, :, 1]
    assert leak == pytest.approx(np.abs(through).max(), rel=1e-5)


def test_a_closed_surface_leaks_little_and_one_with_gaps_much():
    leaks = []
    for spacing in (1.1, 3.2):
        lattice = Lattice3(*SIZE, shear_rate=1.5, fringe=4)
        boundary = placed(
            lattice, alone(*plate(5, 5, spacing)), np.array([16.2, 15.3, 16.1, 1.0, 0.0, 0.0, 0.0])
        )
        leaks.append(boundary.step(lattice, np.array([[0.0, 0.1, 0.0, 0.0, 0.0, 0.0]])))
    assert leaks[0] < 0.025  # a quarter of the plate's speed, at its corners
    assert leaks[1] > 0.09


def test_a_triangle_repeats_its_last_marker():
    lattice, markers = fluid(), one_plate()
    three = markers.face[:1, [0, 1, 2, 2]]
    boundary = placed(lattice, markers._replace(face=three), POSES[0])
    _, _, leak = acted(boundary, lattice, TWISTS[:1])
    assert 0.0 < leak < 0.05


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_marker_in_the_fringe_is_outside(axis, side):
    lattice = Lattice3(*SIZE, shear_rate=1.5, fringe=4)
    pose = np.array([[16.0, 15.0, 16.0, 1.0, 0.0, 0.0, 0.0]])
    boundary = Boundary3(1, alone(np.zeros((1, 3))))
    last = 6 if side < 0 else SIZE[axis] - 7  # fringe + 2 cells are not for bodies
    pose[0, axis] = last
    assert boundary.place(lattice, pose) == (Placement.PLACED, -1)
    pose[0, axis] += side
    assert boundary.place(lattice, pose) == (Placement.OUTSIDE, 0)


def test_bodies_that_touch_overlap_unless_joined():
    lattice = fluid()
    poses = POSES.copy()
    poses[1, :3] = poses[0, :3] + [0.0, 1.5, 0.0]
    for joined, expected in ((0, Placement.OVERLAP), (1, Placement.PLACED)):
        markers = plate_and_ball(joined)
        boundary = Boundary3(2, markers)
        placement, marker = boundary.place(lattice, poses)
        assert placement is expected
        if not joined:
            other = markers.body != markers.body[marker]
            assert np.linalg.norm(boundary.at[other] - boundary.at[marker], axis=1).min() <= 0.8
    assert Boundary3(2, plate_and_ball(0)).place(lattice, POSES)[0] is Placement.PLACED


def run(threads=1):
    """A few steps of two bodies that move; what is left of them, as bytes."""
    lattice, boundary = fluid(threads), Boundary3(2, plate_and_ball())
    poses, seen = POSES.copy(), []
    for k in range(4):
        poses[:, :3] += TWISTS[:, :3]
        boundary.place(lattice, poses)
        boundary.evaluate(TWISTS)
        seen += [boundary.wrench.tobytes(), boundary.response.tobytes()]
        seen.append(boundary.step(lattice, 1.1 * TWISTS, (k % 2, 0, -1)).hex())
        poses[:, :3] -= [k % 2, 0, -1]
    return [*seen, lattice.state]


@pytest.mark.parametrize("name", BUILDS)
def test_bits_do_not_depend_on_instructions_and_compiler(name, monkeypatch):
    expected = run()
    use(monkeypatch, module, compiled(name))
    assert run() == expected


def test_bits_do_not_depend_on_the_number_of_threads():
    assert run(2) == run()
