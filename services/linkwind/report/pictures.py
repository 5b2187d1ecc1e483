"""Pictures of the flow at chosen times: speed with streamlines, vorticity, the bodies in their places."""

from __future__ import annotations

import io
import logging
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwind.frames import FlowFrame
from linkwind.report.closeup import closeups
from linkwind.report.data import Run
from linkwind.report.flow import Flow, shown, speed
from linkwind.scenario.shapes import shape_of
from linkwind.spatial import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 120
WIDTH = 2.9  # inches of one picture
INK, PAPER, BODY = "#12181f", "#ffffff", "#3a444f"
SPEED_COLOURS, VORTICITY_COLOURS = "viridis", "RdBu_r"
LEVELS = 20
STREAMLINE_CELLS = 96  # along the longer side: more cost time and show no more

STYLE: Any = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same picture everywhere
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.linewidth": 0.7,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
}


def png(run: Run, flow: Flow) -> tuple[bytes, int, int, list[float]]:
    """Draw the flow at chosen times, a column each.

    Returns:
        the picture as PNG with a palette, its width and height in pixels, and the times [s].
    """
    quiet()
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    frames = closeups(run, list(flow.some(shown(flow.t))))
    drawn, data = io.BytesIO(), io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure, fills = _figure(run, flow, frames)
        canvas = FigureCanvasAgg(figure)
        canvas.print_figure(drawn, format="png", bbox_inches="tight", pad_inches=0.06)
    with Image.open(drawn) as image, Image.new("P", (1, 1)) as palette:
        palette.putpalette(_palette(fills))
        thin = image.convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE)
    thin.save(data, "PNG", optimize=True)
    return data.getvalue(), *thin.size, [frame.time_ns / 1e9 for frame in frames]


def quiet() -> None:
    """Keep matplotlib from a word about a home that it cannot write to."""
    logging.getLogger("matplotlib").setLevel(logging.ERROR)


def _palette(fills: tuple[Any, Any]) -> bytes:
    """Return the colours of the contours, and mixed with streamlines and outlines; and greys."""
    from matplotlib.colors import to_rgb

    speeds, vortices = (fill.get_facecolor()[:, :3] for fill in fills)
    both, paper, ink = np.vstack([speeds, vortices]), np.array(to_rgb(PAPER)), np.array(to_rgb(INK))
    mixed = [speeds + share * (paper - speeds) for share in (0.3, 0.6, 0.85)]
    mixed += [both + share * (ink - both) for share in (0.4, 0.75)]
    greys = ink + np.linspace(0.0, 1.0, 20)[:, None] * (paper - ink)
    colours = np.vstack([both, greys, to_rgb(BODY), *mixed])[:256]
    return np.round(255.0 * colours).astype(np.uint8).tobytes()


