"""The animated scene: bodies as outlines, joints as points, frames of poses and forces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from linkwind.errors import LinkwindError
from linkwind.native.wind import wind_at
from linkwind.report.arrays import every_nth, pack
from linkwind.report.data import Run
from linkwind.report.wires import Line, wires
from linkwind.scenario import Environment
from linkwind.scenario import pictures as drawings
from linkwind.scenario.ears import triangles
from linkwind.scenario.pictures import pictures_of
from linkwind.scenario.shapes import Ellipsoid, Polygon, Wing, shape_of
from linkwind.spatial import Array
from linkwind.wind import wind_table

FRAMES = 1500
SHEETS = ("plate", "wing")  # shapes without thickness


def scene(run: Run) -> dict[str, Any] | None:
    """Return what the animation needs; None where the log holds no state."""
    path = run.trajectory
    if not len(path.t):
        return None
    frames = every_nth(len(path.t), FRAMES)
    environment = run.scenario["environment"]
    air = _air(run, path.t[frames], path.position[frames])
    return {
        "t": pack(path.t[frames], "f8"),
        "position": pack(path.position[frames]),
        "orientation": pack(path.orientation[frames]),
        "force": pack(path.wrench[frames, :, :3]),
        "bodies": [_body(run, i) for i in range(len(run.bodies))],
        "joints": [_joint(run, joint) for joint in run.scenario.get("joints", ())],
        "planar": flat(run),
        "up": "z" if upwards(run)[2] else "y",
        "still": [line for picture in pictures_of(environment) for line in _as_data(wires(picture))],
        "wind": environment["wind"] if air is None else _mean(air),
        "air": None if air is None else pack(air),
    }


def _air(run: Run, t: Array, position: Array) -> Array | None:
    """Return the wind at the centre of mass of all [m/s], shape (k, 3); None where it is uniform and steady.

    It is not a number where it cannot be told, because the log is not one of a run that was checked.

    Args:
        run: with the scenario.
        t: times [s], shape (k,).
        position: of the bodies [m], shape (k, n, 3).
    """
    environment = run.scenario["environment"]
    stated = {key: environment[key] for key in ("wind", "inputs", "gusts") if key in environment}
    if not stated["gusts"] and not any(isinstance(component, Mapping) for component in stated["wind"]):
        return None
    mass = np.array([max(body["mass"], 1e-12) for body in run.scenario["bodies"]])[:, None]
    centre = (mass * position).sum(axis=1) / mass.sum()
    try:
        table = wind_table(Environment.model_validate(stated), run.scenario["name"])
    except (LinkwindError, ValueError):
        return np.full(centre.shape, np.nan)
    return wind_at(table, t, centre, np.zeros(3))[0]


def _mean(air: Array) -> list[float]:
    """Return the mean of the winds [m/s] that are finite; 0 where there is none."""
    finite = air[np.isfinite(air).all(axis=1)]
    return (finite.mean(axis=0) if len(finite) else np.zeros(3)).tolist()


def flat(run: Run) -> bool:
    """Tell whether a run is seen straight on: it stays in a plane, and its fluid does."""
    spatial = any(_in_space(provider) for provider in run.scenario.get("providers", ()))
    return run.planar and not spatial and not run.volumes


def _in_space(provider: Mapping[str, Any]) -> bool:
    """Tell whether a provider's fluid is one of three dimensions."""
    model = provider["model"]
    return bool(model == "vortex" or (model == "flow" and provider["flow"].get("dimensions", 2) == 3))


def upwards(run: Run) -> tuple[float, float, float]:
    """Return the axis of W that is drawn upwards: z where gravity is along it, else y."""
    gravity = np.abs(run.scenario["environment"]["gravity"])
    return (0.0, 0.0, 1.0) if not flat(run) and gravity[2] > gravity[1] else (0.0, 1.0, 0.0)


def outlines(run: Run, index: int) -> list[Line]:
    """Return what is drawn of a body: lines in its frame [m], each with whether it is closed."""
    body = run.scenario["bodies"][index]
    return _lines(body, _joint_points(run, body["name"]), _modest(run), flat(run))


def _modest(run: Run) -> float:
    """Return how large a body without a shape is drawn at most [m]: it shall not hide those that have one."""
    shapes = (shape_of(body.get("shape")) for body in run.scenario["bodies"])
    sizes = [max(shape.reference_length, 0.0 if flat(run) else shape.span) for shape in shapes if shape]
    return 0.25 * max(sizes, default=np.inf)


