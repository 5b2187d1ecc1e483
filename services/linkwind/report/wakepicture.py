"""A picture of wings and their wakes at some times, in perspective, coloured by circulation."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from linkwind.frames import WakeFrame
from linkwind.mechanism.quaternion import matrix
from linkwind.report.data import Run
from linkwind.report.pictures import BODY, INK, PAPER, STYLE, quiet
from linkwind.report.scene import outlines, upwards
from linkwind.report.wake import COLOURS, Wake, shown_wakes
from linkwind.spatial import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AZIMUTH, ELEVATION = np.radians(128.0), np.radians(24.0)  # of the eye, from the way that the wakes trail
AWAY = 3.2  # of the eye, in radii of what is seen
SEAM = "#8b949d"  # between the rings of a wing
SUN = 0.35  # share of a ring's light that depends on how it lies to the eye
MARGIN = 0.04
WIDTH, SHARPNESS = 12.0, 160  # inches and dots an inch of the figure
WIDE = 2.0  # width over height from which there are two pictures in a row, else three


class View(NamedTuple):
    """The eye: it looks along −``back`` at a point; ``right`` and ``up`` span the picture; unit vectors."""

    right: Array
    up: Array
    back: Array
    away: float

    def project(self, points: Array, centre: Array) -> Array:
        """Return right, up [m at the centre's distance] and distance from the eye [m], shape (…, 3)."""
        off = points - centre
        distance = self.away - off @ self.back
        scale = self.away / distance
        return np.stack([off @ self.right * scale, off @ self.up * scale, distance], axis=-1)


def wake_png(run: Run, wake: Wake) -> tuple[bytes, int, int, list[float]] | None:
    """Draw wings and wakes at chosen times.

    Returns:
        the picture as PNG, its width and height in pixels, and the times [s]; None if every frame at these
        times has corners that are no numbers.
    """
    quiet()
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    frames = [frame for frame in wake.some(shown_wakes(wake.t)) if np.isfinite(frame.corner).all()]
    if not frames:
        return None
    drawn, data = io.BytesIO(), io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure = _figure(run, wake, frames)
        FigureCanvasAgg(figure).print_figure(drawn, format="png", bbox_inches="tight", pad_inches=0.06)
    with Image.open(drawn) as image:
        thin = image.convert("RGB").quantize(255, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    thin.save(data, "PNG", optimize=True)
    return data.getvalue(), *thin.size, [frame.time_ns / 1e9 for frame in frames]


def _figure(run: Run, wake: Wake, frames: list[WakeFrame]) -> Figure:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    view = _view(run, frames)
    boxes = [_box(view, frame) for frame in frames]
    size = np.max([high - low for low, high in boxes], axis=0)
    width, height = (size + 2.0 * MARGIN * size.max()).tolist()
    columns = 2 if width > WIDE * height else 3
    rows = len(frames) // columns + 1  # with a free place for directions and a length
    inches = (WIDTH, 0.9 * WIDTH / columns * height / width * rows + 0.3 * rows)
    figure = Figure(figsize=inches, dpi=SHARPNESS, layout="compressed", facecolor=PAPER)
    axes = figure.subplots(rows, columns, squeeze=False)
    mapped = ScalarMappable(Normalize(-wake.circulation, wake.circulation), COLOURS)
    for ax in axes.flat:
        ax.set(xlim=(-0.5 * width, 0.5 * width), ylim=(-0.5 * height, 0.5 * height), aspect="equal")
        ax.axis("off")
    for ax, frame, (low, high) in zip(axes.flat, frames, boxes, strict=False):
        _draw(ax, run, frame, view, mapped)
        x, y = (0.5 * (low + high)).tolist()
        ax.set(xlim=(x - 0.5 * width, x + 0.5 * width), ylim=(y - 0.5 * height, y + 0.5 * height))
        ax.set_title(f"t = {frame.time_ns / 1e9:.3f} s")
    _key(axes.flat[-1], view, width, height)
    figure.colorbar(
        mapped, ax=list(axes.flat), label="circulation of a ring [m²/s]", aspect=24, pad=0.01, shrink=0.6
    )
    return figure


def _view(run: Run, frames: list[WakeFrame]) -> View:
    """Return an eye to the side of the wakes of the last frame, a little above and ahead of them."""
    last = frames[-1]
    up = np.array(upwards(run))
    along = (last.corner[:, -1] - last.corner[:, last.bound]).mean(axis=(0, 1)).astype(float)
    along -= along @ up * up
    length = float(np.linalg.norm(along))
    along = along / length if length > 1e-9 else np.roll(up, 1)
    side = np.cross(up, along)
    flat = np.cos(AZIMUTH) * along + np.sin(AZIMUTH) * side
    back = np.cos(ELEVATION) * flat + np.sin(ELEVATION) * up
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    radius = max(float(np.linalg.norm(f.corner - _centre(f), axis=-1).max()) for f in frames)
    return View(right, np.cross(back, right), back, AWAY * radius)


def _centre(frame: WakeFrame) -> Array:
    points = frame.corner.reshape(-1, 3).astype(np.float64)
    return np.asarray(0.5 * (points.min(axis=0) + points.max(axis=0)))


def _box(view: View, frame: WakeFrame) -> tuple[Array, Array]:
    """Return the lower left and the upper right corner of what is seen of a frame [m]."""
    points = frame.corner.reshape(-1, 3).astype(np.float64)
    seen = view.project(points, _centre(frame))[:, :2]
    return seen.min(axis=0), seen.max(axis=0)


def _draw(ax: Axes, run: Run, frame: WakeFrame, view: View, mapped: Any) -> None:
    """Draw everything from the farthest to the nearest."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

    corner = frame.corner.astype(float)
    polygon = np.stack(
        [corner[:, :-1, :-1], corner[:, :-1, 1:], corner[:, 1:, 1:], corner[:, 1:, :-1]], axis=-2
    )
    wing = np.zeros(frame.shape, bool)
    wing[:, : frame.bound] = True
    colour = np.where(wing[..., None], to_rgb(BODY), mapped.cmap(mapped.norm(frame.strength))[..., :3])
    colour = colour * _light(polygon, view)[..., None]
    edge = np.where(wing[..., None], to_rgb(SEAM), 0.72 * colour)
    opacity = np.where(wing, 1.0, 0.9)[..., None]
    face, edge = (np.concatenate([each, opacity], axis=-1).reshape(-1, 4) for each in (colour, edge))
    seen = view.project(polygon.reshape(-1, 4, 3), _centre(frame))
    order = np.argsort(-seen[..., 2].mean(axis=1))
    rings = PolyCollection(
        list(seen[order, :, :2]), facecolors=face[order], edgecolors=edge[order], linewidths=0.25
    )
    ax.add_collection(rings)
    _others(ax, run, frame, view)


def _light(polygon: Array, view: View) -> Array:
    """Return how bright polygons are, most where they face the eye."""
    normal = np.cross(polygon[..., 2, :] - polygon[..., 0, :], polygon[..., 3, :] - polygon[..., 1, :])
    size = np.maximum(np.linalg.norm(normal, axis=-1), 1e-30)
    return np.asarray(1.0 - SUN + SUN * np.abs(normal @ view.back) / size)


def _others(ax: Axes, run: Run, frame: WakeFrame, view: View) -> None:
    """Draw the lines of the bodies at the time of a frame."""
    path = run.trajectory
    found = int(np.searchsorted(path.step, frame.step))
    if found == len(path.step) or path.step[found] != frame.step:
        return  # a log that was cut does not have the state
    for body in range(len(run.bodies)):
        turn, at = matrix(path.orientation[found, body]), path.position[found, body]
        for points, closed in outlines(run, body):
            line = view.project(points @ turn.T + at, _centre(frame))[:, :2]
            line = np.vstack([line, line[:1]]) if closed else line
            ax.plot(*line.T, color=INK, linewidth=0.6, solid_joinstyle="round", zorder=3)


def _key(ax: Axes, view: View, width: float, height: float) -> None:
    """Draw the axes of W and a length, as it is seen in the middle of a picture."""
    size = 0.11 * width
    for name, axis in zip("xyz", np.eye(3), strict=True):
        x, y = size * float(axis @ view.right), size * float(axis @ view.up)
        arrow = {"arrowstyle": "-|>", "linewidth": 0.9, "color": INK, "shrinkA": 0.0}
        ax.annotate("", (x, y), (0.0, 0.0), arrowprops=arrow)
        ax.text(1.25 * x, 1.25 * y, name, ha="center", va="center", color=INK)
    unit = 10.0 ** np.floor(np.log10(0.4 * width))
    length = unit * max(step for step in (1, 2, 5) if step * unit <= 0.4 * width)
    y = -0.32 * height
    ax.plot([-0.5 * length, 0.5 * length], [y, y], color=INK, linewidth=1.6, solid_capstyle="butt")
    ax.text(0.0, y, f"{length:g} m\n", ha="center", va="center", color=INK)
