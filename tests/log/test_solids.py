"""The solids that Foxglove draws: their size, and triangles that fill an outline exactly."""

import numpy as np
import pytest
from foxglove.messages import Color, SceneEntity
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from linkwind.log import solids
from linkwind.log.solids import solid
from linkwind.scenario.ears import triangles
from linkwind.scenario.pictures import pictures_of
from linkwind.scenario.shapes import shape_of, signed_area

GREY = Color(r=0.5, g=0.5, b=0.5, a=1.0)
DART = [[0.2, 0.0], [-0.1, 0.1], [0.0, 0.0], [-0.1, -0.1]]
COMB = [[0, 0], [6, 0], [6, 2], [5, 2], [5, 1], [4, 1], [4, 2], [3, 2], [3, 1], [2, 1], [2, 2], [0, 2]]

KINDS = [
    ({"type": "plate", "length": 0.5, "span": 1.0}, "cubes", (0.5, 0.01, 1.0)),
    ({"type": "rectangle", "length": 0.5, "width": 0.2, "span": 2.0}, "cubes", (0.5, 0.2, 2.0)),
    ({"type": "circle", "diameter": 0.3}, "cylinders", (0.3, 0.3, 1.0)),
    ({"type": "ellipse", "length": 0.5, "width": 0.2}, "cylinders", (0.5, 0.2, 1.0)),
]


def entity(primitives):
    """Return primitives as an entity, read back with Foxglove's own schema."""
    pool = descriptor_pool.DescriptorPool()
    for proto in descriptor_pb2.FileDescriptorSet.FromString(SceneEntity.get_schema().data).file:
        pool.Add(proto)
    cls = message_factory.GetMessageClass(pool.FindMessageTypeByName("foxglove.SceneEntity"))
    return cls.FromString(SceneEntity(**primitives).encode())


def drawn(data, key):
    """Return the one primitive of a shape."""
    message = entity(solid(shape_of(data), 0.01, GREY))
    assert [field.name for field, _ in message.ListFields()] == [key]
    (primitive,) = getattr(message, key)
    return primitive


@pytest.mark.parametrize(("data", "key", "size"), KINDS)
def test_boxes_and_cylinders_have_their_size(data, key, size):
    primitive = drawn(data, key)
    sides = (primitive.size.x, primitive.size.y, primitive.size.z)
    assert sides == pytest.approx(size)


def test_an_ellipsoid_is_a_sphere_that_is_stretched():
    size = drawn({"type": "ellipsoid", "size": [1.0, 2.0, 3.0]}, "spheres").size
    assert (size.x, size.y, size.z) == (1.0, 2.0, 3.0)


@pytest.mark.parametrize("outline", [DART, COMB, COMB[:7]])
def test_triangles_fill_a_polygon(outline):
    """As many triangles as there must be, none turned over, their areas adding up to the polygon's."""
    points = shape_of({"type": "polygon", "points": outline}).outline()
    areas = [signed_area(points[list(corner)]) for corner in triangles(points)]
    assert len(areas) == len(outline) - 2
    assert min(areas) >= 0.0
    assert sum(areas) == pytest.approx(signed_area(points))


@pytest.mark.parametrize(
    "data",
    [
        {"type": "polygon", "points": DART, "span": 0.4},
        {"type": "rectangle", "length": 0.5, "width": 0.2, "radius": 0.1, "span": 0.4},
    ],
)
def test_a_prism_is_closed_and_has_its_volume(data):
    """Divergence theorem: the volume is the sum of the tetrahedra on the triangles."""
    shape = shape_of(data)
    prism = drawn(data, "triangles")
    points = np.array([[p.x, p.y, p.z] for p in prism.points])
    corners = points[np.array(prism.indices).reshape(-1, 3)]
    volume = np.linalg.det(corners).sum() / 6.0
    assert volume == pytest.approx(signed_area(shape.outline()) * 0.4)


def test_a_wing_has_two_sides():
    """Its triangles seen from above, and the same from below, each of its area."""
    primitive = drawn({"type": "wing", "points": [[x, -y] for x, y in DART]}, "triangles")
    points = np.array([[p.x, p.y, p.z] for p in primitive.points])
    a, b, c = np.moveaxis(points[np.array(primitive.indices).reshape(-1, 3)], 1, 0)
    across = np.cross(b - a, c - a)[:, 1] / 2.0
    assert across[across > 0.0].sum() == pytest.approx(0.02)
    assert across[across < 0.0].sum() == pytest.approx(-0.02)
    assert not points[:, 1].any()


def test_pictures_have_their_size_and_place():
    lying = {"position": [0.0, 1.0, 0.0], "orientation": [2**-0.5, 2**-0.5, 0.0, 0.0]}  # its z is our -y
    pictures = [
        {"type": "box", "size": [1.0, 2.0, 3.0], "position": [4.0, 5.0, 6.0]},
        {"type": "capsule", "diameter": 0.2, "length": 1.0} | lying,
        {"type": "mesh", "file": "package://robot/arm.stl", "scale": [0.001, 0.001, 0.001]},
    ]
    message = entity(solids.drawn(pictures_of({"picture": pictures}), GREY))
    (box,), (cylinder,), (mesh,) = message.cubes, message.cylinders, message.models
    assert (box.size.x, box.size.y, box.size.z) == (1.0, 2.0, 3.0)
    assert (box.pose.position.x, box.pose.position.y, box.pose.position.z) == (4.0, 5.0, 6.0)
    assert (cylinder.size.x, cylinder.size.z, cylinder.pose.orientation.x) == (0.2, 1.0, 2**-0.5)
    ends = sorted(ball.pose.position.y for ball in message.spheres)
    assert ends == pytest.approx([0.5, 1.5])
    assert (mesh.url, mesh.scale.x) == ("package://robot/arm.stl", 0.001)
