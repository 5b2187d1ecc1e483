"""The quick encoders against protobuf's own serialisation."""

from __future__ import annotations

import math

import numpy as np
import pytest

from linkwind.log.state import StateMessage, StepEncoder, TimingEncoder
from linkwind.schema import MESSAGES
from tests.log.sample import NQ, NV, N, encoded, state


@pytest.mark.parametrize("special", [0.0, -0.0, math.nan, math.inf, -math.inf])
def test_state(special):
    point = state(np.random.default_rng(3))
    point.motion.linear[1, 2] = special
    point.scalars["joint_gap"] = special
    data = encoded(StateMessage(N, NQ, NV), 7, 9, point)
    expected = MESSAGES["State"](step=7, time_ns=9, **point.scalars)
    for name in ("position", "orientation", "linear", "angular"):
        getattr(expected.motion, name)[:] = getattr(point.motion, name).ravel()
    for name, array in point.arrays.items():
        getattr(expected, name)[:] = array.ravel()
    assert data == expected.SerializeToString()


def test_state_keeps_nothing_of_the_one_before():
    points = [state(np.random.default_rng(seed)) for seed in (1, 2)]
    message = StateMessage(N, NQ, NV)
    both = [encoded(message, 5, 6, p) for p in points]
    alone = encoded(StateMessage(N, NQ, NV), 5, 6, points[1])
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
    with pytest.raises(IndexError):
        StepEncoder(1).encode(0, 0, extrapolation_error=[1.0] * 3, **values)


def test_timing():
    assert (
        TimingEncoder().encode(3, 2**40) == MESSAGES["Timing"](step=3, exchange_ns=2**40).SerializeToString()
    )
