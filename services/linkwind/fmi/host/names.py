"""What the name of a variable tells: which quantity, which component, of which body.

The shapes that are understood: ``link1.r[1]`` (linkwind), ``wheel_state.pos.x`` and ``wheel_load.force.x``
(Chrono), ``s, v, a → f`` and ``phi, w, a → tau`` (Modelica's adaptors), ``relativeVelocity_x →
fluidDynamicForce_x`` (gazebo-fmi, in the body frame), ``Fx``, ``force_link1.x``, ``bodies[2].F[1]``, and
native arrays of shape (3), (n, 3), (6, 6) …
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher

from linkwind.fmi.host.quantities import INPUTS, OUTPUTS


@dataclass(frozen=True)
class Reading:
    """What a name says.

    Attributes:
        body: index among the provider's bodies; None where the name names none.
        component: index.
        body_frame: whether variables of this name are usually in the body frame.
    """

    quantity: str
    component: int
    body: int | None = None
    body_frame: bool = False


# One letter: upper and lower case mean different things. All else: in lower case, without underscores.
_INPUT_WORDS = {
    "position": "r s pos position location translation",
    "orientation": "q Q rot orientation quat quaternion attitude",
    "velocity": "v V vel velocity linvel linearvelocity",
    "angular_velocity": "w omega angvel angularvelocity",
    "relative_velocity": "vrel relvel relativevelocity airvelocity airspeed",
    "wind": "wind windvelocity uinf freestream",
    "acceleration": "a acc acceleration linacc linearacceleration",
    "angular_acceleration": "alpha angacc angularacceleration",
    "angle": "phi theta angle",
    "density": "rho density",
}
_OUTPUT_WORDS = {
    "force": "F f force fluiddynamicforce",
    "torque": "T M tau torque moment fluiddynamicmoment fluiddynamictorque",
    "added_inertia": "A addedinertia addedmass",
    "point": "point applicationpoint",
}
_BODY_FRAME_WORDS = {"relativevelocity", "fluiddynamicforce", "fluiddynamicmoment", "fluiddynamictorque"}
# Pieces of a name that say nothing: what may stand before a word.
_NEUTRAL = {
    *("state", "load", "wheel", "body", "bodies", "link", "frame", "fluid", "aero", "hydro"),
    *("input", "output", "in", "out", "u", "y", "com", "cg"),
}
# A single number is about z (planar mechanisms), or along x (the 1-D adaptors of Modelica).
_SINGLE = {"angular_velocity": 2, "angular_acceleration": 2, "torque": 2} | dict.fromkeys(
    ("position", "velocity", "acceleration", "force"), 0
)


def _index(words: dict[str, str]) -> dict[str, str]:
    return {word: quantity for quantity, line in words.items() for word in line.split()}


_WORDS = {"input": _index(_INPUT_WORDS), "output": _index(_OUTPUT_WORDS)}


def read(name: str, causality: str, bodies: Sequence[str], *, scalar: bool) -> Reading | None:
    """Return what a name says, or None.

    Args:
        name: of one element: ``link1.r[2]``; elements of native arrays are written like this too.
        causality: ``input`` or ``output``.
        bodies: names of the provider's bodies.
        scalar: whether the variable is a single number by itself.
    """
    rest, body = _without_body(name, bodies)
    indices: tuple[int, ...] = ()
    if found := re.search(r"\[([\d,\s]+)\]$", rest):
        indices = tuple(int(number) for number in found[1].split(","))
        rest = rest[: found.start()]
    words = _WORDS[causality]
    for stem, letter in _splits(rest, has_indices=bool(indices)):
        word = _word(stem, words)
        if word is None:
            continue
        quantity = words[word]
        reading = _component(quantity, letter, indices, len(bodies) if body is None else 0)
        if reading is None and not indices and not letter and scalar:
            reading = _single(quantity)
        if reading is not None:
            component, row = reading
            return Reading(quantity, component, row if row is not None else body, word in _BODY_FRAME_WORDS)
    return None


def _without_body(name: str, bodies: Sequence[str]) -> tuple[str, int | None]:
    """Take the name of a body, or its number, out of a variable's name."""
    for index in sorted(range(len(bodies)), key=lambda i: -len(bodies[i])):
        found = re.search(rf"(?:^|(?<=[._\]])){re.escape(bodies[index])}(?:$|(?=[._\[]))", name)
        if found:
            left, right = name[: found.start()].rstrip("._"), name[found.end() :].lstrip("._")
            separator = "" if not left or right.startswith("[") else "."
            return left + separator + right, index
    found = re.match(r"(?:body|bodies|link|links)(?:\[(\d+)\]|_?(\d+))[._]", name)
    if found and 1 <= (number := int(found[1] or found[2])) <= len(bodies):
        return name[found.end() :], number - 1
    return name, None


