"""Random closed mechanisms against equations written apart, and every joint cut and its force reapplied."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from linkwind.mechanism.quaternion import matrix
from linkwind.runs.validate.multibody.moving import RK4, Moving
from linkwind.runs.validate.multibody.newton import Bodies, Linked, State, rates, rk4, state_of
from linkwind.runs.validate.multibody.scenes import joint, scene
from linkwind.runs.validate.rows import Findings, most
from linkwind.scenario import Scenario, load
from linkwind.spatial import Array

NUMPY = "bodies in coordinates of their own, joints by multipliers (numpy)"
CUT = "Newton and Euler on the bodies alone (numpy)"

TREES = ("spherical", "revolute", "spherical", "prismatic", "spherical", "planar")
CLOSURES: tuple[tuple[str, ...], ...] = (
    ("spherical",), ("revolute",), ("distance",), ("planar",), ("prismatic",), ("fixed",),
    ("distance", "distance", "distance"), ("spherical", "distance"), ("revolute", "distance"),
    ("planar", "spherical"),
)  # fmt: skip


def random_closed(seed: int, kinds: Sequence[str]) -> Scenario:
    """Return six bodies in space on joints of all types, and joints between random ones that close loops."""
    rng = np.random.default_rng([seed, len(kinds)])
    names = [f"body{i}" for i in range(len(TREES))]
    places, bodies, joints = [np.zeros(3)] * len(TREES), [], []
    for i, kind in enumerate(TREES):
        parent = -1 if i == 0 else int(rng.integers(i))
        points = rng.normal(size=(2, 3)) * 0.5
        places[i] = (places[parent] if parent >= 0 else 0.0) + points[0] - points[1]
        cloud = rng.normal(size=(6, 3)) * rng.uniform(0.1, 0.4, 3)
        inertia = (np.sum(cloud**2) * np.eye(3) - cloud.T @ cloud)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        bodies.append({"name": names[i], "mass": float(rng.uniform(0.5, 3.0)), "inertia": inertia.tolist()})
        on = names[parent] if parent >= 0 else "world"
        axis = rng.normal(size=3).tolist()
        joints.append(
            joint(f"joint{i}", on, names[i], points[0].tolist(), points[1].tolist(), kind, axis=axis)
        )
    for k, kind in enumerate(kinds):
        first, second = (int(x) for x in rng.choice(np.arange(-1, len(TREES)), 2, replace=False))
        if second < 0:
            first, second = second, first
        point = rng.normal(size=3)
        meet = (places[first] if first >= 0 else 0.0) + point - places[second]
        if kind == "distance":
            meet = meet + rng.normal(size=3)
        on = names[first] if first >= 0 else "world"
        ends = point.tolist(), meet.tolist()
        joints.append(joint(f"closure{k}", on, names[second], *ends, kind, axis=rng.normal(size=3).tolist()))
    return scene(bodies, joints, (0.3, -9.81, 1.0))


def random_mechanisms(short: bool) -> Findings:
    """Accelerations after a while, and the motion up to then."""
    worst, apart, gap, seconds = 0.0, 0.0, 0.0, 0.0
    cases = [(seed, kinds) for seed in range(1 if short else 3) for kinds in CLOSURES]
    span, h = (0.01 if short else 0.1), 5e-4
    for seed, kinds in cases:
        moving = Moving(random_closed(seed, kinds))
        start = state_of(moving.motion)
        other = Linked(moving.scenario, moving.mechanism.tables, start)
        moving.go(span, h, **RK4)
        end = other.go(start, h, round(span / h))
        apart = max(apart, float(np.abs(end[:, :7] - _same_sign(state_of(moving.motion), end)[:, :7]).max()))
        moving.go(0.2, h, **RK4)
        calm = np.zeros((moving.multibody.n, 6))
        got = moving.multibody.evaluate(moving.state, calm).acceleration
        expected = other.accelerations(state_of(moving.motion))
        worst = max(worst, float(np.abs(got - expected).max() / np.abs(expected).max()))
        gap = max(gap, moving.gap)
        seconds += moving.seconds
    case = f"{len(cases)} random closed mechanisms of six bodies in space"
    rows = [
        most(case, "relative error of the accelerations", worst, 1e-9, NUMPY),
        most(case, f"error of poses after {span:g} s, rk4 at 0.5 ms [m, 1]", apart, 1e-8, NUMPY),
        most(case, "largest gap of a joint [m]", gap, 1e-13),
    ]
    return Findings(rows, seconds=seconds)


def _same_sign(y: State, other: State) -> State:
    """Return y with quaternions of the sign that the other ones have."""
    sign = np.sign(np.sum(y[:, 3:7] * other[:, 3:7], axis=1, keepdims=True))
    return np.hstack([y[:, :3], sign * y[:, 3:7], y[:, 7:]])


def reactions(moving: Moving) -> Array:
    """Return what all joints do to the bodies, as wrenches at the centres of mass, shape (n, 6)."""
    result = moving.multibody.evaluate(moving.state, np.zeros((moving.multibody.n, 6)))
    tables, motion = moving.mechanism.tables, moving.motion
    loads = np.zeros((moving.multibody.n, 6))
    carrying = zip(tables.parent, range(moving.multibody.n), tables.child_point, result.reaction, strict=True)
    closing = (
        (*pair, points[1], wrench)
        for pair, points, wrench in zip(
            tables.closure_body, tables.closure_point, result.closure_reaction, strict=True
        )
    )
    for first, second, point, wrench in (*carrying, *closing):
        place = np.array(point)
        if second >= 0:
            place = motion.position[second] + matrix(motion.orientation[second]) @ point
        for body, sign in ((first, -1.0), (second, 1.0)):
            if body >= 0:
                arm = place - motion.position[body]
                loads[body] += sign * np.r_[wrench[:3], wrench[3:] + np.cross(arm, wrench[:3])]
    return loads


class _Cut:
    """Bodies without joints, under the forces that these had.

    Attributes:
        y: their state.
        off: largest error of their accelerations so far, and ``size``, the largest acceleration.
    """

    def __init__(self, moving: Moving) -> None:
        self.moving, self.y = moving, state_of(moving.motion)
        self.off, self.size = 0.0, 0.0
        self._bodies = Bodies(moving.mechanism.tables)

    def step(self, h: float) -> None:
        """Go on for h [s], with the forces that the joints have at its start, middle and end."""
        loads = {0.0: self._reactions()}
        for part in (0.5, 1.0):
            self.moving.go(0.5 * h, 0.5 * h, **RK4)
            loads[part] = self._reactions()
        self.y = rk4(self.y, h, lambda part, y: rates(y, self._bodies.accelerations(y, loads[part])))

    def _reactions(self) -> Array:
        """Return the forces of the joints now; note what they amount to."""
        loads = reactions(self.moving)
        alone = self._bodies.accelerations(state_of(self.moving.motion), loads)
        linked = self.moving.multibody.evaluate(self.moving.state, np.zeros_like(loads)).acceleration
        self.off = max(self.off, float(np.abs(alone - linked).max()))
        self.size = max(self.size, float(np.abs(linked).max()))
        return loads


def cut(short: bool) -> Findings:
    """Every joint cut, its force reapplied: the same motion."""
    scenarios = {"four-bars": load("four_bar"), "Bricard's mechanism": load("bricard")}
    for kinds in CLOSURES[:1] if short else CLOSURES:
        scenarios[f"random, closed by {' and '.join(kinds)}"] = random_closed(1, kinds)
    found, h, steps = Findings(), 2.5e-4, 100 if short else 400
    for name, scenario in scenarios.items():
        bodies = _Cut(Moving(scenario).go(0.2, 1e-3, **RK4))
        for _ in range(steps):
            bodies.step(h)
        linked = _same_sign(state_of(bodies.moving.motion), bodies.y)
        apart = float(np.abs(linked - bodies.y)[:, :7].max())
        rows = [
            most(name, "cut: error of accelerations over the largest", bodies.off / bodies.size, 1e-10, CUT),
            most(name, f"cut: error of poses after {h * steps:g} s [m, 1]", apart, 1e-10, CUT),
        ]
        found.add(Findings(rows, seconds=bodies.moving.seconds))
    return found


CASES = {"random closed mechanisms": random_mechanisms, "joints cut": cut}
