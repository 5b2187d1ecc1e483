"""The page of a reproduction: verdicts, then the paper's figures as they come out here."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from pathlib import Path

from linkwind.report import pictures
from linkwind.runs.reproduce.accuracy import PAPER, Velocities
from linkwind.runs.reproduce.claims import Claim
from linkwind.runs.reproduce.flight import Flight
from linkwind.runs.validate.page import STYLE, picture
from linkwind.runs.validate.rows import Curve, Plot

TITLE = "Rahmati & Karimi 2021, made again"
REMARK = """S. M. Rahmati, A. Karimi, A Nonlinear CFD/Multibody Incremental-Dynamic Model for A Constrained
Mechanism, Appl. Sci. 2021, 11(3), 1136, doi:10.3390/app11031136. The paper gives neither the initial angles
(here 200° and −20°, a roof with the hinge on top, at rest) nor the force field of Fig. 7 (here F0, 3 to
40 Hz, and F1, gusts). So a statement about forces or attitudes that does not hold here may hold for its
start. Nothing was tuned."""
CASES = ("with the hinge, 5 m/s", "without, 3 m/s")


def write(path: Path, claims: Sequence[Claim], flights: Sequence[Flight], field: Velocities) -> None:
    """Write the page as one HTML file, pictures inside."""
    rows = "".join(_claim_row(claim) for claim in claims)
    figures = (
        _flows(flights)
        + _section("Fig. 5: force and moment of the air on both bodies", _loads(flights))
        + _section("Fig. 6: force of the hinge on link 1", _hinge(flights[0]))
        + _section("Fig. 7: velocities in the field F0, steps of 1 ms", _velocities(field))
        + _errors(field)
    )
    path.write_text(
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(TITLE)}</title>'
        f"<style>{STYLE} img.wide {{ max-width: 100% }}</style><h1>{html.escape(TITLE)}</h1>"
        f"<p>{html.escape(REMARK)}</p><table><tr><th>The paper says</th><th>Measured</th>"
        f"<th>Value</th><th></th></tr>{rows}</table>{figures}</html>\n",
        encoding="utf-8",
    )


def _claim_row(claim: Claim) -> str:
    mark, word = ("yes", "holds") if claim.holds else ("no", "does not hold")
    return (
        f"<tr><td>{html.escape(claim.claim)}</td><td>{html.escape(claim.measure)}</td>"
        f'<td class="n">{claim.value:.3g}</td><td class="{mark}">{word}</td></tr>'
    )


def _flows(flights: Sequence[Flight]) -> str:
    sections = []
    for number, flight, case in zip((4, 3), flights, CASES, strict=True):
        (flow,) = flight.run.flows
        data, *_ = pictures.png(flight.run, flow)
        title = f"Fig. {number}: speed with streamlines, and vorticity, {case}"
        image = _image(title, base64.b64encode(data).decode(), "wide")
        sections.append(f"<h2>{html.escape(title)}</h2>{image}")
    return "".join(reversed(sections))


def _section(title: str, plots: Sequence[Plot]) -> str:
    images = "".join(_image(plot.title, picture(plot)) for plot in plots)
    return f"<h2>{html.escape(title)}</h2>{images}"


def _image(title: str, data: str, kind: str = "") -> str:
    return f'<img class="{kind}" alt="{html.escape(title)}" src="data:image/png;base64,{data}">'


def _loads(flights: Sequence[Flight]) -> list[Plot]:
    plots = []
    for axis, (name, unit) in enumerate((("X", "force [N]"), ("Y", "force [N]"), ("moment", "moment [N·m]"))):
        curves = tuple(
            Curve(f"link {body + 1} {case}", flight.t, flight.loads[:, body, axis])
            for flight, case in zip(flights, CASES, strict=True)
            for body in (0, 1)
        )
        plots.append(Plot(name, "t [s]", unit, curves))
    return plots


def _hinge(flight: Flight) -> list[Plot]:
    curves = tuple(Curve(name, flight.t, flight.joint[:, axis]) for axis, name in enumerate("XY"))
    return [Plot("joint force", "t [s]", "force [N]", curves)]


def _velocities(field: Velocities) -> list[Plot]:
    units = ("Vx", "velocity [m/s]"), ("Vy", "velocity [m/s]"), ("ω", "angular velocity [rad/s]")
    named = (("exact", "DOP853, 1e-12"), ("ode45", "ode45 as it comes"), ("incremental", "incremental"))
    return [
        Plot(
            f"{name} of link {body + 1}", "t [s]", unit,
            tuple(Curve(label, field.t, field.by[how][:, 3 * body + axis]) for how, label in named),
        )
        for body in (0, 1)
        for axis, (name, unit) in enumerate(units)
    ]  # fmt: skip


def _errors(field: Velocities) -> str:
    heads = "".join(f"<th>{name} of link {body}</th>" for body in (1, 2) for name in ("Vx", "Vy", "ω"))
    by = {
        "the paper's": PAPER,
        "incremental": field.errors["incremental"],
        "ode45 as it comes": field.errors["ode45"],
    }
    by["pec of order 3"] = field.errors["pec"]
    rows = "".join(
        f"<tr><td>{how}</td>" + "".join(f'<td class="n">{error:.3g}</td>' for error in errors) + "</tr>"
        for how, errors in by.items()
    )
    return f"<h3>Mean errors [%]</h3><table><tr><th></th>{heads}</tr>{rows}</table>"
