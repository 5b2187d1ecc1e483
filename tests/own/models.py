"""Force models as users write them, to be named on a command line."""

import struct

import numpy as np

import linkwind
from linkwind.aero.plate import Plate


class Native(linkwind.ForceModel):
    """The native plate, called from Python."""

    capabilities = linkwind.Capabilities(added_inertia=True)

    def __init__(self, scenario, provider):
        self.plate = Plate(scenario, provider)

    def evaluate(self, t, motion, wrench):
        self.plate.evaluate(t, motion, wrench)


def drag(t, motion, wrench):
    wrench.force[:] = -0.5 * np.linalg.norm(motion.linear, axis=1)[:, None] * motion.linear


class Wake(linkwind.ForceModel):
    """A drag of what the speed was lately."""

    def __init__(self, scenario, provider):
        self.speed = 0.0

    def commit(self, t, motion):
        self.speed = 0.9 * self.speed + 0.1 * float(np.linalg.norm(motion.linear))

    def evaluate(self, t, motion, wrench):
        wrench.force[:] = -0.5 * self.speed * motion.linear

    def save(self):
        return struct.pack("<d", self.speed)

    def restore(self, blob):
        (self.speed,) = struct.unpack("<d", blob)


class Everything(linkwind.ForceModel):
    """It returns all that there is."""

    capabilities = linkwind.Capabilities(added_inertia=True, response_size=72, diagnostics=("speed [m/s]",))

    def evaluate(self, t, motion, wrench):
        wrench.force[:] = -2.0 * motion.linear
        wrench.response[:, range(3), range(3)] = 2.0
        wrench.added_inertia[:] = 0.1 * np.eye(6)
        wrench.diagnostics[0] = np.linalg.norm(motion.linear[0])


def counts(t, motion, wrench):
    COUNT.append(t)
    wrench.force[:, 0] = len(COUNT)


COUNT = []


def fails_later(t, motion, wrench):
    if t > 0.0115:
        print(1.0 / (t - t))  # line 68
