"""A drawing of the mechanism at its start, seen along z: as SVG, and as PNG for tools that want pixels."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

import numpy as np

from linkwind.mechanism import Mechanism
from linkwind.mechanism.quaternion import matrix
from linkwind.native.multibody import Multibody
from linkwind.scenario import Scenario
from linkwind.spatial import Array, Motion

_BODY, _JOINT, _GROUND = "#1f5f8b", "#e07b39", "#8a949c"
_MARGIN = 0.12  # of the picture's side


@dataclass(frozen=True)
class Stroke:
    """A line with round ends, in units of the picture's side, y downwards; a point where both ends agree."""

    start: tuple[float, float]
    end: tuple[float, float]
    width: float
    colour: str


def strokes(scenario: Scenario, mechanism: Mechanism) -> list[Stroke]:
    """Return the drawing: bodies, then joints on top of them."""
    multibody = Multibody(mechanism.tables)
    motion = Motion.at_rest(multibody.n)
    multibody.motion(multibody.initial_state(mechanism.q0, mechanism.v0), motion)
    lines: list[tuple[Array, Array, float, str]] = []
    points: list[tuple[Array, Array, float, str]] = []
    for i, body in enumerate(scenario.bodies):
        centre, turn = motion.position[i], matrix(motion.orientation[i])
        joint = centre + turn @ mechanism.tables.child_point[i]
        if body.shape:
            outline = np.pad(body.shape.outline(), ((0, 0), (0, 1))) @ turn.T + centre
            width = 0.025 if body.shape.closed else 0.05
            sides = list(zip(outline, np.roll(outline, -1, axis=0), strict=True))
            lines += [(*side, width, _BODY) for side in (sides if body.shape.closed else sides[:-1])]
        else:
            lines.append((joint, centre, 0.03, _BODY))
            points.append((centre, centre, 0.09, _BODY))
        if not mechanism.joints[i].startswith("world-"):
            colour = _GROUND if mechanism.tables.parent[i] < 0 else _JOINT
            points.append((joint, joint, 0.07, colour))
    return _fitted([*lines, *points])


def svg(drawing: list[Stroke], side: int) -> str:
    """Return the drawing as SVG, ``side`` pixels wide and high."""
    lines = "".join(
        f'<line x1="{s.start[0] * side:.2f}" y1="{s.start[1] * side:.2f}" x2="{s.end[0] * side:.2f}" '
        f'y2="{s.end[1] * side:.2f}" stroke="{s.colour}" stroke-width="{s.width * side:.2f}" '
        'stroke-linecap="round"/>'
        for s in drawing
    )
    size = f'width="{side}" height="{side}" viewBox="0 0 {side} {side}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{lines}</svg>\n'


def png(drawing: list[Stroke], side: int) -> bytes:
    """Return the drawing as PNG with a transparent ground, ``side`` pixels wide and high."""
    centres = (np.arange(side) + 0.5) / side
    x, y = np.meshgrid(centres, centres)
    image = np.zeros((side, side, 4))
    for stroke in drawing:
        distance = _distance(x, y, stroke) - stroke.width / 2.0
        cover = np.clip(0.5 - distance * side, 0.0, 1.0)[..., None]  # edges over one pixel
        colour = [int(stroke.colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5)]
        alpha = image[..., 3:]
        blend = cover + alpha * (1.0 - cover)
        mixed = np.array(colour) * cover + image[..., :3] * alpha * (1.0 - cover)
        image[..., :3] = np.divide(mixed, blend, out=np.zeros_like(mixed), where=blend > 0.0)
        image[..., 3:] = blend
    return _encode_png((image * 255.0 + 0.5).astype(np.uint8))


def _fitted(items: list[tuple[Array, Array, float, str]]) -> list[Stroke]:
    """Scale to the picture, the same in both directions, the middle in the middle."""
    ends = np.array([end[:2] for item in items for end in item[:2]])
    low, high = ends.min(axis=0), ends.max(axis=0)
    extent = max(float((high - low).max()), 1e-9)
    scale, middle = (1.0 - 2.0 * _MARGIN) / extent, (low + high) / 2.0

    def place(end: Array) -> tuple[float, float]:
        x, y = (end[:2] - middle) * scale
        return 0.5 + float(x), 0.5 - float(y)

    return [Stroke(place(start), place(end), width, colour) for start, end, width, colour in items]


def _distance(x: Array, y: Array, stroke: Stroke) -> Array:
    (x1, y1), (x2, y2) = stroke.start, stroke.end
    along = (x2 - x1) ** 2 + (y2 - y1) ** 2
    t = np.clip(((x - x1) * (x2 - x1) + (y - y1) * (y2 - y1)) / along, 0.0, 1.0) if along else 0.0
    distance: Array = np.hypot(x - x1 - t * (x2 - x1), y - y1 - t * (y2 - y1))
    return distance


def _encode_png(image: np.ndarray[tuple[int, ...], np.dtype[np.uint8]]) -> bytes:
    height, width = image.shape[:2]
    rows = b"".join(b"\0" + row.tobytes() for row in image)
    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows, 9)), (b"IEND", b""))
    body = b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in chunks
    )
    return b"\x89PNG\r\n\x1a\n" + body
