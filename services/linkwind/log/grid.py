"""Frames of the fluid as the log holds them: ``foxglove.Grid``, which Foxglove draws unchanged.

A cell is four float32, ``vx``, ``vy``, ``pressure`` and ``vorticity``; the grid's position is the outer
corner of its first cell. What is read is parsed with the schema that the file carries.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError

from linkwind.errors import LogError
from linkwind.frames import SINGLE, FlowFrame

FIELDS = ("vx", "vy", "pressure", "vorticity")
CELL = SINGLE.itemsize * len(FIELDS)  # bytes
SECOND = 1_000_000_000  # ns


def encode(frame: FlowFrame) -> bytes:
    """Return the frame as a Grid in the frame ``world``."""
    from foxglove import messages as fox

    left, _, bottom, _ = frame.extent
    columns, single = frame.shape[1], fox.PackedElementFieldNumericType.Float32
    corner, upright = fox.Vector3(x=left, y=bottom, z=0.0), fox.Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    cells = np.dstack([frame.velocity, frame.pressure, frame.vorticity])
    grid = fox.Grid(
        timestamp=fox.Timestamp(sec=frame.time_ns // SECOND, nsec=frame.time_ns % SECOND),
        frame_id="world",
        pose=fox.Pose(position=corner, orientation=upright),
        column_count=columns,
        cell_size=fox.Vector2(x=frame.cell, y=frame.cell),
        row_stride=CELL * columns,
        cell_stride=CELL,
        fields=[
            fox.PackedElementField(name=name, offset=SINGLE.itemsize * i, type=single)
            for i, name in enumerate(FIELDS)
        ],
        data=cells.astype(SINGLE, copy=False).tobytes(),
    )
    return bytes(grid.encode())


def decode(payload: bytes, name: str, schema: bytes, step_ns: int) -> FlowFrame:
    """Return the frame that a logged Grid is.

    Args:
        payload: the message.
        name: of its type.
        schema: descriptor set of the type, as the file carries it.
        step_ns: communication step size of the run [ns].

    Raises:
        LogError: it is not such a Grid.
    """
    try:
        grid = _message(name, schema).FromString(payload)
    except (DecodeError, TypeError, KeyError) as error:
        raise LogError(f"expected a {name}; got {error}") from error
    fields, size = tuple(field.name for field in grid.fields), len(grid.data)
    if fields != FIELDS or grid.cell_stride != CELL or not grid.row_stride or size % grid.row_stride:
        raise LogError(f"expected a Grid of {', '.join(FIELDS)}; got {', '.join(fields)}, {size} bytes")
    cells = np.frombuffer(grid.data, SINGLE).reshape(-1, grid.column_count, len(FIELDS))
    time_ns, cell = grid.timestamp.seconds * SECOND + grid.timestamp.nanos, grid.cell_size.x
    corner = grid.pose.position
    return FlowFrame(
        step=time_ns // step_ns,
        time_ns=time_ns,
        origin=(corner.x + 0.5 * cell, corner.y + 0.5 * cell),
        cell=cell,
        velocity=cells[:, :, :2],
        pressure=cells[:, :, 2],
        vorticity=cells[:, :, 3],
    )


@cache
def _message(name: str, schema: bytes) -> Any:
    """Return the class of a message type from its descriptor set."""
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(name))
