"""What the numbers of a logged State are called that belong to no body."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from linkwind.mechanism import Mechanism


def labels(mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """Return the names of numbers of State by field: ``hinge.q``, ``wrist.v.2``, ``flap.force_effort``."""
    tables, joints = mechanism.tables, mechanism.joints
    per_force = {
        field: tuple(f"{name}.{field}" for name in mechanism.forces)
        for field in ("force_effort", "force_power")
    }
    return {
        "q": tuple(_coordinates("q", joints, tables.q_index, len(mechanism.q0))),
        "v": tuple(_coordinates("v", joints, tables.v_index, len(mechanism.v0))),
        "event_time": tuple(f"{name}.event_time" for name in mechanism.events),
        **per_force,
    }


def _coordinates(field: str, joints: Sequence[str], starts: NDArray[np.int32], size: int) -> Iterator[str]:
    """Yield a name for each coordinate, joint after joint as they lie in the state."""
    order = np.argsort(starts, kind="stable")
    ends = [*starts[order][1:].tolist(), size]
    for joint, end in zip(order.tolist(), ends, strict=True):
        width = end - int(starts[joint])
        for place in range(width):
            yield f"{joints[joint]}.{field}" if width == 1 else f"{joints[joint]}.{field}.{place}"
