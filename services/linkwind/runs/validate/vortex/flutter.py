"""A section on two springs in a stream: whole runs, strongly coupled, against Theodorsen's flutter."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from linkwind.log.tables import Trajectory
from linkwind.runs.validate.free import fastest, flown
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row, most
from linkwind.runs.validate.vortex import exact
from linkwind.runs.validate.vortex.scenes import SPAN, WIDTH, communication_step
from linkwind.scenario import Scenario, loads
from linkwind.spatial import Array

THEODORSEN = "T. Theodorsen, NACA report 496 (1935), its determinant solved"

EXACT = "exact: flutter between"

KICK = 1e-3  # speed of the heave at the start
PERIODS = 10.0  # that a run lasts


@dataclass(frozen=True)
class Section:
    """A plate with chord and density 1 that heaves and pitches on springs, and a mass that is fixed to it.

    Attributes:
        name: for the tables.
        ratio: mass over that of the fluid in a cylinder around the chord, the added mass.
        axis: of the pitch, behind the middle of the chord.
        share: of the mass that is in the plate, as a rod; the rest is a point.
        place: of that point, behind the middle of the chord.
        heave: natural frequency of the heave over that of the pitch, which is 1, in the void, each alone.
    """

    name: str
    ratio: float
    axis: float
    share: float
    place: float
    heave: float

    @property
    def mass(self) -> float:
        """Of a unit of span."""
        return 0.25 * np.pi * self.ratio

    @property
    def inertia(self) -> Array:
        """For heave of the axis, up, and pitch, nose up, of a unit of span."""
        plate, point = self.mass * self.share, self.mass * (1.0 - self.share)
        behind = -plate * self.axis + point * (self.place - self.axis)
        turn = plate * (1.0 / 12.0 + self.axis**2) + point * (self.place - self.axis) ** 2
        return np.array([[self.mass, -behind], [-behind, turn]])

    @property
    def springs(self) -> Array:
        """Stiffnesses of heave and pitch of a unit of span."""
        inertia = np.diag(self.inertia)
        return np.array([inertia[0] * self.heave**2, inertia[1]])

    def determinant(self, speed: float, rate: complex) -> complex:
        """Return what is 0 for a motion that grows as exp(rate t) in a stream of this speed."""
        fluid = np.zeros((2, 2), complex)
        for column, (heave, pitch) in enumerate(((1.0, 0.0), (self.axis, 1.0))):
            load = exact.loads(rate / speed / 2j, heave, pitch)
            fluid[:, column] = load.lift, load.moment + self.axis * load.lift
        return complex(np.linalg.det(rate**2 * self.inertia + np.diag(self.springs) - speed**2 * fluid))

    def flutter(self, speed: float, frequency: float) -> tuple[float, float]:
        """Return speed and frequency [rad per time] of the neutral motion near these."""
        x = np.array([speed, frequency])
        for _ in range(30):
            value = self._parts(x)
            slope = np.stack([(self._parts(x + d) - value) / 1e-7 for d in 1e-7 * np.eye(2)], axis=1)
            x = x - np.linalg.solve(slope, value)
        return float(x[0]), float(x[1])

    def rate(self, speed: float, near: complex) -> complex:
        """Return the rate of the motion in a stream of this speed whose rate is near this one, by secants."""
        last, now = near, near * 1.001 + 1e-4
        below = self.determinant(speed, last)
        for _ in range(40):
            value = self.determinant(speed, now)
            if abs(now - last) < 1e-13:
                break
            last, below, now = now, value, now - value * (now - last) / (value - below)
        return now

    def _parts(self, x: Array) -> Array:
        value = self.determinant(float(x[0]), 1j * float(x[1]))
        return np.array([value.real, value.imag])

    def scenario(self, speed: float, frequency: float, chordwise: int, scheme: str) -> Scenario:
        """Return a run of some periods of a frequency."""
        step = communication_step(1.0 / chordwise / speed)
        steps = round(PERIODS * 2.0 * np.pi / frequency / step)
        plate, point = (WIDTH * self.mass * share for share in (self.share, 1.0 - self.share))
        heave, pitch = (WIDTH * self.springs).tolist()
        grain = 1e-6 * (plate + point)  # no body is without mass
        text = f"""
