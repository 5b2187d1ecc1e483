"""What programs call, by the names of ``import linkwind``: the commands as functions, and tables of a log.

``models`` puts models of the user's own in the place of those of the scenario, by provider. A model is

- a function ``force(t, motion, wrench)`` that writes ``wrench.force`` and ``wrench.torque``, which are zero
  before. It is taken to remember nothing; motion and wrench have the bodies of its provider, in that order;
- a class derived from :class:`linkwind.ForceModel`, for all that a model can do;
- ``"FILE.py:NAME"``, either of these in a file, which a process of its own can load;
- ``"FILE.fmu"``, somebody else's.

A function or class of this process keeps the run in this process (bus.transport ``inprocess``). The log says
its file and name, and the SHA-256 of the file as it was when the run began.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from types import MappingProxyType
from typing import Any

from numpy.typing import NDArray

from linkwind import aero
from linkwind.aero import Own, PythonSource
from linkwind.aero.source import refuse_while_loading
from linkwind.log import export
from linkwind.log.means import means as _means
from linkwind.log.reader import Log, open_log
from linkwind.runs import resume as resuming
from linkwind.runs import run as running
from linkwind.runs import verify as verifying
from linkwind.runs.labels import labels_of
from linkwind.runs.own import settled
from linkwind.scenario import Scenario, load

Models = Mapping[str, Any]
Progress = Callable[[int], None]

_NONE: Models = MappingProxyType({})


def run(
    scenario: Scenario | str | Path,
    out: str | Path | None = None,
    *,
    models: Models = _NONE,
    report: bool = True,
    tls: str | Path | None = None,
    progress: Progress = lambda step: None,
) -> running.Outcome:
    """Run a scenario with every provider on this machine, as ``linkwind run``.

    Args:
        scenario: what to run, or what :func:`linkwind.load` takes: a built-in's name or a file.
        out: folder for log and report; None for a new one under ``runs/``.
        models: of the user's own, by provider, see :mod:`linkwind.api`.
        report: make the page of the run.
        tls: folder with a certificate for each participant; None without TLS.
        progress: is told now and then how many steps are done.

    Raises:
        LinkwindError: the run ended early; its log and report tell as well.
    """
    refuse_while_loading()
    own = _own(models)
    loaded = scenario if isinstance(scenario, Scenario) else load(scenario)
    complete, _ = settled(_together(loaded, own), own)
    return running.run(complete, _path(out), progress, own, _path(tls), report=report)


def serve(
    name: str,
    model: Any = None,
    *,
    connect: str | Sequence[str] = (),
    listen: str | Sequence[str] = (),
    run: str = "*",
    start_timeout: float = 60.0,
    tls: str | Path | None = None,
) -> None:
    """Be a provider of one run that is started elsewhere, until it is over, as ``linkwind aero``.

    Args:
        name: of the provider, as in the scenario, whose model is ``python`` there.
        model: of the user's own, see :mod:`linkwind.api`; None for the one of the scenario.
        connect: zenoh endpoints of the dynamics, or of a router, such as ``tcp/10.0.0.2:7447``.
        listen: zenoh endpoints to listen on.
        run: id of the run, ``*`` for the only one there.
        start_timeout: [s] to wait for the dynamics.
        tls: folder with the provider's certificate; None without TLS.

    Raises:
        LinkwindError: no dynamics came, it refused the provider, the run or the model failed.
    """
    from linkwind.aero.service import serve as serve_link
    from linkwind.aero.service import session
    from linkwind.bus.zenoh import ZenohProviderLink
    from linkwind.credentials import identity_in

    refuse_while_loading()
    provider = session(name, None if model is None else aero.own(model))
    identity = identity_in(_path(tls), name)
    ends = (_several(connect), _several(listen))
    with closing(ZenohProviderLink(*ends, run, name=name, identity=identity)) as link:
        serve_link(link, provider, start_timeout)


def verify(
    log: Log | str | Path,
    *,
    models: Models = _NONE,
    from_recorded_wrenches: bool = False,
    progress: Progress = lambda step: None,
) -> verifying.Verified:
    """Run a log again from what it contains and compare bit for bit, as ``linkwind verify``.

    Args:
        log: of a run: open, its file, or the run's folder.
        models: of the user's own that the run was made with, by provider, see :mod:`linkwind.api`.
        from_recorded_wrenches: take the forces from the log; they are not compared.
        progress: is told now and then how many steps are done.

    Returns:
        whether it is ``identical``, and the first ``difference`` if it is not.

    Raises:
        InputError: the log cannot be run again here, or a model is missing or another one.
    """
    refuse_while_loading()
    opened, scenario = verifying.scenario_of(_opened(log).path)
    recorded = from_recorded_wrenches
    return verifying.verify(opened, scenario, progress, _own(models), from_recorded_wrenches=recorded)


def resume(
    log: Log | str | Path,
    out: str | Path | None = None,
    *,
    from_step: int | None = None,
    overrides: Sequence[str] = (),
    models: Models = _NONE,
    report: bool = True,
    tls: str | Path | None = None,
    progress: Progress = lambda step: None,
) -> running.Outcome:
    """Go on with a run from its log, as ``linkwind resume``.

    Args:
        log: of a run: open, its file, or the run's folder; may be cut or damaged.
        out: folder for the new log and report; None for a new one under ``runs/``.
        from_step: go on after this step; None for the last one whose exchange is whole.
        overrides: ``KEY=VALUE`` settings that count from there on.
        models: of the user's own that the run was made with, by provider, see :mod:`linkwind.api`.
        report: make the page of the run.
        tls: folder with a certificate for each participant; None without TLS.
        progress: is told now and then how many steps are done, those from the log included.

    Raises:
        MismatchError: what was recorded does not come out again here.
        LinkwindError: there is nothing to go on with, or the run ended early.
    """
    refuse_while_loading()
    own = _own(models)
    found = resuming.plan(_opened(log), from_step, overrides)
    found = dataclasses.replace(found, scenario=_together(found.scenario, own))
    return resuming.resume(found, _path(out), progress, own, _path(tls), report=report).outcome


def table(log: Log | str | Path, name: str = "trajectory") -> dict[str, NDArray[Any]]:
    """Return a table of a log as columns by title, which are those of ``linkwind log export``.

    Args:
        log: of a run: open, its file, or the run's folder.
        name: ``trajectory``, the accepted states; ``steps``, what the coupling did; ``wrench_PROVIDER``, the
            answers of a provider.

    Returns:
        columns such as ``t [s]``, ``link1.position.x [m]``, ``hinge.q [rad]``, and the providers' own
        numbers, ``aero.incidence_deg``; each of shape (rows,).

    Raises:
        LogError: there is no such log or table.
    """
    opened = _opened(log)
    return export.table(opened, name, labels_of(opened))


def means(
    log: Log | str | Path, begin: float | None = None, end: float | None = None, name: str = "trajectory"
) -> dict[str, float]:
    """Return the mean of each column of a table over a range of time, as ``linkwind log means``.

    Args:
        log: of a run: open, its file, or the run's folder.
        begin: of the range [s]; None for that of the log.
        end: of the range [s], a whole number of beats later, say; None for that of the log.
        name: of the table, see :func:`table`.

    Returns:
        means by title, by the trapezoidal rule; at the ends of the range by straight lines between rows. NaN
        where a value within the range is.

    Raises:
        InputError: the range reaches beyond the log, or is none.
        LogError: there is no such log or table.
    """
    opened = _opened(log)
    return _means(table(opened, name), begin, end, str(opened.path))


def _own(models: Models) -> dict[str, Own]:
    return {name: aero.own(model) for name, model in models.items()}


def _together(scenario: Scenario, own: Mapping[str, Own]) -> Scenario:
    """Return the scenario, in one process if a model is in this one only."""
    if not any(isinstance(model, PythonSource) and model.here is not None for model in own.values()):
        return scenario
    return scenario.model_copy(update={"bus": scenario.bus.model_copy(update={"transport": "inprocess"})})


def _opened(log: Log | str | Path) -> Log:
    return log if isinstance(log, Log) else open_log(log)


def _path(path: str | Path | None) -> Path | None:
    return None if path is None else Path(path)


def _several(endpoints: str | Sequence[str]) -> list[str]:
    return [endpoints] if isinstance(endpoints, str) else list(endpoints)
