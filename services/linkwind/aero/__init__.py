"""Force models: what the fluid does to the bodies.

>>> model = build(scenario, scenario.providers[0])
>>> model.commit(0.0, accepted)
>>> model.evaluate(0.001, trial, wrench)  # fills the wrench in place

``MODELS`` need nothing but the scenario; the models ``fmu`` and ``python`` are the user's own.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from linkwind.aero.base import Capabilities, ForceModel, item
from linkwind.aero.doubts import doubts, doubts_after
from linkwind.aero.field import ForceField
from linkwind.aero.flow import Flow
from linkwind.aero.none import Vacuum
from linkwind.aero.plate import Plate
from linkwind.aero.python import PythonForces
from linkwind.aero.seldom import Seldom
from linkwind.aero.source import PythonSource, python_source
from linkwind.aero.vortex import Vortex
from linkwind.errors import InputError
from linkwind.scenario import Provider, Scenario
from linkwind.wind import Wind

__all__ = ["MODELS", "OWN", "Capabilities", "ForceModel", "Own", "PythonSource", "build", "check", "own"]

MODELS: dict[str, Callable[[Scenario, Provider], ForceModel]] = {
    "none": Vacuum,
    "field": ForceField,
    "plate": Plate,
    "flow": Flow,
    "vortex": Vortex,
}

OWN = ("fmu", "python")  # models that are made from what the user has beside the scenario
Own = Path | PythonSource  # it: an FMU, or Python

_log = logging.getLogger("linkwind")


def own(model: object) -> Own:
    """Return a model of the user's own.

    Args:
        model: ``"FILE.fmu"``, ``"FILE.py:NAME"``, or a function or class of this process (see
            :func:`linkwind.aero.source.python_source`).

    Raises:
        InputError: it is none.
    """
    if isinstance(model, str | Path):
        return Path(model) if str(model).endswith(".fmu") else python_source(str(model))
    return python_source(model)


def build(scenario: Scenario, provider: Provider, own: Own | None = None) -> ForceModel:
    """Return the force model of a provider, which answers at every communication point.

    Args:
        scenario: all of it.
        provider: the one to make the model of.
        own: the model itself if it is the user's own (``--force-fmu``, ``--model``).

    Raises:
        InputError: the scenario does not give what the model needs, or the user's model is wrong.
        SimulationError: an FMU cannot be started.
    """
    if provider.every == 1:
        return _build(scenario, provider, own)
    return Seldom(scenario, provider, partial(_build, own=own))


def _build(scenario: Scenario, provider: Provider, own: Own | None) -> ForceModel:
    """Return the force model itself."""
    if provider.model == "fmu" and not isinstance(own, PythonSource):
        from linkwind.aero.fmu import ForceFmu

        return ForceFmu(scenario, provider, own)
    if provider.model == "python" and not isinstance(own, Path):
        return PythonForces(scenario, provider, own)
    if own is not None:
        wanted = "fmu" if isinstance(own, Path) else "python"
        raise InputError(
            f'{item(scenario, provider, "model")}: expected "{wanted}" for {own}; got "{provider.model}". '
            f"Start the dynamics with --set providers.{provider.name}.model={wanted}."
        )
    return MODELS[provider.model](scenario, provider)


def check(scenario: Scenario) -> None:
    """Find what is wrong with the settings of a model before anything is started, and log what may be.

    Raises:
        InputError: the scenario does not give what a model needs, or its wind is wrong.
    """
    Wind(scenario)
    for provider in scenario.providers:
        if provider.model not in OWN:
            build(scenario, provider)
    for doubt in doubts(scenario):
        _log.warning("note: %s", doubt)


def check_after(scenario: Scenario, reported_max: Mapping[str, Mapping[str, float]]) -> None:
    """Log what may be wrong with the forces of a run that is over; see :func:`doubts_after`."""
    for doubt in doubts_after(scenario, reported_max):
        _log.warning("note: %s", doubt)
