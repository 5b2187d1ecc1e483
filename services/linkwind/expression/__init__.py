"""Expressions and tables of a scenario as programs of the stack machine of ``fmu/core/lw_expression.h``."""

from linkwind.expression.compiler import CONSTANTS, FUNCTIONS, Program, compile_program
from linkwind.expression.curves import Curve, curve, law

__all__ = ["CONSTANTS", "FUNCTIONS", "Curve", "Program", "compile_program", "curve", "law"]
