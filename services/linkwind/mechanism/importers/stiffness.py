"""Joints whose springs or dampers act much faster than a communication step."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from linkwind.mechanism import Mechanism
from linkwind.native.multibody import Multibody
from linkwind.spatial import Array

SUBSTEPS = 100  # in a communication step that are too many
STABLE = 3.3  # rate times substep up to which dopri5 is stable
NUDGE = 1e-6  # rad/s, m/s, rad or m


def stiff_joints(mechanism: Mechanism, core: Multibody, step: float) -> Iterator[str]:
    """Yield the joints that need very many substeps, each with the time in which it relaxes at the start.

    Args:
        mechanism: as it starts.
        core: made of its tables.
        step: communication step [s].
    """
    tables = mechanism.tables
    rest = _accelerations(core, mechanism.q0, mechanism.v0)
    ends = [*tables.v_index[1:].tolist(), core.nv]
    for i, name in enumerate(mechanism.joints):
        first, rate = int(tables.v_index[i]), 0.0
        for k in range(first, ends[i]):
            if tables.damping[k] > 0.0:
                moved = _accelerations(core, mechanism.q0, _nudged(mechanism.v0, k))
                rate = max(rate, abs(moved[k] - rest[k]) / NUDGE)
        if ends[i] == first + 1 and tables.stiffness[first] > 0.0:
            turned = _accelerations(core, _nudged(mechanism.q0, int(tables.q_index[i])), mechanism.v0)
            rate = max(rate, math.sqrt(abs(turned[first] - rest[first]) / NUDGE))
        if rate * step > SUBSTEPS * STABLE:
            yield f"{name} (relaxes in {1.0 / rate:.1g} s)"


def _accelerations(core: Multibody, q: Array, v: Array) -> Array:
    return core.evaluate(core.initial_state(q, v), np.zeros((core.n, 6))).joint_acceleration


def _nudged(values: Array, index: int) -> Array:
    moved = values.copy()
    moved[index] += NUDGE
    return moved
