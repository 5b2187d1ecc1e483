"""``modelDescription.xml`` of FMI 2.0 and 3.0.

The standards: https://fmi-standard.org/docs/2.0.4 and https://fmi-standard.org/docs/3.0.2. FMI 2 refers to
variables by their index, which counts from 1; FMI 3 by value references.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from typing import Literal

from linkwind import __version__
from linkwind.fmi.part import Part
from linkwind.fmi.units import COUNT, SWITCH, Quantity, Unit
from linkwind.fmi.variables import Dependence, Variable

FmiVersion = Literal["2", "3"]

LOG_CATEGORIES = {
    "logStatusWarning": "Calls that return Warning",
    "logStatusDiscard": "Calls that return Discard: a step that cannot be done",
    "logStatusError": "Calls that return Error: wrong use, values that make no sense",
}
TYPES_2 = {"Float64": "Real", "Int32": "Integer", "Boolean": "Boolean"}  # names of types in FMI 2
# A list of dependencies that is longer is left out, which means "on everything": quadratic in the bodies.
INDICATOR = "EVENT_INDICATOR"
LONGEST_LIST = 500


def model_description(part: Part, version: FmiVersion, token: str, sources: Sequence[str]) -> bytes:
    """Return the model description.

    Args:
        part: what is exported; its variables are scalars for FMI 2.
        version: of FMI.
        token: GUID, or instantiation token.
        sources: C files to compile, relative to ``sources/``; FMI 3 lists them elsewhere.
    """
    root = ET.Element("fmiModelDescription", _about(part, version, token))
    _interfaces(root, part, version, sources)
    quantities = {variable.quantity for variable in part.variables}
    _units(root, quantities)
    _types(root, quantities, version)
    categories = ET.SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        ET.SubElement(categories, "Category", name=name, description=text)
    ET.SubElement(
        root,
        "DefaultExperiment",
        startTime="0",
        stopTime=repr(part.scenario.time.end),
        tolerance="1e-6",
        stepSize=repr(part.step),
    )
    variables = ET.SubElement(root, "ModelVariables")
    index = {variable.name: at for at, variable in enumerate(part.variables)}
    for at, variable in enumerate(part.variables):
        (_scalar_variable if version == "2" else _variable)(variables, at, variable, index)
    (_structure_2 if version == "2" else _structure_3)(root, part.variables, index)
    return to_bytes(root)


def to_bytes(root: ET.Element) -> bytes:
    """Return the document, indented."""
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"


def _about(part: Part, version: FmiVersion, token: str) -> dict[str, str]:
    own = {"2": ("2.0", "guid"), "3": ("3.0", "instantiationToken")}[version]
    return {
        "fmiVersion": own[0],
        "modelName": part.identifier,
        own[1]: token,
        "description": part.description,
        "generationTool": f"linkwind {__version__}",
        "variableNamingConvention": "structured",
    } | _event_indicators(part, version)


def _event_indicators(part: Part, version: FmiVersion) -> dict[str, str]:
    """Return their number, which FMI 2 wants; FMI 3 has them as variables."""
    count = len(part.mechanism.events) if part.provider is None else 0
    return {"numberOfEventIndicators": str(count)} if version == "2" else {}


def _interfaces(root: ET.Element, part: Part, version: FmiVersion, sources: Sequence[str]) -> None:
    """Write what the C layers can do; a force model has neither states nor use for derivatives of inputs."""
    write = _interfaces_2 if version == "2" else _interfaces_3
    mechanism = part.provider is None
    # A field unwraps headings from step to step; loops that have drifted open are closed between steps.
    headings = part.provider is not None and part.provider.model == "field"
    needed = headings or (mechanism and bool(part.mechanism.closures))
    write(root, part.identifier, mechanism, needed, sources)


def _interfaces_2(
    root: ET.Element, identifier: str, mechanism: bool, needed: bool, sources: Sequence[str]
) -> None:
    shared = {
        "modelIdentifier": identifier,
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
        "providesDirectionalDerivative": "true",
    }
    exchange = {"completedIntegratorStepNotNeeded": _boolean(not needed)}
    step = {"canHandleVariableCommunicationStepSize": "true", "canInterpolateInputs": _boolean(mechanism)}
    step |= {"maxOutputDerivativeOrder": "1"} if mechanism else {}
    for name, own in (("ModelExchange", exchange), ("CoSimulation", step)):
        files = ET.SubElement(ET.SubElement(root, name, shared | own), "SourceFiles")
        for source in sources:
            ET.SubElement(files, "File", name=source)


def _interfaces_3(
    root: ET.Element, identifier: str, mechanism: bool, needed: bool, sources: Sequence[str]
) -> None:
    """Sources are listed in ``buildDescription.xml``."""
    shared = {
        "modelIdentifier": identifier,
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
        "providesDirectionalDerivatives": "true",
        "providesAdjointDerivatives": "true",
    }
    ET.SubElement(root, "ModelExchange", shared | {"needsCompletedIntegratorStep": _boolean(needed)})
    step = {
        "canHandleVariableCommunicationStepSize": "true",
        "providesIntermediateUpdate": "true",
        "canReturnEarlyAfterIntermediateUpdate": "true",
    }
    step |= {"maxOutputDerivativeOrder": "1"} if mechanism else {}
    ET.SubElement(root, "CoSimulation", shared | step)


def _boolean(value: bool) -> str:
    return "true" if value else "false"


def _units(root: ET.Element, quantities: Iterable[Quantity]) -> None:
    """Write each unit with what it is in base units, and how to show it."""
    units: dict[str, Unit] = {q.unit.name: q.unit for q in quantities if q.unit}
    definitions = ET.SubElement(root, "UnitDefinitions")
    for name in sorted(units):
        unit = ET.SubElement(definitions, "Unit", name=name)
        ET.SubElement(unit, "BaseUnit", {base: str(power) for base, power in units[name].exponents})
        if units[name].display:
            ET.SubElement(unit, "DisplayUnit", name=units[name].display, factor=repr(units[name].factor))


def _types(root: ET.Element, quantities: Iterable[Quantity], version: FmiVersion) -> None:
    definitions = ET.SubElement(root, "TypeDefinitions")
    for quantity in sorted(quantities, key=lambda entry: entry.name):
        if quantity in (COUNT, SWITCH):  # of integers and Booleans, which have no type of their own
            continue
        about = {"quantity": quantity.name}
        if quantity.unit:
            about["unit"] = quantity.unit.name
            if quantity.unit.display:
                about["displayUnit"] = quantity.unit.display
        if version == "2":
            simple = ET.SubElement(definitions, "SimpleType", name=quantity.name)
            ET.SubElement(simple, "Real", about)
        else:
            ET.SubElement(definitions, "Float64Type", {"name": quantity.name} | about)


def _attributes(at: int, variable: Variable) -> dict[str, str]:
    found = {
        "name": variable.name,
        "valueReference": str(at),
        "description": variable.description,
        "causality": variable.causality,
        "variability": variable.variability,
    }
    return found | ({"initial": variable.initial} if variable.initial else {})


def _typed(variable: Variable) -> dict[str, str]:
    """Return type, limits and start."""
    if variable.limits:
        least, most = variable.limits
        return {"min": str(least), "max": str(most), "start": str(int(variable.start[0]))}
    if variable.boolean:
        return {"start": _boolean(variable.start != (0.0,))}
    found = {"declaredType": variable.quantity.name}
    if variable.quantity.unit:
        found["unit"] = variable.quantity.unit.name
    if variable.start:
        found["start"] = " ".join(map(repr, variable.start))
    return found


def _scalar_variable(parent: ET.Element, at: int, variable: Variable, index: dict[str, int]) -> None:
    element = ET.SubElement(parent, "ScalarVariable", _attributes(at, variable))
    typed = _typed(variable)
    if variable.derivative_of:
        typed["derivative"] = str(index[variable.derivative_of] + 1)
    ET.SubElement(element, TYPES_2[variable.type], typed)


def _variable(parent: ET.Element, at: int, variable: Variable, index: dict[str, int]) -> None:
    attributes = _attributes(at, variable) | _typed(variable)
    if variable.derivative_of:
        attributes["derivative"] = str(index[variable.derivative_of])
    if variable.causality == "output" and variable.variability == "continuous":
        attributes["intermediateUpdate"] = "true"
    element = ET.SubElement(parent, variable.type, attributes)
    for length in variable.dimensions:
        ET.SubElement(element, "Dimension", start=str(length))


def _structure_2(root: ET.Element, variables: list[Variable], index: dict[str, int]) -> None:
    structure = ET.SubElement(root, "ModelStructure")
    for name, unknowns, initial in _unknowns(variables):
        if not unknowns:
            continue
        group = ET.SubElement(structure, {"Output": "Outputs", "Derivative": "Derivatives"}.get(name, name))
        for variable in unknowns:
            about = {"index": str(index[variable.name] + 1)}
            ET.SubElement(group, "Unknown", about | _dependencies(variable, index, 1, initial=initial))


def _structure_3(root: ET.Element, variables: list[Variable], index: dict[str, int]) -> None:
    structure = ET.SubElement(root, "ModelStructure")
    names = {"Derivative": "ContinuousStateDerivative", "InitialUnknowns": "InitialUnknown"}
    indicators = [variable for variable in variables if variable.section == INDICATOR]
    for name, unknowns, initial in (*_unknowns(variables), ("EventIndicator", indicators, False)):
        for variable in unknowns:
            about = {"valueReference": str(index[variable.name])}
            about |= _dependencies(variable, index, 0, initial=initial)
            ET.SubElement(structure, names.get(name, name), about)


def _unknowns(variables: list[Variable]) -> list[tuple[str, list[Variable], bool]]:
    outputs = [variable for variable in variables if variable.causality == "output"]
    # In the order of the continuous states of the C layers: all q, then all v.
    derivatives = [variable for variable in variables if variable.derivative_of]
    derivatives.sort(key=lambda variable: (variable.section, variable.offset))
    initial = [each for each in variables if each.initial == "calculated" and each.section != INDICATOR]
    return [
        ("Output", outputs, False),
        ("Derivative", derivatives, False),
        ("InitialUnknowns", initial, True),
    ]


def _dependencies(variable: Variable, index: dict[str, int], base: int, *, initial: bool) -> dict[str, str]:
    found: tuple[Dependence, ...] = variable.depends + (variable.initially if initial else ())
    if len(found) > LONGEST_LIST:
        return {}
    ordered = sorted((index[dependence.on] + base, dependence.kind) for dependence in found)
    about = {"dependencies": " ".join(str(number) for number, _ in ordered)}
    return about | {"dependenciesKind": " ".join(kind for _, kind in ordered)}
