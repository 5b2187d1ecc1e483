"""Expressions → a postfix program for the stack machine of ``fmu/core/lw_expression.h``.

Whatever is not on the lists below is refused, with its column.
"""

from __future__ import annotations

import ast
import difflib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from linkwind.errors import ExpressionError
from linkwind.expression.curves import Curve
from linkwind.expression.syntax import MAX_NESTING, Source
from linkwind.native.expressions import LOCALS_SIZE, MAX_INTEGER_POWER, STACK_SIZE, Operation

CONSTANTS = {"pi": math.pi}
_UNARY = "sin cos tan asin acos atan sinh cosh tanh exp log sqrt abs"
FUNCTIONS = {name: (Operation[name.upper()], 1, 1) for name in _UNARY.split()} | {
    "atan2": (Operation.ATAN2, 2, 2),
    "hypot": (Operation.HYPOT, 2, 2),
    "min": (Operation.MIN, 2, 99),
    "max": (Operation.MAX, 2, 99),
}
"""Operation, least and most arguments; more than two are taken from left to right."""

_BINARY: dict[type[ast.operator], Operation] = {
    ast.Add: Operation.ADD,
    ast.Sub: Operation.SUBTRACT,
    ast.Mult: Operation.MULTIPLY,
    ast.Div: Operation.DIVIDE,
    ast.Pow: Operation.POWER,
}

_SHIFTED = (Operation.CONSTANT, Operation.TABLE)


@dataclass(frozen=True)
class Program:
    """Instructions (operation, operand), and the constants that they push: the first are inputs."""

    code: tuple[tuple[Operation, int], ...]
    constants: tuple[float, ...]
    inputs: int = 0

    def shifted(self, places: int) -> list[tuple[int, int]]:
        """Return the code for constants that stand ``places`` further on."""
        return [(op, operand + places * (op in _SHIFTED)) for op, operand in self.code]


def compile_program(
    let: Mapping[str, str] | None,
    results: Mapping[str, str | Curve],
    item: str,
    *,
    variables: Sequence[str],
    components: Sequence[str],
    inputs: Mapping[str, float] | None = None,
) -> Program:
    """Return the program that gives some results.

    Args:
        let: named expressions in order; each may use those before it. None: there is no place for them.
        results: expressions of some of the components, or curves over the first variable.
        item: where they stand, for errors: ``two_link.toml: aero.field.link1``.
        variables: names that expressions may use, in the order that the program is given them.
        components: names of all results, in the order that the program numbers them.
        inputs: names and values of constants that may be set from outside; expressions may use them.

    Raises:
        ExpressionError: a name or an expression is wrong, or an input of no use.
    """
    inputs = inputs or {}
    for name in inputs:
        _check_name(name, f"{item}.inputs", variables)
    variables = (*variables, *inputs)
    compiler = _Compiler(variables, inputs, defines=let is not None)
    for name, text in (let or {}).items():
        here = f"{item}.let.{name}"
        _check_name(name, here, variables)
        compiler.compile(text, here)
        compiler.define(name, here)
    for component, law in results.items():
        if isinstance(law, Curve):
            compiler.table(law)
        else:
            compiler.compile(law, f"{item}.{component}")
        compiler.emit(Operation.RESULT, components.index(component))
    for name, place in compiler.inputs.items():
        if (Operation.CONSTANT, place) not in compiler.code:
            raise ExpressionError(
                f'{item}.inputs: expected names that an expression uses; got "{name}", which none does. Use '
                "it, or remove it."
            )
    return Program(tuple(compiler.code), tuple(compiler.constants), len(inputs))


def _check_name(name: str, item: str, variables: Sequence[str]) -> None:
    if not (name.isidentifier() and name.isascii()):
        raise ExpressionError(f'{item}: expected a name of letters, digits and _; got "{name}". Rename it.')
    if name in (*variables, *CONSTANTS, *FUNCTIONS):
        raise ExpressionError(
            f'{item}: expected a name that is not taken; got "{name}", which is a variable, constant or '
            "function already. Rename it."
        )


