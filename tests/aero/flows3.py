"""Short flows in space around moving bodies for the tests of the model flow of three dimensions."""

import math

import numpy as np

from linkwind import aero
from linkwind.runs.validate.scenes import communication_step
from linkwind.runs.validate.space.scenes import scene
from linkwind.scenario import loads
from linkwind.spatial import Motion, Wrench

CELLS = 10
STEP = communication_step(0.05, CELLS)
SIDE = 4.8  # of a window of 48³ cells
INERTIA = "inertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]"
HEAVY = "mass = 1e3\ninertia = [1e3, 1e3, 1e3, 0.0, 0.0, 0.0]"
PLATE = '{ type = "plate", length = 1.0, span = 0.9 }'
BALL = '{ type = "ellipsoid", size = [1.0, 0.8, 0.6] }'
ROD = '{ type = "circle", diameter = 0.6, span = 1.0 }'
KITE = '{ type = "wing", points = [[0.3, -0.5], [0.5, 0.0], [0.2, 0.5], [-0.5, 0.1]] }'
WIND = (0.5, 0.3, -0.2)


def text(shape=PLATE, *, cells=CELLS, step=STEP, viscosity=1e-2, wind=WIND, window=(SIDE,) * 3, **rest):
    """A body of length 1 in a stream of about 0.6 m/s, Re about 60, in 48³ cells."""
    return scene(shape, cells, step, viscosity, window, wind=tuple(map(float, wind)), **rest)


class Driven:
    """A flow whose bodies are told where to go.

    Attributes:
        scenario: what it was built from.
        model: the force model.
        h: communication step [s].
        n: bodies.
    """

    def __init__(self, scene_text, *overrides):
        self.scenario = loads(scene_text, "scene.toml", list(overrides))
        self.model = aero.build(self.scenario, self.scenario.providers[0])
        self.h = self.scenario.coupling.step_ns / 1e9
        self.n = len(self.scenario.providers[0].bodies)
        self.at = 0

    def go(self, course, steps):
        """Follow a course for so many steps; return the wrenches, shape (steps, n, 6)."""
        if not self.at:
            self.model.commit(0.0, motion(*course(0.0)))
        found = []
        for k in range(self.at + 1, self.at + steps + 1):
            found.append(wrench_of(self.answer(course, k * self.h)))
            self.model.commit(k * self.h, motion(*course(k * self.h)))
        self.at += steps
        return np.array(found)

    def answer(self, course, t, change=0.0):
        """A fresh evaluation at time t, its twist changed."""
        place, twist = course(t)
        out = blank(self.model, self.n)
        self.model.evaluate(t, motion(place, twist + change), out)
        return out


def driven(*overrides, **settings):
    return Driven(text(**settings), *overrides)


def blank(model, n):
    """A wrench with room for everything that the model says."""
    out = Wrench.zeros(n)
    out.response = np.zeros((6 * n, 6 * n)) if model.capabilities.response_size else None
    out.diagnostics = np.zeros(len(model.capabilities.diagnostics))
    return out


def wrench_of(out):
    """Force and torque of each body, shape (n, 6)."""
    return np.hstack([out.force, out.torque])


def bits(out):
    """All of an answer as bytes."""
    response = b"" if out.response is None else out.response.tobytes()
    return out.force.tobytes() + out.torque.tobytes() + response + out.diagnostics.tobytes()


def motion(place, twist):
    """Positions and rotation vectors, and twists, (6,) or (n, 6), as a motion."""
    place, twist = np.atleast_2d(place), np.atleast_2d(twist)
    out = Motion.at_rest(len(place))
    out.position[:], out.linear[:], out.angular[:] = place[:, :3], twist[:, :3], twist[:, 3:]
    for k, vector in enumerate(place[:, 3:]):
        angle = float(np.linalg.norm(vector))
        out.orientation[k, 0] = math.cos(0.5 * angle)
        out.orientation[k, 1:] = vector * (math.sin(0.5 * angle) / angle if angle else 0.5)
    return out


AXIS = np.array([2.0, -1.0, 2.0]) / 3.0


def swing(t):
    """A body that heaves, sways and pitches about an axis that is none of the lattice's."""
    rate = 2.0 * np.pi / (600 * STEP)
    s, c = np.sin(rate * t), np.cos(rate * t)
    place = np.array([0.02 * s, 0.1 * (1.0 - c), -0.03 * s, *(0.3 + 0.2 * s) * AXIS])
    return place, rate * np.array([0.02 * c, 0.1 * s, -0.03 * c, *0.2 * c * AXIS])


def still(*place):
    """The course of a body that stays, at a place (x, y, z, rotation vector)."""
    there = np.array([*place, *np.zeros(6 - len(place))])
    return lambda t: (there, np.zeros(6))


def steady(*twist):
    """The course of a body that moves, and does not turn."""
    velocity = np.array([*twist, 0.0, 0.0, 0.0])
    return lambda t: (velocity * t, velocity)
