"""Frames of a made-up wake of the synthetic two links: vortices shed by their edges, carried by the wind."""

import numpy as np

from linkwind.frames import FlowFrame

WIND = np.array([-5.0, 0.0])


def shed(run, every):
    """Return birth time, place and strength of the vortices, one at each edge of each plate at a time."""
    path = run.trajectory
    born = []
    for k in range(0, len(path.t), every):
        for body in range(path.position.shape[1]):
            theta = 2.0 * np.arctan2(path.orientation[k, body, 3], path.orientation[k, body, 0])
            along = np.array([np.cos(theta), np.sin(theta)])
            lift = along @ WIND / 5.0
            for edge in (-0.25, 0.25):
                at = path.position[k, body, :2] + edge * along
                wobble = np.sin(40.0 * path.t[k] + 3.0 * body)
                strength = 0.16 * np.sign(edge) * (0.6 + lift + 0.6 * wobble)
                born.append((path.t[k], *at, strength))
    return np.array(born)


def wake(run, *, every=25, rows=112, columns=128, width=5.1, left=-4.1, bottom=None):
    """Yield frames of the wake at every so many-th step of the run."""
    cell = width / columns
    bottom = -0.9 * rows * cell if bottom is None else bottom
    x = (left + cell * (np.arange(columns) + 0.5)).astype("f4")
    y = (bottom + cell * (np.arange(rows) + 0.5)).astype("f4")[:, None]
    vortices = shed(run, 8)
    noise = np.random.default_rng(4)
    for k in range(0, len(run.trajectory.t), every):
        t = run.trajectory.t[k]
        u, v = np.full((rows, columns), WIND[0], "f4"), np.zeros((rows, columns), "f4")
        w = 0.05 * noise.standard_normal((rows, columns)).astype("f4")
        for born, px, py, strength in vortices:
            age = np.float32(t - born)
            if age < 0.0:
                break
            dx = x - np.float32(px + 0.85 * WIND[0] * age + 0.05 * np.sin(9 * born))
            dy = y - np.float32(py + 0.3 * strength * age * 4 + 0.1 * age * np.sin(31.0 * born))
            squared, size = dx**2 + dy**2, np.float32(0.05**2 + 6e-3 * age)
            core = np.exp(-squared / size)
            w += np.float32(strength / (np.pi * size)) * core
            swirl = np.float32(strength / (2 * np.pi)) * (1 - core) / np.maximum(squared, np.float32(1e-9))
            u -= swirl * dy
            v += swirl * dx
        pressure = 0.6125 * (25.0 - u**2 - v**2)
        origin = (float(x[0]), float(y[0, 0]))
        yield FlowFrame(k, k * 1_000_000, origin, cell, np.dstack([u, v]), pressure.astype("f4"), w)
