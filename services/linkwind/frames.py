"""Pictures of the fluid on a grid, as a force model shows them: arrays to bytes and back.

The schema is ``schemas/linkwind/v1/observe.proto``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from google.protobuf.message import DecodeError
from numpy.typing import NDArray

from linkwind.errors import ProtocolError
from linkwind.schema import MESSAGES
from linkwind.wire import preamble

Single = NDArray[np.float32]

SINGLE = np.dtype("<f4")
COMPONENTS = {"velocity": (2,), "pressure": (), "vorticity": ()}  # array of a frame: shape of a cell's value


@dataclass(frozen=True, eq=False)
class FlowFrame:
    """The fluid in the plane z = 0 at one time, on square cells; values at the centres of the cells.

    The first row has the lowest y, the first column the lowest x.

    Attributes:
        step: index k of the communication point that the fluid is at.
        time_ns: its simulation time t_k [ns].
        origin: centre of the first cell (x, y) [m], in W.
        cell: side of a cell [m].
        velocity: [m/s], shape (rows, columns, 2), in W.
        pressure: relative to the undisturbed fluid [Pa], shape (rows, columns).
        vorticity: about z [1/s], shape (rows, columns).
    """

    step: int
    time_ns: int
    origin: tuple[float, float]
    cell: float
    velocity: Single
    pressure: Single
    vorticity: Single

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.pressure.shape
        return rows, columns

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Outer edges of the cells: left, right, bottom, top [m], in W."""
        (x, y), (rows, columns), half = self.origin, self.shape, 0.5 * self.cell
        return x - half, x + (columns - 0.5) * self.cell, y - half, y + (rows - 0.5) * self.cell

    def encode(self, run: str, provider: str, number: int) -> bytes:
        """Return the message FlowFrame.

        Args:
            run: id of the run.
            provider: that shows the frame.
            number: of the provider's frames, from 1.

        Raises:
            ProtocolError: an array has another shape than the pressure.
        """
        rows, columns = self.shape
        message = MESSAGES["FlowFrame"](
            run=run, provider=provider, number=number, step=self.step, time_ns=self.time_ns,
            rows=rows, columns=columns, cell=self.cell, origin_x=self.origin[0], origin_y=self.origin[1],
        )  # fmt: skip
        parts = [message.SerializeToString()]
        for name, inner in COMPONENTS.items():
            array = getattr(self, name)
            if array.shape != (rows, columns, *inner):
                expected = (rows, columns, *inner)
                raise ProtocolError(f'"{provider}": frame: {name}: expected {expected}; got {array.shape}')
            field = message.DESCRIPTOR.fields_by_name[name]
            data = np.ascontiguousarray(array, SINGLE).tobytes()
            parts += [preamble(field.number, len(data)), data]
        return b"".join(parts)


def decode(payload: bytes, run: str, provider: str) -> tuple[int, FlowFrame]:
    """Return the number of a message FlowFrame, and the frame.

    Args:
        payload: an encoded message.
        run: that it must be of.
        provider: that it must come from.

    Raises:
        ProtocolError: it is not such a message, of another run or provider, or its sizes do not fit.
    """
    what = f'frame from "{provider}": expected a FlowFrame of this run'
    try:
        message = MESSAGES["FlowFrame"].FromString(payload)
    except DecodeError as error:
        raise ProtocolError(f"{what}; got {error}") from error
    if (message.run, message.provider) != (run, provider):
        raise ProtocolError(f'{what}; got one of run {message.run} from "{message.provider}"')
    arrays = {name: _array(message, name, inner, what) for name, inner in COMPONENTS.items()}
    origin = (message.origin_x, message.origin_y)
    return message.number, FlowFrame(message.step, message.time_ns, origin, message.cell, **arrays)


def _array(message: Any, name: str, inner: tuple[int, ...], what: str) -> Single:
    shape, data = (message.rows, message.columns, *inner), getattr(message, name)
    expected = SINGLE.itemsize * int(np.prod(shape, dtype=np.int64))
    if len(data) != expected:
        raise ProtocolError(f"{what}: {name}: expected {expected} bytes for {shape}; got {len(data)}")
    return np.frombuffer(data, SINGLE).reshape(shape)
