"""Loops at the start: bodies whose place or motion is not stated take those that close them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NoReturn

import numpy as np

from linkwind.errors import MechanismError, SimulationError
from linkwind.mechanism.tree import Loop
from linkwind.native.multibody import FORCE_TYPES, JOINT_TYPES, NQ, NV, QUATERNION_AT, Multibody, Tables
from linkwind.scenario import Body, Scenario
from linkwind.spatial import Array

ITERATIONS = 100
STATED = 1e-3  # of the mechanism's size, by which bodies that are all stated may miss each other
RATE = 1e-6  # of the fastest motion, likewise of their velocities
NEARBY = 1e-2  # m or rad of motion, after which a singular position has been left
RANK = 1e-8  # singular values below this part of the largest one count as none


def assemble(
    scenario: Scenario, tables: Tables, loops: list[Loop], q: Array, v: Array
) -> tuple[Array, Array]:
    """Return coordinates and velocities that close all loops.

    Args:
        scenario: says which bodies state how they start.
        tables: the mechanism.
        loops: the joints that close loops.
        q: coordinates of the tree, as stated.
        v: velocities of the tree, as stated.

    Raises:
        MechanismError: a loop does not close, or the start is singular.
    """
    bodies = [body.name for body in scenario.bodies]
    multibody = Multibody(tables, bodies, [loop.joint.name for loop in loops])
    state = multibody.initial_state(q, v)
    state = _close_positions(multibody, state, _loose(tables, scenario, _is_placed), loops)
    state = _close_velocities(multibody, state, _loose(tables, scenario, _is_moved), loops)
    _refuse_singular(multibody, state, loops)
    return state[: multibody.nq], state[multibody.nq : multibody.nq + multibody.nv]


def _is_placed(body: Body) -> bool:
    return not (body.position is None and body.angle_deg is None and body.orientation is None)


def _is_moved(body: Body) -> bool:
    return not (body.velocity is None and body.angular_velocity is None)


def _loose(tables: Tables, scenario: Scenario, stated: Callable[[Body], bool]) -> Array:
    """Return which degrees of freedom no statement fixes, shape (nv,)."""
    loose = np.zeros(len(tables.stiffness), dtype=bool)
    for i, body in enumerate(scenario.bodies):
        width = _width(tables, i)
        loose[tables.v_index[i] : tables.v_index[i] + width] = not stated(body)
    moved = tables.force_body[tables.force_type == FORCE_TYPES["motion"]]
    loose[tables.v_index[moved[:, 0]] + moved[:, 1]] = False
    return loose


def _width(tables: Tables, i: int) -> int:
    return next(NV[name] for name, code in JOINT_TYPES.items() if code == tables.joint_type[i])


def _close_positions(multibody: Multibody, state: Array, loose: Array, loops: list[Loop]) -> Array:
    """Levenberg and Marquardt's method on what is loose; then all bodies move by round-off, or a little."""
    size, best = _size(multibody.tables), state
    for _ in range(ITERATIONS):
        value, jacobian = multibody.violations(state)
        if np.abs(value).max() < np.abs(multibody.violations(best)[0]).max():
            best = state
        if np.abs(value).max() <= 1e-12 * size or not loose.any():
            break
        turn = np.zeros(multibody.nv)
        free, damping = jacobian[:, loose], float(value @ value) * 1e-2 + 1e-12
        turn[loose] = -free.T @ np.linalg.solve(free @ free.T + damping * np.eye(len(value)), value)
        longest = np.abs(turn).max()
        state = _moved(multibody, state, turn * min(1.0, 0.3 / longest if longest else 1.0))
    value, _ = multibody.violations(best)
    if np.abs(value).max() > STATED * size:
        _refuse_open(multibody, value, loops, size)
    try:
        closed = multibody.close(best)
    except SimulationError:
        _refuse_open(multibody, value, loops, size)
    closed[multibody.nq :] = best[multibody.nq :]
    return closed


