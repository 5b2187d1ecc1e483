"""A plate in two dimensions: heave and pitch, a sudden start, gusts."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from linkwind.runs.validate.driven import Driven, Forces
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row, most, near
from linkwind.runs.validate.signals import fit
from linkwind.runs.validate.vortex import exact
from linkwind.runs.validate.vortex.scenes import SPAN, WIDTH, communication_step, wing
from linkwind.spatial import Array

THEODORSEN = "T. Theodorsen, NACA report 496 (1935)"
GARRICK = "I. E. Garrick, NACA report 567 (1936)"
WAGNER = "H. Wagner 1925, as an integral by W. R. Sears 1940, doi:10.1016/S0016-0032(40)90336-3"
SEARS = "W. R. Sears 1941, doi:10.2514/8.10655"

SIZE = 0.01  # of all motions and gusts: all is linear but for the thrust, which is quadratic
PERIODS = 3.0  # that a motion lasts at least
SHORTEST = 12.0  # chords that it lasts at least


@dataclass(frozen=True)
class Motion:
    """Amplitudes of heave [chords] and pitch [rad] of a motion that is a sine."""

    name: str
    heave: float
    pitch: float


MOTIONS = (Motion("heave", SIZE, 0.0), Motion("pitch", 0.0, SIZE))


def plate(chordwise: int, chords: float, advance: float = 1.0, **more: float | str) -> Driven:
    """Return a plate in two dimensions that goes so many chords, in steps of so many panels."""
    step = communication_step(advance / chordwise)
    return Driven(wing(SPAN, rings=(chordwise, 1), step=step, rows=round(chords / step) + 1, **more))  # type: ignore[arg-type]


def per_length(forces: Forces) -> tuple[Array, Array, Array]:
    """Return thrust, lift, and moment nose up on a unit of span."""
    along, up, turn = (forces.wrench[:, 0] / WIDTH).T
    return -along, up, -turn


def harmonics(t: Array, x: Array, omega: float) -> tuple[complex, float]:
    """Return the amplitude at omega, and the mean, over the last period of a history."""
    late = t > t[-1] - 2.0 * np.pi / omega
    t, x = t[late], x[late]
    waves = [wave(n * omega * t) for n in (1, 2) for wave in (np.cos, np.sin)]
    cosine, sine, *_, mean = fit(x, *waves, np.ones_like(t)).tolist()
    return complex(cosine, -sine), mean


@dataclass(frozen=True)
class Compared:
    """What a motion has given, about what it should: complex ratios of lift and moment, ratio of thrust."""

    lift: complex
    moment: complex
    thrust: float


def oscillate(motion: Motion, k: float, chordwise: int, advance: float = 1.0) -> Compared:
    """Move a plate to and fro; return its loads over the exact ones."""
    omega = 2.0 * k
    chords = max(SHORTEST, PERIODS * 2.0 * np.pi / omega)
    driven = plate(chordwise, chords, advance)
    turn = np.array([0.0, motion.heave, -motion.pitch])

    def path(t: float) -> tuple[Array, Array]:
        return turn * np.sin(omega * t), turn * (omega * np.cos(omega * t))

    forces = driven.go(path, round(chords / driven.h))
    thrust, lift, moment = per_length(forces)
    right = exact.loads(k, -1j * motion.heave, -1j * motion.pitch)
    return Compared(
        harmonics(forces.t, lift, omega)[0] / right.lift,
        harmonics(forces.t, moment, omega)[0] / right.moment,
        harmonics(forces.t, thrust, omega)[1] / right.thrust,
    )


def harmonic(short: bool) -> Findings:
    """Heave and pitch: lift and moment of Theodorsen, thrust of Garrick."""
    start, found = time.perf_counter(), Findings()
    chordwise = 10 if short else 20
    for motion in MOTIONS:
        for k in (0.5,) if short else (0.2, 0.5, 1.0):
            got = oscillate(motion, k, chordwise)
            case = f"{motion.name}, k = {k:g}, {chordwise} rings along the chord"
            for load, ratio in (("lift", got.lift), ("moment", got.moment)):
                phase = round(float(np.degrees(np.angle(ratio))), 4)
                found.rows += [
                    Row(case, f"{load}: amplitude over the exact one", abs(ratio), 1.0, 0.01, THEODORSEN),
                    near(case, f"{load}: phase ahead of the exact one [deg]", phase, 0.0, 0.5, THEODORSEN),
                ]
            within = 0.05  # a small difference of suction and of the lift that leans back
            found.rows.append(Row(case, "mean thrust over the exact one", got.thrust, 1.0, within, GARRICK))
    return Findings(found.rows, [], time.perf_counter() - start)


def convergence(short: bool) -> Findings:
    """The same over the number of rings, and over how far the plate goes in a step."""
    start, found, k = time.perf_counter(), Findings(), 0.5
    counts, curves = (3, 6, 12) if short else (3, 6, 12, 24), []
    for motion in MOTIONS:
        errors = np.array([_errors(oscillate(motion, k, count)) for count in counts])
        for load, error in zip(("lift", "moment", "thrust"), errors.T, strict=True):
            curves.append(Curve(f"{motion.name}: {load}", np.array(counts), error))
        case = f"{motion.name}, k = {k:g}, 6 rings along the chord"
        loads = float(errors[counts.index(6), :2].max())
        found.rows.append(most(case, "error of lift and moment", loads, 0.015, THEODORSEN))
    for advance in (0.25, 0.5, 2.0):
        ratio = oscillate(MOTIONS[0], k, 12, advance).lift
        case = f"heave, k = {k:g}, 12 rings, {advance:g} of their lengths a step"
        phase = round(float(np.degrees(np.angle(ratio))), 4)
        found.rows += [
            Row(case, "lift: amplitude over the exact one", abs(ratio), 1.0, 0.02, THEODORSEN),
            near(case, "lift: phase ahead of the exact one [deg]", phase, 0.0, 0.5, THEODORSEN),
        ]
    plot = Plot(
        f"Heave and pitch at k = {k:g}", "rings along the chord", "relative error", tuple(curves), "loglog"
    )
    return Findings(found.rows, [plot], time.perf_counter() - start)


def _errors(got: Compared) -> tuple[float, float, float]:
    return abs(got.lift - 1.0), abs(got.moment - 1.0), abs(got.thrust - 1.0)


def sudden(short: bool) -> Findings:
    """A plate that is suddenly there, at an angle to the stream: its lift over that in the end."""
    start, rows = time.perf_counter(), []
    chordwise, chords = (10, 10.0) if short else (20, 20.0)
    driven = plate(chordwise, chords)
    pose = np.array([0.0, 0.0, -SIZE])
    forces = driven.go(lambda t: (pose, np.zeros(3)), round(chords / driven.h))
    share = per_length(forces)[1] / (np.pi * SIZE)
    half_chords = forces.t / exact.HALF
    case = f"sudden start, {chordwise} rings along the chord"
    for s in (2.0, 4.0, 10.0, 20.0):
        if s > half_chords[-1]:
            continue
        value, right = float(np.interp(s, half_chords, share)), float(exact.wagner(np.array([s]))[0])
        rows.append(Row(case, f"lift over the final one after {s / 2:g} chords", value, right, 0.01, WAGNER))
    first = float(exact.wagner(half_chords[:1])[0])
    rows.append(Row(case, "the same in the first step", float(share[0]), first, None, WAGNER))
    marks = np.geomspace(0.2, half_chords[-1], 25)
    curves = (
        Curve("linkwind", half_chords, share),
        Curve("Wagner's function", marks, exact.wagner(marks), True),
    )
    plot = Plot("Sudden start", "half chords", "lift over the final one", curves)
    return Findings(rows, [plot], time.perf_counter() - start)


def _through(chordwise: int, chords: float, gust: str) -> tuple[Array, Array, Array]:
    """Fly through a gust that stands still; return t, lift and moment on a unit of span."""
    driven = plate(chordwise, chords, wind=0.0, gust=gust)

    def path(t: float) -> tuple[Array, Array]:
        return np.array([-t, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0])

    forces = driven.go(path, round(chords / driven.h))
    return forces.t, *per_length(forces)[1:]


def gusts(short: bool) -> Findings:
    """Waves and a single gust that stand still in the air: Sears' function, and what follows from it."""
    start, found = time.perf_counter(), Findings()
    chordwise = 10 if short else 20
    for k in (0.5,) if short else (0.2, 0.5, 1.0):
        omega = 2.0 * k
        cycles = omega / (2.0 * np.pi)
        gust = f"amplitude = [0.0, {SIZE!r}, 0.0]\nfrequency = 0.0\nwavenumber = [{cycles!r}, 0.0, 0.0]"
        t, lift, moment = _through(chordwise, max(SHORTEST, PERIODS * 2.0 * np.pi / omega), gust)
        right = 2.0 * np.pi * exact.HALF * complex(exact.sears(np.array([k]))[0]) * 1j * SIZE
        case = f"waves of gusts, k = {k:g}, {chordwise} rings along the chord"
        for load, history, expected in (
            ("lift", lift, right), ("moment", moment, 0.5 * exact.HALF * right)
        ):  # fmt: skip
            ratio = harmonics(t, history, omega)[0] / expected
            phase = round(float(np.degrees(np.angle(ratio))), 4)
            found.rows += [
                Row(case, f"{load}: amplitude over the exact one", abs(ratio), 1.0, 0.01, SEARS),
                near(case, f"{load}: phase ahead of the exact one [deg]", phase, 0.0, 1.0, SEARS),
            ]
    found.add(_single(chordwise))
    return Findings(found.rows, found.plots, time.perf_counter() - start)


