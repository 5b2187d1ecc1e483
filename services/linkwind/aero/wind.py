"""The wind of a scenario: a uniform stream and travelling gusts."""

from __future__ import annotations

import math

import numpy as np

from linkwind.native.wind import GUST_SHAPES, WindTable
from linkwind.scenario import Environment


def wind_table(environment: Environment) -> WindTable:
    """Return the wind as a table for the native library: SI units, phases in radians.

    wind(t, r) = U0 + Σ amplitude · shape(2π(frequency · t + wavenumber · r) + phase)
    """
    gusts = [
        (
            *gust.amplitude,
            gust.frequency,
            *gust.wavenumber,
            math.radians(gust.phase_deg),
            GUST_SHAPES[gust.shape],
        )
        for gust in environment.gusts
    ]
    return WindTable(np.array(environment.wind), np.array(gusts, dtype=np.float64).reshape(-1, 9))
