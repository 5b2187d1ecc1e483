"""The page of a validation: its table, and the plots beside the published values."""

from __future__ import annotations

import base64
import html
import io
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from linkwind.runs.validate.rows import Plot, Row

STYLE = """body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 90rem;
padding: 0 1rem }
table { border-collapse: collapse } td, th { padding: .25rem .6rem; text-align: left;
border-bottom: 1px solid #ddd } td.n { text-align: right; font-variant-numeric: tabular-nums;
white-space: nowrap }
.no { color: #b00020; font-weight: 600 } .yes { color: #1b6e3c } img { max-width: 34rem; margin: .5rem }"""


def verdict(row: Row) -> str:
    """Return ok, off, or reported."""
    return {True: "ok", False: "off", None: "reported"}[row.ok]


def expected(row: Row) -> str:
    """Return what a row's value should be, as text."""
    if row.kind == "most":
        return f"≤ {row.reference:.4g}"
    if row.kind == "near":
        return f"{row.reference:.12g} ± {row.tolerance:g}"
    within = "" if row.tolerance is None else f" ± {100 * row.tolerance:g} %"
    return f"{row.reference:.4g}{within}"


def cells(row: Row) -> list[str]:
    """Return the texts of a row below ``HEADINGS``."""
    value = f"{row.value:.12g}" if row.kind == "near" else f"{row.value:.4g}"
    ratio = f"{row.ratio:.4f}" if row.kind == "equal" and row.ratio is not None else ""
    error = f"{row.error:.1e}" if row.kind == "near" else ""
    seconds = "" if row.seconds is None else f"{row.seconds:.3g}"
    return [
        row.case, row.quantity, value, expected(row), ratio or error, verdict(row), seconds, row.source
    ]  # fmt: skip


def summary(rows: Sequence[Row]) -> str:
    """Return how many rows are right, off, or only reported."""
    counts = Counter(verdict(row) for row in rows)
    return ", ".join(f"{counts[word]} {word}" for word in ("ok", "off", "reported") if counts[word])


HEADINGS = ("Case", "Quantity", "Value", "Reference", "Ratio, error", "", "Time [s]", "Source")
NUMBERS = ("Value", "Reference", "Ratio, error", "Time [s]")


def write(path: Path, title: str, rows: Sequence[Row], plots: Sequence[Plot], remark: str = "") -> None:
    """Write the page as one HTML file, pictures inside."""
    body = "".join(_table_row(row) for row in rows)
    pictures = "".join(
        f'<img alt="{html.escape(plot.title)}" src="data:image/png;base64,{picture(plot)}">' for plot in plots
    )
    head = "<tr>" + "".join(f"<th>{name}</th>" for name in HEADINGS) + "</tr>"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f"<style>{STYLE}</style><h1>{html.escape(title)}</h1><p>{summary(rows)}</p>"
        f"{pictures}<table>{head}{body}</table><p>{html.escape(remark)}</p>"
        "</html>\n",
        encoding="utf-8",
    )


def _table_row(row: Row) -> str:
    mark = {True: "yes", False: "no", None: ""}[row.ok]
    found = ""
    for heading, text in zip(HEADINGS, cells(row), strict=True):
        style = "n" if heading in NUMBERS else "" if heading else mark
        found += f'<td class="{style}">{html.escape(text)}</td>'
    return f"<tr>{found}</tr>"


def picture(plot: Plot) -> str:
    """Return a plot as PNG, in base64."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for curve in plot.curves:
        if curve.published:
            axes.plot(curve.x, curve.y, "o", markerfacecolor="none", label=curve.label)
        else:
            style = "o-" if plot.scale == "loglog" else "-"
            axes.plot(curve.x, curve.y, style, linewidth=1.2, label=curve.label)
    axes.set(title=plot.title, xlabel=plot.x, ylabel=plot.y)
    if plot.scale == "linear":
        axes.set(ylim=_range(plot))
    else:
        axes.set(yscale="log", xscale="log" if plot.scale == "loglog" else "linear")
    axes.legend(fontsize="small")
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=130)
    return base64.b64encode(stream.getvalue()).decode("ascii")


def _range(plot: Plot) -> tuple[float, float]:
    """Return limits around the middle 98 % of all values: without the peak of an impulsive start."""
    import numpy as np

    values = np.concatenate([curve.y for curve in plot.curves])
    low, high = (float(x) for x in np.quantile(values, (0.01, 0.99)))
    published = [value for curve in plot.curves if curve.published for value in curve.y.tolist()]
    low, high = min([low, *published]), max([high, *published])
    margin = 0.08 * (high - low) or 0.1 * abs(high) or 1.0
    return low - margin, high + margin