def _figure(run: Run, flow: Flow, frames: list[FlowFrame]) -> tuple[Figure, tuple[Any, Any]]:
    """Return the figure and its contours: a row of the speed, one of the vorticity, a colour bar each."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    rows, columns = frames[-1].shape
    size = (WIDTH * len(frames) + 1.4, 2.0 * WIDTH * rows / columns + 1.2)
    figure = Figure(figsize=size, dpi=DPI, layout="compressed", facecolor=PAPER)
    axes = figure.subplots(2, len(frames), squeeze=False)
    for column, frame in enumerate(frames):
        above, below = axes[:, column]
        speeds = _speed(above, frame, flow.speed)
        vortices = _vorticity(below, frame, flow.vorticity)
        above.set_title(f"t = {frame.time_ns / 1e9:.4g} s")
        below.set_xlabel("x [m]")
        for ax in (above, below):
            _mechanism(ax, run, frame)
            _frame(ax, frame)
    fixed = len({frame.extent for frame in frames}) == 1  # else every picture has ticks of its own
    for ax in axes.flat:
        ax.tick_params(labelbottom=ax in axes[1], labelleft=not fixed or ax in axes[:, 0])
    for ax in axes[:, 0]:
        ax.set_ylabel("y [m]")
    for row, filled, label in ((0, speeds, "speed [m/s]"), (1, vortices, "vorticity [1/s]")):
        low, high = filled.levels[0], filled.levels[-1]
        round_ = MaxNLocator(6, steps=[1, 2, 5, 10]).tick_values(low, high)
        ticks = [tick for tick in round_ if low <= tick <= high]
        figure.colorbar(filled, ax=list(axes[row]), label=label, aspect=28, pad=0.012, ticks=ticks)
    return figure, (speeds, vortices)


def _speed(ax: Axes, frame: FlowFrame, top: float) -> Any:
    """Draw contours of the speed, and streamlines on them; return the contours."""
    x, y = _centres(frame)
    filled = ax.contourf(
        x, y, np.ma.masked_invalid(speed(frame)), np.linspace(0.0, top, LEVELS + 1),
        cmap=SPEED_COLOURS, extend="max",
    )  # fmt: skip
    stride = max(1, max(frame.shape) // STREAMLINE_CELLS)
    vx, vy = (np.ma.masked_invalid(frame.velocity[::stride, ::stride, axis]) for axis in (0, 1))
    ax.streamplot(
        x[::stride], y[::stride], vx, vy,
        color=PAPER, linewidth=0.55, density=1.1, arrowsize=0.55, arrowstyle="->",
    )  # fmt: skip
    return filled


def _vorticity(ax: Axes, frame: FlowFrame, top: float) -> Any:
    """Draw contours of the vorticity, which is white where there is none; return them."""
    x, y = _centres(frame)
    levels = np.linspace(-top, top, LEVELS + 2)  # an even number: none at 0, where only round-off is
    values = np.ma.masked_invalid(frame.vorticity)
    return ax.contourf(x, y, values, levels, cmap=VORTICITY_COLOURS, extend="both")


def _centres(frame: FlowFrame) -> tuple[Array, Array]:
    (left, bottom), (rows, columns) = frame.origin, frame.shape
    x = left + frame.cell * np.arange(columns, dtype=np.float64)
    return x, bottom + frame.cell * np.arange(rows, dtype=np.float64)


def _frame(ax: Axes, frame: FlowFrame) -> None:
    left, right, bottom, top = frame.extent
    half = 0.5 * frame.cell
    ax.set(xlim=(left + half, right - half), ylim=(bottom + half, top - half), aspect="equal")
    ax.locator_params(nbins=6)


def _mechanism(ax: Axes, run: Run, frame: FlowFrame) -> None:
    """Draw the outlines of the bodies and the points of the joints at the time of a frame."""
    path = run.trajectory
    found = int(np.searchsorted(path.step, frame.step))
    if found == len(path.step) or path.step[found] != frame.step:
        return  # a log that was cut does not have the state
    for body, joint in enumerate(run.joint_of):
        position, turn = path.position[found, body, :2], _turn(path.orientation[found, body])
        shape = shape_of(run.scenario["bodies"][body].get("shape"))
        if shape is None:
            ax.plot(*position, "o", color=BODY, markersize=4, zorder=6)
        else:
            outline = shape.outline() @ turn.T + position
            if shape.closed:
                ax.fill(*outline.T, facecolor=BODY, edgecolor=INK, linewidth=0.8, zorder=6)
            else:  # on any colour
                ax.plot(*outline.T, color=PAPER, linewidth=4.2, solid_capstyle="round", zorder=5)
                ax.plot(*outline.T, color=INK, linewidth=2.4, solid_capstyle="round", zorder=6)
        if joint is not None:
            at = position + turn @ np.array(joint["child_point"][:2])
            ax.plot(*at, "o", markersize=5, markerfacecolor=PAPER, markeredgecolor=INK, zorder=7)


def _turn(quaternion: Array) -> Array:
    """Return the rotation about z of a planar orientation, body to world, shape (2, 2)."""
    w, _, _, z = quaternion
    return np.array([[w * w - z * z, -2.0 * w * z], [2.0 * w * z, w * w - z * z]])
