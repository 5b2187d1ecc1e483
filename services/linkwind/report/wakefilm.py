"""Wings and wakes for the animations: corners and circulation of each frame in few bytes.

A corner is three int16 on the box of its frame, 0.02 mm in a wake of 1.5 m; a circulation is an int8 on one
scale for all frames. Lines of a wake are told by the step at which they were shed, so that the page can
follow them from frame to frame.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwind.frames import WakeFrame
from linkwind.log.rings import thinned
from linkwind.report.arrays import every_nth
from linkwind.report.wake import COLOURS, Wake

FRAMES = 64  # on the page of a report
RINGS = 2000  # of all wakes of a frame
STEPS = 32767  # int16 from the middle of a box to its faces
LEVELS = 127  # int8 of the largest circulation


def wake_film(scenario: Mapping[str, Any], wake: Wake) -> dict[str, Any]:
    """Return what the animation of a report needs: what all frames share, and the frames."""
    chosen = every_nth(len(wake.t), FRAMES)
    frames = [coded(frame, wake.circulation) for frame in wake.some(chosen)]
    return about(scenario, wake) | {"t": wake.t[chosen].tolist(), "frames": frames}


def about(scenario: Mapping[str, Any], wake: Wake) -> dict[str, Any]:
    """Return what all frames share: bodies, rows that a wake keeps, step [s], scale and its colours."""
    provider = next(each for each in scenario["providers"] if each["name"] == wake.provider)
    names = [body["name"] for body in scenario["bodies"]]
    return {
        "bodies": [names.index(name) for name in provider["bodies"]],
        "step": float(scenario["coupling"]["step"]),
        "top": wake.circulation,
        "colours": base64.b64encode(colours().tobytes()).decode("ascii"),
    }


def coded(frame: WakeFrame, top: float) -> dict[str, Any]:
    """Return a frame for the page; ``top`` is the end of the scale [m²/s]."""
    corner, strength, shed = thinned(frame, RINGS)
    points = np.nan_to_num(corner.astype(float), posinf=0.0, neginf=0.0)
    low, high = points.min(axis=(0, 1, 2)), points.max(axis=(0, 1, 2))
    middle, half = 0.5 * (low + high), 0.5 * float((high - low).max()) or 1.0
    places = np.round((points - middle) / half * STEPS)
    levels = np.round(np.clip(np.nan_to_num(strength / top), -1.0, 1.0) * LEVELS)
    return {
        "t": frame.time_ns / 1e9,
        "bound": frame.bound,
        "columns": frame.shape[2],
        "shed": shed,
        "middle": middle.tolist(),
        "unit": half / STEPS,
        "corner": _text(places.astype("<i2")),
        "strength": _text(levels.astype(np.int8)),
    }


def colours() -> NDArray[np.uint8]:
    """Return red, green, blue of each level of circulation, from the most negative, uint8, (255, 3)."""
    from matplotlib import colormaps

    sampled: NDArray[np.uint8] = colormaps[COLOURS](np.linspace(0.0, 1.0, 2 * LEVELS + 1), bytes=True)[:, :3]
    return sampled


def _text(array: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
