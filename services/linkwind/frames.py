"""Pictures of the fluid, as a force model shows them: arrays to bytes and back.

A frame is one of three kinds: the fluid in a plane (``flow``) or in a box (``volume``), on a grid, or wings
with their wakes (``wake``). The schema is ``schemas/linkwind/v1/observe.proto``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, TypeVar

import numpy as np
from google.protobuf.message import DecodeError
from numpy.typing import NDArray

from linkwind.errors import ProtocolError
from linkwind.schema import MESSAGES
from linkwind.wire import preamble

Single = NDArray[np.float32]

SINGLE = np.dtype("<f4")


class Sent(NamedTuple):
    """A frame on its way: its kind and its message."""

    kind: str
    payload: bytes


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

    KIND: ClassVar = "flow"
    MESSAGE: ClassVar = "FlowFrame"
    PLACE: ClassVar = ("origin", "cell")
    ARRAYS: ClassVar = ("velocity", "pressure", "vorticity")

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

    @staticmethod
    def shapes(about: Any) -> dict[str, tuple[int, ...]]:
        """Return the shape of each array of a message."""
        cells = (about.rows, about.columns)
        return {"velocity": (*cells, 2), "pressure": cells, "vorticity": cells}

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
        return _with_arrays(message, self, provider)

    @classmethod
    def of(cls, message: Any, arrays: dict[str, Single]) -> FlowFrame:
        """Return the frame that a message holds."""
        origin = (message.origin_x, message.origin_y)
        return cls(message.step, message.time_ns, origin, message.cell, **arrays)


@dataclass(frozen=True, eq=False)
class WakeFrame:
    """Thin wings and their free wakes at one time, as rings of vortex filaments.

    Each wing is one grid from its leading edge over the trailing edge to the end of its wake; a ring lies
    between four corners.

    Attributes:
        step: index k of the communication point that wings and wakes are at.
        time_ns: its simulation time t_k [ns].
        bound: rows of rings that lie on the wing; the others are its wake.
        corner: of the rings [m], shape (wings, rows + 1, columns + 1, 3), in W; wings in the order of the
            provider's bodies, columns along the span.
        strength: circulation of the rings [m²/s], shape (wings, rows, columns), right-handed about the way to
            the next column × the way to the next row.
    """

    KIND: ClassVar = "wake"
    MESSAGE: ClassVar = "WakeFrame"
    PLACE: ClassVar = ("bound",)
    ARRAYS: ClassVar = ("corner", "strength")

    step: int
    time_ns: int
    bound: int
    corner: Single
    strength: Single

    @property
    def shape(self) -> tuple[int, int, int]:
        """Wings, and rows and columns of the rings of each."""
        wings, rows, columns = self.strength.shape
        return wings, rows, columns

    @staticmethod
    def shapes(about: Any) -> dict[str, tuple[int, ...]]:
        """Return the shape of each array of a message."""
        wings, rows, columns = about.wings, about.rows, about.columns
        return {"corner": (wings, rows + 1, columns + 1, 3), "strength": (wings, rows, columns)}

    def encode(self, run: str = "", provider: str = "", number: int = 0) -> bytes:
        """Return the message WakeFrame; without arguments, as a log holds it.

        Args:
            run: id of the run.
            provider: that shows the frame.
            number: of the provider's frames, from 1.

        Raises:
            ProtocolError: an array has another shape than the strengths ask for.
        """
        wings, rows, columns = self.shape
        message = MESSAGES["WakeFrame"](
            **_sender(run, provider, number), step=self.step, time_ns=self.time_ns,
            wings=wings, rows=rows, columns=columns, bound=self.bound,
        )  # fmt: skip
        return _with_arrays(message, self, provider)

    @classmethod
    def of(cls, message: Any, arrays: dict[str, Single]) -> WakeFrame:
        """Return the frame that a message holds."""
        return cls(message.step, message.time_ns, message.bound, **arrays)


@dataclass(frozen=True, eq=False)
class VolumeFrame:
    """The fluid in a box at one time, on cubic cells; values at the centres of the cells.

    Layers go up along z, rows along y, columns along x; two or more of each, so that velocity has a gradient.

    Attributes:
        step: index k of the communication point that the fluid is at.
        time_ns: its simulation time t_k [ns].
        origin: centre of the first cell (x, y, z) [m], in W.
        cell: side of a cell [m].
        velocity: [m/s], shape (layers, rows, columns, 3), in W.
        pressure: relative to the undisturbed fluid [Pa], shape (layers, rows, columns).
    """

    KIND: ClassVar = "volume"
    MESSAGE: ClassVar = "VolumeFrame"
    PLACE: ClassVar = ("origin", "cell")
    ARRAYS: ClassVar = ("velocity", "pressure")

    step: int
    time_ns: int
    origin: tuple[float, float, float]
    cell: float
    velocity: Single
    pressure: Single

    @property
    def shape(self) -> tuple[int, int, int]:
        """Layers, rows and columns."""
        layers, rows, columns = self.pressure.shape
        return layers, rows, columns

    @property
    def extent(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Outer corners of the box with the lowest and with the highest x, y, z [m], in W."""
        half, (x, y, z), (layers, rows, columns) = 0.5 * self.cell, self.origin, self.shape
        low = (x - half, y - half, z - half)
        return low, (low[0] + columns * self.cell, low[1] + rows * self.cell, low[2] + layers * self.cell)

    @staticmethod
    def shapes(about: Any) -> dict[str, tuple[int, ...]]:
        """Return the shape of each array of a message."""
        cells = (about.layers, about.rows, about.columns)
        return {"velocity": (*cells, 3), "pressure": cells}

    def encode(self, run: str = "", provider: str = "", number: int = 0) -> bytes:
        """Return the message VolumeFrame; without arguments, as a log holds it.

        Args:
            run: id of the run.
            provider: that shows the frame.
            number: of the provider's frames, from 1.

        Raises:
            ProtocolError: an array has another shape than the pressure.
        """
        (layers, rows, columns), (x, y, z) = self.shape, self.origin
        message = MESSAGES["VolumeFrame"](
            **_sender(run, provider, number), step=self.step, time_ns=self.time_ns,
            layers=layers, rows=rows, columns=columns, cell=self.cell, origin_x=x, origin_y=y, origin_z=z,
        )  # fmt: skip
        return _with_arrays(message, self, provider)

    @classmethod
    def of(cls, message: Any, arrays: dict[str, Single]) -> VolumeFrame:
        """Return the frame that a message holds."""
        origin = (message.origin_x, message.origin_y, message.origin_z)
        return cls(message.step, message.time_ns, origin, message.cell, **arrays)


