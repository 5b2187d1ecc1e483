"""The methods by which a mechanism is advanced: the default, and those that it is compared with."""

from __future__ import annotations

import numpy as np

from linkwind.errors import MechanismError, SimulationError
from linkwind.mechanism import Mechanism
from linkwind.native.cfe import Cfe, Stabilisation
from linkwind.native.incremental import Incremental
from linkwind.native.multibody import Multibody
from linkwind.scenario import Scenario
from linkwind.scenario.providers import ADDING_INERTIA


def check(mechanism: Mechanism, scenario: Scenario) -> None:
    """Raise MechanismError if the method of the scenario cannot do the mechanism, or nothing can move it.

    Where providers add inertia, what can be moved shows only in the run.
    """
    made = multibody(mechanism, scenario)
    if any(provider.model in ADDING_INERTIA for provider in scenario.providers):
        return
    try:
        made.evaluate(made.initial_state(mechanism.q0, mechanism.v0), np.zeros((made.n, 6)))
    except SimulationError as error:
        raise MechanismError(f"{scenario.source}: at the start: {error}") from error


def multibody(mechanism: Mechanism, scenario: Scenario) -> Multibody:
    """Return the mechanism, ready to move by the method of the scenario.

    Raises:
        MechanismError: the method cannot do this mechanism.
    """
    dynamics = scenario.dynamics
    names = mechanism.bodies, mechanism.closures, mechanism.events, mechanism.forces
    try:
        if dynamics.method == "cfe":
            stabilisation = Stabilisation[dynamics.stabilisation.upper()]
            time = dynamics.stabilisation_time
            return Cfe(mechanism.tables, *names, stabilisation=stabilisation, time=time)
        if dynamics.method == "incremental":
            return Incremental(mechanism.tables, *names)
    except MechanismError as error:
        raise MechanismError(f"{scenario.source}: dynamics.method: {error}") from error
    return Multibody(mechanism.tables, *names)
