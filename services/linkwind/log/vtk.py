"""Flow, wakes and bodies of a log for ParaView and its relatives: files of VTK's XML formats, with times.

Frames of a fluid become images (``flow_PROVIDER_0001.vti`` in a plane, ``volume_PROVIDER_0001.vti`` in a box,
values in cells), wings and their wakes the rings on them (``wake_PROVIDER_0001.vtu``, circulation in cells),
bodies their outlines in their x, y planes, in space their surfaces and centres of mass, with the forces on
them (``bodies_0001.vtu``); ``*.pvd`` hold them together over time.
Bodies are written at the times of the frames, or, without any, at times spread evenly over the run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from linkwind.errors import InputError, LogError
from linkwind.frames import FlowFrame, VolumeFrame, WakeFrame
from linkwind.log import contents, tables
from linkwind.log.reader import Log
from linkwind.log.scenarios import recorded
from linkwind.log.surfaces import Surface, surface
from linkwind.log.vortices import criterion, gradient, vorticity
from linkwind.scenario.shapes import AnyShape
from linkwind.spatial import Array, rotations

STATES = 300  # of the bodies, where there are no frames
VERTEX, POLYLINE, TRIANGLE, POLYGON, QUAD = 1, 4, 5, 7, 9  # types of VTK's cells
AROUND = {3: TRIANGLE, 4: QUAD}  # by the number of their points; others are polygons
BLOCK = 1024  # states in memory at a time


class Cells(NamedTuple):
    """Bodies as cells, in their frames.

    Attributes:
        points: corners of all [m], shape (k, 3).
        whose: body of each point, shape (k,).
        corners: numbers of the points around the cells, one cell after the other.
        ends: of the cells among them, shape (m,).
        types: VTK's, shape (m,).
        body: of each cell, shape (m,).
    """

    points: Array
    whose: Any
    corners: Any
    ends: Any
    types: Any
    body: Any


def export_vtk(log: Log, folder: Path) -> list[Path]:
    """Write the frames of every fluid and of all wakes, and the bodies.

    Args:
        log: to read.
        folder: for the files; is made if it is not there.

    Returns:
        the collections, one for each fluid, for each provider of wakes, and for the bodies.

    Raises:
        InputError: pyevtk is not there.
        LogError: the folder has files, or cannot be written; or the log has neither frames nor states.
    """
    hl, group = _library()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise LogError(
                f"{folder}: expected a new or empty folder; got one with files. Choose another -o."
            )
        times: list[int] = []
        written = []
        for name, shown, file in _shown(log):
            found = group(str(folder / name))
            for number, frame in enumerate(shown, 1):
                found.addFile(file(hl, folder / f"{name}_{number:04}", frame), frame.time_ns / 1e9)
                times.append(frame.time_ns)
            written.append(_saved(found, folder / name))
        if log.topics.get(contents.STATE):
            found, cells = group(str(folder / "bodies")), _cells(log)
            for number, (time_ns, state) in enumerate(_states(log, times), 1):
                found.addFile(_bodies(hl, folder / f"bodies_{number:04}", cells, state), time_ns / 1e9)
            written.append(_saved(found, folder / "bodies"))
    except OSError as error:
        raise LogError(
            f"{folder}: expected to write there; got {error.strerror}. Choose another -o."
        ) from error
    if not written:
        raise LogError(f"{log.path}: expected frames or states; got none. The run ended before the first.")
    return written


def _library() -> tuple[Any, Any]:
    try:
        from pyevtk import hl
        from pyevtk.vtk import VtkGroup
    except ImportError as error:
        raise InputError(
            "--format vtk: expected the package pyevtk; got none. Install it with: "
            "pip install 'linkwind[vtk]'"
        ) from error
    return hl, VtkGroup


def _shown(log: Log) -> Iterator[tuple[str, Iterator[Any], Callable[[Any, Path, Any], str]]]:
    """Yield of each provider and kind of frames: a name, the frames, and what writes one to a file."""
    kinds: tuple[tuple[str, Sequence[str], Any, Any], ...] = (
        ("flow", log.flows, log.frames, _image),
        ("volume", log.volumes, log.volume_frames, _box),
        ("wake", log.wakes, log.wake_frames, _rings),
    )
    for kind, providers, frames, file in kinds:
        yield from ((f"{kind}_{provider}", frames(provider), file) for provider in providers)


def _saved(found: Any, path: Path) -> Path:
    found.save()
    return path.with_name(f"{path.name}.pvd")


def _image(hl: Any, path: Path, frame: FlowFrame) -> str:
    left, _, bottom, _ = frame.extent

    def cells(values: Any) -> Any:  # x runs first
        return np.asfortranarray(values.T[:, :, None])

    u, v = frame.velocity[:, :, 0], frame.velocity[:, :, 1]
    data = {
        "velocity [m/s]": (cells(u), cells(v), cells(np.zeros_like(u))),
        "pressure [Pa]": cells(frame.pressure),
        "vorticity [1/s]": cells(frame.vorticity),
    }
    spacing = (frame.cell, frame.cell, frame.cell)
    return str(hl.imageToVTK(str(path), origin=(left, bottom, 0.0), spacing=spacing, cellData=data))


def _box(hl: Any, path: Path, frame: VolumeFrame) -> str:
    change = gradient(frame)

    def cells(values: Any) -> Any:  # x runs first
        return np.asfortranarray(values.T)

    def vector(values: Any) -> tuple[Any, ...]:
        return tuple(cells(values[..., axis]) for axis in range(3))

    data = {
        "velocity [m/s]": vector(frame.velocity),
        "pressure [Pa]": cells(frame.pressure),
        "vorticity [1/s]": vector(vorticity(change)),
        "Q [1/s^2]": cells(criterion(change)),
    }
    spacing = (frame.cell, frame.cell, frame.cell)
    return str(hl.imageToVTK(str(path), origin=frame.extent[0], spacing=spacing, cellData=data))


def _rings(hl: Any, path: Path, frame: WakeFrame) -> str:
    _, rows, columns = frame.shape
    wing, row, column = np.indices(frame.shape).reshape(3, -1)
    first = (wing * (rows + 1) + row) * (columns + 1) + column
    across = columns + 1
    ring = np.stack([first, first + 1, first + across + 1, first + across], axis=1)
    data = {
        "circulation [m^2/s]": frame.strength.ravel(),
        "wing": wing,
        "row": row,
        "bound": (row < frame.bound).astype(np.uint8),
    }
    x, y, z = (np.ascontiguousarray(axis) for axis in frame.corner.reshape(-1, 3).T)
    ends, kinds = 4 * np.arange(1, ring.shape[0] + 1), np.full(ring.shape[0], QUAD, np.uint8)
    return str(hl.unstructuredGridToVTK(str(path), x, y, z, ring.ravel(), ends, kinds, cellData=data))


def _states(log: Log, times: Sequence[int]) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield simulation time [ns] and fields of the states at ``times``, or of some that are spread evenly."""
    stride = max(1, log.topics[contents.STATE] // STATES)
    wanted = set(times)
    messages = log.raw(contents.STATE)
    count = 0
    while block := list(islice(messages, BLOCK)):
        chosen = []
        for message in block:
            if message.time_ns in wanted if wanted else count % stride == 0:
                chosen.append(message)
            count += 1
        if chosen:
            columns = tables.columns([m.payload for m in chosen], "State", f"{log.path}: {contents.STATE}")
            for row, message in enumerate(chosen):
                yield message.time_ns, {name: values[row] for name, values in columns.items()}


def _bodies(hl: Any, path: Path, cells: Cells, state: dict[str, Any]) -> str:
    turn = rotations(state["motion.orientation"].reshape(-1, 4))[cells.whose]
    position = state["motion.position"].reshape(-1, 3)
    points = np.einsum("pij,pj->pi", turn, cells.points) + position[cells.whose]
    wrench = state["wrench"].reshape(-1, 6)

    def vector(values: Array) -> tuple[Array, ...]:
        return tuple(np.ascontiguousarray(column) for column in values.T)

    data = {
        "body": cells.body,
        "centre": (cells.types == VERTEX).astype(np.uint8),
        "force [N]": vector(wrench[cells.body, :3]),
        "torque [N m]": vector(wrench[cells.body, 3:]),
        "velocity [m/s]": vector(state["motion.linear"].reshape(-1, 3)[cells.body]),
        "angular velocity [rad/s]": vector(state["motion.angular"].reshape(-1, 3)[cells.body]),
    }
    x, y, z = vector(points)
    return str(
        hl.unstructuredGridToVTK(str(path), x, y, z, cells.corners, cells.ends, cells.types, cellData=data)
    )


def _cells(log: Log) -> Cells:
    """Return the bodies of a log: in a plane an outline each, or a point; in space surfaces and points."""
    scenario = recorded(log)
    flat = scenario.planar and not log.volumes and not log.wakes
    points: list[Array] = []
    corners: list[Any] = []
    whose: list[int] = []  # body of a point
    types: list[int] = []
    body: list[int] = []
    for index, each in enumerate(scenario.bodies):
        for found, kind in _parts(each.shape, flat=flat):
            corners += [len(whose) + np.array(cell) for cell in found.cells]
            points.append(found.point)
            whose += [index] * len(found.point)
            types += [kind or AROUND.get(len(cell), POLYGON) for cell in found.cells]
            body += [index] * len(found.cells)
    ends = np.cumsum([len(each) for each in corners])
    return Cells(
        np.vstack(points),
        np.array(whose),
        np.concatenate(corners),
        ends,
        np.array(types, np.uint8),
        np.array(body),
    )


def _parts(shape: AnyShape | None, *, flat: bool) -> list[tuple[Surface, int | None]]:
    """Return what shows a body: cells, and of which type if that does not follow from their points."""
    centre = (Surface(np.zeros((1, 3)), [[0]]), VERTEX)
    if shape is None:
        return [centre]
    if not flat:
        return [centre, (surface(shape), None)]
    outline = np.insert(shape.outline(), 2, 0.0, axis=1)
    return [(Surface(outline, [list(range(len(outline)))]), POLYGON if shape.closed else POLYLINE)]
