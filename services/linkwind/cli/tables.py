"""Where tables are printed: as wide as the terminal, and as wide as they are where there is none."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

UNBOUNDED = 1000  # columns; a file or a pipe takes every line whole


def console() -> Console:
    """Return the console of standard output."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else UNBOUNDED)
