"""Vortices of flows that are known: rotation, shear, strain, Hill's spherical vortex."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from linkwind.frames import VolumeFrame
from linkwind.log.vortices import SHARE, criterion, gradient, scale, vortices, vorticity
from tests.volumes import AXIS, RADIUS, SPEED, START, hill

STEP_NS = 1_000_000
RATE = 3.0  # 1/s


def linear(matrix: object) -> VolumeFrame:
    """The flow whose velocity gradient is this one everywhere."""
    place = np.stack(np.meshgrid(*(0.5 * np.arange(n) for n in (4, 5, 6)), indexing="ij"), axis=-1)
    velocity = place[..., ::-1] @ np.array(matrix, float).T + [4.0, 0.0, -1.0]
    return VolumeFrame(0, 0, (0.0, 0.0, 0.0), 0.5, velocity.astype("f4"), np.zeros((4, 5, 6), "f4"))


@pytest.mark.parametrize(
    ("matrix", "q", "omega"),
    [
        ([[0, -RATE, 0], [RATE, 0, 0], [0, 0, 0]], RATE**2, (0, 0, 2 * RATE)),  # rotation about z
        ([[0, 0, RATE], [0, 0, 0], [-RATE, 0, 0]], RATE**2, (0, 2 * RATE, 0)),  # about y
        ([[0, RATE, 0], [0, 0, 0], [0, 0, 0]], 0.0, (0, 0, -RATE)),  # shear
        ([[RATE, 0, 0], [0, -RATE, 0], [0, 0, 0]], -(RATE**2), (0, 0, 0)),  # strain
        ([[0, 0, 0], [0, 0, 2 * RATE], [0, 4 * RATE, 0]], -8 * RATE**2, (2 * RATE, 0, 0)),
    ],
)
def test_gradient_q_and_vorticity_of_linear_flows(
    matrix: object, q: float, omega: tuple[float, float, float]
) -> None:
    change = gradient(linear(matrix))
    np.testing.assert_allclose(change, np.broadcast_to(matrix, (4, 5, 6, 3, 3)), atol=1e-5)
    np.testing.assert_allclose(criterion(change), q, atol=1e-4)
    np.testing.assert_allclose(vorticity(change), np.broadcast_to(omega, (4, 5, 6, 3)), atol=2e-5)


@pytest.fixture(scope="module")
def frame() -> VolumeFrame:
    return hill(0.1, STEP_NS, size=(44, 46, 56), cell=0.025)


def test_the_vorticity_of_hill_s_vortex_is_that_of_the_book(frame: VolumeFrame) -> None:
    z, y, x = np.meshgrid(*(o + frame.cell * np.arange(n) for o, n in zip(
        frame.origin[::-1], frame.shape, strict=True)), indexing="ij")  # fmt: skip
    x, y, z = x - START - SPEED * 0.1, y - AXIS[0], z - AXIS[1]
    inside = (
        np.sqrt(x * x + y * y + z * z) < RADIUS - 2.0 * frame.cell
    )  # where differences do not see the edge
    expected = 7.5 * SPEED / RADIUS**2 * np.stack([0.0 * x, -z, y], axis=-1)
    found = vorticity(gradient(frame))
    assert inside.sum() > 1000
    np.testing.assert_allclose(found[inside], expected[inside], atol=0.01 * np.abs(expected[inside]).max())


def test_the_level_has_the_share_of_the_rotation_within(frame: VolumeFrame) -> None:
    q = criterion(gradient(frame)).astype(float)
    found = scale([frame])
    rate = np.sqrt(np.where(q > 0.0, q, 0.0))
    within = rate[q >= found.level].sum() / rate.sum()
    assert SHARE - 0.01 < within < SHARE + 0.08  # levels are a quarter of an octave apart
    x, y, z = found.turning
    assert x < 0.1 * min(y, z)  # a ring around the line along x
    assert y == pytest.approx(z, rel=0.05)
    assert found.top == pytest.approx(3.0 * math.sqrt(found.level), rel=0.05)  # 1.5 times the least vorticity


def test_one_level_for_all_frames(frame: VolumeFrame) -> None:
    slow = dataclasses.replace(frame, velocity=0.1 * frame.velocity)
    alone, both = scale([frame]), scale([slow, frame])
    assert scale([frame, slow]).level == both.level
    assert 0.3 * alone.level < both.level < alone.level
    assert scale([slow]).level == pytest.approx(0.01 * alone.level, rel=0.25)


def test_surfaces_lie_around_the_ring_and_carry_its_vorticity_and_velocity(frame: VolumeFrame) -> None:
    on = scale([frame])
    point, about, velocity, triangle = vortices(frame, on, 10**6)
    off = point - (START + SPEED * 0.1, *AXIS)
    assert np.linalg.norm(off, axis=1).max() < RADIUS + frame.cell
    radial = np.hypot(off[:, 1], off[:, 2])
    signed = off[:, 1] if on.axis == 2 else -off[:, 2]
    sure = np.linalg.norm(off, axis=1) < RADIUS - 2.5 * frame.cell
    np.testing.assert_allclose(about[sure], 7.5 * SPEED / RADIUS**2 * signed[sure], atol=2.0)
    inner = SPEED * (2.5 - 1.5 * (off[:, 0] ** 2 + 2.0 * radial**2) / RADIUS**2)
    np.testing.assert_allclose(velocity[sure, 0], inner[sure], atol=0.05)
    assert sure.sum() > 100
    few = vortices(frame, on, 500)
    assert len(few.triangle) <= 500 < len(triangle)


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_in_a_stream_nothing_turns(noise: float) -> None:
    around = np.array([5.0, 0.0, 0.0]) + noise * np.random.default_rng(2).normal(size=(8, 9, 10, 3))
    frame = VolumeFrame(0, 0, (0.0, 0.0, 0.0), 0.1, around.astype("f4"),
                        np.zeros((8, 9, 10), "f4"))  # fmt: skip
    found = scale([frame])
    assert math.isinf(found.level)
    assert len(vortices(frame, found, 100).triangle) == 0
    assert found.top == 1.0


def test_what_is_no_number_is_no_vortex(frame: VolumeFrame) -> None:
    wild = frame.velocity.copy()
    wild[:, :, 20:30] = np.nan
    wild[3, 4, 5], wild[10, 10, 10] = np.inf, 3e38
    found = scale([dataclasses.replace(frame, velocity=wild)])
    shown = vortices(dataclasses.replace(frame, velocity=wild), scale([frame]), 10**6)
    assert found.level > 0.0
    assert np.isfinite(shown.point).all()
    low, high = (frame.origin[0] + frame.cell * i for i in (20.0, 29.0))
    assert not ((shown.point[:, 0] > low) & (shown.point[:, 0] < high)).any()
