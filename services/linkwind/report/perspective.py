"""What pictures in perspective share: eye, light, bodies, and how several times stand together."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from linkwind.mechanism.quaternion import matrix
from linkwind.report.data import Run
from linkwind.report.pictures import INK, PAPER, STYLE, quiet
from linkwind.report.scene import outlines
from linkwind.spatial import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AZIMUTH, ELEVATION = np.radians(128.0), np.radians(24.0)  # of the eye, from the way that the wakes trail
AWAY = 3.2  # of the eye, in radii of what is seen
SUN = 0.35  # share of the light of what is lit that depends on how it lies to the eye
MARGIN = 0.04
WIDTH, SHARPNESS = 12.0, 160  # inches and dots an inch of the figure
WIDE = 2.0  # width over height from which there are two pictures in a row, else three

Box = tuple[Array, Array]


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

    def box(self, points: Array, centre: Array) -> Box:
        """Return the lower left and the upper right corner of what is seen of points [m]."""
        seen = self.project(points.reshape(-1, 3), centre)[:, :2]
        return seen.min(axis=0), seen.max(axis=0)


def eye(up: Array, along: Array, radius: float) -> View:
    """Return an eye to the side of what trails, a little above and ahead of it.

    Args:
        up: unit vector that is drawn upwards.
        along: the way that it trails, any length.
        radius: of what is seen, about its centre [m].
    """
    level = along - along @ up * up
    length = float(np.linalg.norm(level))
    level = level / length if length > 1e-9 else np.roll(up, 1)
    flat = np.cos(AZIMUTH) * level + np.sin(AZIMUTH) * np.cross(up, level)
    back = np.cos(ELEVATION) * flat + np.sin(ELEVATION) * up
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return View(right, np.cross(back, right), back, AWAY * radius)


def middle(points: Array) -> Array:
    """Return the middle of the box around points, shape (…, 3)."""
    flat = points.reshape(-1, 3)
    return np.asarray(0.5 * (flat.min(axis=0) + flat.max(axis=0)))


def light(normal: Array, view: View) -> Array:
    """Return how bright faces with these normals of any length are, most where they face the eye."""
    size = np.maximum(np.linalg.norm(normal, axis=-1), 1e-30)
    return np.asarray(1.0 - SUN + SUN * np.abs(normal @ view.back) / size)


def state_at(run: Run, step: int) -> int | None:
    """Return the index of the state of a step; None where a log that was cut does not have it."""
    found = int(np.searchsorted(run.trajectory.step, step))
    return found if found < len(run.trajectory.step) and run.trajectory.step[found] == step else None


def draw_bodies(ax: Axes, run: Run, step: int, view: View, centre: Array) -> None:
    """Draw the lines of the bodies at the time of a step."""
    path, found = run.trajectory, state_at(run, step)
    for body in range(len(run.bodies)) if found is not None else ():
        turn, at = matrix(path.orientation[found, body]), path.position[found, body]
        for points, closed in outlines(run, body):
            line = view.project(points @ turn.T + at, centre)[:, :2]
            line = np.vstack([line, line[:1]]) if closed else line
            ax.plot(*line.T, color=INK, linewidth=0.6, solid_joinstyle="round", zorder=3)


def pictures(boxes: Sequence[Box], times: Sequence[float], view: View) -> tuple[Figure, list[Axes]]:
    """Return a figure with axes for each box, all of one size, and with the directions and a length.

    Args:
        boxes: what is seen at each time.
        times: of them [s].
        view: the eye.
    """
    from matplotlib.figure import Figure

    size = np.max([high - low for low, high in boxes], axis=0)
    width, height = (size + 2.0 * MARGIN * size.max()).tolist()
    columns = 2 if width > WIDE * height else 3
    rows = len(boxes) // columns + 1  # with a free place for directions and a length
    inches = (WIDTH, 0.9 * WIDTH / columns * height / width * rows + 0.3 * rows)
    figure = Figure(figsize=inches, dpi=SHARPNESS, layout="compressed", facecolor=PAPER)
    axes = list(figure.subplots(rows, columns, squeeze=False).flat)
    for ax in axes:
        ax.set(xlim=(-0.5 * width, 0.5 * width), ylim=(-0.5 * height, 0.5 * height), aspect="equal")
        ax.axis("off")
    for ax, (low, high), t in zip(axes, boxes, times, strict=False):
        x, y = (0.5 * (low + high)).tolist()
        ax.set(xlim=(x - 0.5 * width, x + 0.5 * width), ylim=(y - 0.5 * height, y + 0.5 * height))
        ax.set_title(f"t = {t:.4g} s")
    _key(axes[-1], view, width, height)
    return figure, axes


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


def scale_bar(figure: Figure, axes: list[Axes], mapped: Any, label: str) -> None:
    """Draw the colours beside all axes."""
    figure.colorbar(mapped, ax=axes, label=label, aspect=24, pad=0.01, shrink=0.6)


def drawing() -> Any:
    """Return the style of every picture, to be drawn within."""
    quiet()
    import matplotlib

    return matplotlib.rc_context(STYLE)


def as_png(figure: Figure) -> tuple[bytes, int, int]:
    """Return a figure as PNG with few colours, its width and height in pixels."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    drawn, data = io.BytesIO(), io.BytesIO()
    FigureCanvasAgg(figure).print_figure(drawn, format="png", bbox_inches="tight", pad_inches=0.06)
    with Image.open(drawn) as image:
        thin = image.convert("RGB").quantize(255, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    thin.save(data, "PNG", optimize=True)
    return data.getvalue(), *thin.size
