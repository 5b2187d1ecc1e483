"""The plots of a run as plain data: panels of rows of curves, thinned and packed for the page."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np

from linkwind.report.arrays import means, pack, peaks
from linkwind.report.data import Diagnostics, Run, largest
from linkwind.spatial import Array

POINTS = 2000  # of a curve that is thinned
WHOLE = 1.5  # times as many samples are shown all: that costs half of as many points with times of their own
ROUND_OFF = 1e-12  # of a vector's usual size: a component that is always below is drawn as zero
MANY_BODIES = 8  # more of them share the points of this many

_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_MOTION_AXES = {True: (0, 1), False: (0, 1, 2)}
_TURN_AXES = {True: (2,), False: (0, 1, 2)}


def points_per_curve(run: Run) -> int:
    """Return the most points that a curve of this run gets on the page if it is thinned."""
    return POINTS * MANY_BODIES // max(MANY_BODIES, len(run.bodies))


def shown_whole(run: Run) -> int:
    """Return up to how many samples a curve of this run is shown whole."""
    return int(WHOLE * points_per_curve(run))


def panels(run: Run) -> list[dict[str, Any]]:
    """Return the plots of a run in reading order; those that have nothing to show are left out."""
    every = (_velocity, _aerodynamic, _coordinates, _drives, _joints, _coupling, _energy, _exchange)
    made = (panel(run) for panel in every)
    return [panel for panel in made if panel is not None] + [_reported(run, each) for each in run.diagnostics]


def prefixed(value: float, unit: str) -> tuple[float, str]:
    """Return the factor and the unit with an SI prefix that bring a value between 1 and 1000."""
    exponent = 0 if value == 0.0 else 3 * int(np.floor(np.log10(value) / 3))
    exponent = min(9, max(-15, exponent))
    return 10.0**-exponent, _PREFIXES[exponent] + unit


def _panel(title: str, rows: Sequence[dict[str, Any]], note: str = "") -> dict[str, Any]:
    return {"title": title, "note": note, "rows": list(rows)}


def _row(label: str, *curves: dict[str, Any], **how: bool | str) -> dict[str, Any]:
    """Return one pair of axes; ``how``: log, whole (numbers), bars with their xlabel."""
    return {"label": label, "curves": list(curves), **how}


def _curve(run: Run, name: str, colour: int, y: Array, t: Array | None = None) -> dict[str, Any]:
    """Return one curve.

    ``x`` is left out where it is the trajectory's own times, not thinned. With a thinned one come ``means``,
    of all its samples from each of its points to the next.
    """
    times = run.trajectory.t if t is None else t
    curve = {"name": name, "colour": colour}
    if y.size > shown_whole(run):
        keep = peaks(y, points_per_curve(run))
        return curve | {
            "y": pack(y[keep]),
            "x": pack(times[keep], "f8"),
            "means": pack(means(times, y, keep)),
        }
    shared = np.array_equal(times, run.trajectory.t)
    return curve | {"y": pack(y)} | ({} if shared else {"x": pack(times, "f8")})


def _body_rows(run: Run, labels: Sequence[str], columns: Array) -> list[dict[str, Any]]:
    """Return a row for each component of ``columns``, shape (k, n, components), a curve for each body."""
    drawn = _above_round_off(columns)
    return [
        _row(label, *(_curve(run, name, i, drawn[:, i, c]) for i, name in enumerate(run.bodies)))
        for c, label in enumerate(labels)
    ]


def _above_round_off(values: Array) -> Array:
    """Return values with zeros for a component that is never more than noise, which would fill its plot.

    Args:
        values: of vectors, shape (k, n, components).
    """
    if not values.size:
        return values
    finite = np.isfinite(values)
    size = np.where(finite, np.abs(values), 0.0)
    noise = size.max(axis=(0, 1)) < ROUND_OFF * np.median(size.max(axis=(1, 2)))
    return np.where(noise & finite, 0.0, values)


def _labels(symbol: str, axes: Sequence[int], unit: str) -> list[str]:
    return [f"{symbol}<sub>{'xyz'[axis]}</sub> [{unit}]" for axis in axes]


def _velocity(run: Run) -> dict[str, Any]:
    move, turn = _MOTION_AXES[run.planar], _TURN_AXES[run.planar]
    path = run.trajectory
    rows = _body_rows(run, _labels("V", move, "m/s"), path.linear[:, :, move])
    turning = ["ω [rad/s]"] if run.planar else _labels("ω", turn, "rad/s")
    rows += _body_rows(run, turning, path.angular[:, :, turn])
    return _panel("Velocity", rows, "Of the centres of mass, in the world frame.")


def _aerodynamic(run: Run) -> dict[str, Any]:
    move, turn = _MOTION_AXES[run.planar], tuple(3 + axis for axis in _TURN_AXES[run.planar])
    wrench = run.trajectory.wrench
    rows = _body_rows(run, _labels("F", move, "N"), wrench[:, :, move])
    turning = ["M [N·m]"] if run.planar else _labels("M", _TURN_AXES[False], "N·m")
    rows += _body_rows(run, turning, wrench[:, :, turn])
    note = "At the centres of mass, added mass included."
    return _panel("Aerodynamic force", rows, note)


def _coordinates(run: Run) -> dict[str, Any] | None:
    """Return angles and distances of joints that have one coordinate, and their rates."""
    rows: list[dict[str, Any]] = []
    for turns, unit, factor in ((True, "°", np.degrees(1.0)), (False, "m", 1.0)):
        joints = [each for each in run.coordinates if each.turns == turns and len(run.trajectory.t)]
        if not joints:
            continue
        symbol = "angle" if turns else "distance"
        for values, label in (
            (run.trajectory.q[:, [each.q for each in joints]], f"{symbol} [{unit}]"),
            (run.trajectory.v[:, [each.v for each in joints]], f"rate [{unit}/s]"),
        ):
            curves = (_curve(run, j.joint, j.body, factor * values[:, i]) for i, j in enumerate(joints))
            rows.append(_row(label, *curves))
    return (
        _panel("Joint coordinates", rows, "Zero where the frames of both bodies are parallel.")
        if rows
        else None
    )


def _drives(run: Run) -> dict[str, Any] | None:
    """Return effort and power of actuators and motions, and the mean power of each."""
    drives, path = run.drives, run.trajectory
    if not drives or not len(path.t):
        return None
    rows = [
        _row(label, *(_curve(run, d.name, d.body, path.force_effort[:, d.column]) for d in some))
        for turns, label in ((True, "torque [N·m]"), (False, "force [N]"))
        if (some := [drive for drive in drives if drive.turns == turns])
    ]
    power = path.force_power[:, [d.column for d in drives]]
    rows.append(_row("power [W]", *(_curve(run, d.name, d.body, power[:, i]) for i, d in enumerate(drives))))
    return _panel("Drives", rows, f"What they give to the bodies. {_mean_powers(run, power)}")


def _mean_powers(run: Run, power: Array) -> str:
    """Return the mean power over the time that is shown [W], of each drive and of all; shape (k, drives)."""
    t = run.trajectory.t
    if len(t) < 2:
        return ""
    means = (np.diff(t) @ (power[1:] + power[:-1]) / 2.0 / (t[-1] - t[0])).tolist()
    each = [f"{drive.name} {mean:.3g} W" for drive, mean in zip(run.drives, means, strict=True)]
    total = f"; together {sum(means):.3g} W" if len(means) > 1 else ""
    return f"Mean power from {t[0]:g} to {t[-1]:g} s: {', '.join(each)}{total}."


def _joints(run: Run) -> dict[str, Any] | None:
    path, bodies = run.trajectory, len(run.bodies)
    forces = [(i, joint["name"], path.reaction[:, i]) for i, joint in enumerate(run.joint_of) if joint]
    forces += [
        (bodies + i, joint["name"], path.closure_reaction[:, i]) for i, joint in enumerate(run.closures)
        if path.closure_reaction.shape[1]
    ]  # fmt: skip
    if not forces:
        return None
    axes = _MOTION_AXES[run.planar]
    drawn = _above_round_off(np.stack([force[:, :3] for _, _, force in forces], axis=1))
    rows = [
        _row(label, *(_curve(run, name, i, drawn[:, j, axis]) for j, (i, name, _) in enumerate(forces)))
        for axis, label in zip(axes, _labels("R", axes, "N"), strict=True)
    ]
    rows += _gap(run)
    last = " Joints that close loops come last." if run.closures else ""
    return _panel("Joint forces", rows, f"Force of the parent on the child, in its colour.{last}")


def _energy(run: Run) -> dict[str, Any]:
    path, residual = run.trajectory, run.energy_residual
    factor, unit = prefixed(largest(np.abs(residual)) or 0.0, "J")
    parts = {
        "kinetic": path.kinetic_energy,
        "potential": path.potential_energy,
        "work of air and actuators": path.external_work,
        "dampers": path.dissipated_work,
    }
    rows = [
        _row("E [J]", *(_curve(run, name, 2 + i, y) for i, (name, y) in enumerate(parts.items()))),
        _row(f"ΔE [{unit}]", _curve(run, "kinetic + potential − work + dampers", 7, residual * factor)),
    ]
    return _panel("Energy balance", rows, "Below: what it is off by, since t₀.")


def _gap(run: Run) -> list[dict[str, Any]]:
    """Return the row of the largest distance of two points that a joint holds together."""
    factor, unit = prefixed(run.largest_gap or 0.0, "m")
    gap = run.trajectory.joint_gap * factor
    return [_row(f"gap [{unit}]", _curve(run, "largest distance of two joint points", 7, gap))]


def _coupling(run: Run) -> dict[str, Any] | None:
    t, errors = run.coupling_time, run.extrapolation_error
    if not t.size:
        return None
    rows = [_row("degree [1]", _curve(run, "degree", 7, run.order.astype(float), t), whole=True)]
    known = np.sqrt(np.where(errors > 0.0, errors, np.nan))  # a logarithmic axis has no zero
    if np.isfinite(known).any():
        curves = [_curve(run, f"√E{'₀₁₂₃'[d]}", 2 + d, known[:, d], t) for d in range(known.shape[1])]
        rows.append(_row("√E<sub>d</sub> [m/s²]", *curves, log=True))
    factor, unit = prefixed(largest(np.abs(run.interface_energy)) or 0.0, "J")
    energy = _curve(run, "trial against accepted state", 7, run.interface_energy * factor, t)
    rows.append(_row(f"ΔE [{unit}]", energy))
    note = "Extrapolation: degree, errors by degree, energy error."
    return _panel("Coupling", rows, note)


def _reported(run: Run, diagnostics: Diagnostics) -> dict[str, Any]:
    """Return a row for each number that a provider reports with its wrenches."""
    rows = [
        _row(escape(name), _curve(run, name, 7, diagnostics.values[:, i], diagnostics.t))
        for i, name in enumerate(diagnostics.names)
    ]
    return _panel(f"Reported by {diagnostics.provider}", rows, "Its own numbers, with each wrench.")


def _exchange(run: Run) -> dict[str, Any] | None:
    times = run.exchange[run.exchange > 0.0] * 1e6
    if not times.size:
        return None
    edges = np.geomspace(times.min(), max(times.max(), times.min() * 1.01), 49)
    counts, _ = np.histogram(times, edges)
    bars = {
        "name": "exchanges",
        "colour": 0,
        "x": pack(np.sqrt(edges[1:] * edges[:-1])),
        "width": pack(np.diff(edges)),
        "y": pack(counts),
    }
    row = _row("exchanges [1]", bars, bars=True, xlabel="wall time of an exchange [µs]")
    shares = ", ".join(f"{name} {_short(np.percentile(times, q))}" for name, q in _PERCENTILES.items())
    return _panel("Exchange time", [row], f"From putting the motion to having every wrench: {shares}.")


def _short(microseconds: float) -> str:
    factor, unit = prefixed(microseconds * 1e-6, "s")
    return f"{microseconds * 1e-6 * factor:.3g} {unit}"


_PERCENTILES = {"median": 50, "90 %": 90, "99 %": 99, "largest": 100}
