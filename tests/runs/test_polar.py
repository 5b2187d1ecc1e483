"""The body-fitted flow around an oscillating cylinder against Stokes' exact one, without convection."""

import numpy as np
import pytest

from linkwind.runs.validate import polar
from linkwind.runs.validate.plate import stokes_force
from linkwind.runs.validate.signals import fit


def test_small_oscillations_have_the_force_of_stokes():
    period, viscosity = 0.02, 2.0  # path of the cylinder: 0.003 diameters each way
    phase, force = polar.oscillating(viscosity, period, 1)
    rate, turn = 2.0 * np.pi / period, 2.0 * np.pi * phase
    mass, damping = fit(force, -0.25 * np.pi * rate * np.sin(turn), 0.25 * np.pi * rate * np.cos(turn))
    exact = stokes_force(0.5 * np.sqrt(rate / viscosity))
    assert exact[1] > 0.3 * exact[0]
    assert (mass, damping) == pytest.approx(exact, rel=0.02)
    assert force[0] == pytest.approx(force[-1], rel=0.05)  # a period on
