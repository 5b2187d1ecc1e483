"""When to exchange motion and force, and how to converge, on two callables.

A scheme drives a plant (the bodies: ``plant.advance``) and an exchange (the fluid: one question and its
answer) from the initial state through all steps, and yields every communication point once its state is
final. It knows neither a bus nor a model::

    settings = Settings(weight, order=3)
    for point in SCHEMES["pec"](plant, exchange, initial, steps, settings):
        print(point.step, point.state)

With a force held over the step the order of the integrator buys nothing, the hold is the error: so
`explicit` is the baseline and `pec` the scheme to use. To add a scheme: one file with a generator
function ``run`` like those two, one entry here.
"""

from __future__ import annotations

from linkwind.coupling import explicit, implicit, pec
from linkwind.coupling.answer import Answer
from linkwind.coupling.base import CommunicationPoint, Exchange, Met, Plant, Scheme, Settings, State
from linkwind.coupling.degree import DegreeControl
from linkwind.coupling.history import History

SCHEMES: dict[str, Scheme] = {"explicit": explicit.run, "pec": pec.run, "implicit": implicit.run}

__all__ = [
    "SCHEMES",
    "Answer",
    "CommunicationPoint",
    "DegreeControl",
    "Exchange",
    "History",
    "Met",
    "Plant",
    "Scheme",
    "Settings",
    "State",
]
