"""Force models: what the fluid does to the bodies.

>>> model = build(scenario, scenario.providers[0])
>>> model.commit(0.0, accepted)
>>> model.evaluate(0.001, trial, wrench)  # fills the wrench in place

``MODELS`` need nothing but the scenario; the model ``fmu`` needs a file as well.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

from linkwind.aero.base import Capabilities, ForceModel, item
from linkwind.aero.doubts import doubts
from linkwind.aero.field import ForceField
from linkwind.aero.flow import Flow
from linkwind.aero.none import Vacuum
from linkwind.aero.plate import Plate
from linkwind.errors import InputError
from linkwind.scenario import Provider, Scenario

__all__ = ["FROM_FILE", "MODELS", "Capabilities", "ForceModel", "build", "check"]

MODELS: dict[str, Callable[[Scenario, Provider], ForceModel]] = {
    "none": Vacuum,
    "field": ForceField,
    "plate": Plate,
    "flow": Flow,
}

_log = logging.getLogger("linkwind")

FROM_FILE = ("fmu",)  # models that are made from a file


def build(scenario: Scenario, provider: Provider, file: Path | None = None) -> ForceModel:
    """Return the force model of a provider.

    Args:
        scenario: all of it.
        provider: the one to make the model of.
        file: of a model from a file (``--force-fmu``).

    Raises:
        InputError: the scenario does not give what the model needs, or the file is wrong.
        SimulationError: an FMU cannot be started.
    """
    if provider.model in FROM_FILE:
        from linkwind.aero.fmu import ForceFmu

        return ForceFmu(scenario, provider, file)
    if file is not None:
        raise InputError(
            f'{item(scenario, provider, "model")}: expected "fmu" for {file}; got "{provider.model}". Start '
            f"the dynamics with --set providers.{provider.name}.model=fmu."
        )
    return MODELS[provider.model](scenario, provider)


def check(scenario: Scenario) -> None:
    """Find what is wrong with the settings of a model before anything is started, and log what may be.

    Raises:
        InputError: the scenario does not give what a model needs.
    """
    for provider in scenario.providers:
        if provider.model not in FROM_FILE:
            build(scenario, provider)
    for doubt in doubts(scenario):
        _log.warning("note: %s", doubt)
