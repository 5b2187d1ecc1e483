"""From what an FMU can do and what a scenario asks for to how it is run."""

from __future__ import annotations

import re
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from linkwind.errors import InputError
from linkwind.fmi.host.facts import Abilities, Description, Interface, Variable
from linkwind.fmi.host.links import Mapping
from linkwind.fmi.host.plan import Plan, Setting
from linkwind.scenario.providers import FmuModel

_WORTH_LOGGING = re.compile(r"error|warn|fatal|discard", re.IGNORECASE)


def interface(fmu: Description, settings: FmuModel) -> tuple[Interface, Abilities]:
    """Return the interface that the FMU is used by.

    Raises:
        InputError: it does not have the one asked for.
    """
    wanted: Interface = settings.interface if settings.interface != "auto" else next(iter(fmu.interfaces))
    if wanted not in fmu.interfaces:
        raise InputError(
            f"{fmu.path}: fmu.interface: expected {' or '.join(fmu.interfaces)}; got {wanted}. Change it."
        )
    return wanted, fmu.interfaces[wanted]


def own_step_ns(fmu: Description, settings: FmuModel, step_ns: int) -> int:
    """Return the step of the FMU [ns]: a part of the communication step, equal to it, or a multiple.

    Raises:
        InputError: the two do not fit together.
    """
    _, can = interface(fmu, settings)
    step = settings.step or (0.0 if can.variable_step else can.fixed_step or fmu.default_step)
    own = round(step * 1e9) or step_ns
    if step_ns % own and own % step_ns:
        raise InputError(
            f"{fmu.path}: step of the FMU: expected a part or a multiple of coupling.step = "
            f"{step_ns / 1e9:g} s; got {own / 1e9:g} s. Change coupling.step, or fmu.step if the FMU can "
            "take another one."
        )
    return own


def stepping(fmu: Description, settings: FmuModel, step_ns: int) -> str:
    """Return in words how the FMU is stepped, for the table and the log."""
    kind, can = interface(fmu, settings)
    own = own_step_ns(fmu, settings, step_ns)
    names = {"cs": "Co-Simulation", "me": "Model Exchange, integrated by RK4"}
    state = "with FMU state" if can.get_set_state else "no FMU state: no iterations, no checkpoints"
    each = "one step in each communication step"
    if own < step_ns:
        each = f"{step_ns // own} steps of {own / 1e9:g} s in each communication step, inputs held"
    elif own > step_ns:
        each = (
            f"a step of {own / 1e9:g} s every {own // step_ns} communication steps, outputs held in between"
        )
    return f"FMI {fmu.version}, {names[kind]}; {each}; {state}; from {fmu.tool}"


def plan(
    fmu: Description,
    mapping: Mapping,
    settings: FmuModel,
    instances: tuple[str, ...],
    step_ns: int,
    folder: Path,
    library: str,
    caller: tuple[str, ...] = (),
) -> Plan:
    """Return what a worker needs to know; for the arguments see ``Plan``.

    Raises:
        InputError: a start value does not fit its variable.
    """
    kind, can = interface(fmu, settings)
    given = {name: _setting(fmu, name, value) for name, value in settings.start.items()}
    inputs = {variable.name for variable in fmu.variables if variable.causality == "input"}
    return Plan(
        file=str(fmu.path),
        folder=str(folder),
        version=fmu.version,
        interface=kind,
        identifier=can.identifier,
        token=fmu.token,
        caller=caller,
        library=library,
        instances=instances,
        structural=tuple(_structural(fmu, name, value) for name, value in settings.structural.items()),
        start=tuple(setting for name, setting in given.items() if name not in inputs),
        held=tuple(setting for name, setting in given.items() if name in inputs),
        inputs=tuple(variable.reference for variable in mapping.input_variables),
        outputs=tuple(variable.reference for variable in mapping.output_variables),
        input_size=len(mapping.inputs),
        output_size=sum(variable.size for variable in mapping.output_variables),
        **(_knowns(mapping) if differentiates(fmu, mapping, settings) else _NOTHING_KNOWN),
        variable_step=can.variable_step,
        event_mode=can.event_mode,
        discrete_inputs=any(variable.variability != "continuous" for variable in mapping.input_variables),
        states=fmu.states,
        indicators=fmu.indicators,
        completed_step=can.completed_step_needed,
        state="bytes" if can.serialise_state else "process" if can.get_set_state else "none",
        log_categories=tuple(name for name in fmu.log_categories if _WORTH_LOGGING.search(name)),
        step_ns=step_ns,
        own_ns=own_step_ns(fmu, settings, step_ns),
        memory=int(settings.memory),
    )


