"""What a job leaves behind, however it ends: its log, closed with how it ended, and the report."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from linkwind.bus.base import DynamicsLink
from linkwind.errors import LinkwindError, StoppedError
from linkwind.interrupt import TooLateError, at_most, stops_as_interrupt
from linkwind.log.contents import LOG
from linkwind.log.writer import LogWriter

T = TypeVar("T")

REPORT = "report.html"  # beside the log
REPORT_TIME = 1.0  # s for the report of a run that was told to stop


@dataclass(frozen=True)
class Kept(Generic[T]):
    """A job that is done, and its files.

    Attributes:
        result: of the job.
        log: the MCAP file.
        report: the HTML page; None if none was asked for.
        report_trouble: why there is no page; empty if there is one.
        log_trouble: why the log ends before the job does; empty if it does not.
    """

    result: T
    log: Path
    report: Path | None
    report_trouble: str
    log_trouble: str


def keep(
    folder: Path,
    link: DynamicsLink,
    new_log: Callable[[Path], LogWriter],
    job: Callable[[LogWriter], T],
    *,
    report: bool = True,
) -> Kept[T]:
    """Do a job that writes a log, leave the bus, and write the report either way.

    Args:
        folder: for both files.
        link: an open end of the bus; is closed.
        new_log: makes the log.
        job: writes it and closes it with how it ended; an error is recorded here.
        report: whether there is to be one.

    Raises:
        LinkwindError: the job's, with the places of the files.
    """
    log, page = folder / LOG, folder / REPORT if report else None
    try:
        with stops_as_interrupt(), closing(link), new_log(log) as writer:
            result = job(writer)
    except LinkwindError as error:
        if not log.exists():
            raise
        make = _report_at_once if isinstance(error, StoppedError) else _report
        told = f"\nreport: {make(log, page) or page}" if page else ""
        raise type(error)(f"{error}\nlog: {log}{told}") from error
    return Kept(result, log, page, _report(log, page) if page else "", writer.cut)


def _report(log: Path, report: Path) -> str:
    """Write the report; return what went wrong, which must not hide how the run went."""
    from linkwind.report import write_report

    try:
        write_report(log, report)
    except LinkwindError as error:
        return str(error)
    return ""


def _report_at_once(log: Path, report: Path) -> str:
    """Write the report if that can be done at once: who stops a run does not wait for it."""
    try:
        with at_most(REPORT_TIME):
            return _report(log, report)
    except TooLateError:
        return f"takes more than {REPORT_TIME:g} s. Make it with: linkwind report {log}"
