"""A dynamics that is started again after whatever ended it: on from its log, to the same bits.

Where a log of the run is there, its dynamics is made again from the recorded wrenches and goes on
(:mod:`linkwind.runs.resume`); where there is none the run begins, where it is whole nothing is left to do. So
whoever watches over a process may start it with the same command as often as needed.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from linkwind import schema
from linkwind.dynamics.service import DynamicsService
from linkwind.errors import LinkwindError, LogError, ScenarioError
from linkwind.log.contents import LOG, MOTION
from linkwind.log.head import is_blank
from linkwind.log.reader import Log, open_log
from linkwind.log.scenarios import recorded
from linkwind.log.sink import alone
from linkwind.native.library import library_sha256
from linkwind.report import write_report
from linkwind.runs import folder as folders
from linkwind.runs.changes import HOW, differences
from linkwind.runs.keeping import REPORT
from linkwind.runs.record import exchanges
from linkwind.runs.resume import Plan, Resumed, plan, resume_here
from linkwind.runs.run import Ends, Outcome, Progress, checked, dynamics, with_elsewhere
from linkwind.runs.watch import Watch
from linkwind.scenario import Scenario


@dataclass(frozen=True)
class Finished:
    """A run that has come to its end before.

    Attributes:
        log: of the run.
        report: its page.
    """

    log: Log
    report: Path

    def as_json(self) -> dict[str, Any]:
        """Return what the log says at its end, with the keys of ``linkwind run --json``."""
        return {
            "scenario": json.loads(self.log.scenario_json)["name"],
            "steps": self.log.steps,
            "exchanges": self.log.topics[MOTION] - 1,
            "final_state_sha256": self.log.final_state_sha256,
            "log": str(self.log.path),
            "report": str(self.report),
            "finished_before": True,
        }


def restart(
    scenario: Scenario,
    out: Path | None,
    progress: Progress,
    ends: Ends,
    *,
    run_id: str = "",
    watch: Watch | None = None,
    listened: bool = False,
    goes_on: Callable[[Plan], None] = lambda found: None,
    tell: Callable[[str], None] = lambda text: None,
) -> Outcome | Resumed | Finished:
    """Go on with a run of ``scenario`` where its log ends, or begin it; else as ``dynamics`` of ``runs.run``.

    Args:
        scenario: what to run.
        out: folder of the run; None for the newest run of the same settings and program under ``runs/`` if
            it has not come to its end, else a new one.
        progress: is told now and then how many steps are done, those from the log included.
        ends: where dynamics and providers meet.
        run_id: id of the run; empty for the folder's name.
        watch: who looks at the run while it goes on, if anybody.
        listened: do not begin, or go on, before somebody listens to all of the log.
        goes_on: is told of a run that goes on.
        tell: is told, where ``out`` is None, which run goes on, or why a new one begins.

    Raises:
        LogError: the folder has the log of another run, or of one that is still being made.
        MismatchError: what was recorded does not come out again here; the log is as it was.
        LinkwindError: the run ended early; its log and report tell as well.
    """
    folder = out if out is not None else _unfinished(scenario, tell)
    if folder is None or not (folder / LOG).exists():
        return dynamics(scenario, folder, progress, ends, run_id=run_id, watch=watch, listened=listened)
    with ExitStack() as stack:
        stack.enter_context(alone(folder / LOG))
        log = _opened(folder / LOG)
        if log is None:
            (folder / LOG).unlink()
            stack.close()
            service = DynamicsService(scenario, checked(scenario), run_id or folders.run_id(folder))
            return with_elsewhere(service, folder, progress, ends, watch=watch, listened=listened)
        _check_same(log, scenario, run_id)
        if log.complete:
            return _finished(log)
        found = _plan(log, scenario)
        goes_on(found)
        return resume_here(found, progress, ends, watch, listened=listened, release=stack.close)


def _unfinished(scenario: Scenario, tell: Callable[[str], None]) -> Path | None:
    """Return the folder under ``runs/`` to go on in: of the newest run of these settings, if that was cut.

    Runs that are none, or of others, are passed over. A log that says nothing of its run is taken where no
    other one is.
    """
    blank, passed = None, ""
    for log in _logs(scenario):
        try:
            found = _standing(log, scenario)
        except LinkwindError as error:  # it is another's, or not to be read
            passed = passed or f"; {error}"
            continue
        if found is None:
            blank = blank or log.parent
        elif found.complete and (log.parent / REPORT).exists():
            tell(f"begins a new run: the newest of these settings, {log.parent}, has come to its end")
            return None
        else:
            tell(f"goes on with {log.parent}, the newest run of these settings")
            return log.parent
    if blank is None:
        tell(f"begins a new run: none of these settings is under runs/{passed}")
    else:
        tell(f"begins again in {blank}, where a run was cut before its log said anything{passed}")
    return blank


def _logs(scenario: Scenario) -> list[Path]:
    """Return the logs under ``runs/`` in folders named as those of a scenario's runs, newest first."""
    name = re.compile(re.escape(scenario.name) + r"-\d{8}-\d{6}(-\d+)?")
    logs = [log for log in Path("runs").glob(f"*/{LOG}") if name.fullmatch(log.parent.name)]
    return sorted(logs, key=lambda log: log.stat().st_mtime_ns, reverse=True)


def _standing(path: Path, scenario: Scenario) -> Log | None:
    """Return the log of a run of the same scenario by the same program; None for one that says nothing.

    Raises:
        LinkwindError: it is another's, is being written, or cannot be read.
    """
    with alone(path):
        log = _opened(path)
    if log is None:
        return None
    others = _others(log, scenario, "")
    made_by = log.metadata.get("library_sha256"), log.metadata.get("schema_sha256")
    if made_by != (library_sha256(), schema.SHA256):
        others.append("version of linkwind")
    if others:
        raise LogError(f"{path.parent} has another {', '.join(others[:5])}")
    return log


def _opened(path: Path) -> Log | None:
    """Return a log; None for one that was cut before it said what it is of."""
    if is_blank(path):
        return None
    log = open_log(path)
    return log if log.has_scenario or log.topics else None


def _check_same(log: Log, scenario: Scenario, run_id: str) -> None:
    """Raise LogError unless a log is of a run of this scenario, however that is done."""
    others = _others(log, scenario, run_id)
    if others:
        raise LogError(
            f"{log.path}: expected the log of the very same run, to go on with it; got another "
            f"{', '.join(others[:5])}. Choose another --out, or give the settings of that run."
        )


def _others(log: Log, scenario: Scenario, run_id: str) -> list[str]:
    """Return what of a log is not of a run of this scenario, however that is done."""
    try:
        others = [key for key in differences(recorded(log), scenario) if not _is_how(key)]
    except ScenarioError:
        others = ["a scenario of another version"]
    if log.changes:
        others.append("settings that changed on the way")
    if run_id and run_id != log.run:
        others.append(f'the run id "{log.run}"')
    return others


def _is_how(key: str) -> bool:
    return re.fullmatch(HOW, key) is not None


def _plan(log: Log, scenario: Scenario) -> Plan:
    """Return where a run goes on: behind the last exchange that is whole, or at the beginning."""
    if next(exchanges(log, scenario.coupling.step_ns), None) is None:
        return Plan(log, scenario, {}, last=-1, start=-1)
    return replace(plan(log), scenario=scenario)


def _finished(log: Log) -> Finished:
    """Return what a run came to, with the report that it may have been killed before."""
    report = log.path.with_name(REPORT)
    if not report.exists():
        write_report(log.path, report)
    return Finished(log, report)
