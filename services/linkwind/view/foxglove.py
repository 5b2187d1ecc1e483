"""A layout for Foxglove and Lichtblick: the log's scene in its flow beside plots of its states.

The form is that of an exported layout: ``configById`` has the settings of each panel by its id, which is its
type, "!" and a name; ``layout`` splits the window between the ids.
"""

from __future__ import annotations

from typing import Any

from linkwind.log.contents import FLOW, SCENE, SCENE_OF, STATE, VOLUME, WAKE
from linkwind.scenario.shapes import shape_of
from linkwind.view.film import Film
from linkwind.view.recording import Recording

COLOURS = (
    "#0072b2",
    "#d55e00",
    "#009e73",
    "#b8578f",
    "#b07d00",
    "#3a9bd1",
    "#7a5195",
    "#4d5966",
)  # the page's
BODIES = len(COLOURS)  # that get curves
LENGTHS = 8.0  # of the longest body, that the camera sees


def layout(recording: Recording) -> dict[str, Any]:
    """Return the layout that suits a log."""
    scenario = recording.scenario
    flat = recording.flat and not (recording.log.volumes or recording.log.wakes)
    names = [body["name"] for body in scenario["bodies"]][:BODIES]
    axes = "xy" if flat else "xyz"
    plots = {
        "Plot!velocity": _plot("Velocity [m/s]", _each(names, axes, "motion.linear", 3, "V")),
        "Plot!force": _plot("Force [N]", _each(names, axes, "wrench", 6, "F")),
        "Plot!energy": _plot("Energy [J]", _energies()),
    }
    return {
        "configById": {"3D!mechanism": _scene(recording, names[0], flat=flat)} | plots,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 0.1},
        "layout": {
            "first": "3D!mechanism",
            "second": _column(list(plots)),
            "direction": "row",
            "splitPercentage": 62,
        },
    }


def _column(ids: list[str]) -> Any:
    if len(ids) == 1:
        return ids[0]
    rest = _column(ids[1:])
    return {"first": ids[0], "second": rest, "direction": "column", "splitPercentage": 100 / len(ids)}


def _scene(recording: Recording, followed: str, *, flat: bool) -> dict[str, Any]:
    """Return the 3D panel: from the front for a plane, the camera going along with a body."""
    shapes = [shape_of(body.get("shape")) for body in recording.scenario["bodies"]]
    length = max((shape.reference_length for shape in shapes if shape), default=1.0)
    topics: dict[str, Any] = {SCENE: {"visible": True}}
    for kind, shown in ((VOLUME, recording.log.volumes), (WAKE, recording.log.wakes)):
        topics |= {SCENE_OF[kind] + provider: {"visible": True} for provider in shown}
    for provider in recording.log.flows:
        scale = Film(recording, provider).reel()["quantities"]["vorticity"]
        topics[FLOW + provider] = {
            "visible": True,
            "frameLocked": False,
            "colorField": "vorticity",
            "colorMode": "colormap",
            "colorMap": "turbo",
            "minValue": scale["low"],
            "maxValue": scale["high"],
            "explicitAlpha": 0.8,
        }
    return {
        "cameraState": {
            "perspective": not flat,
            "distance": LENGTHS * length,
            "phi": 0 if flat else 65,
            "thetaOffset": 0 if flat else 35,
            "target": [0, 0, 0],
            "targetOffset": [0, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.01 * length,
            "far": 1000.0 * length,
        },
        "followTf": followed,
        "followMode": "follow-position",
        "scene": {"transforms": {"showLabel": False, "axisScale": 0.2 * length}},
        "transforms": {},
        "topics": topics,
        "layers": {},
    }


def _plot(title: str, paths: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        **{f"{program}PanelTitle": title for program in ("foxglove", "lichtblick")},
        "paths": paths,
        "showLegend": True,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": True,
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "isSynced": True,
        "xAxisVal": "timestamp",
        "sidebarDimension": 240,
    }


def _each(names: list[str], axes: str, field: str, width: int, symbol: str) -> list[dict[str, Any]]:
    """Return a curve for each body and axis of a field that has ``width`` numbers for each body."""
    return [
        _curve(f"{field}[{width * i + k}]", f"{symbol}{axis} {name}", COLOURS[i], 1.5 if k == 0 else 2.5)
        for i, name in enumerate(names)
        for k, axis in enumerate(axes)
    ]


def _energies() -> list[dict[str, Any]]:
    parts = ("kinetic_energy", "potential_energy", "external_work", "dissipated_work")
    return [_curve(name, name.replace("_", " "), COLOURS[2 + i], 1.5) for i, name in enumerate(parts)]


def _curve(field: str, label: str, colour: str, width: float) -> dict[str, Any]:
    return {
        "value": f"{STATE}.{field}",
        "enabled": True,
        "timestampMethod": "receiveTime",
        "label": label,
        "color": colour,
        "lineSize": width,
    }
