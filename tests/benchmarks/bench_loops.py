"""Loops and chains: cost by size, and time for an accuracy of 1e-6 m next to MuJoCo, Pinocchio and Exudyn.

- cost: µs for accelerations in C. Trees are linear in the bodies, up to 500. So are rows of four-bars, whose
  loops share links with their neighbours only; loops that all hang on one body cost at most the cube of
  their number.
- accuracy: rows of four-bars (IFToMM A02) and a chain of ten rods. Every tool goes through its steps, coarse
  ones first, until the tip is right to 1e-6 m at all times, or a run takes several seconds; that run is
  timed, CPU time of the thread, the best of several. Values are linkwind's ms for a simulated second (by its
  fastest integrator), references the tool's. What does not get to 1e-6 m is shown with its best error.
  MuJoCo and Exudyn make all steps between two looks at the tip in one call, as linkwind does. Pinocchio has
  no integrators: RK4 in numpy around its binding, so that Python is in its time; "calls only" is what its
  four calls a step take, and what no program around it can beat.

Exact solutions: four-bars by elliptic functions, the chain by DOP853 on equations written here. Run with
``python -m tests.benchmarks loops``; peers by ``pip install '.[peers]'``, missing ones are left out.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from linkwind.native.multibody import Integrator, Multibody
from linkwind.runs.validate.multibody.published import crank
from tests.benchmarks import peers
from tests.benchmarks.bench_core import chain as links
from tests.benchmarks.bench_core import fastest, ours, row
from tests.native.loops import four_bars
from tests.native.mechanisms import Body, Closure, tables

ACCURACY = 1e-6  # m
ROUNDS = 5
LONGEST = 3.0  # s, of a run after which no smaller step is tried
G = 9.81


# ---- cost


def hub(legs: int) -> tuple[Multibody, np.ndarray]:
    """A free body tied to the world by ``legs`` distances."""
    rng = np.random.default_rng(2)
    ends = rng.normal(size=(legs, 2, 3))
    ties = [
        Closure(-1, 0, 64, tuple(far), tuple(near), length=float(np.linalg.norm(far - near)))
        for far, near in ends
    ]
    multibody = Multibody(tables([Body(-1, "free")], closures=ties))
    return multibody, multibody.initial_state(np.array([0.0, 0, 0, 1, 0, 0, 0]), np.zeros(6))


def evaluation(multibody: Multibody, state: np.ndarray) -> Callable[[int], object]:
    return lambda count: multibody.repeat(state, count)


def growth(
    case: str, made: dict[int, Callable[[int], object]], power: float, slack: float
) -> list[dict[str, Any]]:
    """Return how the µs of an evaluation grow with the size, against that power of it."""
    timed = {str(size): evaluate for size, evaluate in made.items()}
    best = fastest(timed, max(20, 4000 // max(made)))
    (small, *_, large), us = sorted(made), {int(size): value for size, value in best.items()}
    rows = [row(f"{case} {size}", "µs for accelerations", value, None, None) for size, value in us.items()]
    allowed = us[small] * (large / small) ** power
    return [
        *rows,
        row(f"{case} {large}", f"µs / {case} {small} · ratio^{power:g}", us[large], allowed, slack),
    ]


def costs() -> list[dict[str, Any]]:
    trees = {n: ours(links(n))["linkwind"] for n in (50, 100, 200, 500)}
    rows = growth("chain of", trees, 1.0, 1.5)
    rows += growth("four-bars in a row,", {n: evaluation(*four_bars(n)) for n in (10, 40, 160)}, 1.0, 1.5)
    return rows + growth("ties of one body,", {n: evaluation(*hub(n)) for n in (6, 24, 96)}, 3.0, 1.0)


# ---- accuracy


def bars_path(count: int, times: np.ndarray) -> np.ndarray:
    angles = [crank(count, float(t))[0] for t in times]
    return np.array([[math.cos(a), math.sin(a)] for a in angles])


def chain_path(count: int, times: np.ndarray) -> np.ndarray:
    """Angles against the level as coordinates: M θ'' = -Σ m sin(θi - θj) θj'² - weight cos θ."""
    i = np.arange(count)
    behind = count - 1 - i
    shared = count - 1 - np.maximum.outer(i, i) + np.where(np.eye(count), 1 / 3, 0.5)

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        angle, speed = y[:count], y[count:]
        apart = np.subtract.outer(angle, angle)
        right = -(shared * np.sin(apart)) @ speed**2 - (behind + 0.5) * G * np.cos(angle)
        return np.concatenate([speed, np.linalg.solve(shared * np.cos(apart), right)])

    start = np.zeros(2 * count)
    y = solve_ivp(rate, (0.0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-13).y[:count]
    return np.column_stack([np.cos(y).sum(axis=0), np.sin(y).sum(axis=0)])


Tool = dict[str, Callable[[], peers.Flight]]


def tools(case: str, count: int) -> dict[str, Tool]:
    """Return the settings of every tool, those that are cheap first."""
    steps = (20e-3, 10e-3, 5e-3, 2e-3, 1e-3)
    small = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5)
    tolerances = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
    rk4 = {
        f"{1e3 * h:g} ms": partial(peers.linkwind, case, count, Integrator.RK4, h) for h in steps
    }  # fmt: skip
    dopri5 = {
        f"{t:g}": partial(peers.linkwind, case, count, Integrator.DOPRI5, 0.1, rtol=t, atol=t)
        for t in tolerances
    }
    mujoco_steps = small[:-1] if case == "four-bars" else steps
    return {
        "linkwind, rk4": rk4,
        "linkwind, dopri5": dopri5,
        "MuJoCo, RK4": {
            f"{1e3 * h:g} ms": partial(peers.mujoco, case, count, "RK4", h) for h in mujoco_steps
        },
        "MuJoCo, implicitfast": {
            f"{1e3 * h:g} ms": partial(peers.mujoco, case, count, "implicitfast", h) for h in small[:-1]
        },
        "Pinocchio, RK4": {f"{1e3 * h:g} ms": partial(peers.Pinocchio, case, count, h) for h in steps},
        "Exudyn, generalised-α": {f"{1e3 * h:g} ms": partial(peers.Exudyn, case, count, h) for h in small},
    }


