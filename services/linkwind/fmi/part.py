"""What is exported: a mechanism, or the force model of one of its providers."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from linkwind.aero.field import field_table, initial_angles
from linkwind.aero.plate import plate_table
from linkwind.errors import InputError
from linkwind.fmi import aero, dynamics
from linkwind.fmi.layout import aero_sections, dynamics_sections, starts
from linkwind.fmi.variables import Variable, scalars
from linkwind.mechanism import Mechanism, build
from linkwind.scenario import Environment, Provider, Scenario
from linkwind.spatial import Array
from linkwind.wind import wind_table

PartName = Literal["dynamics", "aero"]
EXPORTABLE = ("plate", "field")
# In the order of the enumerations of lw_fmu.h.
AERO_MODELS = {"plate": 0, "field": 1}

Table = int | NDArray[np.int32] | Array


@dataclass(frozen=True)
class Part:
    """One half of a scenario, as an FMU sees it.

    Attributes:
        name: ``dynamics`` or ``aero``.
        scenario: that it comes from.
        mechanism: its bodies and joints.
        provider: whose force model it is; None for the dynamics.
        variables: the index of each is its value reference.
        sections: size of each section of the values.
        integers: start values of the Int32 variables.
        tables: further constants by their C name without ``lw_fmu_``: integers, or arrays.
    """

    name: PartName
    scenario: Scenario
    mechanism: Mechanism
    provider: Provider | None
    variables: list[Variable]
    sections: dict[str, int]
    integers: tuple[int, int]
    tables: Mapping[str, Table]

    @property
    def identifier(self) -> str:
        """The model identifier: a C identifier, and the name of the binaries."""
        name = re.sub(r"\W", "_", self.scenario.name, flags=re.ASCII)
        ending = f"_{self.provider.name}" if self.provider else ""
        return ("m_" if name[0].isdigit() else "") + name + ending

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies that it has variables of."""
        return self.provider.bodies if self.provider else self.mechanism.bodies

    @property
    def description(self) -> str:
        """One line about the model."""
        about = self.scenario.description or f"Mechanism {self.scenario.name}"
        if self.provider is None:
            return about
        return f"Force model {self.provider.model} of: {about}"

    @property
    def step(self) -> float:
        """Communication step size of the scenario [s], the same double as in a run."""
        return self.scenario.coupling.step_ns / 1e9

    def start(self) -> Array:
        """Return the start of all Float64 values; zero where they are calculated."""
        first = starts(self.sections)
        values = np.zeros(sum(self.sections.values()))
        for variable in self.variables:
            if variable.start and not variable.integer:
                at = first[variable.section] + variable.offset
                values[at : at + variable.size] = variable.start
        self._fill_hidden(values, first)
        return values

    def _fill_hidden(self, values: Array, first: Mapping[str, int]) -> None:
        """Set the parameters of automatic joints, which have no variables."""
        if self.name == "dynamics":
            tables = self.mechanism.tables
            for section in ("PARENT_POINT", "CHILD_POINT", "STIFFNESS", "DAMPING", "REST", "FORCE_NUMBER"):
                table = getattr(tables, section.lower()).ravel()
                values[first[section] : first[section] + len(table)] = table


