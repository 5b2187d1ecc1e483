"""What is wrong with a scenario, as data: where, expected, got, and what to do."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any

Path = tuple[str | int, ...]

# What other programs call the things that these files name.
SYNONYMS = {
    "hinge": "revolute",
    "pin": "revolute",
    "continuous": "revolute",
    "slider": "prismatic",
    "slide": "prismatic",
    "ball": "spherical",
    "weld": "fixed",
    "rigid": "fixed",
    "floating": "free",
    "forward_euler": "euler",
    "symplectic_euler": "semi_implicit_euler",
    "runge_kutta": "rk4",
    "rk45": "dopri5",
    "ode45": "dopri5",
    "radau": "radau5",
    "ode15s": "radau5",
    "angle": "angle_deg",
    "dt": "step",
    "implicit": "pec",  # spelled like explicit, but that is the opposite
}


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong, at a path of keys and indices into the scenario."""

    path: Path
    expected: str
    got: str
    advice: str

    def below(self, path: Path) -> Problem:
        """Return the same problem, seen from ``path`` levels further up."""
        return replace(self, path=path + self.path)

    def line(self, name: str | None = None) -> str:
        """Return the problem as one line, without the file's name; ``name``: see ``item``."""
        text = f"expected {self.expected}; got {self.got}. {self.advice}"
        return f"{item(self.path, name)}: {text}" if self.path else text


class ProblemError(ValueError):
    """Raised inside a validator; carries problems to whoever translates the validation error."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(problem.line() for problem in self.problems))

    @classmethod
    def value(cls, expected: str, got: Any, advice: str) -> ProblemError:
        """Return the error for one value that its own validator refuses."""
        return cls([Problem((), expected, show(got), advice)])


def item(path: Path, name: str | None = None) -> str:
    """Return a path as the reader would write it: ``joints[0] "hinge".type``.

    Args:
        path: keys and indices.
        name: of the entry ``path[:2]`` of a list of tables, if it has one.
    """
    parts = [f"[{part}]" if isinstance(part, int) else f".{part}" for part in path]
    if name and isinstance(path[1], int) and path[2:] != ("name",):
        parts[1] += f" {show(name)}"
    return "".join(parts).removeprefix(".")


def show(value: Any, depth: int = 0) -> str:
    """Return a short, one-line rendering of a value, as TOML writes it."""
    if isinstance(value, dict):
        return "{…}" if depth else "a table"
    if isinstance(value, list | tuple):
        text = "…" if depth > 1 else ", ".join(show(entry, depth + 1) for entry in value[:8])
        text = f"[{text}, …]" if len(value) > 8 else f"[{text}]"
    elif isinstance(value, str | bool | None):
        text = json.dumps(value, ensure_ascii=False)
    elif isinstance(value, float):
        text = repr(value)
    else:
        try:
            text = str(value)
        except ValueError:  # an integer with more digits than Python prints
            text = "a number of very many digits"
    return text if len(text) <= 60 else f"{text[:57]}…"


def nearest(word: str, candidates: Sequence[str]) -> str | None:
    """Return the candidate that ``word`` was probably meant to be."""
    synonym = SYNONYMS.get(word.lower())
    if synonym in candidates:
        return synonym
    matches = get_close_matches(word.lower(), candidates, n=1, cutoff=0.55)
    return matches[0] if matches else None


def choice(path: Path, what: str, candidates: Sequence[str], word: Any) -> Problem:
    """Return the problem of a word that is not among the candidates."""
    near = nearest(word, candidates) if isinstance(word, str) else None
    advice = f'Use "{near}".' if near else "Use one of these." if candidates else "Leave it out."
    return Problem(path, f"{what} {', '.join(candidates) or '(there is none)'}", show(word), advice)
