"""Where a run leaves its files."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from linkwind.errors import InputError


def create(name: str, out: Path | None) -> Path:
    """Create and return the folder of a run.

    Args:
        name: of the scenario.
        out: the folder asked for; None for ``runs/<name>-<date>-<time>``.

    Raises:
        InputError: the folder exists and is not empty, or cannot be created.
    """
    try:
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
            if any(out.iterdir()):
                raise InputError(
                    f"{out}: expected a new or empty folder; got one with files. Choose another --out."
                )
            return out
        stem = f"{name}-{time.strftime('%Y%m%d-%H%M%S')}"
        for attempt in range(1, 1000):
            folder = Path("runs") / (stem if attempt == 1 else f"{stem}-{attempt}")
            try:
                folder.mkdir(parents=True)
            except FileExistsError:
                continue
            return folder
    except OSError as error:
        raise InputError(
            f"{error.filename}: cannot create the folder of the run: {error.strerror}. Choose another --out."
        ) from error
    raise InputError(f"runs/{stem}: expected a free name; got none in 1000 tries. Choose one with --out.")


@contextmanager
def removed_if_refused(folder: Path) -> Iterator[None]:
    """Remove the folder again if the input proves wrong within the block, unless there is something in it."""
    try:
        yield
    except InputError:
        with suppress(OSError):
            folder.rmdir()
        raise


def run_id(folder: Path) -> str:
    """Return the folder's name as it may stand in a bus key."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", folder.resolve().name) or "run"
