"""linkwind: co-simulation of mechanisms moving in a flow.

From Python, what ``linkwind run`` does, with the results as arrays::

    import linkwind

    scenario = linkwind.load("two_link", ["bodies.link1.mass=3", "bus.transport=inprocess"])
    outcome = linkwind.run(scenario)
    path = linkwind.open_log(outcome.log).trajectory()  # path.t, path.position, path.wrench …

``load`` and ``loads`` make a scenario (:mod:`linkwind.scenario`). ``run``, ``verify``, ``resume`` and
``serve`` do what the commands do (:mod:`linkwind.api`), also with force models of your own: functions, or
classes derived from ``ForceModel`` (:mod:`linkwind.aero.base`), which find the wind of the scenario with
``Wind`` (:mod:`linkwind.wind`). ``open_log``, ``table`` and ``means`` read a log
(:mod:`linkwind.log.reader`), ``export_fmu`` writes an FMU (:mod:`linkwind.fmi.export`). All errors are
``LinkwindError`` (:mod:`linkwind.errors`).
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

# Where they are; imported when they are asked for, so that a command loads only what it needs.
_PUBLIC = {
    "Capabilities": "linkwind.aero.base:Capabilities",
    "ForceModel": "linkwind.aero.base:ForceModel",
    "LinkwindError": "linkwind.errors:LinkwindError",
    "Wind": "linkwind.wind:Wind",
    "export_fmu": "linkwind.fmi.export:export",
    "load": "linkwind.scenario:load",
    "loads": "linkwind.scenario:loads",
    "means": "linkwind.api:means",
    "open_log": "linkwind.log.reader:open_log",
    "resume": "linkwind.api:resume",
    "run": "linkwind.api:run",
    "serve": "linkwind.api:serve",
    "table": "linkwind.api:table",
    "verify": "linkwind.api:verify",
}
__all__ = list(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'linkwind' has no attribute '{name}'")
    module, _, attribute = _PUBLIC[name].partition(":")
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted([*globals(), *_PUBLIC])
