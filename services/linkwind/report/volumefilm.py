"""Vortices for the animations: the surfaces of each frame in few bytes.

A vertex is three int16 on the box of its frame; its velocity three int8 on the largest of the frame, by which
the page moves it between two frames; its vorticity an int8 on one scale for all frames.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwind.frames import VolumeFrame
from linkwind.log.vortices import Scale, Vortices, vortices
from linkwind.report.arrays import every_nth
from linkwind.report.volume import Volume
from linkwind.report.wakefilm import LEVELS, STEPS, colours

FRAMES = 64  # on the page of a report
TRIANGLES = 3000  # of a frame; its vertices must be fewer than uint16 can count
AXES = "xyz"


def volume_film(volume: Volume) -> dict[str, Any]:
    """Return what the animation of a report needs: what all frames share, and the frames."""
    chosen = every_nth(len(volume.t), FRAMES)
    surfaces, frames = [], []
    for frame in volume.some(chosen):
        surfaces.append(vortices(frame, volume.scale, TRIANGLES))
        frames.append(coded(frame, surfaces[-1], volume.scale))
    return about(volume.scale, surfaces) | {"t": volume.t[chosen].tolist(), "frames": frames}


def about(scale: Scale, surfaces: Sequence[Vortices]) -> dict[str, Any]:
    """Return what all frames share: the scale, its colours and axis, and the room of some surfaces [m]."""
    points = np.concatenate([np.empty((0, 3)), *(each.point for each in surfaces)])
    return {
        "top": scale.top,
        "axis": AXES[scale.axis],
        "colours": base64.b64encode(colours().tobytes()).decode("ascii"),
        "room": [points.min(axis=0).tolist(), points.max(axis=0).tolist()] if len(points) else None,
    }


def coded(frame: VolumeFrame, surface: Vortices, scale: Scale) -> dict[str, Any]:
    """Return the surfaces of a frame for the page."""
    point = surface.point.astype(np.float64)
    low, high = (point.min(axis=0), point.max(axis=0)) if len(point) else (np.zeros(3), np.zeros(3))
    middle, half = 0.5 * (low + high), 0.5 * float((high - low).max()) or 1.0
    velocity = np.nan_to_num(surface.velocity, posinf=0.0, neginf=0.0)
    fastest = float(np.abs(velocity).max()) if len(point) else 0.0
    levels = np.round(np.clip(np.nan_to_num(surface.vorticity / scale.top), -1.0, 1.0) * LEVELS)
    return {
        "t": frame.time_ns / 1e9,
        "middle": middle.tolist(),
        "unit": half / STEPS,
        "fastest": fastest / LEVELS,
        "point": _text(np.round((point - middle) / half * STEPS), "<i2"),
        "velocity": _text(np.round(velocity / (fastest or 1.0) * LEVELS), "i1"),
        "level": _text(levels, "i1"),
        "triangle": _text(surface.triangle, "<u2"),
    }


def _text(array: NDArray[Any], kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(array, np.dtype(kind)).tobytes()).decode("ascii")
