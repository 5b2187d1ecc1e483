"""Pictures of fluid in a box for Foxglove: triangles over its vortices, coloured by their vorticity."""

from __future__ import annotations

import numpy as np
from foxglove.messages import Point3, SceneEntity, SceneUpdate, TriangleListPrimitive

from linkwind.frames import VolumeFrame, logged
from linkwind.log.scene import timestamp
from linkwind.log.solids import ORIGIN
from linkwind.log.vortices import scale, vortices
from linkwind.log.wakes import color

TRIANGLES = 6000  # of a picture


def picture(payload: bytes) -> bytes:
    """Return a ``SceneUpdate`` of a logged frame: its vortices, on the frame's own scale."""
    frame = logged(VolumeFrame, payload)
    on = scale([frame])
    shown = vortices(frame, on, TRIANGLES)
    share = np.clip(np.nan_to_num(shown.vorticity / on.top), -1.0, 1.0)
    mesh = TriangleListPrimitive(
        pose=ORIGIN,
        points=[Point3(x=x, y=y, z=z) for x, y, z in shown.point.tolist()],
        colors=[color(each) for each in share.tolist()],
        indices=shown.triangle.ravel().tolist(),
    )
    stamp = timestamp(frame.time_ns)
    entity = SceneEntity(timestamp=stamp, frame_id="world", id="vortices", triangles=[mesh])
    return bytes(SceneUpdate(entities=[entity]).encode())
