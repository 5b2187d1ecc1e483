"""Expressions against Python's own arithmetic, and the errors for those that are not allowed."""

import math
import operator

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from linkwind.errors import ExpressionError
from linkwind.expression import CONSTANTS, FUNCTIONS, compile_program
from linkwind.expression.syntax import MAX_LENGTH
from linkwind.native.expressions import LOCALS_SIZE, STACK_SIZE, Operation
from linkwind.native.forces import COMPONENTS, VARIABLES, Field, FieldTable
from linkwind.spatial import Motion, Wrench

MOTION = Motion(
    np.array([[0.3, -1.2, 2.5]]),
    np.array([[math.cos(0.35), 0.0, 0.0, math.sin(0.35)]]),
    np.array([[-0.7, 1.9, 0.01]]),
    np.array([[4.0, -0.2, 11.0]]),
)
TIME = 0.125
VALUES = dict(
    zip(
        ("t", "x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz"),
        (TIME, *np.hstack([MOTION.position[0], MOTION.linear[0], MOTION.angular[0]]).tolist()),
        strict=True,
    ),
    theta=math.atan2(2 * math.cos(0.35) * math.sin(0.35), math.cos(0.35) ** 2 - math.sin(0.35) ** 2),
)
FIELD = {"variables": VARIABLES, "components": COMPONENTS}
PYTHON = {name: getattr(math, name, None) for name in FUNCTIONS}
PYTHON |= {"abs": abs, "min": min, "max": max}


def run(let, text):
    """The value of an expression, computed by the library."""
    program = compile_program(let, {"tz": text}, "scene.toml: aero.field.body", **FIELD)
    table = FieldTable(
        np.zeros(1, dtype=np.int32),
        np.array([0, len(program.code)], dtype=np.int32),
        np.array(program.code, dtype=np.int32),
        np.array(program.constants, dtype=float),
    )
    wrench = Wrench.zeros(1)
    Field(table, np.zeros(1)).evaluate(TIME, MOTION, wrench)
    assert not wrench.force.any()
    return wrench.torque[0, 2]


def value(text):
    """The same by Python; the text comes from this file."""
    return eval(text, {"__builtins__": {}}, VALUES | PYTHON | CONSTANTS)


def applied(form, function):
    """Combine expressions, each a pair of text and value, by a text form and a function of floats."""

    def combine(parts):
        texts, values = zip(*parts, strict=True)
        try:
            result = None if None in values else float(function(*values))
        except (ArithmeticError, ValueError):
            result = None  # where Python raises, the library gives inf or NaN, which ends the run
        return form.format(*texts, ", ".join(texts)), result

    return combine


def power(n):
    """x**n as a product of floats, in any order for |n| ≤ 3."""
    return lambda x: math.prod([x] * n) if n >= 0 else 1.0 / math.prod([x] * -n)


def extend(inner):
    binary = {"({} + {})": operator.add, "({} - {})": operator.sub, "({} * {})": operator.mul}
    binary |= {"({} / {})": operator.truediv, "atan2({}, {})": math.atan2}
    unary = {"(-{})": operator.neg, "(+{})": operator.pos}
    unary |= {f"{name}({{}})": PYTHON[name] for name, (_, _, most) in FUNCTIONS.items() if most == 1}
    unary |= {f"({{}} ** {n})": power(n) for n in range(-3, 4)}
    several = {"min({3})": min, "max({3})": max}
    return st.one_of(
        st.tuples(*[inner] * places).map(applied(form, function))
        for places, forms in ((1, unary), (2, binary), (3, several))
        for form, function in forms.items()
    )


leaves = (
    st.floats(0.01, 100.0).map(lambda x: (repr(x), x))
    | st.integers(0, 20).map(lambda n: (str(n), float(n)))
    | st.sampled_from([*VALUES.items(), *CONSTANTS.items()])
)


@settings(max_examples=300, deadline=None)
@given(st.recursive(leaves, extend, max_leaves=20))
def test_random_expressions_agree_with_python_to_the_last_bit(expression):
    """The same functions of the C library in the same order."""
    text, expected = expression
    assume(expected is not None and not math.isnan(expected))
    assert run({}, text) == expected


