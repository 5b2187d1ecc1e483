"""``--force-fmu`` and ``--model``: a model of the user's own that takes the place of a force model."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from linkwind.aero import Own, PythonSource
    from linkwind.scenario import Scenario

ForceFmuOption = Annotated[
    list[str] | None,
    typer.Option(
        "--force-fmu",
        metavar="[PROVIDER=]FILE",
        help="An FMU as the force model of a provider (aero if not named); repeatable.",
    ),
]
ModelOption = Annotated[
    list[str] | None,
    typer.Option(
        "--model",
        metavar="[PROVIDER=]FILE.py:NAME",
        help="A function or class in Python as the force model of a provider (likewise); repeatable.",
    ),
]

Given = tuple[list[str] | None, list[str] | None]  # what was given with the two


def load_with(
    source: str, overrides: Sequence[str], force_fmu: Sequence[str] | None, model: Sequence[str] | None = None
) -> tuple[Scenario, dict[str, Own], list[str]]:
    """Return the scenario with the user's own models, these by provider, and the mappings of FMUs.

    Raises:
        InputError: something of it does not fit together.
    """
    from linkwind.runs.own import settled
    from linkwind.scenario import load

    scenario = load(source, overrides)
    own = by_provider(scenario, force_fmu, model)
    if own:
        scenario = load(source, [*overrides, *as_models(own)])
    scenario, tables = settled(scenario, own)
    return scenario, own, tables


def as_models(own: Mapping[str, Own]) -> list[str]:
    """Return the overrides that put the user's models in the place of others."""
    kinds = {name: "fmu" if isinstance(model, Path) else "python" for name, model in own.items()}
    return [f"providers.{name}.model={kind}" for name, kind in kinds.items()]


def by_provider(
    scenario: Scenario, force_fmu: Iterable[str] | None, model: Iterable[str] | None
) -> dict[str, Own]:
    """Return what the options give, by provider.

    Raises:
        InputError: it is not clear which provider something is for, or there is no such file.
    """
    from linkwind.errors import InputError

    found: dict[str, Own] = {}
    for name, own in _given(scenario, force_fmu or (), model or ()):
        if name in found:
            raise InputError(
                f"{own}: expected one model for {name}; got {found[name]} as well. Leave one away."
            )
        found[name] = own
    return found


def _given(
    scenario: Scenario, force_fmu: Iterable[str], model: Iterable[str]
) -> Iterator[tuple[str, Path | PythonSource]]:
    from linkwind.aero.source import python_source

    for text in force_fmu:
        name, file = _named(scenario, "--force-fmu", "fmu", text, text)
        yield name, Path(file)
    for text in model:
        name, source = _named(scenario, "--model", "python", text, text.rpartition(":")[0])
        yield name, python_source(source)


def _named(scenario: Scenario, option: str, model: str, text: str, file: str) -> tuple[str, str]:
    """Return provider and value of one option."""
    from linkwind.errors import InputError

    names = [provider.name for provider in scenario.providers]
    name, equals, value = text.partition("=")
    if equals and name in names:
        return name, value
    if equals and not Path(file).exists():
        raise InputError(
            f"{option} {text}: expected a provider of {scenario.source} before the =, "
            f"{', '.join(names) or '(there is none)'}; got {name}. Correct it."
        )
    wanting = [provider.name for provider in scenario.providers if provider.model == model]
    choices = wanting if len(wanting) == 1 else ["aero"] if "aero" in names else names
    if len(choices) == 1:
        return choices[0], text
    raise InputError(f"{option}: expected PROVIDER=FILE with one of {', '.join(names)}; got {text}.")
