"""Models of the user's own in the place of a scenario's: FMUs (``--force-fmu``), and Python (``--model``)."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from linkwind.aero import Own, PythonSource
from linkwind.errors import InputError
from linkwind.scenario import Provider, Scenario


def settled(
    scenario: Scenario, own: Mapping[str, Own], *, another: bool = False
) -> tuple[Scenario, list[str]]:
    """Return the scenario with these models, and what it says of them; and the tables of the FMUs' variables.

    Args:
        scenario: with other models, or with these already.
        own: the models, by provider.
        another: they may be others than those that the scenario says, in Python.

    Raises:
        InputError: there is no such provider, or the model is not the one of the scenario or cannot be used.
    """
    names = [provider.name for provider in scenario.providers]
    for name, model in own.items():
        if name not in names:
            known = ", ".join(names)
            raise InputError(
                f"{model}: expected a provider of {scenario.source}, {known}; got {name}. Correct it."
            )
    providers, tables = list(scenario.providers), []
    for index, provider in enumerate(providers):
        if provider.name in own:
            providers[index], table = _settled(scenario, provider, own[provider.name], another=another)
            tables += table
    return scenario.model_copy(update={"providers": tuple(providers)}), tables


def _settled(
    scenario: Scenario, provider: Provider, own: Own, *, another: bool
) -> tuple[Provider, list[str]]:
    if isinstance(own, PythonSource):
        if not another:
            own.check(scenario, provider)
        return provider.model_copy(update={"model": "python", "python": own.settings()}), []
    from linkwind.aero.fmu import settle

    provider, table = settle(own, scenario, provider)
    return provider.model_copy(update={"model": "fmu"}), [table]


def refuse_missing(scenario: Scenario, own: Mapping[str, Own], names: Collection[str]) -> None:
    """Raise InputError for a provider that needs a model of the user's own and has none, or another one.

    Args:
        scenario: all of it.
        own: the models, by provider.
        names: of the providers that take part.
    """
    for provider in scenario.providers:
        if provider.name not in names:
            continue
        model = own.get(provider.name)
        if isinstance(model, PythonSource) and provider.model == "python":
            model.check(scenario, provider)
        elif model is None and provider.model == "fmu":
            raise InputError(
                f'{scenario.source}: provider "{provider.name}": expected the file of its FMU; got none. Add '
                f"--force-fmu {provider.name}=FILE."
            )
        elif model is None and provider.model == "python":
            raise InputError(
                f'{scenario.source}: provider "{provider.name}": expected the Python of its model'
                f"{_known(provider)}; got none. Add --model {provider.name}=FILE.py:NAME."
            )


def _known(provider: Provider) -> str:
    said = provider.python
    return f", {said.source}, SHA-256 {said.sha256}" if said.source and said.sha256 else ""