Frame = FlowFrame | VolumeFrame | WakeFrame
KINDS: dict[str, type[FlowFrame] | type[VolumeFrame] | type[WakeFrame]] = {
    each.KIND: each for each in (FlowFrame, VolumeFrame, WakeFrame)
}
Logged = TypeVar("Logged", VolumeFrame, WakeFrame)


def decode(sent: Sent, run: str, provider: str) -> tuple[int, Frame]:
    """Return the number of a frame that was sent, and the frame.

    Args:
        sent: its kind and its message.
        run: that it must be of.
        provider: that it must come from.

    Raises:
        ProtocolError: there is no such kind, the message is not one of it, of another run or provider, or its
            sizes do not fit.
    """
    if sent.kind not in KINDS:
        raise ProtocolError(f'frame from "{provider}": expected one of {", ".join(KINDS)}; got {sent.kind}')
    what = f'frame from "{provider}": expected a {KINDS[sent.kind].MESSAGE} of this run'
    message = _parsed(sent, what)
    if (message.run, message.provider) != (run, provider):
        raise ProtocolError(f'{what}; got one of run {message.run} from "{message.provider}"')
    return message.number, _frame(sent.kind, message, what)


def logged(kind: type[Logged], payload: bytes) -> Logged:
    """Return the frame of a message without a sender, as a log holds it.

    Raises:
        ProtocolError: it is none of this kind, or its sizes do not fit.
    """
    what = f"expected a {kind.MESSAGE}"
    frame = _frame(kind.KIND, _parsed(Sent(kind.KIND, payload), what), what)
    assert isinstance(frame, kind)
    return frame


def _parsed(sent: Sent, what: str) -> Any:
    try:
        return MESSAGES[KINDS[sent.kind].MESSAGE].FromString(sent.payload)
    except DecodeError as error:
        raise ProtocolError(f"{what}; got {error}") from error


def _frame(kind: str, message: Any, what: str) -> Frame:
    shapes = KINDS[kind].shapes(message)
    frame = KINDS[kind].of(message, {name: _array(message, name, shapes[name], what) for name in shapes})
    if isinstance(frame, WakeFrame) and frame.bound > message.rows:
        raise ProtocolError(f"{what}: bound: expected at most {message.rows} rows; got {frame.bound}")
    if isinstance(frame, VolumeFrame) and not (min(frame.shape) > 1 and frame.cell > 0.0):
        raise ProtocolError(
            f"{what}: expected two or more layers, rows and columns of cells above 0 m; "
            f"got {frame.shape} of {frame.cell:g} m"
        )
    return frame


def _array(message: Any, name: str, shape: tuple[int, ...], what: str) -> Single:
    data = getattr(message, name)
    if 0 in shape:
        raise ProtocolError(f"{what}: {name}: expected sizes above 0; got {shape}")
    expected = SINGLE.itemsize * math.prod(shape)
    if len(data) != expected:
        raise ProtocolError(f"{what}: {name}: expected {expected} bytes for {shape}; got {len(data)}")
    return np.frombuffer(data, SINGLE).reshape(shape)


def _sender(run: str, provider: str, number: int) -> dict[str, Any]:
    """Return the fields that tell who sent a frame, none for one in a log."""
    return {"run": run, "provider": provider, "number": number} if number else {}


def _with_arrays(message: Any, frame: Frame, provider: str) -> bytes:
    """Return the bytes of a message, and the arrays of its frame behind them."""
    parts = [message.SerializeToString()]
    for name, shape in frame.shapes(message).items():
        array = getattr(frame, name)
        if array.shape != shape:
            raise ProtocolError(f'"{provider}": frame: {name}: expected {shape}; got {array.shape}')
        data = np.ascontiguousarray(array, SINGLE).tobytes()
        parts += [preamble(message.DESCRIPTOR.fields_by_name[name].number, len(data)), data]
    return b"".join(parts)
