"""Mechanisms: from the bodies and joints of a scenario to the tables and the start that the core needs.

>>> mechanism = build(load("two_link"))
>>> mechanism.joints
('world-link1', 'hinge')
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from linkwind.mechanism.assembly import assemble
from linkwind.mechanism.events import check_stops, happenings
from linkwind.mechanism.forces import inputs, prescribed, with_forces
from linkwind.mechanism.start import WORLD_START, JointStart, Start, start
from linkwind.mechanism.tables import padded, room, tables
from linkwind.mechanism.tree import WORLD, carriers, order
from linkwind.native.multibody import NQ, NV, Tables
from linkwind.scenario import Scenario
from linkwind.spatial import Array

__all__ = ["Mechanism", "build"]


@dataclass(frozen=True)
class Mechanism:
    """A mechanism as the core takes it.

    Attributes:
        bodies: names, in scenario order.
        joints: name of the joint that carries each body; an automatic root is ``world-`` and the body's
            name.
        closures: names of the joints that close loops.
        events: names of what may happen to joints: events, then stops.
        forces: names of the force elements.
        inputs: element, by its number, and name of each of their inputs, in the order of the tables.
        tables: bodies, joints and gravity as flat arrays.
        q0: joint coordinates at the start [m, rad, unit quaternions], shape (nq,).
        v0: joint velocities at the start [m/s, rad/s], shape (nv,).
        has_joints: whether the scenario states any joint.
    """

    bodies: tuple[str, ...]
    joints: tuple[str, ...]
    closures: tuple[str, ...]
    events: tuple[str, ...]
    forces: tuple[str, ...]
    inputs: tuple[tuple[int, str], ...]
    tables: Tables
    q0: Array
    v0: Array
    has_joints: bool


def build(scenario: Scenario) -> Mechanism:
    """Return the mechanism of a scenario.

    A body without a joint gets one to the world at its centre of mass: ``planar`` if every inertia is a
    single number, so that its coordinates are x, y and the angle, else ``free``.

    Loops are closed: bodies whose place or motion is not stated take those that close them.

    Raises:
        MechanismError: joints that leave the plane of a planar mechanism, springs that do not fit their
            joint, a body that starts in a way that its joint does not allow, a loop that does not close, an
            event that cannot happen to its joint, a force element that does not fit, or a start from which
            it is not settled how the mechanism moves.
    """
    carried, loops = carriers(scenario)
    bodies: dict[int, Start] = {WORLD: WORLD_START}
    joints: dict[int, JointStart] = {}
    moved = prescribed(scenario, carried)
    for i in order([carrier.parent for carrier in carried]):
        item = scenario.where("bodies", i)
        given = moved.get(carried[i].name, {})
        bodies[i], joints[i] = start(scenario.bodies[i], carried[i], bodies[carried[i].parent], item, given)
    count = range(len(carried))
    starts = [joints[i] for i in count]
    happening = happenings(scenario, carried, loops)
    flat = tables(scenario, carried, starts, loops, [bodies[i] for i in count], happening)
    roomy = room([carrier.type for carrier in carried], happening)
    q0 = padded([joint.q for joint in starts], roomy, NQ)
    v0 = padded([joint.v for joint in starts], roomy, NV)
    if loops:
        moving = with_forces(flat, scenario, carried, q0, v0, motions=True)
        q0, v0 = assemble(scenario, moving, loops, q0, v0)
    first = np.cumsum([0, *(NQ[kind] for kind in roomy)])  # of the coordinates of each joint
    check_stops(scenario, dict(zip((each.name for each in carried), first.tolist(), strict=False)), q0)
    return Mechanism(
        bodies=tuple(body.name for body in scenario.bodies),
        joints=tuple(carrier.name for carrier in carried),
        closures=tuple(loop.joint.name for loop in loops),
        events=tuple(each.name for each in happening),
        forces=tuple(force.name for force in scenario.forces),
        inputs=tuple((i, name) for i, force in enumerate(scenario.forces) for name in inputs(force)),
        tables=with_forces(flat, scenario, carried, q0, v0),
        q0=q0,
        v0=v0,
        has_joints=bool(scenario.joints),
    )