def dynamics_part(scenario: Scenario, *, native_arrays: bool) -> Part:
    """Return the mechanism of a scenario.

    Raises:
        MechanismError: the scenario's bodies and joints do not make a mechanism.
        InputError: the scenario has another method than reduced.
    """
    if scenario.dynamics.method != "reduced":
        raise InputError(
            f"{scenario.source}: dynamics.method: expected reduced, which is what an FMU computes; got "
            f"{scenario.dynamics.method}. Export with --set dynamics.method=reduced."
        )
    mechanism = build(scenario)
    tables = mechanism.tables
    n, nq, nv = len(mechanism.bodies), len(mechanism.q0), len(mechanism.v0)
    variables = dynamics.variables(scenario, mechanism)
    integers = tuple(int(variable.start[0]) for variable in variables if variable.integer)
    return Part(
        "dynamics", scenario, mechanism, None,
        variables if native_arrays else scalars(variables),
        dynamics_sections(
            n, nq, nv, len(mechanism.closures), len(mechanism.forces), len(mechanism.inputs),
            len(mechanism.events),
        ),
        (integers[0], integers[1]),
        {
            "n": n, "nq": nq, "nv": nv, "parent": tables.parent, "order": tables.order,
            "joint_type": tables.joint_type, "q_index": tables.q_index, "v_index": tables.v_index,
            "parent_rotation": tables.parent_rotation, "child_rotation": tables.child_rotation,
            "closures": len(mechanism.closures),
            "closure_body": tables.closure_body, "closure_rows": tables.closure_rows,
            "closure_point": tables.closure_point, "closure_rotation": tables.closure_rotation,
            "closure_length": tables.closure_length,
            "forces": len(mechanism.forces), "force_type": tables.force_type, "force_body": tables.force_body,
            "force_point": tables.force_point, "instructions": len(tables.force_code),
            "constants": len(tables.force_constants), "force_start": tables.force_start,
            "force_code": tables.force_code, "force_constants": tables.force_constants,
            "inputs": len(mechanism.inputs), "force_input": tables.force_input,
            "events": len(mechanism.events),
            "event_joint": tables.event_joint, "event_action": tables.event_action,
            "event_occasion": tables.event_occasion, "event_side": tables.event_side,
            "event_threshold": tables.event_threshold, "event_restitution": tables.event_restitution,
        },
    )  # fmt: skip


def aero_part(scenario: Scenario, *, native_arrays: bool) -> Part:
    """Return the force model of the scenario's first provider that has one in C.

    Raises:
        InputError: the scenario has none.
    """
    provider = next((entry for entry in scenario.providers if entry.model in EXPORTABLE), None)
    if provider is None:
        models = " and ".join(f'"{entry.model}"' for entry in scenario.providers)
        raise InputError(
            f"{scenario.source}: providers: expected one with model plate or field, to export it; got "
            f"{models}. Export the other half with --part dynamics."
        )
    return provider_part(scenario, provider, native_arrays=native_arrays)


def provider_part(scenario: Scenario, provider: Provider, *, native_arrays: bool) -> Part:
    """Return the force model of a provider, which is one of those in C, `EXPORTABLE`."""
    mechanism = build(scenario)
    variables = aero.variables(scenario, provider, mechanism)
    n = len(provider.bodies)
    tables: dict[str, Table] = {"n": n, "nq": 0, "nv": 0, "aero_model": AERO_MODELS[provider.model]}
    return Part(
        "aero", scenario, mechanism, provider,
        variables if native_arrays else scalars(variables),
        aero_sections(n, len(aero.wind_inputs(scenario, provider))),
        (0, 0),
        tables | _plate_constants(scenario, provider) | _field_constants(scenario, provider),
    )  # fmt: skip


def _plate_constants(scenario: Scenario, provider: Provider) -> dict[str, Table]:
    environment = scenario.environment if provider.model == "plate" else Environment()
    table = wind_table(environment, scenario.source)
    wind: dict[str, Table] = {
        "gust_count": len(table.gusts),
        "gusts": table.gusts,
        "wind_instructions": len(table.code),
        "wind_code": table.code,
        "wind_constants": table.constants,
        "wind_constant_count": len(table.constants),
        "wind_inputs": table.inputs,
    }
    if provider.model != "plate":
        return {
            "coefficients": 0,
            "strips": 0,
            "curve_size": 0,
            "curves": np.zeros(0),
            **_planform(np.zeros(0)),
            **wind,
        }
    plates = plate_table(scenario, provider)
    return {
        "coefficients": int(plates.coefficients),
        "strips": plates.strips,
        "curve_size": plates.curves.shape[1],
        "curves": plates.curves,
        **_planform(plates.planform),
        **wind,
    }


def _planform(rows: Array) -> dict[str, Table]:
    return {"planform_size": rows.size, "planform": rows}


def _field_constants(scenario: Scenario, provider: Provider) -> dict[str, Table]:
    n = len(provider.bodies)
    if provider.model != "field":
        nothing = np.zeros(0, dtype=np.int32)
        start = np.zeros(n + 1, dtype=np.int32)
        return {
            "field_start": start,
            "field_code": nothing,
            "field_constants": np.zeros(0),
            "theta": np.zeros(n),
        }
    table = field_table(scenario, provider)
    return {
        "field_start": table.start,
        "field_code": table.code,
        "field_constants": table.constants,
        "theta": initial_angles(scenario, provider),
    }
