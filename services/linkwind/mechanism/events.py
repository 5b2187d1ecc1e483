"""What may happen to joints, laid out as the core reads it: events as they are stated, then the stops."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwind.errors import MechanismError
from linkwind.mechanism.tree import Carrier, Loop
from linkwind.native.multibody import ACTIONS, OCCASIONS
from linkwind.scenario import Scenario
from linkwind.spatial import Array

START = 1e-9  # rad or m by which a joint may start beyond a stop: round-off


@dataclass(frozen=True)
class Happening:
    """One row of the core's tables.

    Attributes:
        name: of the event; of a stop the joint's name, ``.low`` or ``.high``.
        joint: of a body, or number of bodies + closure.
        action, occasion: keys of ``ACTIONS`` and ``OCCASIONS``.
        side: 1 at or above the threshold, -1 at or below it.
        threshold: [s, N, N·m, rad, m or per second].
        restitution: of a stop.
    """

    name: str
    joint: int
    action: str
    occasion: str
    side: int
    threshold: float
    restitution: float = 0.0


def happenings(scenario: Scenario, carriers: list[Carrier], loops: list[Loop]) -> list[Happening]:
    """Return what may happen, events in the order of the scenario, then the stops of its joints.

    Raises:
        MechanismError: a joint that closes a loop is to be locked, or has stops.
    """
    place = {carrier.name: i for i, carrier in enumerate(carriers)}
    place |= {loop.joint.name: len(carriers) + i for i, loop in enumerate(loops)}
    found = []
    for i, event in enumerate(scenario.events):
        joint = place[event.joint]
        if event.action == "lock" and joint >= len(carriers):
            _refuse(f"{scenario.where('events', i)}.action: expected release", event.joint, '"lock"')
        if event.at is not None:
            found.append(Happening(event.name, joint, event.action, "time", 1, event.at))
            continue
        threshold, side = (event.above, 1) if event.above is not None else (event.below or 0.0, -1)
        occasion = event.when or "command"
        found.append(Happening(event.name, joint, event.action, occasion, side, threshold or 0.0))
    for i, stated in enumerate(scenario.joints):
        if stated.stop is None:
            continue
        if place[stated.name] >= len(carriers):
            _refuse(f"{scenario.where('joints', i)}.stop: expected none", stated.name, str(list(stated.stop)))
        for end, side, threshold in (("low", -1, stated.stop[0]), ("high", 1, stated.stop[1])):
            name, e = f"{stated.name}.{end}", stated.restitution
            found.append(Happening(name, place[stated.name], "stop", "position", side, threshold, e))
    return found


def check_stops(scenario: Scenario, place: Mapping[str, int], q0: Array) -> None:
    """Find joints that start beyond a stop, where they would stay.

    Args:
        scenario: with the joints.
        place: of the first coordinate of each joint, by its name.
        q0: coordinates at the start [rad, m].

    Raises:
        MechanismError: one does.
    """
    for i, joint in enumerate(scenario.joints):
        if joint.stop is None:
            continue
        (low, high), q = joint.stop, float(q0[place[joint.name]])
        slack = START * max(1.0, abs(low), abs(high))
        if not low - slack <= q <= high + slack:
            unit = "rad" if joint.type == "revolute" else "m"
            raise MechanismError(
                f"{scenario.where('joints', i)}.stop: expected the start between them, at {q:.6g} {unit}; "
                f"got {list(joint.stop)}. Correct them, or where {joint.child} starts."
            )


def event_tables(found: list[Happening]) -> dict[str, Any]:
    """Return the ``event_*`` tables."""
    return {
        "event_joint": np.array([each.joint for each in found], np.int32),
        "event_action": np.array([ACTIONS[each.action] for each in found], np.int32),
        "event_occasion": np.array([OCCASIONS[each.occasion] for each in found], np.int32),
        "event_side": np.array([each.side for each in found], np.int32),
        "event_threshold": np.array([each.threshold for each in found], np.float64),
        "event_restitution": np.array([each.restitution for each in found], np.float64),
    }


def released(found: list[Happening], n: int) -> set[int]:
    """Return which joints of the n bodies may be released."""
    return {each.joint for each in found if each.action == "release" and each.joint < n}


def _refuse(expected: str, joint: str, got: str) -> None:
    raise MechanismError(
        f"{expected}, because {joint} closes a loop; got {got}. Move {joint} before the other joint of its "
        "child in the file, so that that one closes the loop."
    )