class _Compiler:
    """Emits postfix code for syntax trees, and watches the machine's limits."""

    def __init__(self, variables: Sequence[str], inputs: Mapping[str, float], *, defines: bool) -> None:
        self._variables = variables
        self._defines = defines
        self.inputs = {name: place for place, name in enumerate(inputs)}
        self.code: list[tuple[Operation, int]] = []
        self.constants: list[float] = list(inputs.values())
        self.locals: dict[str, int] = {}
        self._source = Source("0", "")

    def emit(self, operation: Operation, operand: int = 0) -> None:
        self.code.append((operation, operand))

    def define(self, name: str, item: str) -> None:
        if len(self.locals) == LOCALS_SIZE:
            raise ExpressionError(
                f"{item}: expected at most {LOCALS_SIZE} names in let; got more. Join some of them."
            )
        self.locals[name] = len(self.locals)
        self.emit(Operation.DEFINE, self.locals[name])

    def table(self, curve: Curve) -> None:
        """Emit the code that leaves the value of a curve over the first variable on the stack."""
        self.emit(Operation.VARIABLE, 0)
        self.emit(Operation.TABLE, len(self.constants))
        self.constants += curve.layout()

    def compile(self, text: str, item: str) -> None:
        """Emit the code that leaves the value of ``text`` on the stack."""
        self._source = Source(text, item)
        needed = self._expression(self._source.tree(), 1)
        if needed > STACK_SIZE:
            raise self._source.too_deep()

    def _expression(self, node: ast.expr, level: int) -> int:
        """Emit one node; return the number of places that it takes on the stack."""
        if level > MAX_NESTING:
            raise self._source.too_deep()
        match node:
            case ast.Constant():
                return self._number(node)
            case ast.Name():
                return self._name(node)
            case ast.UnaryOp(op=ast.USub()):
                needed = self._expression(node.operand, level + 1)
                self.emit(Operation.NEGATE)
                return needed
            case ast.UnaryOp(op=ast.UAdd()):
                return self._expression(node.operand, level + 1)
            case ast.BinOp():
                return self._chain(node, level)
            case ast.Call():
                return self._call(node, level)
        expected = "numbers, names, + - * / **, brackets and functions"
        raise self._source.error(node, expected, self._source.quote(node), "Nothing else is allowed.")

    def _number(self, node: ast.Constant) -> int:
        value = node.value
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self._source.error(node, "a number", self._source.quote(node), "Write it like 1.5e-3.")
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if math.isinf(number):
            raise self._source.error(
                node, "a number below 1.8e308", self._source.quote(node), "Write a smaller one."
            )
        return self._constant(number)

    def _constant(self, number: float) -> int:
        fixed = len(self.inputs)
        if number not in self.constants[fixed:]:
            self.constants.append(number)
        self.emit(Operation.CONSTANT, self.constants.index(number, fixed))
        return 1

    def _name(self, node: ast.Name) -> int:
        name = node.id
        if name in self.locals:
            self.emit(Operation.LOCAL, self.locals[name])
        elif name in self.inputs:
            self.emit(Operation.CONSTANT, self.inputs[name])
        elif name in self._variables:
            self.emit(Operation.VARIABLE, self._variables.index(name))
        elif name in CONSTANTS:
            self._constant(CONSTANTS[name])
        elif name in FUNCTIONS:
            raise self._source.error(node, f"{name}(…)", f'"{name}"', "Give the function its argument.")
        else:
            known = (*self._variables, *CONSTANTS, *self.locals)
            hint = "Define it in let before it is used." if self._defines else "Use one of these."
            raise self._unknown(node, "one of", known, name, hint)
        return 1

    def _chain(self, node: ast.BinOp, level: int) -> int:
        """Emit a + b - c … without a recursion for each term: sums may be long."""
        chain = [node]
        while isinstance(left := chain[-1].left, ast.BinOp):
            chain.append(left)
        needed = self._expression(left, level + 1)
        for link in reversed(chain):
            operation = _BINARY.get(type(link.op))
            if operation is None:
                raise self._operator(link)
            power = _integer_power(link)
            if power is None:
                needed = max(needed, 1 + self._expression(link.right, level + 1))
                self.emit(operation)
            else:
                self.emit(Operation.POWER_INTEGER, power)
        return needed

    def _operator(self, node: ast.BinOp) -> ExpressionError:
        if isinstance(node.op, ast.BitXor):
            return self._source.error(node, "** for a power", f"^ in {self._source.quote(node)}", "Use **.")
        return self._source.error(
            node, "one of + - * / **", self._source.quote(node), "Use one of these operators."
        )

    def _call(self, node: ast.Call, level: int) -> int:
        if not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS:
            name = (
                node.func.id if isinstance(node.func, ast.Name) else self._source.quote(node.func).strip('"')
            )
            raise self._unknown(node, "a function, one of", FUNCTIONS, name, "Only these can be called.")
        name = node.func.id
        operation, least, most = FUNCTIONS[name]
        given = len(node.args)
        if node.keywords or not least <= given <= most:
            count = f"{least}" if least == most else f"{least} or more"
            got = "named ones" if node.keywords else str(given)
            raise self._source.error(node, f"{count} arguments of {name}", got, "Separate them by commas.")
        needed = 0
        for place, argument in enumerate(node.args):
            needed = max(needed, min(place, 1) + self._expression(argument, level + 1))
            if place or most == 1:
                self.emit(operation)
        return needed

    def _unknown(
        self, node: ast.expr, what: str, known: Iterable[str], name: str, hint: str
    ) -> ExpressionError:
        near = difflib.get_close_matches(name.lower(), known := tuple(known), n=1)
        advice = f'Did you mean "{near[0]}"?' if near else hint
        return self._source.error(node, f"{what} {', '.join(known)}", f'"{name}"', advice)


def _integer_power(node: ast.BinOp) -> int | None:
    """Return the exponent, if it is written as a small whole number."""
    sign, exponent = 1, node.right
    if isinstance(exponent, ast.UnaryOp) and isinstance(exponent.op, ast.USub):
        sign, exponent = -1, exponent.operand
    if not isinstance(node.op, ast.Pow) or not isinstance(exponent, ast.Constant):
        return None
    value = exponent.value
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value // 1:
        return None
    return sign * int(value) if value <= MAX_INTEGER_POWER else None
