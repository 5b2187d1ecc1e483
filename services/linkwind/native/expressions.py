"""The stack machine of ``fmu/core/lw_expression.h``: its instructions, and what a program gives at a time."""

from __future__ import annotations

import ctypes
import enum
from collections.abc import Sequence

import numpy as np

from linkwind.native.library import declare
from linkwind.spatial import address

STACK_SIZE = 64
LOCALS_SIZE = 64
MAX_INTEGER_POWER = 16  # above it repeated multiplication loses more digits than pow

Operation = enum.IntEnum(
    "Operation",
    "CONSTANT VARIABLE LOCAL DEFINE RESULT NEGATE ADD SUBTRACT MULTIPLY DIVIDE POWER POWER_INTEGER "
    "SIN COS TAN ASIN ACOS ATAN SINH COSH TANH EXP LOG SQRT ABS ATAN2 HYPOT MIN MAX TABLE",
    start=0,
)
"""Instructions, numbered in the order of the header."""

_jet = declare("lw_expression_jet", [ctypes.c_void_p] * 5, None)


def derivatives(
    code: Sequence[tuple[int, int]], constants: Sequence[float], at: float
) -> tuple[float, float, float]:
    """Return the result of a program of one variable and its first two derivatives, at a value of it."""
    program, numbers = np.array(code, np.int32).reshape(-1, 2), np.array([*constants, 0.0])
    start, result = int(program.__array_interface__["data"][0]), np.zeros(3)
    _jet(start, start + program.nbytes, address(numbers), address(np.array([at, 1.0, 0.0])), address(result))
    value, rate, change = result.tolist()
    return value, rate, change
