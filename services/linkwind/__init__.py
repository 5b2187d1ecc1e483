"""linkwind: co-simulation of mechanisms moving in a flow.

From Python, what ``linkwind run`` does, with the results as arrays::

    import linkwind

    scenario = linkwind.load("two_link", ["bodies.link1.mass=3", "bus.transport=inprocess"])
    outcome = linkwind.run(scenario)
    path = linkwind.open_log(outcome.log).trajectory()  # path.t, path.position, path.wrench …

``load`` and ``loads`` make a scenario (:mod:`linkwind.scenario`), ``run`` runs it (:mod:`linkwind.runs.run`),
``open_log`` reads a log (:mod:`linkwind.log.reader`); all errors are ``LinkwindError``
(:mod:`linkwind.errors`).
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

# Where they are; imported when they are asked for, so that a command loads only what it needs.
_PUBLIC = {
    "LinkwindError": "linkwind.errors",
    "load": "linkwind.scenario",
    "loads": "linkwind.scenario",
    "open_log": "linkwind.log.reader",
    "run": "linkwind.runs.run",
}
__all__ = list(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'linkwind' has no attribute '{name}'")
    return getattr(import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_PUBLIC])
