"""The mechanism of a scenario as URDF, at its joints' zero.

The frame of a link is at the joint that carries it, its axes those of the body. What the format cannot say
is noted: springs, the start, the forces.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from linkwind.mechanism import Mechanism, build
from linkwind.mechanism.quaternion import matrix
from linkwind.mechanism.remarks import Remark, comment
from linkwind.native.tables import JOINT_TYPES
from linkwind.scenario import Body, Circle, Ellipsoid, Plate, Rectangle, Scenario
from linkwind.scenario import pictures as drawings
from linkwind.scenario.pictures import Box, Capsule, Cylinder, Mesh, Picture, Pictures
from linkwind.spatial import Array

TYPES = {
    "fixed": "fixed",
    "revolute": "continuous",
    "prismatic": "prismatic",
    "planar": "planar",
    "free": "floating",
}
FAR = 1e6  # m: a prismatic joint must have limits
Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Exported:
    """A scenario as URDF: its text, how many links and joints it has, and what it lacks."""

    text: str
    links: int
    joints: int
    remarks: tuple[Remark, ...]


def export_urdf(scenario: Scenario) -> Exported:
    """Return the URDF of a scenario; the root link is the world.

    Raises:
        MechanismError: bodies and joints that do not make a mechanism.
    """
    mechanism = build(scenario)
    root = ET.Element("robot", name=scenario.name)
    world = ET.SubElement(root, "link", name="world")
    world.extend(_visual(*drawn) for drawn in _of_pictures(scenario.environment.picture))
    for index, body in enumerate(scenario.bodies):
        root.append(_link(body, -mechanism.tables.child_point[index], mechanism.tables.inertia[index]))
        root.extend(_joints(scenario, mechanism, index))
    remarks = (*_of_joints(scenario, mechanism.closures), *_of_bodies(scenario), *_of_surroundings(scenario))
    ET.indent(root)
    lines = [f"Exported by linkwind from {scenario.name}.", *comment(remarks)]
    note = "\n".join(lines).replace("--", "- -")  # which would end an XML comment
    head = f'<?xml version="1.0" encoding="utf-8"?>\n<!--\n{note}\n-->\n'
    text = f"{head}{ET.tostring(root, encoding='unicode')}\n"
    return Exported(text, len(root.findall("link")), len(root.findall("joint")), remarks)


def _link(body: Body, centre: Array, inertia: Array) -> ET.Element:
    """Return a link whose centre of mass is at ``centre`` in its frame."""
    link = ET.Element("link", name=body.name)
    if body.mass or inertia.any():
        inertial = ET.SubElement(link, "inertial")
        ET.SubElement(inertial, "origin", xyz=_numbers(centre), rpy="0 0 0")
        ET.SubElement(inertial, "mass", value=repr(body.mass))
        six = zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), inertia.tolist(), strict=True)
        ET.SubElement(inertial, "inertia", {key: repr(value) for key, value in six})
    link.extend(
        _visual(geometry, centre + position, rotation) for geometry, position, rotation in _drawn(body)
    )
    return link


def _visual(geometry: ET.Element, position: Array, rotation: Array) -> ET.Element:
    visual = ET.Element("visual")
    ET.SubElement(visual, "origin", xyz=_numbers(position), rpy=_numbers(roll_pitch_yaw(rotation)))
    ET.SubElement(visual, "geometry").append(geometry)
    return visual


def _joints(scenario: Scenario, mechanism: Mechanism, index: int) -> Iterator[ET.Element]:
    """Return the joint that carries a body; of a spherical one three, with links without mass between."""
    t, child = mechanism.tables, scenario.bodies[index].name
    parent = int(t.parent[index])
    carrier = scenario.bodies[parent].name if parent >= 0 else "world"
    xyz = t.parent_point[index] - (t.child_point[parent] if parent >= 0 else 0.0)
    rotation = t.parent_rotation[index] @ t.child_rotation[index].T
    origin = {"xyz": _numbers(xyz), "rpy": _numbers(roll_pitch_yaw(rotation))}
    name, kind = mechanism.joints[index], list(JOINT_TYPES)[t.joint_type[index]]
    if kind != "spherical":
        damping = float(t.damping[t.v_index[index]]) if kind in ("revolute", "prismatic") else 0.0
        stop = next((joint.stop for joint in scenario.joints if joint.name == name), None)
        urdf_type = "revolute" if stop and kind == "revolute" else TYPES[kind]
        axis = t.child_rotation[index] @ Z
        yield _joint(name, urdf_type, carrier, child, origin, axis, damping, stop or (-FAR, FAR))
        return
    for axis, letter in zip(np.eye(3)[:2], "xy", strict=True):
        between = f"{name}_{letter}_link"
        yield ET.Element("link", name=between)
        yield _joint(f"{name}_{letter}", "continuous", carrier, between, origin, axis)
        carrier, origin = between, {"xyz": "0 0 0", "rpy": "0 0 0"}
    yield _joint(f"{name}_z", "continuous", carrier, child, origin, Z)


def _joint(
    name: str, kind: str, parent: str, child: str, origin: dict[str, str], axis: Array, damping: float = 0.0,
    stop: tuple[float, float] = (-FAR, FAR),
) -> ET.Element:  # fmt: skip
    joint = ET.Element("joint", name=name, type=kind)
    ET.SubElement(joint, "origin", origin)
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    if kind in ("continuous", "revolute", "prismatic", "planar"):
        ET.SubElement(joint, "axis", xyz=_numbers(axis))
    if kind in ("revolute", "prismatic"):
        low, high = map(repr, stop)
        ET.SubElement(joint, "limit", lower=low, upper=high, effort=repr(FAR), velocity=repr(FAR))
    if damping:
        ET.SubElement(joint, "dynamics", damping=repr(damping))
    return joint


def _drawn(body: Body) -> Iterator[tuple[ET.Element, Array, Array]]:
    """Return what is drawn of a body: geometry, position from the centre of mass [m], rotation."""
    yield from _of_pictures(body.picture)
    shape = body.shape
    if body.picture or shape is None:
        return
    if isinstance(shape, Circle):
        yield _cylinder(shape.diameter, shape.span), np.zeros(3), np.eye(3)
    elif isinstance(shape, Ellipsoid) and len(set(shape.size)) == 1:
        yield ET.Element("sphere", radius=repr(0.5 * shape.span)), np.zeros(3), np.eye(3)
    elif isinstance(shape, Plate | Rectangle):
        width = shape.width if isinstance(shape, Rectangle) else 0.01 * shape.length
        yield ET.Element("box", size=_numbers([shape.length, width, shape.span])), np.zeros(3), np.eye(3)


def _of_pictures(pictures: Pictures) -> Iterator[tuple[ET.Element, Array, Array]]:
    for picture in pictures:
        rotation = matrix(np.array(picture.orientation))
        for geometry, along in _geometry(picture):
            yield geometry, np.array(picture.position) + rotation @ (along * Z), rotation


def _geometry(picture: Picture) -> Iterator[tuple[ET.Element, float]]:
    """Return geometries, each with how far it is moved along the picture's z axis [m]."""
    if isinstance(picture, Box):
        yield ET.Element("box", size=_numbers(picture.size)), 0.0
    elif isinstance(picture, Mesh):
        yield ET.Element("mesh", filename=picture.file, scale=_numbers(picture.scale)), 0.0
    elif isinstance(picture, drawings.Ellipsoid):
        if len(set(picture.size)) == 1:
            yield ET.Element("sphere", radius=repr(picture.size[0] / 2)), 0.0
    elif isinstance(picture, Cylinder | Capsule):
        yield _cylinder(picture.diameter, picture.length), 0.0
        for end in (-0.5, 0.5) if isinstance(picture, Capsule) else ():
            yield ET.Element("sphere", radius=repr(picture.diameter / 2)), end * picture.length


