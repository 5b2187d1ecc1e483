"""Short scenarios for the tests of the force models."""

from linkwind import aero
from linkwind.scenario import loads
from linkwind.spatial import Wrench

PLATE = """
[time]
end = 1.0
[[bodies]]
name = "plate"
mass = 1.0
inertia = 1.0
shape = { type = "plate", length = 0.4, span = 0.7 }
[aero]
model = "plate"
"""


def model(text, *overrides):
    """The force model of a scenario's first provider."""
    scenario = loads(text, "scene", overrides)
    return aero.build(scenario, scenario.providers[0])


def wrench(force_model, motion, t=0.0, n=1):
    """The wrench on n bodies, in fresh arrays."""
    out = Wrench.zeros(n, added_inertia=force_model.capabilities.added_inertia)
    force_model.evaluate(t, motion, out)
    return out
