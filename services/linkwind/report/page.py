"""The page itself: a run to one HTML file that needs no network."""

from __future__ import annotations

import json
import re
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

import numpy as np
from plotly.offline import get_plotlyjs

from linkwind.report.arrays import pack
from linkwind.report.data import Run
from linkwind.report.gallery import gallery
from linkwind.report.header import badge, banner, made_from, note, tiles
from linkwind.report.panels import panels
from linkwind.report.scene import scene
from linkwind.report.tables import tables

_ASSETS = files("linkwind.report").joinpath("assets")
_SCRIPTS = ("clock.js", "range.js", "charts.js", "motion.js", "film.js", "reel.js", "wake.js", "vortices.js",
            "scene.js", "main.js")  # fmt: skip


def render(run: Run) -> str:
    """Return the report of a run as one self-contained HTML document."""
    name = run.scenario["name"]
    return Template(_asset("page.html")).substitute(
        title=escape(f"{name} · linkwind"),
        name=escape(name),
        badge=badge(run),
        description=escape(run.scenario.get("description", "")),
        banner=banner(run),
        origin=made_from(run),
        tiles=tiles(run),
        gallery=gallery(run),
        note=note(run),
        tables=tables(run),
        data=script_json(_data(run)),
        css=_asset("page.css"),
        plotly=get_plotlyjs(),
        script="\n".join(map(_plain, _SCRIPTS)),
    )


def script_json(value: Any) -> str:
    """Return JSON that can stand in a script element, whatever text is in it."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def _plain(name: str) -> str:
    """Return a module as plain script: in one file with the others it needs no imports."""
    return re.sub(r"^import .*;$|^export ", "", _asset(name), flags=re.MULTILINE)


def _asset(name: str) -> str:
    return _ASSETS.joinpath(name).read_text(encoding="utf-8")


def _data(run: Run) -> dict[str, Any]:
    """Return the data block: the scene, the plots, and the times that curves without ``x`` share."""
    moving = scene(run)
    if moving is None:
        return {"scene": None}
    plots = panels(run)
    shared = any("x" not in curve for panel in plots for row in panel["rows"] for curve in row["curves"])
    return {
        "scene": moving,
        "t": pack(run.trajectory.t if shared else np.empty(0), "f8"),
        "panels": plots,
        "flow": _film(run) if moving["planar"] else None,
        "wake": _wake(run),
        "vortices": _vortices(run),
    }


def _film(run: Run) -> dict[str, Any] | None:
    """Return the flow behind the animation, of the first provider that shows its own."""
    if not run.flows:
        return None
    from linkwind.report.film import film

    return film(run.flows[0])


def _wake(run: Run) -> dict[str, Any] | None:
    """Return the wakes in the animation, of the first provider that shows its own."""
    if not run.wakes:
        return None
    from linkwind.report.wakefilm import wake_film

    return wake_film(run.scenario, run.wakes[0])


def _vortices(run: Run) -> dict[str, Any] | None:
    """Return the vortices in the animation, of the first provider that shows its fluid in a box."""
    if not run.volumes:
        return None
    from linkwind.report.volumefilm import volume_film

    return volume_film(run.volumes[0])
