"""XML with line numbers, read without document types: no entity is ever expanded or fetched."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

import numpy as np

from linkwind.errors import InputError
from linkwind.spatial import Array

DEEPEST = 500  # nested elements; no robot has as many


@dataclass
class Element:
    """An element of a file.

    Attributes:
        file: what errors call the file.
        line: where the element starts, from 1.
        tag: its name.
        attributes: as written.
        children: in the file's order.
    """

    file: str
    line: int
    tag: str
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)

    def __str__(self) -> str:
        name = self.attributes.get("name")
        return f"<{self.tag}>" if name is None else f'<{self.tag} name="{name}">'

    def all(self, tag: str) -> Iterator[Element]:
        """Return the children of that name."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        """Return the first child of that name."""
        return next(self.all(tag), None)

    def need(self, tag: str) -> Element:
        """Return the first child of that name.

        Raises:
            InputError: there is none.
        """
        found = self.first(tag)
        if found is None:
            self.refuse(f"an element <{tag}>", "none", "Add it.")
        return found

    def text(self, key: str) -> str:
        """Return an attribute that must be there.

        Raises:
            InputError: it is not.
        """
        if key not in self.attributes:
            self.refuse(f"an attribute {key}", "none", "Add it.")
        return self.attributes[key]

    def numbers(self, key: str, count: int, default: tuple[float, ...] | None = None) -> Array:
        """Return the numbers of an attribute, shape (count,); ``default`` where it is absent.

        Raises:
            InputError: it is absent without a default, or holds something else.
        """
        if key not in self.attributes and default is not None:
            return np.array(default)
        written = self.text(key)
        try:
            numbers = [float(part) for part in written.split()]
        except ValueError:
            numbers = []
        if len(numbers) != count or not all(map(math.isfinite, numbers)):
            what = "a finite number" if count == 1 else f"{count} finite numbers with spaces between them"
            xacro = "Expand the file with xacro first." if "$" in written else "Correct it."
            self.refuse(f'{what} in {key}="…"', f'"{written[:60]}"', xacro)
        return np.array(numbers)

    def number(self, key: str, default: float | None = None) -> float:
        """Return the number of an attribute; ``default`` where it is absent.

        Raises:
            InputError: it is absent without a default, or no finite number.
        """
        return float(self.numbers(key, 1, None if default is None else (default,))[0])

    def refuse(self, expected: str, got: str, advice: str) -> NoReturn:
        """Raise an InputError about this element."""
        raise InputError(f"{self.file}:{self.line}: {self}: expected {expected}; got {got}. {advice}")


def read(path: Path) -> Element:
    """Return the root of an XML file.

    Raises:
        InputError: the file cannot be read, is not well-formed, or declares a document type.
    """
    try:
        text = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}. Check the path.") from None
    builder = _Builder(str(path))
    try:
        builder.parser.Parse(text, True)
    except expat.ExpatError as error:
        advice = "It is no text of this kind, or damaged."
        raise InputError(f"{path}:{error.lineno}: expected XML; got: {error}. {advice}") from None
    except (ValueError, LookupError) as error:  # an encoding that Python does not know
        raise InputError(f"{path}: expected XML; got: {error}. Save it as UTF-8.") from None
    return builder.root


class _Builder:
    def __init__(self, file: str) -> None:
        self.file = file
        self.open: list[Element] = []
        self.root = Element(file, 1, "", {})
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.StartDoctypeDeclHandler = self._doctype

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        element = Element(self.file, self.parser.CurrentLineNumber, tag, attributes)
        if len(self.open) == DEEPEST:
            element.refuse(f"at most {DEEPEST} elements inside each other", "more", "Flatten the file.")
        if self.open:
            self.open[-1].children.append(element)
        else:
            self.root = element
        self.open.append(element)

    def _end(self, tag: str) -> None:
        self.open.pop()

    def _doctype(self, name: str, *_: object) -> NoReturn:
        raise InputError(
            f"{self.file}:{self.parser.CurrentLineNumber}: expected no document type; got <!DOCTYPE {name}>, "
            "which may declare entities. Remove it."
        )
