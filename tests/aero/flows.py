"""Short flows around moving bodies for the tests of the model flow."""

import numpy as np

from linkwind.runs.validate.driven import Driven, motion
from linkwind.runs.validate.scenes import PLATE, communication_step, scene
from linkwind.spatial import Wrench

CELLS = 24
STEP = communication_step(0.05, CELLS)


def text(shape=PLATE, **settings):
    """A body of length 1 in a diagonal stream of about 0.6 m/s, Re about 600, in 5 x 5 lengths."""
    defaults = {
        "cells": CELLS, "step": STEP, "viscosity": 1e-3, "window": (5.0, 5.0), "wind": (0.5, 0.3)
    }  # fmt: skip
    return scene(shape, **(defaults | settings))


def swing(t):
    """A path that heaves and pitches."""
    rate = 2.0 * np.pi / (200 * STEP)
    s, c = np.sin(rate * t), np.cos(rate * t)
    pose = np.array([0.02 * s, 0.1 * (1.0 - c), 0.3 + 0.2 * s])
    return pose, rate * np.array([0.02 * c, 0.1 * s, 0.2 * c])


def answer(model, t, n=1):
    """The wrench and response of a fresh evaluation on the path, as bytes."""
    wrench = Wrench.zeros(n)
    wrench.response = np.zeros((6 * n, 6 * n)) if model.capabilities.response_size else None
    model.evaluate(t, motion(*swing(t), n), wrench)
    response = b"" if wrench.response is None else wrench.response.tobytes()
    return wrench.force.tobytes() + wrench.torque.tobytes() + response


def driven(*overrides, shape=PLATE, **settings):
    return Driven(text(shape, **settings), overrides)