def _splits(rest: str, *, has_indices: bool) -> list[tuple[str, str]]:
    """Return the ways to read a name as a word and the letter of a component."""
    splits = []
    if not has_indices:
        if found := re.fullmatch(r"(.+)[._]([wxyz]|[eq][0-3])", rest):
            splits.append((found[1], found[2]))
        if found := re.fullmatch(r"(.+?)_?([xyzXYZ])", rest):
            splits.append((found[1], found[2].lower()))
    whole = (rest, "")
    # "q.w" is a component of a quaternion, "link.w" an angular velocity: the longer reading comes first.
    return [*splits, whole]


def _word(stem: str, words: dict[str, str]) -> str | None:
    """Return the known word at the end of a stem with nothing but neutral pieces before it."""
    pieces = re.findall(r"[A-Za-z]+?(?=[A-Z][a-z]|[\d._]|$)|\d+", stem.replace("_", "."))
    if not pieces or "".join(pieces) != re.sub(r"[._]", "", stem):
        return None
    for begin in range(len(pieces)):
        tail = "".join(pieces[begin:])
        word = tail if len(tail) == 1 else tail.lower()
        if word in words and all(piece.lower() in _NEUTRAL or piece.isdigit() for piece in pieces[:begin]):
            return word
    return None


def _component(
    quantity: str, letter: str, indices: tuple[int, ...], bodies: int
) -> tuple[int, int | None] | None:
    """Return component and body that a letter or indices say, or None where they say neither."""
    components = {**INPUTS, **OUTPUTS}[quantity].components
    if letter:
        if quantity == "orientation" and letter[0] in "eq" and len(letter) == 2:
            return int(letter[1]), None
        return (components.index(letter), None) if letter in components else None
    body = None
    needed = 2 if quantity == "added_inertia" else 1 if len(components) > 1 else 0
    if len(indices) == needed + 1:
        body, indices = indices[0] - 1, indices[1:]
        if not 0 <= body < bodies:
            return None
    if len(indices) != needed:
        return None
    if not needed:
        return 0, body
    limits = (6, 6) if needed == 2 else (len(components),)
    if not all(1 <= i <= most for i, most in zip(indices, limits, strict=True)):
        return None
    return ((indices[0] - 1) * 6 + indices[1] - 1 if needed == 2 else indices[0] - 1), body


def _single(quantity: str) -> tuple[int, int | None] | None:
    """Return the component that a single number stands for: about z, or along x."""
    component = _SINGLE.get(quantity)
    return None if component is None else (component, None)


def likeness(name: str, causality: str) -> dict[str, float]:
    """Return how much a name looks like each quantity, from 0 to 1, for the candidates of an error."""
    stem = re.sub(r"[^a-z]", "", re.sub(r"(\[.*\]|[._][xyz])$", "", name).lower())
    alike = {}
    for quantity, line in (_INPUT_WORDS if causality == "input" else _OUTPUT_WORDS).items():
        words = [quantity.replace("_", ""), *(word for word in line.split() if len(word) > 1)]
        alike[quantity] = max(SequenceMatcher(None, stem, word).ratio() for word in words)
    return alike
