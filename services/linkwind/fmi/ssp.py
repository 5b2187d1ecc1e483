"""A scenario as a system of FMUs: the mechanism, its force models, and what connects them (SSP 1.0).

https://ssp-standard.org/publications/SSP10/SystemStructureAndParameterization10.pdf: a zip file with
``SystemStructure.ssd`` and the FMUs. The mechanism's FMU is the element ``dynamics``, a force model's is
named like its provider; what has the same name on both sides is connected, as the terminals of FMI 3 are.
Inputs of the mechanism that no force model gives, and those of the wind, are inputs of the system, with the
values that they have in a run, and all that the mechanism tells are its outputs. Where there are none the
system is closed: it has no connectors of its own, which some tools cannot read.
"""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from linkwind import __version__
from linkwind.errors import InputError
from linkwind.fmi import toolchain
from linkwind.fmi.description import to_bytes
from linkwind.fmi.export import Exported, archive, write, zipped
from linkwind.fmi.part import EXPORTABLE, Part, dynamics_part, provider_part
from linkwind.fmi.variables import Variable
from linkwind.scenario import Scenario

DYNAMICS = "dynamics"
Link = tuple[str | None, str, str | None, str]  # element (None: the system) and variable at start and end
SSD, SSC, SSV = (
    f"http://ssp-standard.org/SSP1/SystemStructure{what}"
    for what in ("Description", "Common", "ParameterValues")
)


@dataclass(frozen=True)
class System(Exported):
    """A system of FMUs that was written.

    Attributes:
        components: names of the FMUs.
        left_out: providers that are none, because there is no C of their models.
    """

    components: tuple[str, ...]
    left_out: tuple[str, ...]


def export_system(
    scenario: Scenario, out: str | os.PathLike[str], *, platforms: Sequence[str] = ("host",)
) -> System:
    """Write an ``.ssp`` with FMUs of FMI 2.0.

    Args:
        scenario: what is written.
        out: the file.
        platforms: as for `linkwind.fmi.export.export`.

    Raises:
        InputError: as `linkwind.fmi.export.export`; or two force models act on one body.
    """
    names = toolchain.choose(platforms)
    _check_single(scenario)
    parts = {DYNAMICS: dynamics_part(scenario, native_arrays=False)}
    left_out = []
    for provider in scenario.providers:
        if provider.model in EXPORTABLE:
            parts[provider.name] = provider_part(scenario, provider, native_arrays=False)
        elif provider.model != "none":
            left_out.append(provider.name)
    content = {f"resources/{name}.fmu": archive(part, "2", platforms) for name, part in parts.items()}
    content["SystemStructure.ssd"] = structure(parts)
    whole = zipped(content, "SystemStructure.ssd")
    file = Path(out)
    write(file, whole)
    return System(file, len(whole), "2", tuple(names), tuple(parts), tuple(left_out))


def _check_single(scenario: Scenario) -> None:
    """A connection gives a value; nothing in SSP adds the forces of two models."""
    acting = [entry for entry in scenario.providers if entry.model != "none"]
    for body, count in Counter(name for entry in acting for name in entry.bodies).items():
        if count > 1:
            both = " and ".join(f'"{entry.name}"' for entry in acting if body in entry.bodies)
            raise InputError(
                f"{scenario.source}: providers: expected one for each body, because connections of SSP add "
                f"no forces; got {both} for {body}. Export the FMUs one by one, and add their forces."
            )


