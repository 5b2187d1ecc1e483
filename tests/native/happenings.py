"""Events for the tests of the core."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from linkwind.native.multibody import ACTIONS, NQ, NV, OCCASIONS, Integrator, Multibody, Tables
from tests.native.mechanisms import Body, tables


@dataclass
class Event:
    """What happens to the joint of a body, or to closure ``joint - n``."""

    joint: int
    action: str = "release"
    occasion: str = "time"
    threshold: float = 0.0
    side: int = 1
    restitution: float = 0.0


def with_events(made: Tables, events: list[Event]) -> Tables:
    """Return the tables with events, and with room for the coordinates of joints that may be released."""
    names = {code: name for name, code in zip(NQ, range(6), strict=True)}
    roomy = {event.joint for event in events if event.action == "release"}
    kinds = [names[int(code)] for code in made.joint_type]
    nq = [7 if i in roomy else NQ[kind] for i, kind in enumerate(kinds)]
    nv = [6 if i in roomy else NV[kind] for i, kind in enumerate(kinds)]
    q_index, v_index = (np.cumsum([0, *sizes[:-1]]).astype(np.int32) for sizes in (nq, nv))
    room = {"rest": np.zeros(sum(nq)), "stiffness": np.zeros(sum(nv)), "damping": np.zeros(sum(nv))}
    for i, kind in enumerate(kinds):
        for name, old, new, size in (
            ("rest", made.q_index, q_index, NQ[kind]),
            ("stiffness", made.v_index, v_index, NV[kind]),
            ("damping", made.v_index, v_index, NV[kind]),
        ):
            room[name][new[i] : new[i] + size] = getattr(made, name)[old[i] : old[i] + size]
    return replace(
        made, q_index=q_index, v_index=v_index, **room,
        event_joint=np.array([e.joint for e in events], np.int32),
        event_action=np.array([ACTIONS[e.action] for e in events], np.int32),
        event_occasion=np.array([OCCASIONS[e.occasion] for e in events], np.int32),
        event_side=np.array([e.side for e in events], np.int32),
        event_threshold=np.array([e.threshold for e in events], float),
        event_restitution=np.array([e.restitution for e in events], float),
    )  # fmt: skip


def eventful(bodies: list[Body], events: list[Event], gravity=(0.0, -9.81, 0.0), closures=()) -> Multibody:
    return Multibody(with_events(tables(bodies, gravity, closures), events))


def fly(multibody, state, h, steps, integrator=Integrator.RK4, wrench=None, start=0.0):
    """Return all states and the work, shape (steps + 1, …)."""
    held = np.zeros((1, multibody.n, 6)) if wrench is None else wrench
    states, works = [state], [np.zeros(2)]
    for k in range(steps):
        state, work = multibody.advance(
            state,
            h,
            np.zeros(1),
            held,
            None,
            integrator=integrator,
            time=start + k * h,
            rtol=1e-10,
            atol=1e-12,
        )
        states.append(state)
        works.append(works[-1] + work)
    return np.array(states), np.array(works)
