"""What must hold exactly: impulse is kept, only relative motion counts, two bodies push each other alike."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from linkwind.aero.flow import Flow
from linkwind.aero.flow.window import Window
from linkwind.runs.validate.driven import Driven, at_rest
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row, most
from linkwind.runs.validate.scenes import CIRCLE, PLATE, communication_step, scene
from linkwind.spatial import Array

CX = np.array([0, 1, 0, -1, 0, 1, -1, -1, 1])  # the directions of ``lw_lattice.h``
CY = np.array([0, 0, 1, 0, -1, 1, 1, -1, -1])
HALF = 40  # cells from the middle of the control volume to its sides


def fluid_of(driven: Driven) -> Window:
    """Return the fluid of a driven model flow."""
    assert isinstance(driven.model, Flow)
    return driven.model.fluid


class ControlVolume:
    """A square of fluid that stays where it is: what its momentum gains beyond what flows in.

    Momentum is (x, y, angular about a place), in cells and steps.

    Attributes:
        gained: from outside the fluid, in each step but the last, which has not been made yet.
    """

    def __init__(self, middle: Array) -> None:
        """Take a square around ``middle`` [cells of the first window]."""
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
        x, y = self._low - fluid.offset
        size, populations = 2 * HALF, fluid.lattice.populations
        steps = zip(CX.tolist(), CY.tolist(), strict=True) if moved else [(0, 0)] * 9
        parts = [
            populations[q, y - cy : y - cy + size, x - cx : x - cx + size] for q, (cx, cy) in enumerate(steps)
        ]
        return np.asarray(parts, dtype=np.float64)

    def _momentum(self, populations: Array, about: Array) -> Array:
        x, y = np.tensordot(CX, populations, 1), np.tensordot(CY, populations, 1)
        along = self._low[0] - about[0] + np.arange(2 * HALF)
        up = self._low[1] - about[1] + np.arange(2 * HALF)[:, None]
        return np.array([x.sum(), y.sum(), (along * y - up * x).sum()])


def impulse(short: bool) -> Findings:
    """Wrench on a plate that heaves and pitches against the momentum of the fluid around it."""
    cells, steps = 32, 300 if short else 1200
    text = scene(
        PLATE,
        cells=cells,
        step=communication_step(0.05, cells),
        viscosity=1e-3,
        window=(6.0, 6.0),
        wind=(0.5, 0.2),
    )
    driven = Driven(text)
    rate = 2.0 * np.pi / (300 * driven.h)

    def path(t: float) -> tuple[Array, Array]:
        s, c = np.sin(rate * t), np.cos(rate * t)
        pose = np.array([0.0, 0.1 * (1.0 - c), 0.3 + 0.2 * s])
        return pose, np.array([0.0, 0.1 * rate * s, 0.2 * rate * c])

    volume: list[ControlVolume] = []

    def watch(driven: Driven, k: int) -> None:
        fluid = fluid_of(driven)
        pose = path((k + 1) * driven.h)[0]
        place = fluid.poses(np.array([[*pose[:2], 1.0, 0.0]]))[0, :2] + fluid.offset
        if not volume:
            volume.append(ControlVolume(place))
        volume[0].watch(fluid, place)

    wrench = driven.go(path, steps=steps, watch=watch).wrench[:-1, 0]
    fluid = fluid_of(driven)
    unit = fluid.speed**2 / cells
    gained = np.array(volume[0].gained) * unit * (1.0, 1.0, 1.0 / cells)
    off = np.abs(wrench + gained).max(axis=0) / np.abs(wrench).max(axis=0)
    case = "impulse of a heaving and pitching plate, control volume against markers"
    rows = [
        most(case, "force off, over the largest", float(off[:2].max()), 0.01),
        most(case, "torque off, over the largest", float(off[2]), 0.01),
    ]
    t = np.asarray((np.arange(len(wrench)) + 0.5) * driven.h, np.float64)
    curves = (
        Curve("on the plate, y", t, wrench[:, 1]),
        Curve("out of the control volume, y", t[::20], -gained[::20, 1], True),
    )
    return Findings(rows, [Plot("Impulse balance of a heaving and pitching plate", "t U/c", "force", curves)])


def galilean(short: bool) -> Findings:
    """A cylinder in a stream against one that moves through a fluid at rest with the window."""
    cells, end = (20, 4.0) if short else (32, 8.0)
    speed = np.array([0.8, 0.6])
    histories = []
    for moving in (False, True):
        wind = (0.0, 0.0) if moving else (float(speed[0]), float(speed[1]))
        text = scene(
            CIRCLE,
            cells=cells,
            step=communication_step(0.08, cells),
            viscosity=0.01,
            window=(20.0, 20.0),
            wind=wind,
            start_time=1.0,
        )
        driven = Driven(text)
        twist = np.array([*-speed, 0.0]) if moving else np.zeros(3)
        path = at_rest() if not moving else lambda t, twist=twist: (twist * t, twist)
        histories.append(driven.go(path, steps=round(end / driven.h)))
    still, gone = (h.wrench[:, 0, :2] @ speed for h in histories)
    t = histories[0].t
    late = t > 2.0
    off = float(np.sqrt(np.mean((still - gone)[late] ** 2)) / np.abs(still[late]).mean())
    ratio = float(gone[late].mean() / still[late].mean())
    case = "Galilean invariance: moving window against moving stream"
    rows = [
        most(case, "difference of drag (rms), over the drag", off, 0.02),
        Row(case, "mean drag over mean drag", ratio, 1.0, 0.01, "exact"),
    ]
    curves = (Curve("stream", t[late], still[late]), Curve("moving", t[late], gone[late]))
    return Findings(
        rows, [Plot("Cylinder, Re 100: moving stream and moving window", "t U/D", "drag / ρU²D", curves)]
    )


def carried(short: bool) -> Findings:
    """Bodies that move with the stream feel nothing."""
    del short
    twist = np.array([0.8, 0.6, 0.0])
    rows = []
    for name, shape in (("plate", PLATE), ("circle", CIRCLE)):
        text = scene(
            shape,
            cells=32,
            step=communication_step(0.1, 32),
            viscosity=1e-3,
            window=(6.0, 6.0),
            wind=(0.8, 0.6),
        )
        driven = Driven(text)
        forces = driven.go(lambda t: (np.array([twist[0] * t, twist[1] * t, 0.4]), twist), steps=200)
        rows.append(
            most(
                f"{name} that moves with the stream",
                "largest force over ρU²L",
                float(np.abs(forces.wrench).max()),
                1e-4,
            )
        )
    return Findings(rows)


CASES: dict[str, Callable[[bool], Findings]] = {
    "impulse balance": impulse,
    "Galilean invariance": galilean,
    "carried by the stream": carried,
}
