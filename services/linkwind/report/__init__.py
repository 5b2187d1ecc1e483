"""The report of a run: one HTML file with an animation, the plots and the tables.

    write_report(Path("runs/two_link-1/log.mcap"), Path("runs/two_link-1/report.html"))

``data`` reads the log, ``scene`` and ``panels`` say what is drawn, ``page`` writes it; ``assets`` draws it in
the browser.
"""

from __future__ import annotations

import contextlib
from pathlib import Path

from linkwind.errors import InputError
from linkwind.report.data import read
from linkwind.report.page import render


def write_report(log_path: Path, out: Path) -> None:
    """Write the report of a run as one self-contained HTML file.

    Args:
        log_path: MCAP log of the run, complete or cut short.
        out: the file to write; its folder exists.

    Raises:
        LogError: the log is missing or not one of linkwind's.
        InputError: the file cannot be written.
    """
    page = render(read(log_path))
    partial = out.with_name(out.name + ".partial")
    try:
        partial.write_text(page, encoding="utf-8")
        partial.replace(out)  # a page that is there stays whole until the new one is
    except BaseException as error:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)
        if not isinstance(error, OSError):
            raise
        raise InputError(f"{out}: cannot write the report: {error.strerror}. Choose another place") from error


__all__ = ["write_report"]
