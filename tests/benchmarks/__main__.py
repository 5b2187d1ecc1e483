"""All benchmarks, or those named: ``python -m tests.benchmarks [core log lockstep run memory verify …]``."""

from __future__ import annotations

import importlib
import json
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

NAMES = sorted(path.stem.removeprefix("bench_") for path in Path(__file__).parent.glob("bench_*.py"))


def main() -> int:
    """Print one table; ``--json`` prints ``rows`` instead. Exit code 1 if a target is missed."""
    arguments = [a for a in sys.argv[1:] if a != "--json"]
    unknown = set(arguments) - set(NAMES)
    if unknown:
        print(f"expected some of {', '.join(NAMES)}; got {', '.join(sorted(unknown))}", file=sys.stderr)
        return 2
    rows = [
        row
        for name in arguments or NAMES
        for row in importlib.import_module(f"tests.benchmarks.bench_{name}").main()
    ]
    if "--json" in sys.argv:
        print(json.dumps({"rows": rows}))
    else:
        table = Table("case", "quantity", "value", "reference", "ratio", "target")
        for row in rows:
            numbers = (
                "" if row[key] is None else f"{row[key]:.4g}" for key in ("value", "reference", "ratio")
            )
            verdict = {True: "met", False: "MISSED", None: ""}[row["ok"]]
            table.add_row(str(row["case"]), str(row["quantity"]), *numbers, verdict)
        Console().print(table)
    return int(any(row["ok"] is False for row in rows))


if __name__ == "__main__":
    sys.exit(main())
