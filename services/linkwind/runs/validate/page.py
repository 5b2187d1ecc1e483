"""The page of a validation: its table, and the plots beside the published values."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from pathlib import Path

from linkwind.runs.validate.rows import Plot, Row

_STYLE = """body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 72rem }
table { border-collapse: collapse } td, th { padding: .25rem .6rem; text-align: left;
border-bottom: 1px solid #ddd } td.n { text-align: right; font-variant-numeric: tabular-nums }
.no { color: #b00020; font-weight: 600 } .yes { color: #1b6e3c } img { max-width: 34rem; margin: .5rem }"""

REMARK = (
    "In two dimensions a bluff plate at Re of 1000 and more has more drag than a real one, whose vortices "
    "break up along the span. After separation the motion of falling bodies is chaotic: means and early "
    "windows are compared, never late trajectories."
)


def verdict(row: Row) -> str:
    """Return ok, off, or reported."""
    return {True: "ok", False: "off", None: "reported"}[row.ok]


def expected(row: Row) -> str:
    """Return what a row's value should be, as text."""
    if row.kind == "most":
        return f"≤ {row.reference:.4g}"
    within = "" if row.tolerance is None else f" ± {100 * row.tolerance:g} %"
    return f"{row.reference:.4g}{within}"


def write(path: Path, title: str, rows: Sequence[Row], plots: Sequence[Plot]) -> None:
    """Write the page as one HTML file, pictures inside."""
    body = "".join(_table_row(row) for row in rows)
    pictures = "".join(
        f'<img alt="{html.escape(plot.title)}" src="data:image/png;base64,{_picture(plot)}">'
        for plot in plots
    )
    names = ("Case", "Quantity", "Value", "Reference", "Ratio", "", "Source")
    head = "<tr>" + "".join(f"<th>{name}</th>" for name in names) + "</tr>"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f"<style>{_STYLE}</style><h1>{html.escape(title)}</h1><table>{head}{body}</table><p>{REMARK}</p>"
        f"{pictures}</html>\n",
        encoding="utf-8",
    )


def _table_row(row: Row) -> str:
    ratio = "" if row.ratio is None or row.kind == "most" else f"{row.ratio:.4f}"
    mark = {True: "yes", False: "no", None: ""}[row.ok]
    cells = [
        f"<td>{html.escape(row.case)}</td><td>{html.escape(row.quantity)}</td>",
        f'<td class="n">{row.value:.4g}</td><td class="n">{expected(row)}</td><td class="n">{ratio}</td>',
        f'<td class="{mark}">{verdict(row)}</td><td>{html.escape(row.source)}</td>',
    ]
    return f"<tr>{''.join(cells)}</tr>"


def _picture(plot: Plot) -> str:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for curve in plot.curves:
        if curve.published:
            axes.plot(curve.x, curve.y, "o", markerfacecolor="none", label=curve.label)
        else:
            axes.plot(curve.x, curve.y, "-", linewidth=1.2, label=curve.label)
    low, high = _range(plot)
    axes.set(title=plot.title, xlabel=plot.x, ylabel=plot.y, ylim=(low, high))
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