@given(st.floats(-1e3, 1e3).filter(lambda x: abs(x) > 1e-3), st.integers(-40, 40))
def test_powers_are_those_of_python(x, n):
    assert run({"base": repr(x)}, f"base ** {n}") == pytest.approx(x**n, rel=5e-15)


@pytest.mark.parametrize(
    "text",
    [
        "-x**2", "2**-1", "2**3**2", "-2**2", "8/4/2", "8-4-2", "2*3+4*5", "x - -y", "1e-3*t", "+x",
        "theta", "pi", "x**0", "y**3", "y**-2", "vx**2.0", "wx**0.5", "wx**17", "wx**-20", "min(3, 1, 2)",
        "max(x, y, z, 7)", "atan2(y, x)", "hypot(vx, vy)", "  x\n + y\t", "((x))", "10*(x*(y+(z)))",
    ],
)  # fmt: skip
def test_precedence_and_every_kind_of_operand(text):
    assert run({}, text) == pytest.approx(value(text.replace("\n", " ").strip()), rel=1e-15)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function(name):
    arguments = "0.4, 0.9" if FUNCTIONS[name][1] == 2 else "0.4"
    assert run({}, f"{name}({arguments})") == pytest.approx(PYTHON[name](*eval(f"({arguments},)")), rel=1e-15)


def test_a_nan_is_not_hidden_by_min_and_max():
    for text in ("min(sqrt(-1), 1)", "min(1, sqrt(-1))", "max(sqrt(-1), 1)", "max(1, sqrt(-1))"):
        assert math.isnan(run({}, text))


def test_definitions_use_those_before_them():
    let = {"a": "x + 1", "b": "a*a", "c": "b - a"}
    a = 0.3 + 1
    assert run(let, "a + 10*b + 100*c") == pytest.approx(a + 10 * a * a + 100 * (a * a - a), rel=1e-15)


def test_long_sums_and_deep_brackets():
    assert run({}, " + ".join(["t"] * 2000)) == 2000 * TIME
    assert run({}, "(" * 90 + "t" + ")" * 90) == TIME
    assert run({}, "t+(" * 60 + "t" + ")" * 60) == 61 * TIME


def error(text, let=None):
    with pytest.raises(ExpressionError) as caught:
        compile_program(let or {}, {"fx": text}, "scene.toml: aero.field.body", **FIELD)
    message = str(caught.value)
    assert "\n" not in message
    assert "expected" in message
    assert "got" in message
    return message