def _body(run: Run, index: int) -> dict[str, Any]:
    body, lines = run.scenario["bodies"][index], outlines(run, index)
    points = np.vstack([points for points, _ in lines])
    return {
        "name": body["name"],
        "mass": max(body["mass"], 1e-12),  # weights of a mean, which must not all be 0
        "lines": _as_data(lines),
        "ball": _ball(body),
        "ends": _ends(body),
        "thick": not body.get("picture") and (body.get("shape") or {"type": "plate"})["type"] in SHEETS,
        "reach": float(np.linalg.norm(points[:, : 2 if flat(run) else 3], axis=1).max()),
    }


def _ball(body: Mapping[str, Any]) -> tuple[float, float, float] | None:
    """Return the sizes of a body that is an ellipsoid [m], else None."""
    shape = None if body.get("picture") else shape_of(body.get("shape"))
    return shape.size if isinstance(shape, Ellipsoid) else None


def _ends(body: Mapping[str, Any]) -> list[tuple[int, int, int]] | None:
    """Return the triangles that fill each closed line of a body; None where one to their middle does."""
    shape = None if body.get("picture") else shape_of(body.get("shape"))
    if isinstance(shape, Wing):
        return triangles(shape.planform)
    return triangles(shape.outline()) if isinstance(shape, Polygon) else None


def _as_data(lines: list[Line]) -> list[dict[str, Any]]:
    return [{"points": points.tolist(), "closed": closed} for points, closed in lines]


def _joint(run: Run, joint: Mapping[str, Any]) -> dict[str, Any]:
    """Return a joint as a point of its child, and until when it is there [s]; None: to the end."""
    until = run.released.get(joint["name"])
    return {
        "name": joint["name"],
        "body": run.bodies.index(joint["child"]),
        "point": joint["child_point"],
        "until": until,
    }


def _joint_points(run: Run, name: str) -> Array:
    """Return the points of a body where joints hold it, shape (m, 3), in its frame."""
    points = []
    for joint in run.scenario.get("joints", ()):
        if joint["child"] == name:
            points.append(joint["child_point"])
        if joint["parent"] == name:
            points.append(joint["parent_point"])
    return np.array(points, dtype=float).reshape(-1, 3)


def _lines(body: Mapping[str, Any], joint_points: Array, modest: float, planar: bool) -> list[Line]:
    """Return what is drawn of a body: lines in its frame [m], shape (m, 3), each with whether it is closed.

    A plate is its rectangle, a wing its planform; another shape its outline, in 3-D both faces and four
    edges between them.
    """
    drawn = [line for picture in pictures_of(body) for line in wires(picture)]
    if drawn:
        return drawn
    shape = shape_of(body.get("shape"))
    if shape is None:
        return [_without_shape(body, joint_points, modest)]
    if isinstance(shape, Ellipsoid):
        return wires(drawings.Ellipsoid(type="ellipsoid", size=shape.size))
    if isinstance(shape, Wing):
        return [(np.insert(shape.planform, 1, 0.0, axis=1), True)]
    outline, half = shape.outline(), 0.5 * shape.span
    near, far = (np.pad(outline, ((0, 0), (0, 1)), constant_values=z) for z in (-half, half))
    if not shape.closed:
        return [(np.vstack([near, far[::-1]]), True)]
    if planar:
        return [(np.pad(outline, ((0, 0), (0, 1))), True)]
    edges = np.linspace(0, len(outline), 4, endpoint=False).astype(int)
    return [(near, True), (far, True), *((np.stack([near[i], far[i]]), False) for i in edges)]


def _without_shape(body: Mapping[str, Any], joint_points: Array, modest: float) -> Line:
    """Return a line through the joint points and the centre of mass.

    Where these coincide it is a circle of the radius of gyration, of a modest one at most, or a point if a
    mesh pictures it.
    """
    if joint_points.size and np.abs(joint_points).max() > 0.0:
        through = np.insert(joint_points, len(joint_points) // 2, 0.0, axis=0)
        if len(joint_points) == 1:
            through = np.vstack([joint_points[0], -joint_points[0]])  # as far beyond the centre of mass
        return through, False
    if body.get("picture"):
        return np.zeros((1, 3)), False
    inertia = body["inertia"]
    about_z = inertia if isinstance(inertia, float | int) else max(inertia[:3])
    radius = min(modest, float(np.sqrt(about_z / max(body["mass"], 1e-12))))
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    return radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)]), True