[environment]
gravity = [0.0, 0.0, 0.0]
density = 1.0
wind = [{speed!r}, 0.0]
[[bodies]]
name = "slide"
mass = {grain!r}
inertia = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
velocity = [0.0, {KICK!r}]
[[bodies]]
name = "plate"
mass = {plate!r}
inertia = [0.0, {plate / 12.0!r}, {plate / 12.0!r}, 0.0, 0.0, 0.0]
shape = {{ type = "plate", length = 1.0, span = {SPAN!r} }}
[[bodies]]
name = "point"
mass = {point + grain!r}
inertia = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
[[joints]]
name = "heave"
type = "prismatic"
parent = "world"
child = "slide"
axis = [0.0, 1.0, 0.0]
stiffness = {heave!r}
[[joints]]
name = "pitch"
type = "revolute"
parent = "slide"
child = "plate"
child_point = [{self.axis!r}, 0.0]
stiffness = {pitch!r}
[[joints]]
name = "weld"
type = "fixed"
parent = "plate"
child = "point"
parent_point = [{self.place!r}, 0.0]
[aero]
model = "vortex"
bodies = ["plate"]
[aero.vortex]
chordwise = {chordwise}
spanwise = 1
wake = {steps + 1}
core = 0.01
trailing_edge = {{ plate = "+x" }}
[coupling]
step = {step!r}
scheme = "{scheme}"
timeout = 60.0
[bus]
transport = "inprocess"
"""
        return loads(text, "section", [f"time.end={round(steps * step, 9)!r}"])


@dataclass(frozen=True)
class Trial:
    """A section, where its flutter is sought, and how finely.

    Attributes:
        section: that flutters.
        near: speed, frequency.
        around: speeds that are run, over that of flutter, below and above.
        rings: along the chord, in the short form and in the full one.
        within: what the speed of flutter may be off, likewise.
    """

    section: Section
    near: tuple[float, float]
    around: float
    rings: tuple[int, int]
    within: tuple[float, float]


AIR = Trial(
    Section("section of 20 added masses", 20.0, -0.2, 1.0, 0.0, 0.6),
    (1.25, 0.94),
    0.05,
    (6, 12),
    (0.01, 0.01),
)
WATER = Trial(
    Section("section of 0.4 added masses", 0.4, 0.0, 0.1, 0.55, 0.2),
    (0.35, 0.93),
    0.10,
    (12, 24),
    (0.05, 0.02),
)


def heave_of(path: Trajectory) -> Array:
    """Return the height of the axis."""
    found: Array = path.position[:, 0, 1]
    return found


def growth(t: Array, x: Array) -> complex:
    """Return the rate of the oscillation that is largest in the end, of a sum of a few exponentials.

    The matrix pencil of Y. Hua, T. K. Sarkar, IEEE Trans. Acoust. Speech Signal Process. 38(5), 1990,
    doi:10.1109/29.56027, on some 40 values a period.
    """
    every = max(1, len(x) // 240)
    x, step = x[::every], every * (t[1] - t[0])
    length = len(x) // 2
    table = np.stack([x[k : k + length] for k in range(len(x) - length)])
    _, sizes, right = np.linalg.svd(table, full_matrices=False)
    right = right[: max(2, int((sizes > 1e-6 * sizes[0]).sum()))].conj().T
    poles = np.linalg.eigvals(np.linalg.lstsq(right[:-1], right[1:], rcond=None)[0])
    poles = poles[np.abs(poles) > 1e-3]
    shares = np.linalg.lstsq(poles[None, :] ** np.arange(len(x))[:, None], x.astype(complex), rcond=None)[0]
    last = np.abs(shares * poles ** (len(x) - 1)) * (poles.imag > 0.0)
    rate = np.log(poles[int(np.argmax(last))]) / step
    return complex(rate)


def flutter(short: bool) -> Findings:
    """Sections in a stream below and above the speed of flutter."""
    found, start = Findings(), time.perf_counter()
    for trial in (AIR, WATER):
        found.add(_flutter(trial, short))
    found.rows.append(_held(WATER))
    return Findings(found.rows, found.plots, time.perf_counter() - start)


def _flutter(trial: Trial, short: bool) -> Findings:
    section, rings, within = trial.section, trial.rings[not short], trial.within[not short]
    speed, frequency = section.flutter(*trial.near)
    shares = np.array([1.0 - trial.around, 1.0, 1.0 + trial.around])
    paths = [flown(section.scenario(share * speed, frequency, rings, "pec")) for share in shares.tolist()]
    rates = np.array([growth(path.t, heave_of(path)) for path in paths])
    neutral = float(np.interp(0.0, rates.real, shares))
    case, off = f"{section.name}, {rings} rings along the chord", f"{trial.around:.0%}"
    rows = [
        most(case, f"growth per radian {off} below flutter", rates[0].real / frequency, 0.0, EXACT),
        most(case, f"decay per radian {off} above it", -rates[2].real / frequency, 0.0, EXACT),
        Row(case, "speed of flutter over the exact one", neutral, 1.0, within, THEODORSEN),
        Row(
            case, "its frequency over the exact one",
            float(np.interp(0.0, rates.real, rates.imag)) / frequency, 1.0, 0.01, THEODORSEN,
        ),
    ]  # fmt: skip
    marks = np.linspace(shares[0], shares[-1], 9)
    exactly = [section.rate(share * speed, 1j * frequency).real / frequency for share in marks.tolist()]
    names = ("below flutter", "at it", "above")
    plots = [
        Plot(
            f"{section.name.capitalize()}",
            "periods", "heave over its speed at the start, as a time",
            tuple(
                Curve(name, path.t * frequency / (2.0 * np.pi), heave_of(path) / KICK)
                for name, path in zip(names, paths, strict=True)
            ),
        ),
        Plot(
            f"{section.name.capitalize()}: growth", "speed over that of flutter", "growth per radian",
            (
                Curve("linkwind", shares, rates.real / frequency),
                Curve("Theodorsen, exact", marks, np.array(exactly), True),
            ),
        ),
    ]  # fmt: skip
    return Findings(rows, plots)


def _held(trial: Trial) -> Row:
    """Return how the scheme that holds the force of the last step fails."""
    speed, frequency = trial.section.flutter(*trial.near)
    path = flown(trial.section.scenario(speed, frequency, trial.rings[0], "explicit"), to_the_end=False)
    return Row(
        f"{trial.section.name}, scheme explicit", "blows up: speed at the start over the largest",
        KICK / fastest(path), 1e-3, 0.0, "unstable where the added mass is more than the mass", "most",
    )  # fmt: skip


CASES: dict[str, Callable[[bool], Findings]] = {"flutter": flutter}
