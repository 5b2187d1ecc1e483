"""A picture of wings and their wakes at some times, in perspective, coloured by circulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from linkwind.frames import WakeFrame
from linkwind.report.data import Run
from linkwind.report.perspective import (
    View,
    as_png,
    draw_bodies,
    drawing,
    eye,
    light,
    middle,
    pictures,
    scale_bar,
)
from linkwind.report.pictures import BODY
from linkwind.report.scene import upwards
from linkwind.report.wake import COLOURS, Wake, shown_times
from linkwind.spatial import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SEAM = "#8b949d"  # between the rings of a wing


def wake_png(run: Run, wake: Wake) -> tuple[bytes, int, int, list[float]] | None:
    """Draw wings and wakes at chosen times.

    Returns:
        the picture as PNG, its width and height in pixels, and the times [s]; None if every frame at these
        times has corners that are no numbers.
    """
    frames = [frame for frame in wake.some(shown_times(wake.t)) if np.isfinite(frame.corner).all()]
    if not frames:
        return None
    times = [frame.time_ns / 1e9 for frame in frames]
    with drawing():
        return *as_png(_figure(run, wake, frames, times)), times


def _figure(run: Run, wake: Wake, frames: list[WakeFrame], times: list[float]) -> Figure:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    view = _view(run, frames)
    boxes = [view.box(_points(frame), middle(_points(frame))) for frame in frames]
    figure, axes = pictures(boxes, times, view)
    mapped = ScalarMappable(Normalize(-wake.circulation, wake.circulation), COLOURS)
    for ax, frame in zip(axes, frames, strict=False):
        _draw(ax, frame, view, mapped)
        draw_bodies(ax, run, frame.step, view, middle(_points(frame)))
    scale_bar(figure, axes, mapped, "circulation of a ring [m²/s]")
    return figure


def _points(frame: WakeFrame) -> Array:
    return frame.corner.astype(np.float64)


def _view(run: Run, frames: list[WakeFrame]) -> View:
    last = frames[-1]
    along = (last.corner[:, -1] - last.corner[:, last.bound]).mean(axis=(0, 1)).astype(float)
    radius = max(float(np.linalg.norm(f.corner - middle(_points(f)), axis=-1).max()) for f in frames)
    return eye(np.array(upwards(run)), along, radius)


def _draw(ax: Axes, frame: WakeFrame, view: View, mapped: Any) -> None:
    """Draw the rings from the farthest to the nearest."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

    corner = _points(frame)
    polygon = np.stack(
        [corner[:, :-1, :-1], corner[:, :-1, 1:], corner[:, 1:, 1:], corner[:, 1:, :-1]], axis=-2
    )
    wing = np.zeros(frame.shape, bool)
    wing[:, : frame.bound] = True
    normal = np.cross(polygon[..., 2, :] - polygon[..., 0, :], polygon[..., 3, :] - polygon[..., 1, :])
    colour = np.where(wing[..., None], to_rgb(BODY), mapped.cmap(mapped.norm(frame.strength))[..., :3])
    colour = colour * light(normal, view)[..., None]
    edge = np.where(wing[..., None], to_rgb(SEAM), 0.72 * colour)
    opacity = np.where(wing, 1.0, 0.9)[..., None]
    face, edge = (np.concatenate([each, opacity], axis=-1).reshape(-1, 4) for each in (colour, edge))
    seen = view.project(polygon.reshape(-1, 4, 3), middle(corner))
    order = np.argsort(-seen[..., 2].mean(axis=1))
    rings = PolyCollection(
        list(seen[order, :, :2]), facecolors=face[order], edgecolors=edge[order], linewidths=0.25
    )
    ax.add_collection(rings)