def _moved(multibody: Multibody, state: Array, turn: Array) -> Array:
    """Return the state after moving with the joint velocities ``turn`` for a second."""
    tables, moved = multibody.tables, state.copy()
    names = {code: name for name, code in JOINT_TYPES.items()}
    for i, code in enumerate(tables.joint_type.tolist()):
        q, v, slides = int(tables.q_index[i]), int(tables.v_index[i]), QUATERNION_AT.get(code)
        if slides is None:
            moved[q : q + NQ[names[code]]] += turn[v : v + NV[names[code]]]
            continue
        moved[q : q + slides] += turn[v : v + slides]
        quaternion = moved[q + slides : q + slides + 4]
        w, x, y, z = quaternion
        rates = np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])
        quaternion += 0.5 * rates @ turn[v + slides : v + slides + 3]
        quaternion /= np.linalg.norm(quaternion)
    return moved


def _close_velocities(multibody: Multibody, state: Array, loose: Array, loops: list[Loop]) -> Array:
    """What is loose moves with what is stated."""
    _, jacobian = multibody.violations(state)
    v = state[multibody.nq : multibody.nq + multibody.nv].copy()
    if loose.any():
        v[loose] += np.linalg.lstsq(jacobian[:, loose], -jacobian @ v, rcond=RANK)[0]
    rate = np.abs(jacobian @ v)
    fastest = (np.abs(jacobian) @ np.abs(v)).max()
    if rate.max() > RATE * fastest:
        loop = _loop_of(multibody, int(rate.argmax()), loops)
        raise MechanismError(
            f"{loop.item}: expected velocities of {loop.joint.parent} and {loop.joint.child} that keep "
            f"{loop.joint.name} closed; got some that open it at {rate.max():.6g} m/s (or rad/s). Leave out "
            "the velocities that follow from others, or correct them."
        )
    closed = state.copy()
    closed[multibody.nq : multibody.nq + multibody.nv] = v
    return multibody.close(closed)


def _refuse_singular(multibody: Multibody, state: Array, loops: list[Loop]) -> None:
    """Where the loops say less than they do a little further on, more than one motion is possible."""
    _, jacobian = multibody.violations(state)
    singular, free = np.linalg.svd(jacobian)[1:]
    rank = int((singular > RANK * singular[0]).sum()) if singular[0] > 0.0 else 0
    way = free[rank:].T @ np.sin(np.arange(1.0, multibody.nv - rank + 1.0)) if rank < multibody.nv else None
    if way is None:
        return
    try:
        nearby = multibody.close(_moved(multibody, state, NEARBY * way / np.abs(way).max()))
    except SimulationError:
        nearby = state  # cannot move: as far as can be seen, not singular but stuck
    _, there = multibody.violations(nearby)
    further = int((np.linalg.svd(there)[1] > 1e-6 * singular[0]).sum())
    if further > rank:
        worst = loops[-1]
        raise MechanismError(
            f"{worst.item}: expected a start from which the motion is settled; got a singular one, in which "
            f"the loops keep {rank} directions and a little further {further}. Start in another position."
        )


def _refuse_open(multibody: Multibody, value: Array, loops: list[Loop], size: float) -> NoReturn:
    loop = _loop_of(multibody, int(np.abs(value).argmax()), loops)
    joint = loop.joint
    raise MechanismError(
        f"{loop.item}: expected {joint.parent} and {joint.child} to meet in {joint.name} ({joint.type}) at "
        f"the start; got a loop that stays open by {np.abs(value).max():.6g} m (or rad), in a mechanism of "
        f"{size:.3g} m. Correct points and start, or leave out the start of bodies that are to find their "
        "place."
    )


def _loop_of(multibody: Multibody, row: int, loops: list[Loop]) -> Loop:
    ends = np.cumsum([int(kept).bit_count() for kept in multibody.tables.closure_rows])
    return loops[int(np.searchsorted(ends, row, side="right"))]


def _size(tables: Tables) -> float:
    """Return the largest lever in the mechanism [m]."""
    levers = [tables.parent_point, tables.child_point, tables.closure_point.reshape(-1, 3)]
    return float(np.linalg.norm(np.concatenate(levers), axis=1).max(initial=1e-3))
