"""Force models: what the fluid does to the bodies.

>>> model = build(scenario, scenario.providers[0])
>>> model.commit(0.0, accepted)
>>> model.evaluate(0.001, trial, wrench)  # fills the wrench in place
"""

from __future__ import annotations

from collections.abc import Callable

from linkwind.aero.base import Capabilities, ForceModel
from linkwind.aero.field import ForceField
from linkwind.aero.none import Vacuum
from linkwind.aero.plate import Plate
from linkwind.scenario import Provider, Scenario

__all__ = ["MODELS", "Capabilities", "ForceModel", "build"]

MODELS: dict[str, Callable[[Scenario, Provider], ForceModel]] = {
    "none": Vacuum,
    "field": ForceField,
    "plate": Plate,
}


def build(scenario: Scenario, provider: Provider) -> ForceModel:
    """Return the force model of a provider.

    Raises:
        InputError: the scenario does not give what the model needs.
    """
    return MODELS[provider.model](scenario, provider)
