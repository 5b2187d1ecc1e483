"""``--force-fmu``: the file of an FMU that takes the place of a force model."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from linkwind.scenario import Scenario

ForceFmuOption = Annotated[
    list[str] | None,
    typer.Option(
        "--force-fmu",
        metavar="[PROVIDER=]FILE",
        help="An FMU as the force model of a provider (aero if not named); repeatable.",
    ),
]


def load_with(
    source: str, overrides: Sequence[str], given: Sequence[str]
) -> tuple[Scenario, dict[str, Path], list[str]]:
    """Return the scenario with FMUs in the place of models, their files by provider, and their mappings.

    Raises:
        InputError: something of it does not fit together.
    """
    from linkwind.scenario import load

    files = files_by_provider(load(source, overrides), given)
    return settled(load(source, [*overrides, *as_models(files)]), files)


def as_models(files: Mapping[str, Path]) -> list[str]:
    """Return the overrides that put FMUs in the place of models."""
    return [f"providers.{name}.model=fmu" for name in files]


def settled(scenario: Scenario, files: dict[str, Path]) -> tuple[Scenario, dict[str, Path], list[str]]:
    """Return the scenario with what the FMUs say of themselves, their files by provider, their mappings."""
    from linkwind.aero.fmu import settle

    providers, tables = list(scenario.providers), []
    for index, provider in enumerate(providers):
        if provider.name in files:
            providers[index], table = settle(files[provider.name], scenario, provider)
            tables.append(table)
    return scenario.model_copy(update={"providers": tuple(providers)}), files, tables


def files_by_provider(scenario: Scenario, given: Sequence[str]) -> dict[str, Path]:
    """Return the files of the options by provider.

    Raises:
        InputError: it is not clear which provider a file is for.
    """
    return dict(_named(scenario, text) for text in given)


def _named(scenario: Scenario, text: str) -> tuple[str, Path]:
    """Return provider and file of one option."""
    from linkwind.errors import InputError

    names = [provider.name for provider in scenario.providers]
    name, equals, file = text.partition("=")
    if equals and name in names:
        return name, Path(file)
    if equals and not Path(text).exists():
        raise InputError(
            f"--force-fmu {text}: expected a provider of {scenario.source} before the =, "
            f"{', '.join(names) or '(there is none)'}; got {name}. Correct it."
        )
    wanting = [provider.name for provider in scenario.providers if provider.model == "fmu"]
    choices = wanting if len(wanting) == 1 else ["aero"] if "aero" in names else names
    if len(choices) == 1:
        return choices[0], Path(text)
    raise InputError(f"--force-fmu: expected PROVIDER=FILE with one of {', '.join(names)}; got {text}.")


def refuse_missing(
    scenario: Scenario, files: Mapping[str, Path], names: Collection[str] | None = None
) -> None:
    """Raise InputError for a provider that needs a file and has none: any, or one of ``names``."""
    from linkwind.errors import InputError

    for provider in scenario.providers:
        wanted = names is None or provider.name in names
        if wanted and provider.model == "fmu" and provider.name not in files:
            raise InputError(
                f'{scenario.source}: provider "{provider.name}": expected the file of its FMU; got '
                f"none. Add --force-fmu {provider.name}=FILE."
            )
