"""Figs. 3-6: two plates in a flow that is resolved around them, on a hinge and without one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from linkwind.frames import FlowFrame
from linkwind.report.data import Run, read
from linkwind.report.flow import PAPER, speed
from linkwind.runs.reproduce.claims import Claim
from linkwind.runs.run import run
from linkwind.scenario import load
from linkwind.spatial import Array

COARSE = ("aero.flow.cells=32", "coupling.step=1.5e-4")
SETTLED = 0.1  # s, from which on forces are judged: before, the flow comes up


@dataclass(frozen=True)
class Flight:
    """One of the two cases.

    Attributes:
        log: of the run.
        run: that log, as a report reads it.
        median_us: median time of an exchange, the flow's step in it [µs].
    """

    log: Path
    run: Run
    median_us: float

    @property
    def t(self) -> Array:
        """Times of the accepted states [s], shape (k,)."""
        return self.run.trajectory.t

    @property
    def loads(self) -> Array:
        """Force X, Y [N] and moment [N·m] of the air on both bodies, shape (k, 2, 3)."""
        return self.run.trajectory.wrench[:, :, [0, 1, 5]]

    @property
    def joint(self) -> Array:
        """Force of the hinge on link 1, X and Y [N], shape (k, 2)."""
        return -self.run.trajectory.reaction[:, 1, :2]

    @cached_property
    def tops(self) -> Array:
        """Ends of both plates that the hinge is, or was, at [m], shape (k, 2, 2)."""
        path = self.run.trajectory
        along = np.stack([np.cos(self.angles), np.sin(self.angles)], axis=-1)
        return path.position[:, :, :2] - 0.5 * self._length * along

    @cached_property
    def angles(self) -> Array:
        """From the world's x axis to the plates [rad], without whole turns, shape (k, 2)."""
        orientation = self.run.trajectory.orientation
        return 2.0 * np.arctan2(orientation[:, :, 3], orientation[:, :, 0])

    @property
    def _length(self) -> float:
        return float(self.run.scenario["bodies"][0]["shape"]["length"])

    def off_vertical(self, k: int) -> float:
        """Return by how much both plates are off the vertical at a point of the run, mean [°]."""
        return float(np.degrees(np.arcsin(np.abs(np.cos(self.angles[k])))).mean())

    def frames(self) -> list[FlowFrame]:
        """Return the frames next to the times that the paper shows."""
        (flow,) = self.run.flows
        return list(flow.some(np.array([int(np.abs(flow.t - t).argmin()) for t in PAPER])))

    def fastest_to_hinge(self) -> float:
        """Return how far the fastest air is from the hinge at the paper's times, at most [link lengths]."""
        away = []
        for frame in self.frames():
            k = int(np.searchsorted(self.run.trajectory.step, frame.step))
            row, column = np.unravel_index(np.nanargmax(speed(frame)), frame.shape)
            place = np.array(frame.origin) + frame.cell * np.array([column, row])
            away.append(np.linalg.norm(place - self.tops[k, 0]) / self._length)
        return float(max(away))


def fly(name: str, folder: Path, progress: Callable[[int], None], *, short: bool) -> Flight:
    """Run one of the cases, both sides in this process."""
    scenario = load(name, [*(COARSE if short else ()), 'bus.transport="inprocess"'])
    outcome = run(scenario, folder / name, progress)
    return Flight(outcome.log, read(outcome.log), outcome.result.exchange_us.quantile_us(0.5))


def claims(hinged: Flight, free: Flight) -> list[Claim]:
    """Judge what the paper says about both cases."""
    gap, apart = hinged.run.largest_gap or 0.0, float(np.linalg.norm(free.tops[-1, 0] - free.tops[-1, 1]))
    turned = free.off_vertical(0) - free.off_vertical(-1)
    nearest = hinged.fastest_to_hinge()
    later = [flight.loads[flight.t >= SETTLED] for flight in (hinged, free)]
    highest = float(max(loads[:, :, 1].max() for loads in later))
    negative = float(min((loads[:, :, 0] < 0.0).mean(axis=0).min() for loads in later))
    ratio = float(np.abs(later[0][:, :, 0]).mean() / np.abs(later[1][:, :, 0]).mean())
    return [
        Claim(
            "Constrained bodies keep together (Fig. 4).",
            "largest gap of the hinge [m]; holds up to 1e-9",
            gap, gap <= 1e-9,
        ),
        Claim(
            "Unconstrained bodies drift apart (Fig. 3).",
            "distance of the two ends that touched at the start, at the end [m]; holds from 0.05 on",
            apart, apart >= 0.05,
        ),
        Claim(
            "Unconstrained bodies turn towards the vertical (Fig. 3).",
            "by how much less they are off it at the end, mean of both [°]; holds above 0",
            turned, turned > 0.0,
        ),
        Claim(
            "The highest speeds are at the joint (Fig. 4).",
            f"how far from it the fastest air is at {PAPER[0]} and {PAPER[1]} s, the larger [link lengths]; "
            "holds up to 0.25",
            nearest, nearest <= 0.25,
        ),
        Claim(
            "The Y force goes up to about 20 N (Fig. 5).",
            f"largest on a body after {SETTLED} s, both cases [N]; holds from 13 to 30",
            highest, 13.0 <= highest <= 30.0,
        ),
        Claim(
            "The X force is negative most of the time (Fig. 5).",
            "share of the time, least of both bodies and cases; holds above 0.5",
            negative, negative > 0.5,
        ),
        Claim(
            "The X force is about twice as large in the constrained case (Fig. 5).",
            "its mean size there over that in the other case; holds from 1.5 to 2.5",
            ratio, 1.5 <= ratio <= 2.5,
        ),
    ]  # fmt: skip
