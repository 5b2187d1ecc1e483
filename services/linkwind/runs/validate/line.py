"""Bodies that move along x under a fluid that is a formula: the real core and schemes, no provider."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from linkwind.coupling import SCHEMES, Answer, Settings
from linkwind.dynamics.plant import MechanismPlant, State, acceleration_weight
from linkwind.mechanism import build
from linkwind.scenario import loads
from linkwind.spatial import Array, Motion


class Seen(NamedTuple):
    """What a fluid is asked about: time [s]; x and its rate, accepted before and tried now [m, m/s].

    The places and rates have shape (n,), or are numbers where there is one body (:meth:`Body.fly`).
    """

    t: float
    before: tuple[Any, Any]
    now: tuple[Any, Any]


class Says(NamedTuple):
    """What it answers: force along x [N], added mass [kg], minus the derivative of the force by v [N·s/m].

    A force for each body; added mass and derivative are those of every body.
    """

    force: Any
    added: float | None = None
    slope: float | None = None


class Flown(NamedTuple):
    """x [m] and its rate [m/s] after each step, shape (steps + 1, n), and how often the fluid was asked."""

    x: Array
    v: Array
    exchanges: int


@dataclass(frozen=True)
class Body:
    """A body in the plane that moves along x, with a spring of its own that is not coupled.

    Attributes:
        mass: [kg].
        spring: [N/m].
        start: x [m] and its rate [m/s].
    """

    mass: float = 1.0
    spring: float = 0.0
    start: tuple[float, float] = (0.0, 1.0)

    def fly(
        self, fluid: Callable[[Seen], Says], h: float, steps: int, scheme: str, order: int
    ) -> tuple[Array, Array]:
        """Return x [m] and its rate [m/s] of this body alone, shape (steps + 1,) each; see :func:`fly`."""

        def of_one(seen: Seen) -> Says:
            (x0, v0), (x, v) = seen.before, seen.now
            return fluid(Seen(seen.t, (float(x0[0]), float(v0[0])), (float(x[0]), float(v[0]))))

        flown = fly([self], of_one, h, steps, scheme, order)
        return flown.x[:, 0], flown.v[:, 0]


def fly(
    bodies: Sequence[Body],
    fluid: Callable[[Seen], Says],
    h: float,
    steps: int,
    scheme: str,
    order: int,
    **settings: Any,
) -> Flown:
    """Move bodies in steps of h [s].

    Args:
        bodies: side by side.
        fluid: answers for all of them.
        h: step [s].
        steps: how many.
        scheme: of the coupling.
        order: likewise.
        settings: others of `linkwind.coupling.Settings`.
    """
    scenario = loads(_scene(bodies, h, h * steps), "validation")
    mechanism, n = build(scenario), len(bodies)
    plant = MechanismPlant(mechanism, scenario, lambda: "the validation")
    motion, exchanges = Motion.at_rest(n), 0

    def along(state: State) -> tuple[Array, Array]:
        plant.multibody.motion(state.values, motion)
        return motion.position[:, 0].copy(), motion.linear[:, 0].copy()

    def exchange(step: int, iteration: int, accepted: State, trial: State) -> Answer:
        nonlocal exchanges
        exchanges += 1
        return _answer(n, fluid(Seen(step * h, along(accepted), along(trial))))

    chosen = {"adaptive": False, "tolerance": 1e-13} | settings
    x, v = np.zeros((steps + 1, n)), np.zeros((steps + 1, n))
    how = Settings(acceleration_weight(mechanism), order=order, **chosen)
    for point in SCHEMES[scheme](plant, exchange, plant.initial, steps, how):
        x[point.step], v[point.step] = along(point.state)
    return Flown(x, v, exchanges)


def _scene(bodies: Sequence[Body], step: float, end: float) -> str:
    head = f"[time]\nend = {end!r}\n[environment]\ngravity = [0.0, 0.0, 0.0]\n"
    tail = f'[aero]\nmodel = "plate"\n[coupling]\nstep = {step!r}\n'
    return head + "".join(_body(f"body{i}", body) for i, body in enumerate(bodies)) + tail


def _body(name: str, body: Body) -> str:
    spring = f"stiffness = [{body.spring!r}, 0.0, 0.0]" if body.spring else ""
    return f"""
[[bodies]]
name = "{name}"
mass = {body.mass!r}
inertia = 1.0
position = [{body.start[0]!r}, 0.0]
velocity = [{body.start[1]!r}, 0.0]
shape = {{ type = "plate", length = 1.0 }}
[[joints]]
name = "guide_{name}"
type = "planar"
parent = "world"
child = "{name}"
{spring}
"""


def _answer(n: int, says: Says) -> Answer:
    wrench, added, slope = np.zeros((n, 6)), None, None
    wrench[:, 0] = says.force
    if says.added is not None:
        added = np.zeros((n, 6, 6))
        added[:, :3, :3] = says.added * np.eye(3)
        added[:, 3:, 3:] = 1e-3 * says.added * np.eye(3)
    if says.slope is not None:
        slope = np.zeros((6 * n, 6 * n))
        slope[::6, ::6] = says.slope * np.eye(n)
    return Answer(wrench, added, slope)