_NOTHING_KNOWN: dict[str, Any] = {"knowns": (), "seeds": (), "seed_size": 0}


def differentiates(fmu: Description, mapping: Mapping, settings: FmuModel) -> bool:
    """Return whether the FMU is asked for directional derivatives.

    An FMU from linkwind is not, so that it gives what the native model gives; nor one without state, because
    it cannot be checked; both unless the scenario says so.

    Raises:
        InputError: the scenario wants derivatives that the FMU does not have.
    """
    _, can = interface(fmu, settings)
    has = can.derivatives and bool(mapping.twist_inputs)
    if settings.derivatives and not has:
        raise InputError(
            f"{fmu.path}: fmu.derivatives: expected an FMU with directional derivatives and an input that "
            "depends on the velocity of a body; got another. Remove it."
        )
    if settings.derivatives is None:
        return has and can.get_set_state and not fmu.tool.startswith("linkwind")
    return has and settings.derivatives


def _knowns(mapping: Mapping) -> dict[str, Any]:
    """Return by what the outputs are differentiated: the variables that depend on a twist, and which part."""
    wanted = {link.index for link in mapping.twist_inputs}
    knowns, seeds = list[int](), list[int]()
    first = size = 0
    for variable in mapping.input_variables:
        parts = [place for place in range(variable.size) if first + place in wanted]
        if parts:
            knowns.append(variable.reference)
            seeds += [size + place for place in parts]
            size += variable.size
        first += variable.size
    return {"knowns": tuple(knowns), "seeds": tuple(seeds), "seed_size": size}


_TYPES: dict[str, tuple[type, ...]] = {"Boolean": (bool,), "String": (str,), "Enumeration": (int,)}


def _structural(fmu: Description, name: str, value: int) -> Setting:
    variable = fmu.named(name)
    return _setting(fmu, name, bool(value) if variable and variable.type == "Boolean" else value)


def _setting(fmu: Description, name: str, value: Any) -> Setting:
    """Return a start value as the calls of FMI want it."""
    variable = fmu.named(name)
    item = f'{fmu.path}: fmu.start."{name}"'
    if variable is None or variable.causality in ("independent", "calculatedParameter"):
        settable = [v.name for kind in ("parameter", "input") for v in fmu.variables if v.causality == kind]
        near = ", ".join(get_close_matches(name, settable, 5, 0.3) or settable[:5]) or "none (it has none)"
        raise InputError(f"{item}: expected a parameter or an input, such as {near}; got another.")
    values = value if isinstance(value, tuple) else (value,)
    if len(values) != variable.size:
        raise InputError(
            f"{item}: expected {variable.size} values; got {len(values)}. Write them as a flat list."
        )
    return Setting(name, variable.reference, variable.type, tuple(_typed(item, variable, v) for v in values))


def _typed(item: str, variable: Variable, value: Any) -> Any:
    is_float = variable.type in ("Real", "Float64", "Float32")
    allowed: tuple[type, ...] = (int, float) if is_float else _TYPES.get(variable.type, (int,))
    fits = isinstance(value, allowed) and (bool in allowed or not isinstance(value, bool))
    if not fits:
        raise InputError(f"{item}: expected a value of type {variable.type}; got {value!r}. Change it.")
    return float(value) if is_float else value
