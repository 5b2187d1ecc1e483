"""Pictures of the fluid in a box at some times: vortices in perspective, and the speed in a cut."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from linkwind.frames import Single, VolumeFrame
from linkwind.log.vortices import vortices
from linkwind.report.data import Run
from linkwind.report.faces import body_faces, cut
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
    state_at,
)
from linkwind.report.pictures import BODY, INK, LEVELS, PAPER, SPEED_COLOURS, WIDTH
from linkwind.report.scene import upwards
from linkwind.report.volume import Volume, speed
from linkwind.report.volumefilm import AXES
from linkwind.report.wake import COLOURS, shown_times
from linkwind.spatial import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TRIANGLES = 12_000  # of all vortices at one time
OPACITY = 0.85

Picture = tuple[bytes, int, int, list[float]]


class Seen(NamedTuple):
    """What is seen in perspective at one time.

    Attributes:
        step: k of the frame.
        t: its time [s].
        vortex: triangles of the vortices' surfaces [m], shape (m, 3, 3), in W.
        body: triangles of the bodies, likewise.
        normal: of the surfaces there, outwards, any length, first those of the vortices, shape (n, 3).
        vorticity: of the vortices' triangles, about the axis of the scale [1/s], shape (m,).
    """

    step: int
    t: float
    vortex: Array
    body: Array
    normal: Array
    vorticity: Single

    @property
    def points(self) -> Array:
        """All corners, shape (n, 3, 3)."""
        return np.concatenate([self.vortex, self.body])


def vortices_png(run: Run, volume: Volume) -> Picture | None:
    """Draw vortices and bodies at chosen times.

    Returns:
        the picture as PNG, its width and height in pixels, and the times [s]; None where there is nothing to
        see at any time.
    """
    frames = list(volume.some(shown_times(volume.t)))
    seen = [each for each in (_seen(run, volume, frame) for frame in frames) if each.points.size]
    if not seen:
        return None
    times = [each.t for each in seen]
    with drawing():
        return *as_png(_vortices(run, volume, seen, along(run, frames[-1]))), times


def _seen(run: Run, volume: Volume, frame: VolumeFrame) -> Seen:
    shown = vortices(frame, volume.scale, TRIANGLES)
    vortex, body = shown.point.astype(np.float64)[shown.triangle], np.empty((0, 3, 3))
    state = state_at(run, frame.step)
    if state is not None:
        body = np.concatenate([body, *body_faces(run, state)])
    normal = np.concatenate([_smooth(shown.triangle, _normals(vortex)), _normals(body)])
    about = shown.vorticity[shown.triangle].mean(axis=1)
    return Seen(frame.step, frame.time_ns / 1e9, vortex, body, normal, about)


def _normals(triangles: Array) -> Array:
    """Return normals outwards, as long as twice the areas."""
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def _smooth(triangle: Any, normal: Array) -> Array:
    """Return for each triangle the mean normal of all that share a corner with it."""
    count = int(triangle.max()) + 1 if len(triangle) else 0
    around = np.zeros((count, 3))
    for corner in triangle.T:
        np.add.at(around, corner, normal)
    return np.asarray(around[triangle].sum(axis=1))


def along(run: Run, frame: VolumeFrame) -> Array:
    """Return the mean velocity of the fluid past the bodies [m/s], shape (3,)."""
    state = state_at(run, frame.step)
    finite = frame.velocity[np.isfinite(frame.velocity).all(axis=-1)]
    stream = finite.mean(axis=0, dtype=np.float64) if len(finite) else np.zeros(3)
    return stream if state is None else stream - run.trajectory.linear[state].mean(axis=0)


def _vortices(run: Run, volume: Volume, seen: list[Seen], along: Array) -> Figure:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    centres = [middle(each.points) for each in seen]
    radius = max(
        float(np.linalg.norm(each.points - centre, axis=-1).max())
        for each, centre in zip(seen, centres, strict=True)
    )
    view = eye(np.array(upwards(run)), along, radius)
    boxes = [view.box(each.points, centre) for each, centre in zip(seen, centres, strict=True)]
    figure, axes = pictures(boxes, [each.t for each in seen], view)
    top, axis = volume.scale.top, AXES[volume.scale.axis]
    mapped = ScalarMappable(Normalize(-top, top), COLOURS)
    for ax, each, centre in zip(axes, seen, centres, strict=False):
        _draw(ax, each, view, centre, mapped)
        draw_bodies(ax, run, each.step, view, centre)
    scale_bar(figure, axes, mapped, f"vorticity about {axis} [1/s]")
    return figure


def _draw(ax: Axes, seen: Seen, view: View, centre: Array, mapped: Any) -> None:
    """Draw what faces the eye of the vortices, and the bodies, from the farthest to the nearest."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgba

    points, fluid = seen.points, len(seen.vortex)
    colour = np.tile(to_rgba(BODY), (len(points), 1))
    colour[:fluid] = mapped.cmap(mapped.norm(seen.vorticity))
    colour[:fluid, 3] = OPACITY
    colour[:, :3] *= light(seen.normal, view)[:, None]
    towards = (_normals(points) * (centre + view.away * view.back - points[:, 0])).sum(axis=1)
    shown = np.flatnonzero((towards > 0.0) | (np.arange(len(points)) >= fluid))
    projected = view.project(points[shown], centre)
    order = np.argsort(-projected[..., 2].mean(axis=1))
    faces = colour[shown][order]
    ax.add_collection(
        PolyCollection(list(projected[order, :, :2]), facecolors=faces, edgecolors=faces, linewidths=0.2)
    )


