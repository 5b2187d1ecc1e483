"""Flow and bodies for ParaView, read back by VTK itself."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLImageDataReader, vtkXMLUnstructuredGridReader

from linkwind.errors import LogError
from linkwind.log.reader import Log, open_log
from linkwind.log.vtk import export_vtk
from linkwind.runs.run import run
from linkwind.scenario import load, loads


def fly(name: str, folder: Path, *settings: str) -> Log:
    return open_log(run(load(name, ["bus.transport=inprocess", *settings]), folder, lambda step: None).log)


def collected(path: Path) -> dict[float, Path]:
    """Times and files of a collection."""
    entries = ET.parse(path).getroot().iter("DataSet")
    return {float(entry.get("timestep", "nan")): path.parent / str(entry.get("file")) for entry in entries}


def read(reader: object, path: Path) -> object:
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def cells(data: object, name: str) -> np.ndarray:
    return vtk_to_numpy(data.GetCellData().GetArray(name))


def test_flow_and_bodies(tmp_path: Path) -> None:
    log = fly("two_link_flow", tmp_path / "out", "time.end=0.001", "aero.flow.cells=16", "aero.flow.frames=3")
    flow, bodies = export_vtk(log, tmp_path / "vtk")
    assert (flow.name, bodies.name) == ("flow_aero.pvd", "bodies.pvd")
    frames, files = list(log.frames("aero")), collected(flow)
    assert list(files) == [frame.time_ns / 1e9 for frame in frames]
    assert list(files) == list(collected(bodies))
    for frame, file in zip(frames, files.values(), strict=True):
        image = read(vtkXMLImageDataReader(), file)
        rows, columns = frame.shape
        assert image.GetDimensions() == (columns + 1, rows + 1, 2)
        left, right, bottom, top = frame.extent
        assert image.GetBounds()[:4] == pytest.approx((left, right, bottom, top), rel=1e-12)
        shape = (rows, columns)
        assert np.array_equal(cells(image, "pressure [Pa]").reshape(shape), frame.pressure)
        assert np.array_equal(cells(image, "vorticity [1/s]").reshape(shape), frame.vorticity)
        velocity = cells(image, "velocity [m/s]").reshape(*shape, 3)
        assert np.array_equal(velocity[:, :, :2], frame.velocity)
        assert not velocity[:, :, 2].any()
    path = log.trajectory()
    for t, file in collected(bodies).items():
        row = int(np.flatnonzero(path.t == t)[0])
        grid = read(vtkXMLUnstructuredGridReader(), file)
        assert grid.GetNumberOfCells() == 2
        assert np.array_equal(cells(grid, "force [N]"), path.wrench[row, :, :3])
        assert np.array_equal(cells(grid, "angular velocity [rad/s]"), path.angular[row])
        points = vtk_to_numpy(grid.GetPoints().GetData())
        # Plates of 0.5 m: their ends lie on both sides of the centre, along the body's x axis.
        for body in range(2):
            w, _, _, z = path.orientation[row, body]
            along = 0.25 * np.array([w * w - z * z, 2 * w * z, 0.0])
            ends = sorted(points[2 * body : 2 * body + 2].tolist())
            expected = sorted((path.position[row, body] + side * along).tolist() for side in (-1, 1))
            np.testing.assert_allclose(ends, expected, atol=1e-12)


BODIES = [
    ("ball", '{ type = "ellipsoid", size = [1.2, 0.6, 0.4] }', (1.2, 0.6, 0.4)),
    ("wing", '{ type = "wing", points = [[1.0, 0.0], [2.0, 3.0], [1.0, 1.0], [0.0, 3.0]] }', (2.0, 0.0, 3.0)),
    ("plate", '{ type = "plate", length = 0.5, span = 1.5 }', (0.5, 0.0, 1.5)),
    ("can", '{ type = "circle", diameter = 0.8, span = 0.3 }', (0.8, 0.8, 0.3)),
    ("point", None, (0.0, 0.0, 0.0)),
]


def test_bodies_in_space_are_surfaces_with_a_point_at_the_centre_of_mass(tmp_path: Path) -> None:
    text = "[time]\nend = 0.002\n[environment]\ngravity = [0.0, 0.0, 0.0]\n[coupling]\nstep = 1e-3\n"
    for k, (name, shape, _) in enumerate(BODIES):
        text += f'[[bodies]]\nname = "{name}"\nmass = 1.0\ninertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]\n'
        text += f"position = [{5.0 * k}, 2.0, 3.0]\nvelocity = [0.0, {1.0 + k}, 0.0]\n"
        text += f"shape = {shape}\n" if shape else ""
    text += '[aero]\nmodel = "none"\n[bus]\ntransport = "inprocess"\n'
    log = open_log(run(loads(text, "bodies.toml"), tmp_path / "out", lambda step: None).log)
    (bodies,) = export_vtk(log, tmp_path / "vtk")
    grid = read(vtkXMLUnstructuredGridReader(), collected(bodies)[0.0])
    whose, centre = cells(grid, "body"), cells(grid, "centre")
    assert np.flatnonzero(centre).size == len(BODIES)
    assert np.array_equal(cells(grid, "velocity [m/s]")[:, 1], 1.0 + whose)
    for k, (name, _, size) in enumerate(BODIES):
        bounds = np.array([grid.GetCell(int(cell)).GetBounds() for cell in np.flatnonzero(whose == k)])
        low, high = bounds[:, ::2].min(axis=0), bounds[:, 1::2].max(axis=0)
        np.testing.assert_allclose(high - low, size, atol=1e-12, err_msg=name)
        (middle,) = np.flatnonzero((whose == k) & (centre == 1))
        np.testing.assert_allclose(grid.GetCell(int(middle)).GetBounds()[::2], [5.0 * k, 2.0, 3.0])
    areas = [
        sum(_area(grid.GetCell(int(c))) for c in np.flatnonzero((whose == k) & (centre == 0)))
        for k in range(len(BODIES))
    ]
    assert areas[1:] == pytest.approx([1.0, 0.75, math.pi * (0.32 + 0.24), 0.0], rel=0.005)


def _area(cell: Any) -> float:
    points = vtk_to_numpy(cell.GetPoints().GetData())
    return float(0.5 * np.linalg.norm(np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)))


def test_without_frames_some_states(tmp_path: Path) -> None:
    log = fly("two_link_field", tmp_path / "out", "time.end=0.7")
    (bodies,) = export_vtk(log, tmp_path / "vtk")
    times = list(collected(bodies))
    assert 300 <= len(times) <= 351
    assert times[0] == 0.0
    assert math.isclose(times[1], 0.002)
    with pytest.raises(LogError, match="expected a new or empty folder"):
        export_vtk(log, tmp_path / "vtk")
