"""URDF: links, joints and pictures, https://wiki.ros.org/urdf/XML."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np

from linkwind.mechanism.importers.model import ORIGIN, WORLD, Joint, Model, Part, Picture, Pose
from linkwind.mechanism.importers.xmltree import Element
from linkwind.spatial import Array

Base = Literal["fixed", "free"]

TYPES = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "fixed": "fixed",
    "floating": "free",
    "planar": "planar",
    "spherical": "spherical",  # not in the standard, but in use
}
GRAVITY = np.array([0.0, 0.0, -9.81])  # z is up; the format has no gravity

# Elements that are read; of the others, what they are called in the plural and why they are left out.
READ = {
    "robot": {"link", "joint", "material"},
    "link": {"inertial", "visual", "collision"},
    "joint": {"origin", "parent", "child", "axis", "dynamics", "limit"},
}
LEFT_OUT = {
    "mimic": ("mimic joints", "they move freely"),
    "safety_controller": ("safety controllers", "there is no controller"),
    "calibration": ("joint calibrations", "they do not matter to the motion"),
    "transmission": ("transmissions", "joints have no motors"),
    "gazebo": ("gazebo extensions", "they are for another program"),
    "sensor": ("sensors", "they do not matter to the motion"),
    "contact": ("contact properties", "bodies do not touch"),
}


def read(root: Element, base: Base) -> Model:
    """Return the model of a ``<robot>``.

    Args:
        root: the element.
        base: whether the root link is fixed to the world or free to move.

    Raises:
        InputError: an element is missing, has a wrong value, or links and joints make no tree.
    """
    links = _links(root)
    by_child = _joints(root, links)
    order = _order(root, links, by_child)
    model = Model("URDF", root.attributes.get("name", "robot"), [], GRAVITY)
    index = {name: i for i, name in enumerate(order)}
    frames: list[Pose] = []
    for name in order:
        element = by_child.get(name)
        if element is None:
            parent, frame = WORLD, ORIGIN
            joint = Joint("base", "fixed" if base == "fixed" else "free", np.zeros(3))
        else:
            parent = index[element.need("parent").text("link")]
            frame = frames[parent].then(_origin(element))
            joint = _joint(element, frame)
        frames.append(frame)
        model.parts.append(_part(links[name], parent, joint, frame))
    _note_left_out(model, root)
    return model


def _links(root: Element) -> dict[str, Element]:
    links: dict[str, Element] = {}
    for link in root.all("link"):
        name = link.text("name")
        if name in links:
            link.refuse("a name of its own", f"that of line {links[name].line}", "Rename one of the two.")
        links[name] = link
    if not links:
        root.refuse("a <link>", "none", "Give the file of a robot.")
    return links


def _joints(root: Element, links: Mapping[str, Element]) -> dict[str, Element]:
    """Return the joint above each link."""
    by_child: dict[str, Element] = {}
    for joint in root.all("joint"):
        joint.text("name")
        ends = [joint.need(end).text("link") for end in ("parent", "child")]
        for name in ends:
            if name not in links:
                joint.refuse("the name of a link", f'"{name}"', "Correct it, or add that link.")
        if ends[1] in by_child:
            other = by_child[ends[1]]
            joint.refuse(f'a child that no other joint has ("{ends[1]}" hangs on {other})', "a loop",
                         "URDF describes trees.")  # fmt: skip
        by_child[ends[1]] = joint
    return by_child


def _order(root: Element, links: Mapping[str, Element], by_child: Mapping[str, Element]) -> list[str]:
    """Return the links, parents before children."""
    roots = [name for name in links if name not in by_child]
    if len(roots) != 1:
        got = ", ".join(f'"{name}"' for name in roots) or "none: the joints make a loop"
        root.refuse("one link that is no child of a joint", got, "Connect the links with joints.")
    children: dict[str, list[str]] = {name: [] for name in links}
    for name in links:
        if name in by_child:
            children[by_child[name].need("parent").text("link")].append(name)
    order = list(roots)
    for name in order:  # grows on the way
        order += children[name]
    reached = set(order)
    lost = next((name for name in links if name not in reached), None)
    if lost is not None:
        by_child[lost].refuse("joints that form a tree", f'a loop through "{lost}"', "URDF describes trees.")
    return order


def _origin(element: Element) -> Pose:
    origin = element.first("origin")
    if origin is None:
        return ORIGIN
    return Pose(origin.numbers("xyz", 3, (0, 0, 0)), _turned(*origin.numbers("rpy", 3, (0, 0, 0))))


def _turned(roll: float, pitch: float, yaw: float) -> Array:
    """Return the rotation by fixed angles about x, then y, then z, shape (3, 3)."""
    (sr, sp, sy), (cr, cp, cy) = np.sin([roll, pitch, yaw]), np.cos([roll, pitch, yaw])
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _joint(element: Element, frame: Pose) -> Joint:
    kind = element.text("type")
    if kind not in TYPES:
        element.refuse(f"type to be one of {', '.join(TYPES)}", f'"{kind}"', "Use one of these.")
    axis = element.first("axis")
    direction = np.array([1.0, 0.0, 0.0]) if axis is None else axis.numbers("xyz", 3)
    if axis is not None and kind not in ("fixed", "floating", "spherical") and not direction.any():
        axis.refuse("an axis that is not zero", '"0 0 0"', "Give it a direction.")
    dynamics = element.first("dynamics")
    damping = 0.0 if dynamics is None else dynamics.number("damping", 0.0)
    if dynamics is not None and damping < 0.0:
        dynamics.refuse("damping of at least 0", f"{damping:g}", "A negative one would feed energy.")
    joint = Joint(element.text("name"), TYPES[kind], frame.position)
    if joint.type in ("revolute", "prismatic", "planar"):
        joint.axis = frame.rotation @ direction
    if joint.type in ("revolute", "prismatic"):
        joint.damping = damping
    limit = element.first("limit")
    if limit is not None and kind in ("revolute", "prismatic"):
        joint.stop = limit.number("lower", 0.0), limit.number("upper", 0.0)
    return joint


def _part(link: Element, parent: int, joint: Joint, frame: Pose) -> Part:
    mass, centre, inertia = 0.0, frame.position, np.zeros((3, 3))
    inertial = link.first("inertial")
    if inertial is not None:
        within = frame.then(_origin(inertial))
        mass, centre = inertial.need("mass").number("value"), within.position
        if mass < 0.0:
            inertial.need("mass").refuse("a mass of at least 0", f"{mass:g}", "Correct it.")
        moments = inertial.first("inertia")
        if moments is not None:
            xx, yy, zz = (moments.number(key) for key in ("ixx", "iyy", "izz"))
            xy, xz, yz = (moments.number(key, 0.0) for key in ("ixy", "ixz", "iyz"))
            own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            inertia = within.rotation @ own @ within.rotation.T
    item = f"{link.file}:{link.line}: {link}"
    pictures = [picture for visual in _drawn(link) for picture in _pictures(visual, frame)]
    return Part(link.text("name"), item, parent, joint, mass, centre, inertia, pictures)


def _drawn(link: Element) -> list[Element]:
    """Return what shows a link: its visuals, or what it collides with where it has none."""
    return list(link.all("visual")) or list(link.all("collision"))


def _pictures(visual: Element, frame: Pose) -> Iterator[Picture]:
    pose = frame.then(_origin(visual))
    geometry = visual.first("geometry")
    for shape in [] if geometry is None else geometry.children:
        keys = _keys(shape)
        if keys is not None:
            yield Picture(keys, pose)


def _keys(shape: Element) -> dict[str, Any] | None:
    """Return what is drawn of an element of a geometry; None for nothing."""
    if shape.tag == "mesh":
        keys = {"type": "mesh", "file": _reference(shape.text("filename"), Path(shape.file))}
        scale = shape.numbers("scale", 3, (1.0, 1.0, 1.0)).tolist()
        return keys if scale == [1.0, 1.0, 1.0] else {**keys, "scale": scale}
    if shape.tag == "box":
        size = shape.numbers("size", 3).tolist()
        return {"type": "box", "size": size} if min(size) >= 0.0 and any(size) else None
    if shape.tag not in ("sphere", "cylinder", "capsule") or shape.number("radius") <= 0.0:
        return None
    diameter = 2.0 * shape.number("radius")
    if shape.tag == "sphere":
        return {"type": "ellipsoid", "size": [diameter] * 3}
    return {"type": shape.tag, "diameter": diameter, "length": abs(shape.number("length"))}


def _reference(written: str, robot: Path) -> str:
    """Return a mesh's address: one with a scheme as it is, another as a file beside the robot's."""
    return written if "://" in written else (robot.parent / written).resolve().as_uri()


def _note_left_out(model: Model, root: Element) -> None:
    for parent in (root, *root.all("link"), *root.all("joint")):
        for child in parent.children:
            if child.tag in READ[parent.tag]:
                continue
            what, why = LEFT_OUT.get(child.tag, (f"elements <{child.tag}>", "they are not known"))
            owner = (child if parent is root else parent).attributes
            model.leave_out(what, why, [owner.get("name") or owner.get("reference") or f"line {child.line}"])
    for joint in root.all("joint"):
        _note_of_joint(model, joint)
    touching = [link.text("name") for link in root.all("link") if link.first("collision")]
    model.leave_out("collision shapes", "bodies do not touch", touching)
    heavy = [
        link for link in root.all("link") if (own := link.first("inertial")) and not own.first("inertia")
    ]
    points = [link.text("name") for link in heavy]
    model.leave_out("links with mass and without inertia", "each is a point, as the file has it", points)


def _note_of_joint(model: Model, joint: Element) -> None:
    name, kind = joint.text("name"), joint.text("type")
    for limit in joint.all("limit"):
        if {"effort", "velocity"} & set(limit.attributes):
            model.leave_out("limits of effort and velocity", "they are the controller's", [name])
    for dynamics in joint.all("dynamics"):
        if dynamics.number("friction", 0.0):
            model.leave_out("joint frictions", "dry friction is not modelled", [name])
        if TYPES[kind] not in ("revolute", "prismatic") and dynamics.number("damping", 0.0):
            model.leave_out("dampers", f"of a {kind} joint they are not defined", [name])
