"""Pictures of wakes for Foxglove: triangles over the rings, coloured by their circulation."""

from __future__ import annotations

import numpy as np
from foxglove.messages import Color, Point3, SceneEntity, SceneUpdate, TriangleListPrimitive

from linkwind.frames import Single, WakeFrame, logged
from linkwind.log.rings import thinned
from linkwind.log.scene import timestamp
from linkwind.log.solids import ORIGIN

RINGS = 900  # of all wakes in a picture
OPACITY = 0.8
POSITIVE, NONE, NEGATIVE = (0.71, 0.02, 0.15), (0.87, 0.87, 0.87), (0.23, 0.30, 0.75)  # red, grey, blue


def picture(payload: bytes) -> bytes:
    """Return a ``SceneUpdate`` of a logged frame: the wakes of all wings, on the frame's own scale."""
    frame = logged(WakeFrame, payload)
    corner, strength, _ = thinned(frame, RINGS)
    wakes = zip(corner[:, frame.bound :], strength[:, frame.bound :], strict=True)
    top, stamp = float(np.abs(strength).max()) or 1.0, timestamp(frame.time_ns)
    entities = [
        SceneEntity(timestamp=stamp, frame_id="world", id=f"wake {wing}", triangles=[_mesh(*wake, top)])
        for wing, wake in enumerate(wakes, 1)
    ]
    return bytes(SceneUpdate(entities=entities).encode())


def at_corners(strength: Single) -> Single:
    """Return the mean strength of the rings around each corner, shape (rows + 1, columns + 1)."""
    rows, columns = strength.shape
    total, count = np.zeros((2, rows + 1, columns + 1), np.float32)
    for down in (0, 1):
        for across in (0, 1):
            part = (slice(down, rows + down), slice(across, columns + across))
            total[part] += strength
            count[part] += 1.0
    mean: Single = total / np.maximum(count, 1.0)
    return mean


def _mesh(corner: Single, strength: Single, top: float) -> TriangleListPrimitive:
    share = np.clip(at_corners(strength) / top, -1.0, 1.0).ravel()
    rows, columns = strength.shape
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    below = first + columns + 1
    indices = np.stack([first, first + 1, below, below, first + 1, below + 1], axis=1)
    return TriangleListPrimitive(
        pose=ORIGIN,
        points=[Point3(x=x, y=y, z=z) for x, y, z in corner.reshape(-1, 3).tolist()],
        colors=[color(each) for each in share.tolist()],
        indices=indices.ravel().tolist(),
    )


def color(share: float) -> Color:
    """Return the colour of a circulation, as a share of the largest one."""
    end = POSITIVE if share > 0.0 else NEGATIVE
    r, g, b = (none + abs(share) * (most - none) for most, none in zip(end, NONE, strict=True))
    return Color(r=r, g=g, b=b, a=OPACITY)