def seconds(flight: peers.Flight, times: np.ndarray, rounds: int) -> tuple[float, np.ndarray]:
    """Return CPU seconds, the least of several rounds, and the path."""
    least = math.inf
    for _ in range(rounds):
        start = time.thread_time()
        path = flight(times)
        least = min(least, time.thread_time() - start)
    return least, path


def best(tool: Tool, times: np.ndarray, exact: np.ndarray) -> tuple[str, float, float]:
    """Return the first setting that is accurate, else the most accurate one: name, ms a second, error."""
    found = ("", math.inf, math.inf)
    for name, make in tool.items():
        flight = make()
        try:
            took, path = seconds(flight, times, 1)
        except Exception:  # Exudyn's solver gives up; the next step is smaller
            continue
        error = float(np.abs(path - exact).max())
        if error <= ACCURACY:
            took = min(took, seconds(flight, times, ROUNDS if took < 1.0 else 1)[0])
        if error < found[2]:
            found = name, 1e3 * took / times[-1], error
        if error <= ACCURACY or took > LONGEST:
            break
    return found


def bare_calls(case: str, count: int, setting: str) -> float:
    """Return ms a second of Pinocchio's four calls a step, without what is around them."""
    step = 1e-3 * float(setting.removesuffix(" ms"))
    flight = peers.Pinocchio(case, count, step)
    calls = range(2000)
    least = math.inf
    for _ in range(ROUNDS):
        start = time.thread_time()
        for _ in calls:
            flight.acceleration(flight.q0, flight.v0)
        least = min(least, (time.thread_time() - start) / len(calls))
    return 1e3 * 4.0 * least / step


def compare(case: str, count: int, end: float) -> list[dict[str, Any]]:
    times = np.linspace(0.0, end, round(20 * end) + 1)[1:]
    exact = (bars_path if case == "four-bars" else chain_path)(count, times)
    name, results = f"{case}, N = {count}, {end:g} s", {}
    for tool, settings in tools(case, count).items():
        try:
            results[tool] = best(settings, times, exact)
        except ImportError:
            continue
    ms = min(result[1] for tool, result in results.items() if "linkwind" in tool and result[2] <= ACCURACY)
    rows = []
    for tool, (setting, took, error) in results.items():
        reached = bool(error <= ACCURACY)
        what = f"{tool} {setting}: ms a second, error {error:.0e} m" + (
            "" if reached else ", not 1e-6 m at any step tried"
        )
        target = None if "linkwind" in tool else 1.0
        rows.append(row(name, what, ms if target else took, took if target else ms, target))
        if tool.startswith("Pinocchio") and reached:
            bound = bare_calls(case, count, setting)
            rows.append(row(name, f"{tool} {setting}, calls only: ms a second", ms, bound, 1.0))
    return rows


def main() -> list[dict[str, Any]]:
    """Return the rows; peers that are not installed are left out."""
    rows = costs()
    for case, count, end in (
        ("four-bars", 2, 10.0),
        ("four-bars", 10, 2.0),
        ("four-bars", 40, 2.0),
        ("chain", 10, 1.0),
    ):
        rows += compare(case, count, end)
    return rows


if __name__ == "__main__":
    for line in main():
        print(line)
