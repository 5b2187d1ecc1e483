"""A force model with a memory that is larger than any message may be."""

from __future__ import annotations

import numpy as np

import linkwind

SIZE = 300_000_000  # bytes


class Large(linkwind.ForceModel):
    """A part of its memory changes with every accepted state and acts on the bodies."""

    def __init__(self, scenario, provider):
        self.memory = np.arange(SIZE // 8, dtype="<f8")

    def commit(self, t, motion):
        place = round(t * 1e3) % 1000 * (len(self.memory) // 1000)
        self.memory[place : place + 1000] += motion.linear[0, 1]
        self.memory[0] = self.memory[place : place + 1000].mean() % 1.0

    def evaluate(self, t, motion, wrench):
        wrench.force[:] = -0.5 * motion.linear
        wrench.force[0, 1] += self.memory[0]

    def save(self):
        return self.memory.tobytes()

    def restore(self, blob):
        self.memory[:] = np.frombuffer(blob, "<f8")
