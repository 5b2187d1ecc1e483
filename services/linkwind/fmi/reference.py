"""Reference results, with which an importer can check itself: the layered standard FMI-LS-REF.

https://modelica.github.io/fmi-ls-ref/main (1.0.0-alpha.1): a manifest that names an experiment, the inputs
and the results. The numbers come from the library of this package, not from the FMU.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping

import numpy as np

from linkwind import aero
from linkwind.errors import SimulationError
from linkwind.fmi.aero import wind_inputs
from linkwind.fmi.description import to_bytes
from linkwind.fmi.part import Part
from linkwind.fmi.variables import Variable
from linkwind.native.multibody import OCCASIONS, ORDERED, Integrator, Multibody
from linkwind.spatial import Array, Motion, Wrench

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
STEPS = 100
EVERY = 10  # steps from result to result
COMMANDED = 40  # step at which the first event on command happens
EXPERIMENTS_TYPE = "application/x-ma-hs-experiments"

Rows = list[dict[str, Array]]  # for each row the sections of values, flat


def reference_files(part: Part) -> dict[str, bytes]:
    """Return manifest, experiment, inputs and results by path in the FMU.

    Nothing where the model cannot take the inputs: bodies without mass, a field outside its domain.
    """
    try:
        inputs, results = (_dynamics if part.provider is None else _aero)(part)
    except SimulationError:
        return {}
    names = {"in": f"{part.identifier}_in.csv", "ref": f"{part.identifier}_ref.csv", "exp": "experiments.exp"}
    times = [k * part.scenario.coupling.step_ns / 1e9 for k in range(STEPS + 1)]
    given = [variable for variable in part.variables if variable.causality == "input"]
    shown = [variable for variable in part.variables if _is_result(part, variable)]
    given = [variable for variable in given if variable.section != "ADDED_INERTIA"]
    files = {
        "fmi-ls-manifest.xml": _manifest(names),
        names["exp"]: _experiments(part, names),
        names["in"]: _csv(given, times[:STEPS], inputs),
        names["ref"]: _csv(shown, times[EVERY::EVERY], results),
    }
    return {f"{FOLDER}/{name}": content for name, content in files.items()}


def _is_result(part: Part, variable: Variable) -> bool:
    """Of a mechanism what follows from its state: the rest depends on inputs that may be newer."""
    state = ("Q", "V", "POSITION", "ORIENTATION", "LINEAR", "ANGULAR")
    if variable.causality != "output":
        return False
    return variable.section in state if part.name == "dynamics" else variable.section in ("FORCE", "TORQUE")


def _dynamics(part: Part) -> tuple[Rows, Rows]:
    """Push and turn every body, by some m/s² and rad/s²; vary inputs, command events one after the other."""
    settings, mechanism = part.scenario.dynamics, part.mechanism
    tables = mechanism.tables
    size = np.column_stack([np.tile(tables.mass[:, None], 3), np.tile(tables.inertia[:, 2:3], 3)])
    multibody = Multibody(mechanism.tables)
    state = multibody.initial_state(mechanism.q0, mechanism.v0)
    motion, node = Motion.at_rest(multibody.n), np.zeros(1)
    integrator = Integrator[settings.integrator.upper()]
    at_start: Array = tables.force_constants[tables.force_input]
    on_command = tables.event_occasion == OCCASIONS["command"]
    ordered_at = np.where(on_command, COMMANDED + 7 * np.arange(multibody.events), STEPS)
    inputs: Rows = []
    results: Rows = []
    for k in range(STEPS):
        wrench = size * _waves(k, (multibody.n, 6))
        given = at_start + 0.02 * np.maximum(1.0, np.abs(at_start)) * _waves(k, at_start.shape)
        commands = (k >= ordered_at).astype(float)
        known = {"FORCE_INPUT": given, "EVENT_COMMAND": commands}
        inputs.append(_flat({"FORCE": wrench[:, :3], "TORQUE": wrench[:, 3:]} | known))
        state[len(state) - multibody.events :][k == ordered_at] = ORDERED
        state, _ = multibody.advance(
            state, part.step, node, wrench[None].copy(), None, integrator=integrator,
            time=k * part.scenario.coupling.step_ns / 1e9, substeps=settings.substeps,
            rtol=settings.rtol, atol=settings.atol, inputs=given[None].copy(),
        )  # fmt: skip
        if (k + 1) % EVERY == 0:
            multibody.motion(state, motion)
            q, v = state[: multibody.nq], state[multibody.nq : multibody.nq + multibody.nv]
            results.append(_flat(_motion_sections(motion) | {"Q": q, "V": v}))
    return inputs, results


def _aero(part: Part) -> tuple[Rows, Rows]:
    """Let every body move and turn about its start."""
    assert part.provider is not None
    provider, mechanism = part.provider, part.mechanism
    multibody, model = Multibody(mechanism.tables), aero.build(part.scenario, provider)
    start = Motion.at_rest(multibody.n)
    multibody.motion(multibody.initial_state(mechanism.q0, mechanism.v0), start)
    motion = Motion.at_rest(multibody.n)
    wrench = Wrench.zeros(len(provider.bodies))
    which = [mechanism.bodies.index(body) for body in provider.bodies]
    blown = np.array(list(wind_inputs(part.scenario, provider).values()))
    inputs: Rows = []
    results: Rows = []
    for k in range(STEPS):
        _move(motion, start, k, planar=part.scenario.planar)
        moved = _flat({name: rows[which] for name, rows in _motion_sections(motion).items()})
        inputs.append(moved | {"WIND_INPUT": blown})
        t = k * part.step + part.step  # the FMU's: communication point and step size added
        model.evaluate(t, motion, wrench)
        model.commit(t, motion)
        if (k + 1) % EVERY == 0:
            results.append(_flat({"FORCE": wrench.force, "TORQUE": wrench.torque}))
    return inputs, results


def _move(motion: Motion, start: Motion, k: int, *, planar: bool) -> None:
    n = len(motion)
    flat = np.array([1.0, 1.0, 0.0] if planar else [1.0, 1.0, 1.0])
    motion.position[:] = np.round(start.position + 0.1 * _waves(k, (n, 3)) * flat, 3)
    motion.linear[:] = np.round(0.3 * _waves(k + 7, (n, 3)) * flat, 3)
    motion.angular[:] = np.round(0.5 * _waves(k + 13, (n, 3)) * (1.0 - flat if planar else flat), 3)
    for i in range(n):
        angle = round(0.02 * k * (i + 1), 3)
        w, z = math.cos(angle / 2.0), math.sin(angle / 2.0)
        a, b, c, d = start.orientation[i]
        motion.orientation[i] = (w * a - z * d, w * b - z * c, w * c + z * b, w * d + z * a)


def _waves(k: int, shape: tuple[int, ...]) -> Array:
    """Return numbers of the order of 5 that change from step to step, of few digits."""
    phase = np.arange(math.prod(shape)).reshape(shape)
    waves: Array = np.round(5.0 * np.sin(0.11 * k * (1.0 + 0.2 * phase) + phase), 2)
    return waves


def _motion_sections(motion: Motion) -> dict[str, Array]:
    return {
        "POSITION": motion.position,
        "ORIENTATION": motion.orientation,
        "LINEAR": motion.linear,
        "ANGULAR": motion.angular,
    }


def _flat(sections: Mapping[str, Array]) -> dict[str, Array]:
    return {name: rows.ravel().copy() for name, rows in sections.items()}


def _csv(variables: list[Variable], times: Iterable[float], rows: Rows) -> bytes:
    """Return a table: a cell holds the elements of an array, with spaces between them."""
    lines = [",".join(f'"{name}"' for name in ("time", *(variable.name for variable in variables)))]
    for time, row in zip(times, rows, strict=True):
        cells = [_cell(v, row[v.section][v.offset : v.offset + v.size]) for v in variables]
        lines.append(",".join((repr(time), *cells)))
    return ("\n".join(lines) + "\n").encode()


def _cell(variable: Variable, values: Array) -> str:
    return " ".join(map(repr, values.astype(int).tolist() if variable.boolean else values.tolist()))


def _manifest(names: Mapping[str, str]) -> bytes:
    ET.register_namespace("fmi-ls", NAMESPACE)
    about = {
        "fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
        "fmi-ls-version": "1.0.0-alpha.1",
        "fmi-ls-description": "Layered Standard providing information on related files included in an FMU.",
    }
    root = ET.Element("fmiReferences", {f"{{{NAMESPACE}}}{name}": value for name, value in about.items()})
    for key, kind, role, text in (
        ("exp", EXPERIMENTS_TYPE, "experiment/smoke-test", "The experiment: step, inputs and results"),
        ("in", "text/csv", "testcase", "Inputs, held over each communication step"),
        ("ref", "text/csv", "result", "Results of Co-Simulation at the end of steps"),
    ):
        ET.SubElement(root, "Related", type=kind, source=names[key], role=role, description=text)
    ET.SubElement(
        root, "Related", type="text/html", source="../../documentation/fmi-ls-ref.html", role="document",
        description="How the results were obtained",
    )  # fmt: skip
    return to_bytes(root)


def _experiments(part: Part, names: Mapping[str, str]) -> bytes:
    root = ET.Element("Experiments", name="Reference", description="Changing inputs, held over each step")
    experiment = ET.SubElement(
        root, "Experiment", name="changing_inputs", startTime="0",
        stopTime=repr(STEPS * part.scenario.coupling.step_ns / 1e9), stepSize=repr(part.step),
        description="Co-Simulation with the default parameters",
    )  # fmt: skip
    ET.SubElement(experiment, "Stimuli", source=names["in"])
    ET.SubElement(experiment, "References", source=names["ref"])
    return to_bytes(root)
