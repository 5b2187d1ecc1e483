"""Pictures of wakes for Foxglove: triangles over the rings, coloured by their circulation."""

from __future__ import annotations

import numpy as np
from foxglove.messages import Color, Point3, SceneEntity, SceneUpdate, TriangleListPrimitive

from linkwind.frames import Single, WakeFrame, logged_wake
from linkwind.log.scene import timestamp
from linkwind.log.solids import ORIGIN

RINGS = 600  # of a wing's wake in a picture; of a longer one every second or third row
OPACITY = 0.75
ENDS = ((0.70, 0.09, 0.17), (0.93, 0.93, 0.93), (0.13, 0.40, 0.67))  # positive, none, negative: red, blue


def picture(payload: bytes) -> bytes:
    """Return a ``SceneUpdate`` of a logged frame: the wakes of all wings, on the frame's own scale."""
    frame = logged_wake(payload)
    top = float(np.abs(frame.strength).max()) or 1.0
    stamp = timestamp(frame.time_ns)
    entities = [
        SceneEntity(
            timestamp=stamp, frame_id="world", id=f"wake {wing + 1}", triangles=[_mesh(frame, wing, top)]
        )
        for wing in range(len(frame.strength))
    ]
    return bytes(SceneUpdate(entities=entities).encode())


def thinned(frame: WakeFrame, wing: int, rings: int) -> tuple[Single, Single]:
    """Return corners and strengths of a wing's wake, of every so many-th row.

    The last edge stays, whatever is in between.

    Args:
        frame: wings and wakes.
        wing: index.
        rings: that are not exceeded by much.

    Returns:
        corners [m], shape (m + 1, columns + 1, 3); strengths [m²/s], shape (m, columns).
    """
    _, rows, columns = frame.shape
    stride = max(1, -(-(rows - frame.bound) * columns // rings))
    edges = np.unique([*range(frame.bound, rows, stride), rows])
    return frame.corner[wing, edges], frame.strength[wing, edges[:-1]]


def at_corners(strength: Single) -> Single:
    """Return the mean strength of the rings around each corner, shape (rows + 1, columns + 1)."""
    rows, columns = strength.shape
    total, count = np.zeros((rows + 1, columns + 1), np.float32), np.zeros((rows + 1, columns + 1), np.float32)
    for down in (0, 1):
        for across in (0, 1):
            part = (slice(down, rows + down), slice(across, columns + across))
            total[part] += strength
            count[part] += 1.0
    mean: Single = total / np.maximum(count, 1.0)
    return mean


def _mesh(frame: WakeFrame, wing: int, top: float) -> TriangleListPrimitive:
    corner, strength = thinned(frame, wing, RINGS)
    share = np.clip(at_corners(strength) / top, -1.0, 1.0).ravel()
    rows, columns = strength.shape
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    below = first + columns + 1
    indices = np.stack([first, first + 1, below, below, first + 1, below + 1], axis=1)
    return TriangleListPrimitive(
        pose=ORIGIN,
        points=[Point3(x=x, y=y, z=z) for x, y, z in corner.reshape(-1, 3).tolist()],
        colors=[_color(each) for each in share.tolist()],
        indices=indices.ravel().tolist(),
    )


def _color(share: float) -> Color:
    """Return the colour of a circulation, as a share of the largest one."""
    end, none = ENDS[0 if share > 0.0 else 2], ENDS[1]
    r, g, b = (n + abs(share) * (e - n) for e, n in zip(end, none, strict=True))
    return Color(r=r, g=g, b=b, a=OPACITY)
