"""The methods side by side: two_link under the stated forces F0, error against time; evaluations of chains.

- two_link: 1.2 s of F0, from the paper's start, in steps of 2 and 1 ms. The wrench of a step is the cubic
  through four exact samples; of `incremental`, as in the paper, the one at its start. The error is the
  largest one of positions (m) and angles (rad) at the end, against DOP853 at rtol 1e-12 on Eqs. 6-9 written
  separately; time is that of the steps, called from Python (some 3 µs each), the fastest of several rounds
  that take turns. The reference is `reduced` with rk4 at the same step. All methods must come to the same
  limit: the error at 1 ms is at most 1.5 times what the method's order makes of that at 2 ms.
- evaluations: µs in C for accelerations and joint forces, reference `reduced`.

Run with ``python -m tests.benchmarks methods``.
"""

from __future__ import annotations

import timeit
from collections.abc import Callable
from typing import Any

import numpy as np

from linkwind.native.cfe import Cfe, Stabilisation
from linkwind.native.incremental import Incremental
from linkwind.native.multibody import Integrator, Multibody
from tests.benchmarks.bench_core import SIZES, chain, fastest, row
from tests.coupling.two_link_reference import END, START, body2, f0, reference, wrench
from tests.native.mechanisms import motion_of, tables, two_link

ROUNDS = 9
STEPS_MS = (2.0, 1.0)
NODES = np.array([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0])
EULER, SEMI, RK4 = Integrator.EULER, Integrator.SEMI_IMPLICIT_EULER, Integrator.RK4
TABLES = tables(two_link())


def cfe(stabilisation: Stabilisation) -> Cfe:
    """Return two_link as free bodies with a hinge."""
    return Cfe(TABLES, stabilisation=stabilisation, time=0.05)


METHODS: dict[str, tuple[Callable[[], Multibody], Integrator, int]] = {  # made by, integrator, order
    "reduced rk4": (lambda: Multibody(TABLES), RK4, 4),
    "cfe none rk4": (lambda: cfe(Stabilisation.NONE), RK4, 4),
    "cfe baumgarte rk4": (lambda: cfe(Stabilisation.BAUMGARTE), RK4, 4),
    "cfe projection rk4": (lambda: cfe(Stabilisation.PROJECTION), RK4, 4),
    "reduced euler": (lambda: Multibody(TABLES), EULER, 1),
    "cfe none euler": (lambda: cfe(Stabilisation.NONE), EULER, 1),
    "cfe projection euler": (lambda: cfe(Stabilisation.PROJECTION), EULER, 1),
    "incremental euler": (lambda: Incremental(TABLES), EULER, 1),
    "incremental semi-implicit euler": (lambda: Incremental(TABLES), SEMI, 1),
}


class Flight:
    """two_link by one method, its forces known beforehand."""

    def __init__(self, name: str, ms: float) -> None:
        make, self.integrator, self.order = METHODS[name]
        self.multibody, self.h = make(), ms / 1e3
        held = name.startswith("incremental")
        self.nodes = np.zeros(1) if held else NODES
        self.steps = round(END / self.h)
        self.wrenches = [
            np.array([wrench(f0((k + s) * self.h, START)) for s in self.nodes]) for k in range(self.steps)
        ]
        z = START
        q, v = [z[0], z[1], z[2], z[3] - z[2]], [z[4], z[5], z[6], z[7] - z[6]]
        self.start = self.multibody.initial_state(np.array(q), np.array(v))
        self.seconds = np.inf

    def fly(self) -> None:
        """Do every step, and remember the fastest time."""
        multibody, state, h, nodes, integrator = (
            self.multibody, self.start, self.h, self.nodes, self.integrator,
        )  # fmt: skip

        def steps() -> None:
            nonlocal state
            for wrenches in self.wrenches:
                state, _ = multibody.advance(state, h, nodes, wrenches, None, integrator=integrator)

        self.seconds = min(self.seconds, timeit.timeit(steps, number=1))
        self.end = state

    def error(self, exact: np.ndarray) -> float:
        """Return the largest error of positions [m] and angles [rad]."""
        motion = motion_of(self.multibody, self.end)
        places = [*motion.position[0, :2], *motion.position[1, :2]]
        off = np.abs(np.array(places) - [*exact[:2], *body2(exact)[:2]])
        angles = np.array([2.0 * np.arctan2(q[3], q[0]) for q in motion.orientation])
        turned = np.abs(np.remainder(angles - exact[2:4] + np.pi, 2 * np.pi) - np.pi)
        return float(max(off.max(), turned.max()))


def two_links() -> list[dict[str, Any]]:
    """Return time and error of every method and step, and the gap of the hinge."""
    exact, rows = reference(f0, 1)[-1], []
    flights = {(name, ms): Flight(name, ms) for ms in STEPS_MS for name in METHODS}
    for _ in range(ROUNDS):
        for flight in flights.values():
            flight.fly()
    for (name, ms), flight in flights.items():
        yardstick, case = flights["reduced rk4", ms], f"F0, {ms:g} ms, {name}"
        times = 1e3 * flight.seconds / END, 1e3 * yardstick.seconds / END
        rows.append(row(case, "µs for a simulated ms", *times, None))
        rows.append(row(case, "error", flight.error(exact), yardstick.error(exact), None))
    for name in METHODS:
        coarse, fine = (flights[name, ms] for ms in STEPS_MS)
        most = 1.5 * coarse.error(exact) / 2**fine.order
        rows.append(row(f"F0, {name}", "error at 1 ms / by its order", fine.error(exact), most, 1.0))
        gap = fine.multibody.joint_gap(motion_of(fine.multibody, fine.end))
        rows.append(row(f"F0, {name}", "joint gap (m) at 1 ms", gap, None, None))
    return rows


def repeated(core: Multibody, q: np.ndarray, v: np.ndarray) -> Callable[[int], object]:
    """Return what evaluates the accelerations a number of times."""
    start = core.initial_state(q, v)
    return lambda count: core.repeat(start, count)


def evaluations() -> list[dict[str, Any]]:
    """Return the times of an evaluation by each method."""
    rows, taken = [], {}
    cases = {f"chain of {n}": chain(n) for n in SIZES} | {"two_link": two_link()}
    for case, bodies in cases.items():
        made, rng = tables(bodies), np.random.default_rng(1)
        cores = {"reduced": Multibody(made), "cfe": Cfe(made, stabilisation=Stabilisation.NONE, time=1.0)}
        if case == "two_link":
            cores["incremental"] = Incremental(made)
        q, v = rng.normal(size=cores["reduced"].nq), rng.normal(size=cores["reduced"].nv)
        timed = {name: repeated(core, q, v) for name, core in cores.items()}
        rounds = [
            fastest(timed, max(5, 500 // len(bodies))) for _ in range(40)
        ]  # short: some are undisturbed
        best = {name: min(each[name] for each in rounds) for name in timed}
        taken[case] = best["cfe"]
        reference = best.pop("reduced")
        rows += [row(case, f"{name}, µs / reduced", time, reference, None) for name, time in best.items()]
    longest, quarter = (taken[f"chain of {n}"] for n in (200, 50))
    rows.append(row("chain of 200", "cfe, µs / chain of 50, linear is 4", longest, quarter, 6.0))
    return rows


def main() -> list[dict[str, Any]]:
    """Return all rows."""
    return two_links() + evaluations()


if __name__ == "__main__":
    for line in main():
        print(line)
