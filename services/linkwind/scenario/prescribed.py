"""Which bodies move as the scenario states, whatever forces act on them."""

from __future__ import annotations

from linkwind.scenario import Scenario
from linkwind.scenario.forces import Motion
from linkwind.scenario.topology import carries

_COORDINATES = {"fixed": 0, "revolute": 1, "prismatic": 1, "planar": 3}


def prescribed(scenario: Scenario) -> set[str]:
    """Return the names of bodies whose joints, all the way from the world, are fixed or have motions."""
    stated = {(force.joint, force.coordinate) for force in scenario.forces if isinstance(force, Motion)}
    released = {event.joint for event in scenario.events if event.action == "release"}
    bearing = carries((joint.type, joint.parent, joint.child) for joint in scenario.joints)
    parents = {
        joint.child: joint.parent
        for joint, bears in zip(scenario.joints, bearing, strict=True)
        if bears and joint.name not in released and joint.type in _COORDINATES
        and all((joint.name, i) in stated for i in range(_COORDINATES[joint.type]))
    }  # fmt: skip
    return {body.name for body in scenario.bodies if _root(body.name, parents) == "world"}


def _root(body: str, parents: dict[str, str]) -> str:
    while body in parents:
        body = parents[body]
    return body
