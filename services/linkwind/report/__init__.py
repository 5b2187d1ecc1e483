"""The report of a run: one HTML file with an animation, the plots and the tables.

    write_report(Path("runs/two_link-1/log.mcap"), Path("runs/two_link-1/report.html"))

``data`` reads the log, ``scene`` and ``panels`` say what is drawn, ``page`` writes it; ``assets`` draws it in
the browser.
"""

from __future__ import annotations

from pathlib import Path

from linkwind.report.data import read
from linkwind.report.page import render


def write_report(log_path: Path, out: Path) -> None:
    """Write the report of a run as one self-contained HTML file.

    Args:
        log_path: MCAP log of the run, complete or cut short.
        out: the file to write; its folder exists.

    Raises:
        LogError: the log is missing or not one of linkwind's.
    """
    out.write_text(render(read(log_path)), encoding="utf-8")


__all__ = ["write_report"]
