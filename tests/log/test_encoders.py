"""The quick encoders against protobuf's own serialisation."""

from __future__ import annotations

import math

import numpy as np
import pytest

from linkwind.log.state import StateEncoder, StepEncoder, TimingEncoder
from linkwind.schema import MESSAGES
from tests.log.sample import NQ, NV, N, state


@pytest.mark.parametrize("special", [0.0, -0.0, math.nan, math.inf, -math.inf])
def test_state(special):
    point = state(np.random.default_rng(3))
    point.motion.linear[1, 2] = special
    point.scalars["joint_gap"] = special
    data = StateEncoder(N, NQ, NV).encode(7, 9, point.motion, **point.arrays, **point.scalars)
    expected = MESSAGES["State"](step=7, time_ns=9, **point.scalars)
    for name in ("position", "orientation", "linear", "angular"):
        getattr(expected.motion, name)[:] = getattr(point.motion, name).ravel()
    for name, array in point.arrays.items():
        getattr(expected, name)[:] = array.ravel()
    assert data == expected.SerializeToString()


def test_state_keeps_nothing_of_the_one_before():
    points = [state(np.random.default_rng(seed)) for seed in (1, 2)]
    encoder = StateEncoder(N, NQ, NV)
    both = [encoder.encode(5, 6, p.motion, **p.arrays, **p.scalars) for p in points]
    alone = StateEncoder(N, NQ, NV).encode(5, 6, points[1].motion, **points[1].arrays, **points[1].scalars)
    assert both[1] == alone
    assert both[0] != alone


def test_step_fills_up_with_nan():
    encoder = StepEncoder(3)
    values = {"iteration": 2, "order": 1, "residual": 0.25, "interface_energy": -0.5}
    encoder.encode(1, 2, extrapolation_error=[1.0, 2.0, 3.0, 4.0], **values)
    data = encoder.encode(3, 4, extrapolation_error=[5.0, 6.0], **values)
    errors = [5.0, 6.0, math.nan, math.nan]
    expected = MESSAGES["Step"](step=3, time_ns=4, extrapolation_error=errors, **values)
    assert data == expected.SerializeToString()


def test_step_refuses_more_errors_than_degrees():
    values = {"iteration": 0, "order": 1, "residual": 0.0, "interface_energy": 0.0}
    with pytest.raises(ValueError, match="broadcast"):
        StepEncoder(1).encode(0, 0, extrapolation_error=[1.0] * 3, **values)


def test_timing():
    assert (
        TimingEncoder().encode(3, 2**40) == MESSAGES["Timing"](step=3, exchange_ns=2**40).SerializeToString()
    )
