"""The head of the page: how the run ended, and the numbers that sum it up."""

from __future__ import annotations

from html import escape

import numpy as np

from linkwind.report.data import Run, largest
from linkwind.report.panels import points_per_curve, prefixed, shown_whole
from linkwind.report.scene import FRAMES
from linkwind.report.tables import number

_ZOOM = "Drag over a plot to zoom all of them, double-click to go back."


def badge(run: Run) -> str:
    """Return one word on how the run ended."""
    kind, word = ("good", "complete") if run.complete else ("bad", "incomplete")
    return f'<span class="badge {kind}">{word}</span>'


def banner(run: Run) -> str:
    """Return what ended an incomplete run, and where; nothing for a complete one."""
    if run.complete:
        return ""
    times = run.trajectory.t
    where = f"{run.steps} of {run.planned_steps} steps"
    where += f", to t = {number(float(times[-1]))} s" if len(times) else ", not even the first state"
    cause = run.error or "The log has no end: the run was killed, or is still going on."
    text = f"<strong>Not the whole run: {where}.</strong><p>{escape(cause)}</p>"
    return f'<div class="banner" role="alert">{text}</div>'


def made_from(run: Run) -> str:
    """Return what the run was made from; nothing where that is its scenario alone."""
    return "".join(f'<p class="origin">{escape(text[0].upper() + text[1:])}.</p>' for text in run.origin)


def tiles(run: Run) -> str:
    """Return the summary: what, how much, a detail."""
    coupling, dynamics = run.scenario["coupling"], run.scenario["dynamics"]
    times, digest = run.trajectory.t, run.final_state_sha256
    scheme, how = coupling["scheme"], dynamics["integrator"]
    if dynamics["method"] != "reduced":
        how = f"{dynamics['method']}, {how}"
    if scheme == "pec":
        scheme += f" {coupling['order']}"
        how += ", order adaptive" if coupling["adaptive"] else ", order fixed"
    median, late = (_percentile(run, q) for q in (50, 99))
    end = f"{number(float(times[-1]))} s" if len(times) else "–"
    off = largest(np.abs(run.energy_residual))
    shown = [
        ("Simulated", end, f"{run.steps} steps of {_amount(coupling['step'], 's')}"),
        ("Coupling", scheme, how),
        ("Largest force", _amount(run.largest_force, "N"), "of the air on a body"),
        (
            "Largest joint gap",
            _amount(run.largest_gap, "m"),
            "of the poses as sent" if run.scenario["joints"] else "no joints",
        ),
        ("Energy off by", _amount(off, "J"), "at most, since t₀"),
        ("Median exchange", _amount(median, "s"), f"99 % in {_amount(late, 's')}"),
        (
            "Final state" if run.complete else "Last state",
            digest[:8] if digest else "–",
            "SHA-256, in full below",
        ),
    ]
    return "\n".join(
        f"<div><dt>{escape(term)}</dt><dd>{escape(value)}<small>{escape(detail)}</small></dd></div>"
        for term, value, detail in shown
    )


def note(run: Run) -> str:
    """Return what the page leaves out of the run."""
    states, points = len(run.trajectory.t), points_per_curve(run)
    if not states:
        return "The log holds no state of the mechanism: there is nothing to draw."
    between = "Between two frames of the wakes their lines go straight. " if run.wakes else ""
    if run.volumes:
        between += "Between two frames the surfaces of the vortices go with the fluid at their corners. "
    whole = shown_whole(run)
    if states <= min(FRAMES, whole):
        return f"All {states} states are shown. {between}{_ZOOM}"
    thinned = f"; a curve at most {points} points, the smallest and the largest of each interval"
    return (
        f"The run has {states} states. The animation shows at most {FRAMES} of them, evenly spread"
        f"{thinned * (states > whole)}. The log holds all. {between}{_ZOOM}"
    )


def _percentile(run: Run, q: float) -> float | None:
    return float(np.percentile(run.exchange, q)) if run.exchange.size else None


def _amount(value: float | None, unit: str) -> str:
    if value is None:
        return "–"
    factor, unit = prefixed(abs(value), unit)
    return f"{value * factor:.3g} {unit}"