def _single(chordwise: int) -> Findings:
    """A gust of 1 - cos over four chords, which begins two chords ahead."""
    length, ahead, chords = 4.0, 2.0, 12.0
    gust = (
        f'shape = "one_minus_cosine"\namplitude = [0.0, {SIZE!r}, 0.0]\nfrequency = 0.0\n'
        f"wavenumber = [{-1.0 / length!r}, 0.0, 0.0]\nphase_deg = {-360.0 * ahead / length!r}"
    )
    t, lift, _ = _through(chordwise, chords, gust)
    step, count = 0.08, 2**13  # so long that nothing comes round
    place = step * np.arange(count) - ahead
    inside = (place > 0.0) & (place < length)
    met = np.where(inside, 0.5 * SIZE * (1.0 - np.cos(2.0 * np.pi * place / length)), 0.0)
    right = np.interp(t, step * np.arange(count), exact.gust_lift(met, step))
    case = f"gust of 1 - cos over {length:g} chords, {chordwise} rings along the chord"
    largest, of = float(lift.max()), float(right.max())
    off = float(np.sqrt(np.mean((lift - right) ** 2))) / of
    rows = [
        Row(case, "largest lift over the exact one", largest / of, 1.0, 0.01, SEARS),
        most(case, "difference, root mean square over the largest", off, 0.01, SEARS),
    ]
    scale = 2.0 * np.pi * exact.HALF * SIZE
    curves = (
        Curve("linkwind", t, lift / scale),
        Curve("from Sears' function", t[:: chordwise // 2], right[:: chordwise // 2] / scale, True),
    )
    plot = Plot("A gust of 1 − cos", "chords flown", "lift over the quasi-steady largest", curves)
    return Findings(rows, [plot])


CASES: dict[str, Callable[[bool], Findings]] = {
    "heave and pitch": harmonic,
    "rings and steps": convergence,
    "sudden start": sudden,
    "gusts": gusts,
}