def slice_png(run: Run, volume: Volume) -> tuple[Picture, str] | None:
    """Draw the speed in a plane through the middle of the mechanism at chosen times, with the bodies' cuts.

    The plane lies along the stream, across the axis about which the vortices turn most.

    Returns:
        the picture as PNG, its width and height in pixels, and the times [s]; and the axis across the plane;
        None where no frame has its state.
    """
    frames = [f for f in volume.some(shown_times(volume.t)) if state_at(run, f.step) is not None]
    if not frames:
        return None
    turning = np.array(volume.scale.turning)
    stream = np.abs(along(run, frames[-1]))
    turning[int(np.argmax(stream))] = -1.0
    normal = int(np.argmax(turning))
    with drawing():
        figure = _slices(run, volume, frames, normal)
        return (*as_png(figure), [frame.time_ns / 1e9 for frame in frames]), AXES[normal]


def _slices(run: Run, volume: Volume, frames: list[VolumeFrame], normal: int) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    across, up = _plane(run, normal)
    cells = frames[-1].shape[::-1]
    size = (WIDTH * len(frames) + 1.4, WIDTH * cells[up] / cells[across] + 0.9)
    figure = Figure(figsize=size, dpi=120, layout="compressed", facecolor=PAPER)
    axes = figure.subplots(1, len(frames), squeeze=False)[0]
    fixed = len({frame.extent for frame in frames}) == 1  # else every picture has ticks of its own
    for ax, frame in zip(axes, frames, strict=True):
        filled = _slice(ax, run, volume, frame, (across, up, normal))
        ax.set_title(f"t = {frame.time_ns / 1e9:.4g} s")
        ax.set_xlabel(f"{AXES[across]} [m]")
        ax.tick_params(labelleft=not fixed or ax is axes[0])
    axes[0].set_ylabel(f"{AXES[up]} [m]")
    ticks = [
        t for t in MaxNLocator(6, steps=[1, 2, 5, 10]).tick_values(0.0, volume.speed) if t <= volume.speed
    ]
    figure.colorbar(filled, ax=list(axes), label="speed [m/s]", aspect=20, pad=0.012, ticks=ticks)
    return figure


def _plane(run: Run, normal: int) -> tuple[int, int]:
    """Return the axes to the right and upwards in a picture of a plane across an axis."""
    upright = int(np.argmax(upwards(run)))
    up = upright if normal != upright else next(axis for axis in (1, 0) if axis != normal)
    return next(axis for axis in range(3) if axis not in (normal, up)), up


def _slice(ax: Axes, run: Run, volume: Volume, frame: VolumeFrame, plane: tuple[int, int, int]) -> Any:
    """Draw the speed in a plane and what it cuts of the bodies; return the contours."""
    across, up, normal = plane
    state = state_at(run, frame.step)
    assert state is not None
    at = float(run.trajectory.position[state, :, normal].mean())
    values = speed(_layer(frame, normal, at))
    if across > up:  # arrays run along z, y, x: what is left of them must be rows of the axis upwards
        values = values.T
    x, y = (frame.origin[axis] + frame.cell * np.arange(frame.shape[2 - axis]) for axis in (across, up))
    filled = ax.contourf(
        x, y, np.ma.masked_invalid(values), np.linspace(0.0, volume.speed, LEVELS + 1),
        cmap=SPEED_COLOURS, extend="max",
    )  # fmt: skip
    for triangles in body_faces(run, state):
        _body(ax, cut(triangles, normal, at)[..., [across, up]])
    ax.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]), aspect="equal")
    ax.locator_params(axis="x", nbins=4)  # labels as long as 0.0025 stay apart
    ax.locator_params(axis="y", nbins=6)
    return filled


def _layer(frame: VolumeFrame, axis: int, at: float) -> Single:
    """Return the velocity between the two layers of cells around a place on an axis, nearest at the ends."""
    count, along = frame.shape[2 - axis], 2 - axis
    place = min(max((at - frame.origin[axis]) / frame.cell, 0.0), count - 1.0)
    low = min(int(place), count - 2)
    share = np.float32(place - low)
    one, other = (np.take(frame.velocity, low + i, axis=along) for i in (0, 1))
    between: Single = (1 - share) * one + share * other
    return between


def _body(ax: Axes, pieces: Array) -> None:
    """Draw the cut of a body, from its pieces in any order, shape (k, 2, 2)."""
    from matplotlib.collections import LineCollection
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if not len(pieces):
        return
    # Triangles from one point over all pieces: where the body is not, those that wind either way cancel.
    fan = np.insert(pieces, 0, pieces[0, 0], axis=1)[:, [0, 1, 2, 0]].reshape(-1, 2)
    codes = np.tile([Path.MOVETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY], len(pieces))
    ax.add_patch(PathPatch(Path(fan, codes), facecolor=BODY, edgecolor="none", zorder=5))
    ax.add_collection(LineCollection(list(pieces), colors=INK, linewidths=1.4, capstyle="round", zorder=6))
