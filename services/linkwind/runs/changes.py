"""Which settings of a scenario may change in the middle of a run, and how that is told from a new run."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from typing import Any

from linkwind.errors import ScenarioError
from linkwind.scenario import Scenario, from_json

# Settings that say how a run is done; no number that it gives depends on them.
HOW = r"bus\..*|log\..*|coupling\.timeout|description|providers\.\d+\.(flow|vortex)\.threads"
# Settings that may change from a communication point on; what bodies and providers remember stays right.
PHYSICS = (
    r"time\.end|environment\..*|joints\.\d+\.(stiffness|damping|rest).*|dynamics\.(integrator|substeps|rtol|atol)"
    r"|forces\.\d+\.inputs\..*|providers\.\d+\.(plate|field)\..*|providers\.\d+\.(flow|vortex)\.frames"
)
REMEMBERED = (
    r"environment\.(wind|inputs|density|viscosity|gusts).*"  # by a flow: its lattice has them in its state
)
MAY_CHANGE = (
    "time.end, environment.*, joints.*.stiffness, .damping and .rest, dynamics.integrator, .substeps, .rtol "
    "and .atol, forces.*.inputs, the settings of the models plate and field, coupling.timeout, bus.*, log.*"
)


def split(scenario: Scenario, overrides: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the overrides that say how a run is done, and those that change what it gives.

    Raises:
        ScenarioError: an override is wrong, or of a setting that may not change in a run.
    """
    how: list[str] = []
    physics: list[str] = []
    for override in overrides:
        paths = list(differences(scenario, _changed(scenario, [override])))
        for path in paths:
            if not re.fullmatch(f"{HOW}|{PHYSICS}", path):
                raise ScenarioError(
                    f"--set {override}: expected a setting that may change in a run ({MAY_CHANGE}); got "
                    f"{path}. Run the changed scenario from the beginning."
                )
            if re.fullmatch(REMEMBERED, path) and any(p.model == "flow" for p in scenario.providers):
                raise ScenarioError(
                    f"--set {override}: expected a setting that the fluid does not remember; got {path}, "
                    "with the model flow. Run the changed scenario from the beginning."
                )
        (how if all(re.fullmatch(HOW, path) for path in paths) else physics).append(override)
    return tuple(how), tuple(physics)


def differences(one: Scenario, other: Scenario) -> Iterator[str]:
    """Yield the dotted keys at which two scenarios differ."""
    yield from _differences(json.loads(one.to_json()), json.loads(other.to_json()), "")


def _differences(one: Any, other: Any, path: str) -> Iterator[str]:
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted(one.keys() | other.keys()):
            yield from _differences(one.get(key), other.get(key), f"{path}.{key}" if path else key)
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for index, pair in enumerate(zip(one, other, strict=True)):
            yield from _differences(*pair, f"{path}.{index}")
    elif one != other:
        yield path


def _changed(scenario: Scenario, overrides: Sequence[str]) -> Scenario:
    return from_json(scenario.to_json(), scenario.source, overrides)