ITEM = "scene.toml: aero.field.body.fx: "


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x + lift", 'column 5: expected one of t, x, y, z, vx, vy, vz, wx, wy, wz, theta, pi; got "lift". '
                     "Define it in let before it is used."),
        ("2*thta", 'column 3: .*got "thta". Did you mean "theta"?'),
        ("2*sine(t)", 'column 3: expected a function, one of sin, .*got "sine". Did you mean "sin"?'),
        ("2*t(3)", 'column 3: expected a function, one of .*got "t". Only these can be called.'),
        ("x^2", 'column 1: expected ** for a power; got ^ in "x^2". Use **.'),
        ("1 + x%2", 'column 5: expected one of + - * / **; got "x%2".'),
        ("7 // 2", 'column 1: expected one of + - * / **; got "7 // 2".'),
        ("sin + 1", 'column 1: expected sin(…); got "sin". Give the function its argument.'),
        ("sin(x, y)", "column 1: expected 1 arguments of sin; got 2."),
        ("1 + max(x)", "column 5: expected 2 or more arguments of max; got 1."),
        ("atan2(y=1, x=2)", "column 1: expected 2 arguments of atan2; got named ones."),
        ("x if t > 1 else y", 'column 1: expected numbers, names, + - * / **, brackets and functions; '
                              'got "x if t > 1 else y".'),
        ("t > 1", 'column 1: expected numbers, .*got "t > 1".'),
        ("[x]", 'column 1: .*got "[x]".'),
        ("not x", 'column 1: .*got "not x".'),
        ("~x", 'column 1: .*got "~x".'),
        ("x.real", 'column 1: .*got "x.real".'),
        ("__import__('os')", 'column 1: expected a function, .*got "__import__".'),
        ("(lambda: 1)()", 'column 1: expected a function, .*got "lambda: 1".'),
        ("sin(*x)", 'column 5: expected numbers, .*got "*x".'),
        ("'a'", "column 1: expected a number; got \"'a'\". Write it like 1.5e-3."),
        ("2 + True", 'column 5: expected a number; got "True".'),
        ("3j", 'column 1: expected a number; got "3j".'),
        ("1e999", 'column 1: expected a number below 1.8e308; got "1e999".'),
        ("1" * 400, "column 1: expected a number below 1.8e308; got"),
        ("2*(x + 1", 'expected an expression; got "2*(x + 1"'),
        ("x +", 'expected an expression; got "x +"'),
        ("2 x", 'expected an expression; got "2 x"'),
        ("x) + (y", 'expected an expression; got "x) + (y"'),
        ("x, y", 'expected numbers, .*got "x, y"'),
        ("x = 3", 'expected an expression; got "x = 3"'),
        ("", "expected an expression; got nothing."),
        ("x # y", 'column 3: expected an expression; got "#"'),
        ("x\0", "expected an expression; got"),
        ("é + ö", 'column 1: .*got "é"'),
        (" \n\t1 + q", 'column 8: .*got "q"'),
        ("1 + 'é' + q", "column 5: expected a number"),
        ("0*t + é + spin", 'column 7: .*got "é"'),
        ("(" * 150 + "x" + ")" * 150 + "*" * 20, "expected"),
        ("-" * 150 + "x", "expected at most 100 nested levels; got more. Name parts of it in let"),
        ("t+(" * 70 + "t" + ")" * 70, "expected at most 100 nested levels; got more."),
        ("x" * (MAX_LENGTH + 1), f"expected at most {MAX_LENGTH} characters; got {MAX_LENGTH + 1}."),
    ],
)  # fmt: skip
def test_what_is_not_allowed_is_named_with_its_place(text, message):
    got = error(text)
    assert got.startswith(ITEM)
    rest = got.removeprefix(ITEM)
    for part in message.split(".*"):
        assert part in rest
        rest = rest[rest.index(part) :]


@pytest.mark.parametrize(
    ("let", "message"),
    [
        ({"x": "1"}, 'let.x: expected a name that is not taken; got "x"'),
        ({"pi": "1"}, "let.pi: expected a name that is not taken"),
        ({"sin": "1"}, "let.sin: expected a name that is not taken"),
        ({"a b": "1"}, "let.a b: expected a name of letters, digits and _"),
        ({"a": "b", "b": "1"}, 'let.a: column 1: .*got "b". Define it in let before'),
        ({"a": "a + 1"}, 'let.a: column 1: .*got "a"'),
        ({"speed": "1", "q": "sped"}, 'let.q: .*Did you mean "speed"?'),
        (
            {f"a{i}": "1" for i in range(LOCALS_SIZE + 1)},
            f"let.a{LOCALS_SIZE}: expected at most {LOCALS_SIZE}",
        ),
    ],
)
def test_definitions_that_are_wrong(let, message):
    got = error("1", let)
    for part in message.split(".*"):
        assert part in got
    assert got.startswith("scene.toml: aero.field.body.let.")


@pytest.mark.parametrize(
    "text",
    ["x", "x*y+z", "t-(x-(y-(z-t)))", "max(x, y, z+t*t)", "-(x**2)", "x**(y+z)", "hypot(x, hypot(y, z))"]
    + ["t+(" * depth + "t" + ")" * depth for depth in (10, 62, 63, 64)],
)
def test_no_program_leaves_the_stack(text):
    """Simulated here instruction by instruction: what is accepted fits, and leaves nothing behind."""
    pops = {Operation.CONSTANT: 0, Operation.VARIABLE: 0, Operation.LOCAL: 0}
    pops |= {op: 2 for op in Operation if op in range(Operation.ADD, Operation.POWER_INTEGER)}
    pops |= {op: 2 for op in Operation if op >= Operation.ATAN2}
    try:
        program = compile_program({}, {"fx": text}, "item", **FIELD)
    except ExpressionError:
        assert text.count("(") >= STACK_SIZE
        return
    height = highest = 0
    for operation, _ in program.code:
        height -= pops.get(operation, 1)
        assert height >= 0
        height += operation not in (Operation.RESULT, Operation.DEFINE)
        highest = max(highest, height)
    assert height == 0
    assert highest <= STACK_SIZE
