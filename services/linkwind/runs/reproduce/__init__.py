"""The paper that linkwind starts from, made again: its figures, and whether its statements hold.

Rahmati & Karimi 2021, doi:10.3390/app11031136.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from linkwind.errors import InputError
from linkwind.runs.reproduce import accuracy, flight, page
from linkwind.runs.reproduce.accuracy import CHANNELS, Velocities
from linkwind.runs.reproduce.claims import Claim
from linkwind.runs.reproduce.flight import Flight
from linkwind.runs.run import run
from linkwind.scenario import load

__all__ = ["JOBS", "Claim", "Reproduced", "reproduce"]

JOBS = ("velocities in a field", "two programs", "flow, with the hinge", "flow, without the hinge", "page")
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Reproduced:
    """What came out.

    Attributes:
        claims: statements of the paper, judged.
        field: Fig. 7 in the field F0.
        page: the HTML page.
    """

    claims: tuple[Claim, ...]
    field: Velocities
    page: Path

    def as_json(self) -> dict[str, Any]:
        """Return the keys of ``linkwind reproduce --json``; errors of the incremental scheme in percent."""
        errors = self.field.errors["incremental"].reshape(2, 3).tolist()
        fig7 = {f"body{i}": dict(zip(CHANNELS, body, strict=True)) for i, body in enumerate(errors, start=1)}
        return {
            "fig7": fig7,
            "verdicts": [claim.as_json() for claim in self.claims],
            "page": str(self.page),
        }


def reproduce(out: Path, progress: Progress = lambda job, done: None, *, short: bool = False) -> Reproduced:
    """Run the paper's cases, write logs, reports and the page.

    Args:
        out: folder for the results, new.
        progress: is told now and then which of ``JOBS`` is on, and what part of it is done.
        short: a coarser flow, 32 cells along a plate instead of 48.

    Raises:
        InputError: the folder is there already.
    """
    if out.exists():
        raise InputError(f"{out}: expected a new folder; got one that exists. Name another with --out.")
    try:
        out.mkdir(parents=True)
    except OSError as error:
        raise InputError(f"{out}: cannot be a folder: {error.strerror}. Choose another --out.") from None
    field, two_programs, hinged_flow, free_flow, last = JOBS
    progress(field, 0.0)
    velocities = [accuracy.velocities(name, out) for name in ("two_link_field", "two_link_gust")]
    claims = accuracy.claims(velocities[0], velocities[1], out)
    progress(two_programs, 0.0)
    exchanges = run(load("two_link"), out / "two_link", lambda step: None).result.exchange_us
    flights = [
        _fly(name, out, job, progress, short=short)
        for name, job in (("two_link_flow", hinged_flow), ("two_link_flow_free", free_flow))
    ]
    progress(last, 0.0)
    claims += [*flight.claims(*flights), _two_programs(exchanges.quantile_us(0.5), flights[0])]
    page.write(out / "paper.html", claims, flights, velocities[0])
    return Reproduced(tuple(claims), velocities[0], out / "paper.html")


def _fly(name: str, out: Path, job: str, progress: Progress, *, short: bool) -> Flight:
    steps = load(name, flight.COARSE if short else ()).steps
    return flight.fly(name, out, lambda step: progress(job, step / steps), short=short)


def _two_programs(exchange_us: float, hinged: Flight) -> Claim:
    share = exchange_us / hinged.median_us
    return Claim(
        "A flow solver and a dynamics program coupled as two programs are too slow.",
        "time of an exchange between two processes over that of a step of the flow; holds above 1",
        share,
        share > 1.0,
    )
