"""What a mechanism lost on its way from or to a file of another kind."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from dataclasses import dataclass

WIDTH = 108


@dataclass(frozen=True)
class Remark:
    """Something that is not, or not as it was, on the other side.

    Attributes:
        what: the kind of thing, in the plural.
        why: or what became of it.
        item: which one.
    """

    what: str
    why: str
    item: str


def grouped(remarks: Iterable[Remark]) -> dict[tuple[str, str], list[str]]:
    """Return the items by what they are and why they are not there."""
    groups: dict[tuple[str, str], list[str]] = {}
    for remark in remarks:
        groups.setdefault((remark.what, remark.why), []).append(remark.item)
    return groups


def comment(remarks: Iterable[Remark]) -> list[str]:
    """Return the remarks as lines of text, for the top of a file."""
    groups = grouped(remarks)
    lines = ["Left out or changed:"] if groups else []
    for (what, why), items in groups.items():
        lines += wrapped(f"{what} ({len(items)}): {why}", "  - ", "    ")
        lines += wrapped(", ".join(items), "    ", "    ")
    return lines


def wrapped(text: str, first: str = "", further: str = "") -> list[str]:
    """Return a text as lines, without what could end a comment."""
    plain = "".join(letter if letter.isprintable() else " " for letter in text)
    return textwrap.wrap(plain, WIDTH, initial_indent=first, subsequent_indent=further)
