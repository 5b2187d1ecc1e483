"""A page that shows how two runs part: the differences of their states over time."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path

import numpy as np

from linkwind.errors import InputError
from linkwind.spatial import Array

POINTS = 2000  # of a curve; each is the largest of an interval
LABELS = {
    "motion.position": "position [m]",
    "motion.orientation": "orientation (quaternion)",
    "motion.linear": "velocity [m/s]",
    "motion.angular": "angular velocity [rad/s]",
    "wrench": "wrench [N, N·m]",
}


def write_growth(path: Path, title: str, t: Array, distance: Mapping[str, Array]) -> None:
    """Write the page, one HTML file that needs no network.

    Args:
        path: of the page.
        title: of the page.
        t: simulation time [s], shape (k,).
        distance: absolute difference by field of State, each of shape (k,); 0 is left out, as the scale is
            logarithmic.

    Raises:
        InputError: the file cannot be written.
    """
    import plotly.graph_objects as go

    figure = go.Figure()
    for field, values in distance.items():
        where, shown = _thinned(t, values)
        figure.add_scatter(
            x=where.tolist(), y=[value if value > 0.0 else None for value in shown.tolist()],
            mode="lines", name=LABELS.get(field, field),
        )  # fmt: skip
    figure.update_layout(
        title=escape(title),
        template="plotly_white",
        xaxis_title="simulation time [s]",
        yaxis={
            "type": "log",
            "title": "largest difference of the accepted states",
            "exponentformat": "power",
        },
        legend={"orientation": "h", "yanchor": "bottom", "y": 1.0},
    )
    try:
        path.write_text(figure.to_html(include_plotlyjs=True, full_html=True), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot write the plot: {error.strerror}. Choose another place") from error


def _thinned(t: Array, values: Array) -> tuple[Array, Array]:
    """Return at most so many points: the largest value of each interval, at the interval's beginning."""
    starts = np.unique(np.linspace(0, len(t), POINTS, endpoint=False).astype(int))
    return t[starts], np.maximum.reduceat(values, starts)
