"""The text of an expression: its syntax tree, and errors that point into it.

Python's own parser reads it; nothing is evaluated.
"""

from __future__ import annotations

import ast
import warnings

from linkwind.errors import ExpressionError

MAX_LENGTH = 10_000
MAX_NESTING = 100

_LINE = {ord(c): " " for c in "\r\n\t\f\v"}  # a text may be broken into lines


class Source:
    """An expression as it is written.

    Attributes:
        item: where it stands, the beginning of each error.
    """

    def __init__(self, text: str, item: str) -> None:
        self.item = item
        self._text = text.lstrip().translate(_LINE)
        self._blanks = len(text) - len(self._text)  # before the text, for columns
        if not self._text:
            raise ExpressionError(f"{item}: expected an expression; got nothing. Write 0 for no force.")
        if "#" in text:  # Python would drop what follows
            at = text.index("#") + 1
            raise ExpressionError(
                f'{item}: column {at}: expected an expression; got "#". Put comments outside.'
            )
        if len(text) > MAX_LENGTH:
            raise ExpressionError(
                f"{item}: expected at most {MAX_LENGTH} characters; got {len(text)}. "
                "Split it into let = { … }."
            )

    def tree(self) -> ast.expr:
        """Return the syntax tree.

        Raises:
            ExpressionError: the text is not an expression.
        """
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # Python's hints on unusual source text
                return ast.parse(self._text, mode="eval").body
        except (SyntaxError, ValueError) as error:
            raise ExpressionError(
                f'{self.item}: expected an expression; got "{_short(self._text)}" '
                f"({getattr(error, 'msg', error)}). Check brackets and operators."
            ) from None
        except (RecursionError, MemoryError):
            raise self.too_deep() from None

    def quote(self, node: ast.expr) -> str:
        """Return the part of the text that a node stands for, in quotes."""
        return f'"{_short(ast.get_source_segment(self._text, node) or self._text)}"'

    def error(self, node: ast.expr, expected: str, got: str, advice: str) -> ExpressionError:
        """Return the error that something about a node is wrong, with its column."""
        before = self._text.encode()[: node.col_offset].decode()  # offsets are in bytes
        column = self._blanks + len(before) + 1
        return ExpressionError(f"{self.item}: column {column}: expected {expected}; got {got}. {advice}")

    def too_deep(self) -> ExpressionError:
        """Return the error that the expression has too many levels."""
        return ExpressionError(
            f"{self.item}: expected at most {MAX_NESTING} nested levels; got more. "
            "Name parts of it in let = { … }."
        )


def _short(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= 40 else f"{line[:39]}…"