def _cylinder(diameter: float, length: float) -> ET.Element:
    return ET.Element("cylinder", radius=repr(diameter / 2), length=repr(length))


def _of_joints(scenario: Scenario, closures: tuple[str, ...]) -> Iterator[Remark]:
    for joint in scenario.joints:
        if np.any(joint.stiffness):
            yield Remark("springs", "the format has none", joint.name)
        if np.any(joint.damping) and joint.type not in ("revolute", "prismatic"):
            yield Remark("dampers", f"the format has none of a {joint.type} joint", joint.name)
        if joint.name in closures:
            yield Remark("loops", "the format has trees only", joint.name)
        elif joint.type == "spherical":
            yield Remark("spherical joints", "three about x, y, z, which lock at a right angle", joint.name)


def _of_bodies(scenario: Scenario) -> Iterator[Remark]:
    if scenario.planar:
        for body in scenario.bodies:
            yield Remark("inertias about z only", "taken for flat: Ixx = Iyy = Izz / 2", body.name)
    for body in scenario.bodies:
        if _partly_drawn(body):
            yield Remark("shapes", "the format has boxes, cylinders, balls and meshes", body.name)
        stated = (body.position, body.angle_deg, body.orientation, body.velocity, body.angular_velocity)
        if any(part is not None and np.any(part) for part in stated):
            yield Remark("starts", "the format has none: all joints are at zero", body.name)


def _of_surroundings(scenario: Scenario) -> Iterator[Remark]:
    if scenario.environment.gravity != (0.0, 0.0, -9.81):
        gravity = ", ".join(f"{part:g}" for part in scenario.environment.gravity)
        yield Remark(
            "gravities", "the format has none; most programs take -9.81 along z", f"[{gravity}] m/s²"
        )
    for joint in scenario.joints:
        if joint.restitution:
            yield Remark("restitutions", "the format has none", joint.name)
    for event in scenario.events:
        yield Remark("events", "the format has none", event.name)
    for provider in scenario.providers:
        if provider.model != "none":
            yield Remark("force models", "the format has none", f"{provider.name} ({provider.model})")


def _partly_drawn(body: Body) -> bool:
    if body.picture:
        return not all(list(_geometry(picture)) for picture in body.picture)
    return body.shape is not None and not list(_drawn(body))


def roll_pitch_yaw(rotation: Array) -> Array:
    """Return the turns about fixed x, then y, then z that make a rotation [rad], shape (3,)."""
    (a, b, c), (d, e, f), (g, _, _) = rotation
    yaw = math.atan2(d, a) if math.hypot(a, d) > 1e-9 else 0.0
    sine, cosine = math.sin(yaw), math.cos(yaw)
    roll = math.atan2(
        sine * c - cosine * f, cosine * e - sine * b
    )  # of what is left: right also at 90° pitch
    return np.array([roll, math.atan2(-g, math.hypot(a, d)), yaw]) + 0.0


def _numbers(values: Array | tuple[float, ...] | list[float]) -> str:
    return " ".join(repr(value + 0.0) for value in np.asarray(values, dtype=float).tolist())
