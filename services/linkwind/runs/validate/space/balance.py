"""What must hold exactly in space: impulse is kept, only relative motion counts, surfaces do not leak."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from linkwind.aero.flow import Flow
from linkwind.aero.flow.window import Window
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row, most
from linkwind.runs.validate.space.scenes import SPEED, SPHERE, driven, plate, scene, still
from linkwind.spatial import Array, Wrench

# The directions of ``lw_lattice3.h``, a column each.
DIRECTIONS: NDArray[np.int64] = np.array(
    [
        [0, 1, -1, 0, 0, 0, 0, 1, -1, 1, -1, 1, -1, 1, -1, 0, 0, 0, 0],
        [0, 0, 0, 1, -1, 0, 0, 1, -1, -1, 1, 0, 0, 0, 0, 1, -1, 1, -1],
        [0, 0, 0, 0, 0, 1, -1, 0, 0, 0, 0, 1, -1, -1, 1, 1, -1, -1, 1],
    ]
)
HALF = 14  # cells from the middle of the control volume to its sides


class ControlVolume:
    """A cube of fluid that stays where it is: what its momentum gains beyond what flows in.

    Momentum is (x, y, z, and angular about a place), in cells and steps.

    Attributes:
        gained: from outside the fluid, in each step but the last, which has not been made yet.
    """

    def __init__(self, middle: Array) -> None:
        """Take a cube around ``middle`` [cells of the first window]."""
        self._low = np.round(middle).astype(int) - HALF
        self._flowed: tuple[Array, Array] | None = None  # populations after streaming, and the place
        self.gained: list[Array] = []

    def watch(self, fluid: Window, about: Array) -> None:
        """Look at the fluid before its next step; ``about`` [cells of the first window] for that step."""
        if self._flowed is not None:
            before, place = self._flowed
            now = self._inside(fluid, moved=False)
            self.gained.append(self._momentum(now, place) - self._momentum(before, place))
        self._flowed = self._inside(fluid, moved=True), about.copy()

    def _inside(self, fluid: Window, moved: bool) -> Array:
        low, size, populations = self._low - fluid.offset, 2 * HALF, fluid.lattice.populations
        parts = []
        for direction, way in zip(populations, DIRECTIONS.T, strict=True):
            x, y, z = (low - way if moved else low).tolist()
            parts.append(direction[z : z + size, y : y + size, x : x + size])
        return np.asarray(parts, dtype=np.float64)

    def _momentum(self, populations: Array, about: Array) -> Array:
        momentum = np.tensordot(DIRECTIONS, populations, 1)
        places = self._low - about + np.arange(2 * HALF)[:, None]
        x, y, z = np.meshgrid(*places.T, indexing="ij")
        arm = np.stack([x, y, z]).transpose(0, 3, 2, 1)  # z along the first axis of a volume
        turning = np.cross(arm, momentum, axis=0)
        return np.concatenate([part.sum(axis=(1, 2, 3)) for part in (momentum, turning)])


def impulse(short: bool) -> Findings:
    """Wrench on a wing that moves in all six coordinates against the momentum of the fluid around it."""
    chord, steps = 12, 150 if short else 300
    step = round(0.05 / chord, 9)
    text = scene(plate(1.0, 1.5), 1.5 * chord, step, 2e-3, (5.0, 5.0, 5.0), wind=(0.5, 0.2, -0.1))
    rate = 2.0 * np.pi / (200 * step)
    size = np.array([0.02, 0.08, 0.05, 0.0, 0.0, 0.15])  # about one axis: the twist is that of the vector

    def course(t: float) -> tuple[Array, Array]:
        s, c = np.sin(rate * t), np.cos(rate * t)
        tilted = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.3])
        return tilted + size * (1.0 - c), size * rate * s

    volume: list[ControlVolume] = []

    def watch(flow: Flow, _: Wrench, k: int) -> None:
        pose = np.array([[*course((k + 1) * step)[0][:3], 1.0, 0.0, 0.0, 0.0]])
        place = flow.fluid.poses(pose)[0, :3] + flow.fluid.offset
        if not volume:
            volume.append(ControlVolume(place))
        volume[0].watch(flow.fluid, place)

    t, wrench = driven(text, course, steps, watch)
    wrench, t, unit = wrench[:-1], t[:-1], (1.0 / chord) ** 2 * (1.0 / chord / step) ** 2
    gained = np.array(volume[0].gained) * unit * np.repeat([1.0, 1.0 / chord], 3)
    off = np.abs(wrench + gained).max(axis=0)
    largest = np.abs(wrench).reshape(-1, 2, 3).max(axis=(0, 2))
    case = "impulse of a wing that heaves, sways and pitches, control volume against markers"
    rows = [
        most(case, "force off, over the largest", float(off[:3].max() / largest[0]), 1e-4),
        most(case, "torque off, over the largest", float(off[3:].max() / largest[1]), 1e-4),
    ]
    curves = (
        Curve("on the wing, y", t, wrench[:, 1]),
        Curve("out of the control volume, y", t[::10], -gained[::10, 1], True),
    )
    return Findings(rows, [Plot("Impulse balance of a wing in space", "t U/c", "force", curves)])


def galilean(short: bool) -> Findings:
    """A sphere in a stream against one that moves through a fluid at rest with its window."""
    # markers that go through the lattice feel where in its cells they are, the more the fewer cells
    cells, end, re, within = (10, 3.0, 50.0, 0.05) if short else (16, 5.0, 50.0, 0.03)
    speed, step = np.array([0.8, 0.48, 0.36]), round(SPEED / cells, 9)
    twist, histories = np.append(-speed, np.zeros(3)), []
    for moving in (False, True):
        x, y, z = (0.0 * speed if moving else speed).tolist()
        text = scene(SPHERE, cells, step, 1.0 / re, (6.0, 6.0, 6.0), wind=(x, y, z), start_time=0.5)
        course = (lambda t: (twist * t, twist)) if moving else still()
        t, wrench = driven(text, course, round(end / step))
        histories.append(8.0 / np.pi * wrench[:, :3] @ speed)
    late = t > 1.0
    still_there, gone = (drag[late] for drag in histories)
    off = float(np.sqrt(np.mean((still_there - gone) ** 2)) / np.abs(still_there).mean())
    ratio = float(gone.mean() / still_there.mean())
    case = "Galilean invariance in space: a sphere and its window move, or the stream, Re 50"
    rows = [
        most(case, "difference of drag (rms), over the drag", off, within),
        Row(case, "mean drag over mean drag", ratio, 1.0, 0.015, "exact"),
    ]
    curves = (Curve("stream", t[late], still_there), Curve("moving", t[late], gone))
    title = "Sphere, Re 50: moving stream and moving window"
    return Findings(rows, [Plot(title, "t U/D", "drag coefficient", curves)])


def carried(short: bool) -> Findings:
    """Bodies that move with the stream feel nothing."""
    del short
    speed = np.array([0.8, 0.48, 0.36])
    twist, rows = np.append(speed, np.zeros(3)), []
    tilted = np.array([0.0, 0.0, 0.0, 0.2, 0.3, 0.4])
    for name, shape in (("plate", plate(1.0, 1.0)), ("sphere", SPHERE)):
        x, y, z = speed.tolist()
        text = scene(shape, 12, round(0.1 / 12, 9), 1e-3, (4.0, 4.0, 4.0), wind=(x, y, z))
        _, wrench = driven(text, lambda t: (tilted + twist * t, twist), 100)
        case = f"{name} that moves with the stream in space"
        rows.append(most(case, "largest force over ρU²L²", float(np.abs(wrench).max()), 1e-4))
    return Findings(rows)


def tight(short: bool) -> Findings:
    """What flows through surfaces in a stream: a plate at 45 degrees, and a sphere."""
    cells, rows = 12 if short else 16, []
    cases = (
        # of a plate at the corners of its leading edge, where the flow turns within a cell
        ("plate at 45°", plate(1.0, 1.0), 0.25 * np.pi, 0.15),
        ("sphere", SPHERE, 0.0, 0.02),
    )
    for name, shape, turned, bound in cases:
        leaks: list[float] = []

        def watch(flow: Flow, wrench: Wrench, k: int, leaks: list[float] = leaks) -> None:
            assert wrench.diagnostics is not None
            leaks.append(float(wrench.diagnostics[flow.capabilities.diagnostics.index("leak")]))

        step = round(SPEED / cells, 9)
        text = scene(shape, cells, step, 0.01, (5.0, 4.0, 4.0), wind=(1.0, 0.0, 0.0), start_time=0.5)
        driven(text, still(0.0, 0.0, -turned), round(2.0 / step), watch)
        late = max(leaks[len(leaks) // 2 :])
        what = "largest flow through a patch over the stream"
        rows.append(most(f"{name} in a stream, Re 100, leak", what, late, bound))
    return Findings(rows)


CASES: dict[str, Callable[[bool], Findings]] = {
    "impulse balance in space": impulse,
    "Galilean invariance in space": galilean,
    "carried by the stream in space": carried,
    "tight surfaces in space": tight,
}
