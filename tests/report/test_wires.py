"""The lines of a picture lie on its surface, wherever it is and however it is turned."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from linkwind.report.wires import wires
from linkwind.scenario.pictures import pictures_of

TURN = Rotation.from_rotvec([0.3, -0.5, 0.7])
AT = np.array([1.0, 2.0, 3.0])


def on_box(p):
    return np.abs(np.abs(p) / [0.5, 1.0, 1.5] - 1.0).min(axis=1)


def on_ellipsoid(p):
    return np.linalg.norm(p / [0.5, 1.0, 1.5], axis=1) - 1.0


def on_cylinder(p):
    return np.hypot(p[:, 0], p[:, 1]) - 0.5


def on_capsule(p):
    beyond = np.maximum(np.abs(p[:, 2]) - 1.0, 0.0)
    return np.sqrt(p[:, 0] ** 2 + p[:, 1] ** 2 + beyond**2) - 0.5


SOLIDS = [
    ({"type": "box", "size": [1.0, 2.0, 3.0]}, on_box),
    ({"type": "ellipsoid", "size": [1.0, 2.0, 3.0]}, on_ellipsoid),
    ({"type": "cylinder", "diameter": 1.0, "length": 2.0}, on_cylinder),
    ({"type": "capsule", "diameter": 1.0, "length": 2.0}, on_capsule),
]


@pytest.mark.parametrize(("data", "off"), SOLIDS)
def test_lines_lie_on_the_surface(data, off):
    place = {"position": AT.tolist(), "orientation": TURN.as_quat(scalar_first=True).tolist()}
    (picture,) = pictures_of({"picture": [data | place]})
    points = np.vstack([points for points, _ in wires(picture)])
    own = TURN.inv().apply(points - AT)
    assert np.abs(off(own)).max() < 1e-12
    extent = np.ptp(own, axis=0)
    assert extent[2] == pytest.approx(data.get("length", 3.0) + (1.0 if data["type"] == "capsule" else 0.0))
