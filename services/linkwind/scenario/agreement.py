"""What the tables of a scenario must agree on: names, topology, steps, what a model needs."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Sequence
from decimal import Decimal
from typing import TYPE_CHECKING

import numpy as np

from linkwind.scenario.functions import Function
from linkwind.scenario.problems import Path, Problem, choice, show
from linkwind.scenario.providers import ADDING_INERTIA
from linkwind.scenario.settings import nanoseconds
from linkwind.scenario.shapes import Plate, Wing

if TYPE_CHECKING:
    from linkwind.scenario.bodies import Body, Joint
    from linkwind.scenario.model import Scenario
    from linkwind.scenario.providers import Provider
    from linkwind.scenario.settings import Environment


RESERVED = ("dynamics", "observer", "router", "ca")  # that a provider must not be called: names of roles

SINGLE = ("revolute", "prismatic")  # joint types with one coordinate

IN_THE_PLANE = {"wing": "plate", "ellipsoid": "ellipse"}  # shapes of a flow in space, and in their place

NAMED = ("bodies", "joints", "events", "forces", "providers")  # lists of tables


def disagreements(scenario: Scenario, known: Collection[str]) -> list[Problem]:
    """Return everything that does not fit together, in the order of the file, as far as it can be known.

    Args:
        scenario: with the tables that are right in themselves.
        known: these, and the tables of which only the names are known, see ``sound``.
    """
    repeated = [problem for table in NAMED if f"{table}.name" in known for problem in _names(scenario, table)]
    if repeated:
        return repeated  # what a name refers to is not known
    return [problem for check, reads in CHECKS.items() if reads <= set(known) for problem in check(scenario)]


def _end(scenario: Scenario) -> Iterator[Problem]:
    end, step = nanoseconds(scenario.time.end), nanoseconds(scenario.coupling.step)
    if end % step:
        below = end // step * step
        use = [f"{float(ns / 10**9)!r}" for ns in (below, below + step) if ns > Decimal(0)]
        expected = f"a multiple of coupling.step = {scenario.coupling.step!r} s"
        yield Problem(("time", "end"), expected, show(scenario.time.end), f"Use {' or '.join(use)}.")


def _names(scenario: Scenario, table: str) -> Iterator[Problem]:
    names = [entry.name for entry in getattr(scenario, table)]
    for index, name in enumerate(names):
        if name in names[:index]:
            expected = f"a name of its own ({table}[{names.index(name)}] has it)"
            yield Problem((table, index, "name"), expected, show(name), "Rename one of the two.")


def _inertias(scenario: Scenario) -> Iterator[Problem]:
    spatial = next((body.name for body in scenario.bodies if not body.planar), None)
    if spatial is None:
        return
    for index, body in enumerate(scenario.bodies):
        if body.planar:
            expected = f"6 numbers, because {spatial} is 3-D"
            advice = "Give [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]."
            yield Problem(("bodies", index, "inertia"), expected, show(body.inertia), advice)


def _joints(scenario: Scenario) -> Iterator[Problem]:
    bodies = [body.name for body in scenario.bodies]
    for index, joint in enumerate(scenario.joints):
        path: Path = ("joints", index)
        for key, word, known in (
            ("parent", joint.parent, [*bodies, "world"]),
            ("child", joint.child, bodies),
        ):
            if word not in known:
                yield choice((*path, key), "one of the bodies", known, word)
        if joint.parent == joint.child:
            advice = "Name the body that carries it, or world."
            yield Problem((*path, "parent"), "another body than the child", show(joint.parent), advice)


def _events(scenario: Scenario) -> Iterator[Problem]:
    joints = {joint.name: joint for joint in scenario.joints}
    for index, event in enumerate(scenario.events):
        joint = joints.get(event.joint)
        if joint is None:
            yield choice(("events", index, "joint"), "one of the joints", list(joints), event.joint)
        elif event.when in ("position", "speed") and joint.type not in SINGLE:
            expected = "force, torque or distance, because " + _no_coordinate(joint)
            yield Problem(("events", index, "when"), expected, show(event.when), "Choose another.")


def _stops(scenario: Scenario) -> Iterator[Problem]:
    for index, joint in enumerate(scenario.joints):
        if joint.stop is not None and joint.type not in SINGLE:
            expected = "none, because " + _no_coordinate(joint)
            yield Problem(("joints", index, "stop"), expected, show(list(joint.stop)), "Remove it.")


def _no_coordinate(joint: Joint) -> str:
    return f"{joint.name} ({joint.type}) has no single coordinate"


def _forces(scenario: Scenario) -> Iterator[Problem]:
    bodies, joints = [body.name for body in scenario.bodies], [joint.name for joint in scenario.joints]
    known = {"parent": [*bodies, "world"], "child": [*bodies, "world"], "body": bodies, "joint": joints}
    for index, force in enumerate(scenario.forces):
        for key in [key for key in known if key in type(force).model_fields]:
            if (word := getattr(force, key)) not in known[key]:
                what = "one of the joints" if key == "joint" else "one of the bodies"
                yield choice(("forces", index, key), what, known[key], word)
        if force.type == "spring" and force.parent == force.child:
            expected, advice = "another body than the parent", "Name another body, or world."
            yield Problem(("forces", index, "child"), expected, show(force.child), advice)


def _motions(scenario: Scenario) -> Iterator[Problem]:
    for index, force in enumerate(scenario.forces):
        if force.type == "motion" and force.joint in _changing(scenario):
            expected = "a joint to which nothing else happens"
            got = f'"{force.joint}", which has events or stops'
            yield Problem(("forces", index, "joint"), expected, got, "Use an actuator.")


def _changing(scenario: Scenario) -> set[str]:
    """Return the joints that are released, locked or stopped."""
    stopped = {joint.name for joint in scenario.joints if joint.stop is not None}
    return stopped | {event.joint for event in scenario.events}


def _method(scenario: Scenario) -> Iterator[Problem]:
    dynamics = scenario.dynamics
    if dynamics.method == "incremental" and dynamics.integrator not in ("euler", "semi_implicit_euler"):
        expected = "euler or semi_implicit_euler: the method incremental is of first order"
        path: Path = ("dynamics", "integrator")
        yield Problem(path, expected, show(dynamics.integrator), 'Use "semi_implicit_euler".')
    substep = scenario.coupling.step / dynamics.substeps
    baumgarte = dynamics.method == "cfe" and dynamics.stabilisation == "baumgarte"
    if baumgarte and dynamics.stabilisation_time < substep:
        expected = f"at least an integrator step, {substep!r} s: less would be unstable"
        got, advice = show(dynamics.stabilisation_time), "Take ten steps or more."
        yield Problem(("dynamics", "stabilisation_time"), expected, got, advice)


def _providers(scenario: Scenario) -> Iterator[Problem]:
    for index, provider in enumerate(scenario.providers):
        path: Path = ("providers", index)
        if provider.name in RESERVED:
            expected = "a name that no other participant has"
            yield Problem((*path, "name"), expected, show(provider.name), 'Choose another, such as "aero".')
        yield from _provider_bodies(scenario, provider, path)
        yield from _provider_model(scenario, provider, path)


def _provider_bodies(scenario: Scenario, provider: Provider, path: Path) -> Iterator[Problem]:
    bodies = [body.name for body in scenario.bodies]
    for index, name in enumerate(provider.bodies):
        if name not in bodies:
            yield choice((*path, "bodies", index), "one of the bodies", bodies, name)
        elif name in provider.bodies[:index]:
            expected = "each body once"
            yield Problem((*path, "bodies", index), expected, show(name), "Remove one of the two.")
    for name in provider.field:
        if name not in provider.bodies:
            yield choice((*path, "field", name), "one of its bodies", provider.bodies, name)


def _provider_model(scenario: Scenario, provider: Provider, path: Path) -> Iterator[Problem]:
    if provider.model == "field" and not provider.field:
        expected = "a table for at least one body"
        advice = f'Add a table for a body, such as {_first(provider.bodies)}, with fx = "…".'
        yield Problem((*path, "field"), expected, "nothing", advice)
    if provider.every > 1 and provider.model in ("flow", "vortex"):
        expected = f"1 for the model {provider.model}, whose forces are those of one step"
        advice = "Leave it out; take a larger coupling.step, with dynamics.substeps."
        yield Problem((*path, "every"), expected, str(provider.every), advice)
    if provider.model in ("plate", "vortex"):
        yield from _thin(scenario, provider)
    for name in provider.vortex.trailing_edge:
        if name not in provider.bodies:
            yield choice((*path, "vortex", "trailing_edge", name), "one of its bodies", provider.bodies, name)
    if provider.model == "vortex" and scenario.environment.density == 0.0:
        yield Problem(
            ("environment", "density"), "a number above 0 for the model vortex", "0", "Give it one."
        )
    if provider.model == "flow":
        yield from _flow(scenario, provider, path)


def _thin(scenario: Scenario, provider: Provider) -> Iterator[Problem]:
    """Plates and wings, each of one chord at any place of its span."""
    for index, body in enumerate(scenario.bodies):
        shape = body.shape
        if body.name not in provider.bodies:
            continue
        if not isinstance(shape, Plate | Wing):
            expected = f'a plate or a wing, which the model of provider "{provider.name}" needs'
            got = f'type "{shape.type}"' if shape else "nothing"
            advice = f'{"Write" if shape else "Add"} shape = {{ type = "plate", length = … }}.'
            yield Problem(("bodies", index, "shape"), expected, got, advice)
        elif isinstance(shape, Wing) and (z := shape.folds) is not None:
            expected = f'one chord at each z, which the model of provider "{provider.name}" needs'
            advice = "Cut it along its chord into bodies on fixed joints."
            yield Problem(("bodies", index, "shape", "points"), expected, f"more at z = {z:.6g}", advice)


def _flow(scenario: Scenario, provider: Provider, path: Path) -> Iterator[Problem]:
    """What a resolved flow asks for: bodies with shapes, in a wind that is the same everywhere."""
    acted = [(i, body) for i, body in enumerate(scenario.bodies) if body.name in provider.bodies]
    for index, body in acted:
        if body.shape is None:
            expected = f'a shape, which the model of provider "{provider.name}" needs'
            advice = 'Add one, such as shape = { type = "plate", length = … }.'
            yield Problem(("bodies", index, "shape"), expected, "nothing", advice)
    if provider.flow.dimensions == 2:
        yield from _flow_in_the_plane(scenario, acted)
    yield from _wind_of_time(scenario.environment)
    if scenario.environment.density == 0.0:
        yield Problem(("environment", "density"), "a number above 0 for the model flow", "0", "Give it one.")


def _wind_of_time(environment: Environment) -> Iterator[Problem]:
    """A wind that may change with time, and is the same everywhere."""
    for index, function in environment.wind_functions.items():
        if places := sorted({"x", "y", "z"} & set(re.findall(r"\w+", function.expression or ""))):
            expected = "a function of t alone: in the model flow the wind is the same everywhere"
            advice = f"Leave out {' and '.join(places)}, or use the model plate or vortex."
            yield Problem(("environment", "wind", index), expected, show(function.expression), advice)
    for index, gust in enumerate(environment.gusts):
        if any(gust.wavenumber):
            expected = "0 along each axis: in the model flow the wind is the same everywhere"
            got, advice = show(list(gust.wavenumber)), "Leave it out, or use the model plate or vortex."
            yield Problem(("environment", "gusts", index, "wavenumber"), expected, got, advice)


def _flow_in_the_plane(scenario: Scenario, acted: list[tuple[int, Body]]) -> Iterator[Problem]:
    """What a two-dimensional flow asks for besides: planar bodies of one span."""
    otherwise = "or set aero.flow.dimensions = 3."
    spans = [(i, body.shape.span) for i, body in acted if body.shape is not None]
    for index, body in acted:
        if not body.planar:
            expected = "one number: the flow is two-dimensional"
            advice = f"Give it about z, {otherwise}"
            yield Problem(("bodies", index, "inertia"), expected, show(body.inertia), advice)
        if body.shape is not None and body.shape.type in IN_THE_PLANE:
            expected = "a shape with an outline: the flow is two-dimensional"
            advice = f'Use type = "{IN_THE_PLANE[body.shape.type]}", {otherwise}'
            yield Problem(("bodies", index, "shape", "type"), expected, f'"{body.shape.type}"', advice)
    for index, span in spans:
        if span != spans[0][1]:
            expected = f"the span of the others, {spans[0][1]!r} m: the flow is two-dimensional"
            advice = f"Give all the same, {otherwise}"
            yield Problem(("bodies", index, "shape", "span"), expected, show(span), advice)
    environment = scenario.environment
    stated: list[tuple[Path, float | Function]] = [(("wind",), environment.wind[2])]
    stated += [(("gusts", i, "amplitude"), gust.amplitude[2]) for i, gust in enumerate(environment.gusts)]
    for path, upwards in stated:
        if upwards != 0.0:
            expected = "no component along z: the flow is two-dimensional"
            got = "a function" if isinstance(upwards, Function) else show(upwards)
            yield Problem(("environment", *path), expected, got, f"Set z to 0, {otherwise}")


def _first(names: Sequence[str]) -> str:
    return names[0] if names else "body"


def _masses(scenario: Scenario) -> Iterator[Problem]:
    """A body moves only if it, a model or what hangs on it has inertia."""
    adding = [entry for entry in scenario.providers if entry.model in ADDING_INERTIA]
    parents = {joint.child: joint.parent for joint in reversed(scenario.joints)}
    carrying: set[str] = set()
    for body in scenario.bodies:  # what carries mass has it
        name = body.name if body.mass > 0.0 else "world"
        while name != "world" and name not in carrying:
            carrying.add(name)
            name = parents.get(name, "world")
    given = carrying.union(*(entry.bodies for entry in adding))
    for index, body in enumerate(scenario.bodies):
        if body.name not in given:
            expected = "a number above 0 [kg], because no provider adds inertia to this body"
            advice = "Give it a mass, however small, or the model plate, flow or vortex."
            yield Problem(("bodies", index, "mass"), expected, show(body.mass), advice)
        elif body.name not in {*parents, *parents.values()} and _spins_freely(body):
            expected = "principal moments above 0, because nothing holds or hangs on this body"
            yield Problem(("bodies", index, "inertia"), expected, show(body.inertia), "Correct it.")


def _spins_freely(body: Body) -> bool:
    """Return whether a body has no inertia about some axis."""
    if isinstance(body.inertia, float):
        return False
    xx, yy, zz, xy, xz, yz = body.inertia
    low, _, high = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return bool(low <= 1e-14 * high)


# What each check reads: tables, or no more than the names of their entries.
CHECKS: dict[Callable[[Scenario], Iterator[Problem]], set[str]] = {
    _end: {"time", "coupling"},
    _inertias: {"bodies"},
    _joints: {"joints", "bodies.name"},
    _events: {"events", "joints"},
    _stops: {"joints"},
    _forces: {"forces", "bodies.name", "joints.name"},
    _motions: {"forces", "joints", "events"},
    _method: {"dynamics", "coupling"},
    _providers: {"providers", "bodies", "environment"},
    _masses: {"bodies", "joints", "providers"},
}
