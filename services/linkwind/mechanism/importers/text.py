"""A model as the text of a scenario: commented TOML that runs as it is."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from linkwind.mechanism.importers.configuration import displacements
from linkwind.mechanism.importers.model import WORLD, Closure, Model, Motor, Part, Picture, Pose
from linkwind.mechanism.quaternion import from_matrix
from linkwind.mechanism.remarks import comment, wrapped
from linkwind.spatial import Array


def scenario_text(model: Model, source: str, version: str, start: Mapping[str, float]) -> str:
    """Return the TOML text.

    Args:
        model: settled.
        source: the file that it comes from, for the comment.
        version: of linkwind, likewise.
        start: coordinates of joints that do not start at their zero, by name [rad or m].
    """
    bodies = names([part.name for part in model.parts], {"world"})
    joints = names([part.joint.name for part in model.parts])
    placed = displacements(model, start)
    lines = [*_header(model, source, version), *_settings(model)]
    for i, part in enumerate(model.parts):
        lines += ["", *_body(part, bodies[i], placed, i, start)]
    frames = {WORLD: ("world", np.zeros(3))}
    frames |= {i: (bodies[i], part.centre) for i, part in enumerate(model.parts)}
    held = {end for closure in model.closures for end in closure.ends}
    for i, part in enumerate(model.parts):
        free = part.joint.type == "free" and part.parent == WORLD and i not in held
        if not free or part.joint.stiffness or part.joint.damping:
            lines += ["", *_joint(part, joints[i], bodies[i], *frames[part.parent])]
    for closure, name in zip(model.closures, names([c.name for c in model.closures], joints), strict=True):
        lines += ["", *_closure(closure, name, frames)]
    driven = {part.joint.name: joint for part, joint in zip(model.parts, joints, strict=True)}
    for motor, name in zip(model.motors, names([m.name for m in model.motors]), strict=True):
        lines += ["", *_motor(motor, name, driven[motor.joint])]
    return "\n".join(lines) + "\n"


def names(wanted: Sequence[str], taken: Iterable[str] = ()) -> list[str]:
    """Return a name for each that a scenario allows: letters, digits and _, none twice."""
    used, found = set(taken), []
    for name in wanted:
        plain = re.sub(r"\W", "_", name, flags=re.ASCII)
        plain = (plain if re.match("[A-Za-z]", plain) else f"n{plain}")[:60]
        free, count = plain, 1
        while free in used:
            count += 1
            free = f"{plain}_{count}"
        used.add(free)
        found.append(free)
    return found


def _header(model: Model, source: str, version: str) -> Iterator[str]:
    origin = f'Imported by linkwind {version} from {source} ({model.kind}, "{model.name}").'
    frames = "Body frames are at the centres of mass, and parallel to the world where every joint is at zero."
    for line in [*wrapped(origin), frames, *comment(model.remarks)]:
        yield f"# {line}"


def _settings(model: Model) -> list[str]:
    return [
        "",
        f"description = {_string(f'{model.name}, imported from {model.kind}')}",
        "",
        "[time]",
        "end = 1.0                         # s",
        "",
        "[environment]",
        f"gravity = {_row(model.gravity)}    # m/s²",
        *_pictures(model.pictures, np.zeros(3)),
        "",
        "[aero]",
        'model = "none"                    # no forces of a fluid; field and plate are others',
        "",
        "[dynamics]",
        'integrator = "dopri5"             # takes the substeps that light links need',
        "",
        "[coupling]",
        "step = 1e-3                       # s",
    ]


def _body(part: Part, name: str, placed: list[Pose], index: int, start: Mapping[str, float]) -> Iterator[str]:
    yield "[[bodies]]"
    yield f'name = "{name}"' + ("" if name == part.name else f"    # {_string(part.name)} in the file")
    yield f"mass = {_number(part.mass)}    # kg"
    i = part.inertia
    six = np.array([i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]])
    yield f"inertia = {_row(six)}    # kg·m², [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]"
    own, moved = part.joint, placed[index]
    if own.type == "free" or (own.type == "prismatic" and own.name in start):
        yield f"position = {_row(moved.position + moved.rotation @ part.centre)}    # m, centre of mass"
    if own.type == "revolute" and own.name in start:
        at = f"{own.name} at {start[own.name]:g} rad"
        yield f"orientation = {_row(from_matrix(moved.rotation))}    # {_string(at)[1:-1]}"
    yield from _pictures(part.pictures, part.centre)


def _pictures(pictures: Sequence[Picture], centre: Array) -> Iterator[str]:
    if pictures:
        yield "picture = ["
        yield from (f"  {_picture(picture.keys, picture.pose, centre)}," for picture in pictures)
        yield "]"


def _picture(keys: Mapping[str, Any], pose: Pose, centre: Array) -> str:
    fields = {key: _string(value) if isinstance(value, str) else _any(value) for key, value in keys.items()}
    position, quaternion = pose.position - centre, from_matrix(pose.rotation)
    if np.abs(position).max() > 1e-12:
        fields["position"] = _row(position)
    if np.abs(quaternion - [1.0, 0.0, 0.0, 0.0]).max() > 1e-12:
        fields["orientation"] = _row(quaternion)
    return "{ " + ", ".join(f"{key} = {value}" for key, value in fields.items()) + " }"


def _joint(part: Part, name: str, child: str, parent: str, centre: Array) -> Iterator[str]:
    joint = part.joint
    yield "[[joints]]"
    yield f'name = "{name}"' + ("" if name == joint.name else f"    # {_string(joint.name)} in the file")
    yield f'type = "{joint.type}"'
    yield f'parent = "{parent}"'
    yield f'child = "{child}"'
    yield f"parent_point = {_row(joint.point - centre)}    # m, from the parent's centre of mass"
    yield f"child_point = {_row(joint.point - part.centre)}    # m, from the child's"
    if joint.type in ("revolute", "prismatic", "planar"):
        yield f"axis = {_row(joint.axis / np.linalg.norm(joint.axis))}"
    turns = joint.type in ("revolute", "spherical")
    if np.any(joint.stiffness):
        yield f"stiffness = {_any(joint.stiffness)}    # {'N·m/rad' if turns else 'N/m'}"
    if joint.rest is not None:
        single = len(joint.rest) == 1
        yield f"rest = {_number(joint.rest[0]) if single else _row(np.array(joint.rest))}"
    if joint.stop is not None:
        yield f"stop = {_row(np.array(joint.stop))}    # {'rad' if turns else 'm'}"
    if np.any(joint.damping):
        yield f"damping = {_any(joint.damping)}    # {'N·m·s/rad' if turns else 'N·s/m'}"


def _closure(closure: Closure, name: str, frames: Mapping[int, tuple[str, Array]]) -> Iterator[str]:
    """Yield a joint that closes a loop; the world is never its child."""
    way = [0, 1] if closure.ends[1] != WORLD else [1, 0]
    (parent, parent_centre), (child, child_centre) = (frames[closure.ends[end]] for end in way)
    yield "[[joints]]    # closes a loop"
    yield f'name = "{name}"' + ("" if name == closure.name else f"    # {_string(closure.name)} in the file")
    yield f'type = "{closure.type}"'
    yield f'parent = "{parent}"'
    yield f'child = "{child}"'
    yield f"parent_point = {_row(closure.points[way[0]] - parent_centre)}    # m"
    yield f"child_point = {_row(closure.points[way[1]] - child_centre)}    # m"


def _motor(motor: Motor, name: str, joint: str) -> Iterator[str]:
    yield "[[forces]]"
    yield 'type = "actuator"'
    yield f'name = "{name}"' + ("" if name == motor.name else f"    # {_string(motor.name)} in the file")
    yield f'joint = "{joint}"'
    yield "inputs = { u = 0.0 }              # an input of the FMU; in a run it stays what it is here"
    yield f"force = {_string(motor.law)}    # {motor.unit}"


def _any(value: float | list[float]) -> str:
    return _row(np.array(value)) if isinstance(value, list) else _number(value)


def _row(values: Array) -> str:
    """Return a list of numbers; what is round-off beside the others is 0."""
    least = 1e-16 * np.abs(values).max()
    return "[" + ", ".join(_number(value if abs(value) > least else 0.0) for value in values.tolist()) + "]"


def _number(value: float) -> str:
    """Return a number with 15 digits: sums of short numbers stay short, and 1e-15 of it is lost."""
    return repr(float(f"{value + 0.0:.15g}"))


def _string(text: str) -> str:
    """Return text as a TOML string."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
