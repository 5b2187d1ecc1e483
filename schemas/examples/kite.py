"""A kite: the air presses on its sail along the normal, at a point that goes back as the angle grows."""

import numpy as np

import linkwind


class Kite(linkwind.ForceModel):
    def __init__(self, scenario, provider):
        self.density, self.wind = scenario.environment.density, linkwind.Wind(scenario)
        self.sails = [body.shape for body in scenario.bodies]

    def evaluate(self, t, motion, wrench):
        wind = self.wind.velocity(t, motion.position)
        for body, axes in enumerate(motion.rotation()):
            sail, air = self.sails[body], wind[body] - motion.linear[body]
            chord, normal, speed = axes[:, 0], axes[:, 1], np.linalg.norm(air)
            force = self.density * sail.length * sail.span * speed * (air @ normal) * normal
            point = -0.25 * sail.length * (air @ chord) / speed * chord
            wrench.force[body], wrench.torque[body] = force, np.cross(point, force)
