"""A provider is given scenarios with the path of a file at every text; it must not touch that file.

A program of its own, because Python's audit hooks stay. Prints how many scenarios, how many touches, and
what the provider said.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from linkwind.aero.service import session
from linkwind.errors import LinkwindError
from linkwind.mechanism import build
from linkwind.protocol import DynamicsSession
from linkwind.scenario import load

SCENARIOS = (
    ("two_link", []),
    ("two_link_gust", []),
    ("two_link_flow", ["aero.flow.cells=16"]),
    ("two_link", ["aero.model=fmu"]),
)
SUSPICIOUS = ("open", "os.", "shutil.", "subprocess.", "ctypes.dlopen", "import", "socket.", "exec", "glob.")


def texts(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield where the texts of a scenario are, and where one may be that is left out."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from texts(inner, (*path, key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from texts(inner, (*path, index))
    elif isinstance(value, str) or value is None:
        yield path


def replaced(value: Any, path: tuple[Any, ...], text: str) -> Any:
    """Return a scenario with a text at a place."""
    copy = json.loads(json.dumps(value))
    inner = copy
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = text
    return copy


def tampered(canary: Path) -> Iterator[str]:
    """Yield scenarios with the path at every text, and under keys that do not exist."""
    for name, settings in SCENARIOS:
        plain = json.loads(load(name, settings).to_json())
        for path in texts(plain):
            yield json.dumps(replaced(plain, path, str(canary)))
        for key in ("file", "path", "include", "source"):
            yield json.dumps(plain | {key: str(canary)})
            provider = plain["providers"][0] | {key: str(canary)}
            yield json.dumps(plain | {"providers": [provider]})


def offered(scenario_json: str) -> str:
    """Let a provider take part under a scenario, up to its readiness; return its error."""
    base = load("two_link")
    bodies = build(base).bodies
    dynamics = DynamicsSession("run", scenario_json, 1_000_000, 10, bodies, {"aero": bodies})
    provider = session("aero")
    try:
        provider.welcome(dynamics.control(provider.hello()))
        provider.build()
        provider.ready()
    except LinkwindError as error:
        return str(error)
    except StopIteration:
        return "no provider of that name"
    finally:
        provider.close()
    return ""


def main() -> None:
    """Offer them all."""
    with tempfile.TemporaryDirectory() as folder:
        canary = Path(folder) / "canary.fmu"
        canary.write_text("x")
        touched: list[str] = []

        def hook(event: str, arguments: tuple[object, ...]) -> None:
            if event.startswith(SUSPICIOUS) and any("canary" in repr(argument) for argument in arguments):
                touched.append(event)

        scenarios = list(tampered(canary))
        list(map(offered, scenarios[:1]))  # what is imported and compiled on the way
        sys.addaudithook(hook)
        errors = [offered(text) for text in scenarios]
        found = list(touched)
        canary.open().close()
        assert touched != found, "the hook sees what it should"
    said = sum(1 for error in errors if error)
    print(len(scenarios), len(found), f"{said} refused with an error, {len(errors) - said} ignored", sep="\t")


if __name__ == "__main__":
    main()
