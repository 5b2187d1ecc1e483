"""The methods by which a mechanism is advanced: the default, and those that it is compared with."""

from __future__ import annotations

from linkwind.errors import MechanismError
from linkwind.mechanism import Mechanism
from linkwind.native.cfe import Cfe, Stabilisation
from linkwind.native.incremental import Incremental
from linkwind.native.multibody import Multibody
from linkwind.scenario import Scenario


def check(mechanism: Mechanism, scenario: Scenario) -> None:
    """Raise MechanismError if the method of the scenario cannot do the mechanism."""
    multibody(mechanism, scenario)


def multibody(mechanism: Mechanism, scenario: Scenario) -> Multibody:
    """Return the mechanism, ready to move by the method of the scenario.

    Raises:
        MechanismError: the method cannot do this mechanism.
    """
    dynamics = scenario.dynamics
    parts = (mechanism.tables, mechanism.bodies, mechanism.closures, mechanism.events)
    if mechanism.forces and dynamics.method == "incremental":
        raise MechanismError(
            f"{scenario.source}: dynamics.method: expected reduced or cfe, because {mechanism.forces[0]} is "
            "a force element, which the paper does not have; got incremental. Use reduced."
        )
    try:
        if dynamics.method == "cfe":
            stabilisation = Stabilisation[dynamics.stabilisation.upper()]
            time = dynamics.stabilisation_time
            return Cfe(*parts, forces=mechanism.forces, stabilisation=stabilisation, time=time)
        if dynamics.method == "incremental":
            return Incremental(*parts[:3])
    except MechanismError as error:
        raise MechanismError(f"{scenario.source}: dynamics.method: {error}") from error
    return Multibody(*parts, forces=mechanism.forces)
