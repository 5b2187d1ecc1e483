"""Messages of one topic as arrays, one row a message.

The rows of a topic have one byte layout (``linkwind.wire``), so that they are stacked as bytes and every
field is a block of columns; a row in another encoding goes through the protobuf parser first.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from google.protobuf.message import DecodeError
from numpy.typing import NDArray

from linkwind.errors import LogError
from linkwind.schema import MESSAGES
from linkwind.spatial import Array
from linkwind.wire import FixedLayout

Index = NDArray[np.uint64]


class Trajectory(NamedTuple):
    """The accepted trajectory at k communication points, of n bodies in scenario order.

    Attributes:
        step: index of the communication point, shape (k,).
        t: simulation time [s], shape (k,).
        position: centres of mass [m], shape (k, n, 3), in W.
        orientation: unit quaternions (w, x, y, z), body to world, shape (k, n, 4).
        linear: velocities of the centres of mass [m/s], shape (k, n, 3), in W.
        angular: angular velocities [rad/s], shape (k, n, 3), in W.
        q: joint coordinates, shape (k, nq).
        v: joint velocities, shape (k, nv).
        acceleration: of the bodies [m/s², rad/s²], shape (k, n, 6), linear first, in W.
        reaction: of the joint of each body, parent on child [N, N·m], shape (k, n, 6), force first, in W
            at the joint's point on the child.
        wrench: total on each body, with the part of A [N, N·m], shape (k, n, 6), force first, in W.
        kinetic_energy: [J], shape (k,).
        potential_energy: of gravity and springs [J], shape (k,).
        external_work: done by the fluid and by force elements without a potential since t_0 [J], shape (k,).
        dissipated_work: taken by joint dampers since t_0 [J], shape (k,).
        joint_gap: largest distance of two joint points, from the poses [m], shape (k,).
        closure_reaction: of each of c joints that close loops, parent on child [N, N·m], shape (k, c, 6),
            force first, in W at the joint's point on the child.
        event_time: when each of e events had happened [s], -1 for not yet, shape (k, e).
        force_effort: tension, force or torque of f force elements [N or N·m], shape (k, f).
        force_power: that they give to the bodies [W], shape (k, f).
    """

    step: Index
    t: Array
    position: Array
    orientation: Array
    linear: Array
    angular: Array
    q: Array
    v: Array
    acceleration: Array
    reaction: Array
    wrench: Array
    kinetic_energy: Array
    potential_energy: Array
    external_work: Array
    dissipated_work: Array
    joint_gap: Array
    closure_reaction: Array
    event_time: Array
    force_effort: Array
    force_power: Array


class Steps(NamedTuple):
    """What the coupling did in k exchanges.

    Attributes:
        step: index of the communication point, shape (k,).
        t: simulation time [s], shape (k,).
        iteration: coupling iteration, from 0, shape (k,).
        order: degree of the extrapolation that gave the trial state, shape (k,).
        extrapolation_error: E_0 … E_p by degree, NaN where there is no estimate, shape (k, p + 1).
        residual: trial against accepted twist, weighted by mass [J^½], shape (k,).
        interface_energy: step size times the power of the wrench on that difference [J], shape (k,).
    """

    step: Index
    t: Array
    iteration: NDArray[np.uint32]
    order: NDArray[np.uint32]
    extrapolation_error: Array
    residual: Array
    interface_energy: Array


class Timing(NamedTuple):
    """Wall-clock times of k exchanges.

    Attributes:
        step: index of the communication point, shape (k,).
        exchange_ns: from putting the motion to having every wrench [ns], shape (k,).
    """

    step: Index
    exchange_ns: Index


def columns(payloads: Sequence[bytes], name: str, where: str) -> dict[str, NDArray[Any]]:
    """Return the values of every field, by dotted name, shape (messages, values in the field).

    Args:
        payloads: messages of one topic.
        name: of the message type.
        where: file and topic, for the error.

    Raises:
        LogError: there is no message, one is not of this type, or sizes differ.
    """
    if not payloads:
        raise LogError(f"{where}: expected at least one {name}; got none. The run ended before its first.")
    try:
        layout = FixedLayout(MESSAGES[name].FromString(payloads[0]))
        rows = [data if layout.load(data) else _converted(layout, name, data) for data in payloads]
    except (DecodeError, ValueError) as error:
        raise LogError(
            f"{where}: expected messages {name} of one size; got {error}. "
            "Read the messages one by one, with Log.decoded."
        ) from error
    block = np.frombuffer(b"".join(rows), np.uint8).reshape(len(rows), layout.size)
    found: dict[str, NDArray[Any]] = {
        field: np.ascontiguousarray(block[:, region.offset : region.end]).view(region.dtype)
        for field, region in layout.regions.items()
    }
    empty = {field: view for field, view in layout.views.items() if field not in found}
    return found | {field: np.empty((len(rows), 0), view.dtype) for field, view in empty.items()}


def _converted(layout: FixedLayout, name: str, data: bytes) -> bytes:
    layout.fill(MESSAGES[name].FromString(data))
    return layout.payload()


def trajectory(state: dict[str, NDArray[Any]]) -> Trajectory:
    """Return the columns of State messages in their shapes."""

    def bodies(field: str, width: int) -> Array:
        values = state[field]
        return values.reshape(len(values), -1, width)

    scalars = ("kinetic_energy", "potential_energy", "external_work", "dissipated_work", "joint_gap")
    return Trajectory(
        step=state["step"][:, 0],
        t=seconds(state["time_ns"][:, 0]),
        position=bodies("motion.position", 3),
        orientation=bodies("motion.orientation", 4),
        linear=bodies("motion.linear", 3),
        angular=bodies("motion.angular", 3),
        q=state["q"],
        v=state["v"],
        acceleration=bodies("acceleration", 6),
        reaction=bodies("reaction", 6),
        wrench=bodies("wrench", 6),
        **{field: state[field][:, 0] for field in scalars},
        closure_reaction=_sixes(state["closure_reaction"]),
        event_time=state["event_time"],
        force_effort=state["force_effort"],
        force_power=state["force_power"],
    )


def _sixes(values: Array) -> Array:
    return values.reshape(len(values), values.shape[1] // 6, 6)


def steps(step: dict[str, NDArray[Any]]) -> Steps:
    """Return the columns of Step messages in their shapes."""
    return Steps(
        step["step"][:, 0],
        seconds(step["time_ns"][:, 0]),
        step["iteration"][:, 0],
        step["order"][:, 0],
        step["extrapolation_error"],
        step["residual"][:, 0],
        step["interface_energy"][:, 0],
    )


def timing(message: dict[str, NDArray[Any]]) -> Timing:
    """Return the columns of Timing messages in their shapes."""
    return Timing(message["step"][:, 0], message["exchange_ns"][:, 0])


def seconds(time_ns: Index) -> Array:
    """Return simulation times in seconds, each the float64 that is nearest to the exact value."""
    return time_ns / 1e9