def structure(parts: dict[str, Part]) -> bytes:
    """Return ``SystemStructure.ssd`` for the mechanism, by the name `DYNAMICS`, and its force models."""
    for prefix, space in (("ssd", SSD), ("ssc", SSC), ("ssv", SSV)):
        ET.register_namespace(prefix, space)
    mechanism = parts[DYNAMICS]
    identifier = mechanism.identifier
    root = ET.Element(
        f"{{{SSD}}}SystemStructureDescription",
        version="1.0", name=identifier, generationTool=f"linkwind {__version__}",
        description=mechanism.description,
    )  # fmt: skip
    about = f"Forces held over communication steps, of {mechanism.step!r} s in the scenario"
    system = _child(root, "System", name=identifier, description=about)
    inner = list(_inner(parts))
    left = _open_inputs(mechanism, {name for _, _, end, name in inner if end == DYNAMICS})
    blown = [(name, v) for name, part in parts.items() for v in part.variables if v.section == "WIND_INPUT"]
    inputs = [*left, *{v.name: v for _, v in blown}.values()]
    outputs = [v for v in mechanism.variables if v.causality == "output"] if inputs else []
    links = [
        *inner,
        *((None, v.name, DYNAMICS, v.name) for v in left),
        *((None, v.name, name, v.name) for name, v in blown),
        *((DYNAMICS, v.name, None, v.name) for v in outputs),
    ]
    if inputs:
        _connectors(system, [*inputs, *outputs])
        _start_values(system, inputs)
    targets = {(end, name) for _, _, end, name in links}
    elements = _child(system, "Elements")
    for name, part in parts.items():
        component = _child(
            elements, "Component", name=name, source=f"resources/{name}.fmu", implementation="CoSimulation"
        )
        given = [v for v in part.variables if v.causality == "output" or (name, v.name) in targets]
        _connectors(component, given)
    _connections(_child(system, "Connections"), links)
    _units(root, mechanism.variables)
    _child(root, "DefaultExperiment", startTime="0", stopTime=repr(mechanism.scenario.time.end))
    return to_bytes(root)


def _open_inputs(mechanism: Part, given: Collection[str]) -> list[Variable]:
    """Return what somebody else gives; not the added inertia of bodies whose forces come without."""
    found = [v for v in mechanism.variables if v.causality == "input" and v.name not in given]
    forced = {name.partition(".")[0] for name in given}
    return [v for v in found if v.section != "ADDED_INERTIA" or v.name.partition(".")[0] not in forced]


def _inner(parts: dict[str, Part]) -> Iterator[Link]:
    """Yield the connections between mechanism and force models: all motion, then all forces."""
    models = [(name, part) for name, part in parts.items() if name != DYNAMICS]
    for name, part in models:
        moved = (v.name for v in part.variables if v.causality == "input" and v.section != "WIND_INPUT")
        yield from ((DYNAMICS, motion, name, motion) for motion in moved)
    for name, part in models:
        yield from ((name, v.name, DYNAMICS, v.name) for v in part.variables if v.causality == "output")


def _connectors(parent: ET.Element, variables: Iterable[Variable]) -> None:
    group = _child(parent, "Connectors")
    for variable in variables:
        connector = _child(group, "Connector", name=variable.name, kind=variable.causality)
        if variable.boolean:
            ET.SubElement(connector, f"{{{SSC}}}Boolean")
        else:
            unit = variable.quantity.unit
            ET.SubElement(connector, f"{{{SSC}}}Real", {"unit": unit.name} if unit else {})


def _start_values(system: ET.Element, variables: list[Variable]) -> None:
    """What the inputs are that nothing outside of the system is connected to."""
    values = _child(_child(_child(system, "ParameterBindings"), "ParameterBinding"), "ParameterValues")
    group = ET.SubElement(values, f"{{{SSV}}}ParameterSet", version="1.0", name="start")
    group = ET.SubElement(group, f"{{{SSV}}}Parameters")
    for variable in variables:
        parameter = ET.SubElement(group, f"{{{SSV}}}Parameter", name=variable.name)
        (start,) = variable.start
        if variable.boolean:
            ET.SubElement(parameter, f"{{{SSV}}}Boolean", value="true" if start else "false")
        else:
            ET.SubElement(parameter, f"{{{SSV}}}Real", value=repr(start))


def _units(root: ET.Element, variables: Iterable[Variable]) -> None:
    units = {v.quantity.unit.name: v.quantity.unit for v in variables if v.quantity.unit}
    group = _child(root, "Units")
    for name in sorted(units):
        unit = ET.SubElement(group, f"{{{SSC}}}Unit", name=name)
        ET.SubElement(unit, f"{{{SSC}}}BaseUnit", {base: str(power) for base, power in units[name].exponents})


def _connections(group: ET.Element, links: Iterable[Link]) -> None:
    for start, one, end, other in links:
        ends = {"startElement": start, "startConnector": one, "endElement": end, "endConnector": other}
        _child(group, "Connection", **{key: name for key, name in ends.items() if name is not None})


def _child(parent: ET.Element, tag: str, **attributes: str) -> ET.Element:
    return ET.SubElement(parent, f"{{{SSD}}}{tag}", attributes)
