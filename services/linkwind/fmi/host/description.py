"""Reading the model description of an FMU."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree

from linkwind.errors import InputError
from linkwind.fmi.host.archive import DESCRIPTION, Archive, sha256
from linkwind.fmi.host.facts import Abilities, Description, Interface, Unit, Variable


def read(path: Path, structural: Mapping[str, int] | None = None) -> Description:
    """Read the description of an FMU.

    Args:
        path: the file.
        structural: values of structural parameters, by name, which the sizes of arrays follow.

    Raises:
        InputError: the file is no FMU, damaged, or of a kind that cannot be used.
    """
    archive = Archive(path)
    try:
        text = archive.description()
    finally:
        archive.close()
    parsed, remarks = _parse(path, text)
    _add_derivatives(parsed, text)
    try:
        return _description(path, parsed, structural or {}, remarks)
    except (AttributeError, KeyError, TypeError, ValueError) as error:  # something is missing or no number
        raise _damaged(path, error) from None


def _description(
    path: Path, parsed: Any, structural: Mapping[str, int], remarks: tuple[str, ...]
) -> Description:
    version = _version(path, parsed)
    units = {unit.name: _unit(unit) for unit in parsed.unitDefinitions}
    sizes = _structural(path, parsed, structural)
    experiment = parsed.defaultExperiment
    return Description(
        path=path,
        sha256=sha256(path),
        version=version,
        name=str(parsed.modelName),
        token=str(parsed.guid),
        tool=str(parsed.generationTool or "unknown tool"),
        interfaces=_interfaces(path, parsed),
        variables=tuple(_variable(variable, units, sizes) for variable in parsed.modelVariables),
        default_step=float(experiment.stepSize or 0.0) if experiment else 0.0,
        log_categories=tuple(category.name for category in parsed.logCategories),
        states=parsed.numberOfContinuousStates,
        indicators=parsed.numberOfEventIndicators,
        remarks=remarks,
    )


def _parse(path: Path, text: bytes) -> tuple[Any, tuple[str, ...]]:
    from fmpy.model_description import ValidationError, read_model_description

    with TemporaryDirectory(prefix="linkwind-fmu-") as folder:
        file = Path(folder, DESCRIPTION)
        file.write_bytes(text)
        try:
            return read_model_description(str(file)), ()
        except ValidationError as error:
            remarks = tuple(str(problem) for problem in error.problems)
        except Exception as error:  # FMPy raises what it comes across
            raise _damaged(path, error) from None
        try:
            return read_model_description(str(file), validate=False), remarks
        except Exception:
            raise _damaged(path, remarks[0] if remarks else "nothing") from None


def _add_derivatives(parsed: Any, text: bytes) -> None:
    """Read the one ability that FMPy does not know under its name in FMI 3."""
    root = ElementTree.fromstring(text)
    for kind, interface in (("CoSimulation", parsed.coSimulation), ("ModelExchange", parsed.modelExchange)):
        element = root.find(kind)
        if interface and element is not None:
            said = element.get("providesDirectionalDerivatives")
            interface.providesDirectionalDerivative |= said in ("true", "1")


def _damaged(path: Path, problem: object) -> InputError:
    text = " ".join(
        f"{type(problem).__name__}: {problem}".split() if isinstance(problem, Exception) else [str(problem)]
    )
    return InputError(
        f"{path}: {DESCRIPTION}: expected a description of FMI 2.0 or 3.0; got: {text}. "
        "Ask its author for a valid FMU."
    )


def _version(path: Path, parsed: Any) -> int:
    if str(parsed.fmiVersion).startswith(("2.", "3.")):
        return int(str(parsed.fmiVersion)[0])
    raise InputError(
        f"{path}: fmiVersion: expected 2.0 or 3.0; got {parsed.fmiVersion}. Export it as FMI 2.0 or 3.0."
    )


def _interfaces(path: Path, parsed: Any) -> dict[Interface, Abilities]:
    found: dict[Interface, Abilities] = {}
    cs, me = parsed.coSimulation, parsed.modelExchange
    if cs:
        found["cs"] = Abilities(
            **_common(cs),
            variable_step=bool(cs.canHandleVariableCommunicationStepSize),
            fixed_step=float(cs.fixedInternalStepSize or 0.0),
            event_mode=bool(cs.hasEventMode),
        )
    if me:
        found["me"] = Abilities(**_common(me), completed_step_needed=bool(me.needsCompletedIntegratorStep))
    if not found:
        raise InputError(
            f"{path}: expected Co-Simulation or Model Exchange; got Scheduled Execution alone, "
            "whose clocks a force model has no use for. Export it for Co-Simulation."
        )
    return found


def _common(interface: Any) -> dict[str, Any]:
    return {
        "identifier": str(interface.modelIdentifier or ""),
        "once_per_process": bool(interface.canBeInstantiatedOnlyOncePerProcess),
        "get_set_state": bool(interface.canGetAndSetFMUstate),
        "derivatives": bool(interface.providesDirectionalDerivative),
        "serialise_state": bool(interface.canGetAndSetFMUstate and interface.canSerializeFMUstate),
    }


def _unit(unit: Any) -> Unit:
    base = unit.baseUnit
    if base is None:
        return Unit(unit.name)
    other = abs(base.A) + abs(base.K) + abs(base.mol) + abs(base.cd)
    return Unit(unit.name, base.factor, base.offset, (base.kg, base.m, base.s, other))


def _structural(path: Path, parsed: Any, given: Mapping[str, int]) -> dict[int, int]:
    """Return the values of structural parameters that are numbers, by value reference; those given first."""
    known = {v.name: v for v in parsed.modelVariables if v.causality == "structuralParameter"}
    for name in given:
        if name not in known:
            names = ", ".join(known) or "none (it has none)"
            raise InputError(f'{path}: fmu.structural: expected one of {names}; got "{name}".')
    numbers = {name: v for name, v in known.items() if v.type != "Boolean"}
    return {v.valueReference: int(given.get(name, v.start or 0)) for name, v in numbers.items()}


def _variable(variable: Any, units: Mapping[str, Unit], sizes: Mapping[int, int]) -> Variable:
    declared = variable.declaredType
    unit = variable.unit or (declared.unit if declared else None)
    shape = tuple(
        d.start if d.start is not None else sizes.get(d.valueReference, int(d.variable.start))
        for d in variable.dimensions
    )
    return Variable(
        name=variable.name,
        reference=variable.valueReference,
        type=variable.type,
        causality=variable.causality,
        variability=variable.variability,
        shape=shape,
        start=variable.start,
        unit=units.get(unit, Unit(unit)) if unit else None,
    )
