"""Functions in Python that evaluate programs, for emitted modules and for simulation.

Scalars run through the ``math`` module, which is several times faster than
NumPy on single numbers; only results are arrays. Functions never raise for
numeric trouble (a singular mass matrix, a domain error, overflow): they
return NaN.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from textwrap import fill, wrap
from typing import TYPE_CHECKING

from lagrange_cli.emit.numbers import double_literal
from lagrange_cli.emit.printing import Dialect, expression
from lagrange_cli.emit.program import (
    FUNCTIONS,
    Number,
    Operand,
    Product,
    Program,
    Variable,
    build_program,
    input_names,
)

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

__all__ = [
    "function_source",
    "module_source",
    "prelude",
    "program_of",
    "right_hand_side_source",
]

#: Names of the standard library that functions may use.
_MATH = (
    "acos",
    "acosh",
    "asin",
    "asinh",
    "atan",
    "atan2",
    "atanh",
    "cos",
    "cosh",
    "exp",
    "log",
    "nan",
    "pow",
    "sin",
    "sinh",
    "sqrt",
    "tan",
    "tanh",
)

#: Functions that the standard library has not, by name.
_HELPERS = {
    "_sign": '''\
def _sign(x):
    """1, 0 or -1 with the sign of x (NaN for NaN)."""
    return float(x > 0.0) - float(x < 0.0) if x == x else nan
''',
    "_min": '''\
def _min(a, b):
    """The smaller of two numbers (NaN if one is)."""
    return a if a < b or a != a else b
''',
    "_max": '''\
def _max(a, b):
    """The larger of two numbers (NaN if one is)."""
    return a if a > b or a != a else b
''',
}

#: Every function of a program as the module calls it.
PYTHON_FUNCTIONS = {
    **{name: name for name in FUNCTIONS},
    "sign": "_sign",
    "min": "_min",
    "max": "_max",
}

#: Longer expressions are broken into lines.
WIDTH = 84
_TAB = " " * 4

#: A pivot below this multiple of its diagonal entry is rounding error.
ROUNDING = Fraction(1, 2**53)

_DOCS = {
    "rhs": "State derivative [v, a] at time t; all NaN where it does not exist.",
    "disturbed": "State derivative with every operation times a factor of p.",
    "mass_matrix": "Mass matrix M(q, t), n by n, of M a = f.",
    "forcing": "Forcing f(q, v, t) of M a = f.",
    "energy": "Energy function: the sum of v dL/dv, less L (T + V in most systems).",
    "positions": "Cartesian names, in the order of CARTESIAN.",
    "velocities": "Time derivatives of the Cartesian names, in the order of CARTESIAN.",
}

FUNCTIONS_OF_STATE = ("rhs", "mass_matrix", "forcing", "energy", "positions", "velocities")


def right_hand_side_source(equations: Equations, names: Sequence[str] = FUNCTIONS_OF_STATE) -> str:
    """Source of a module with the named evaluators (all of them), made of dummy names alone.

    The module defines ``rhs(t, y, p)``, ``mass_matrix``, ``forcing``,
    ``energy``, ``positions`` and ``velocities`` of the same arguments: ``t`` a
    float, ``y`` an array [q, v] of shape (2n,), ``p`` a sequence of floats, one
    for each parameter in the order of the Equations. ``rhs`` returns an array of
    shape (2n,), the others (n, n), (n,), a float, and arrays in the order of
    ``cartesian_names``. No text of the scene is in it: it is safe to run.
    """
    return module_source({name: program_of(equations, name) for name in names})


def program_of(equations: Equations, name: str) -> Program:
    """The program of an evaluator."""
    return build_program(equations, ["acceleration" if name == "rhs" else name])


def module_source(programs: Mapping[str, Program]) -> str:
    """Source of a module with a function ``f(t, y, p)`` for each program, over dummy names."""
    body = "\n\n".join(function_source(p, name, {}, "p") for name, p in programs.items())
    imports, helpers = prelude(body)
    return "\n\n".join(["\n".join([*imports, "import numpy as np\n"]), *helpers, body])


def prelude(body: str) -> tuple[list[str], list[str]]:
    """Import lines and definitions that the functions in ``body`` need, and no others."""
    helpers = [source for name, source in _HELPERS.items() if f"{name}(" in body]
    words = set(re.findall(r"\w+", "\n".join([body, *helpers])))
    names = [name for name in _MATH if name in words]
    if not names:
        return [], helpers
    line = f"from math import {', '.join(names)}"
    if len(line) > WIDTH:
        text = f"{', '.join(names)},"
        listed = fill(text, WIDTH, initial_indent=_TAB, subsequent_indent=_TAB)
        line = f"from math import (\n{listed}\n)"
    return [line], helpers


def function_source(program: Program, name: str, names: Mapping[str, str], parameter: str) -> str:
    """The definition of one evaluator.

    Parameters
    ----------
    program
        Of one output; with blocks to solve it is that of a right-hand side.
    name
        Of the function.
    names
        Dummy name → local name of the inputs.
    parameter
        The text of the last argument (``p``, or ``p=DEFAULTS``).
    """
    dialect = Dialect(double_literal, PYTHON_FUNCTIONS, names)
    body = _load_inputs(program, dialect)
    for target, operand in program.assignments:
        body.append(_statement(target, expression(operand, dialect)))
    write = _accelerations if program.blocks else _RESULTS.get(name, _vector_result)
    body.extend(write(program, dialect))
    failure = "nan" if name == "energy" else f"np.full({_shape(program, name)}, nan)"
    lines = [f"def {name}(t, y, {parameter}):", f'    """{_DOCS[name]}"""', "    try:"]
    lines.extend(f"        {line}" for line in body)
    lines.append("    except (ArithmeticError, ValueError, np.linalg.LinAlgError):")
    lines.append(f"        return {failure}")
    return "\n".join(lines) + "\n"


def _statement(target: str, text: str) -> str:
    """An assignment, over several lines where it is long."""
    if len(text) <= WIDTH:
        return f"{target} = {text}"
    lines = wrap(text, WIDTH, break_long_words=False, break_on_hyphens=False)
    return "\n            ".join([f"{target} = (", *lines]) + "\n        )"


def _shape(program: Program, name: str) -> str:
    n = program.coordinates
    if name == "mass_matrix":
        return f"({n}, {n})"
    return str(2 * n if program.blocks else len(program.outputs[0][1]))


def _load_inputs(program: Program, dialect: Dialect) -> list[str]:
    """Unpack parameters and state, whole or not at all."""
    used = input_names(program)
    used |= {f"v{i}" for i in range(program.coordinates)} if program.blocks else set()
    lines = []
    parameters = [f"p{i}" for i in range(program.parameters)]
    state = [f"{kind}{i}" for kind in "qv" for i in range(program.coordinates)]
    if used.intersection(parameters):
        lines.append(_unpack(parameters, "p", dialect))
    if used.intersection(state):
        lines.append(_unpack(state, "np.asarray(y, dtype=float).tolist()", dialect))
    return lines


def _unpack(targets: Sequence[str], source: str, dialect: Dialect) -> str:
    names = [dialect.names.get(name, name) for name in targets]
    return f"{', '.join(names)}{',' if len(names) == 1 else ''} = {source}"


def _vector_result(program: Program, dialect: Dialect) -> list[str]:
    # A right-hand side of no coordinates has several outputs, all empty.
    (_, operands), *_ = program.outputs
    return [f"return np.array([{_join(operands, dialect)}], dtype=float)"]


def _scalar_result(program: Program, dialect: Dialect) -> list[str]:
    ((_, (operand,)),) = program.outputs
    return [f"return float({expression(operand, dialect)})"]


def _matrix_result(program: Program, dialect: Dialect) -> list[str]:
    ((_, operands),) = program.outputs
    lines, matrix = _symmetric("m", operands, program.coordinates, dialect)
    return [*lines, f"return {matrix}"]


def _symmetric(
    prefix: str, upper: Sequence[Operand], n: int, dialect: Dialect
) -> tuple[list[str], str]:
    """Lines that name compound entries, and the text of the full array."""
    lines, texts = [], []
    for k, operand in enumerate(upper):
        text = expression(operand, dialect)
        if not isinstance(operand, Variable | Number):
            lines.append(f"{prefix}{k} = {text}")
            text = f"{prefix}{k}"
        texts.append(text)
    start = [i * n - i * (i - 1) // 2 for i in range(n)]
    rows = [[texts[start[min(i, j)] + abs(i - j)] for j in range(n)] for i in range(n)]
    entries = ", ".join(text for row in rows for text in row)
    return lines, f"np.array([{entries}], dtype=float).reshape({n}, {n})"


def _accelerations(program: Program, dialect: Dialect) -> list[str]:
    """Check pivots, solve the blocks that need a loop, and return [v, a]."""
    failure = f"            return np.full({2 * program.coordinates}, nan)"
    lines = [f"if {test}:\n{failure}" for test in _pivot_tests(program, dialect)]
    written = iter(program.output("acceleration"))
    dense_matrix = list(program.output("dense_matrix"))
    dense_forcing = list(program.output("dense_forcing"))
    results = [""] * program.coordinates
    for number, block in enumerate(program.blocks):
        n = len(block.coordinates)
        if block.unrolled:
            for i in block.coordinates:
                results[i] = expression(next(written), dialect)
            continue
        upper, dense_matrix = dense_matrix[: n * (n + 1) // 2], dense_matrix[n * (n + 1) // 2 :]
        right, dense_forcing = dense_forcing[:n], dense_forcing[n:]
        lines.extend(_dense_block(number, block.definite, upper, right, dialect, failure))
        for k, i in enumerate(block.coordinates):
            results[i] = f"a{number}[{k}]"
    velocities = [Variable(f"v{i}") for i in range(program.coordinates)]
    lines.append(
        f"return np.array([{_join(velocities, dialect)}, {', '.join(results)}], dtype=float)"
    )
    return lines


def _dense_block(
    number: int,
    definite: bool,
    upper: Sequence[Operand],
    right: Sequence[Operand],
    dialect: Dialect,
    failure: str,
) -> list[str]:
    """Solve a block with NumPy. Cholesky's factor holds the roots of the pivots."""
    lines, matrix = _symmetric(f"m{number}_", upper, len(right), dialect)
    lines.append(f"m{number} = {matrix}")
    if definite:
        bound = f"{expression(Number(ROUNDING), dialect)} * m{number}.diagonal()"
        lines.append(f"d{number} = np.linalg.cholesky(m{number}).diagonal()")
        lines.append(f"if not (d{number} * d{number} > {bound}).all():\n{failure}")
    vector = f"np.array([{_join(right, dialect)}], dtype=float)"
    lines.append(f"a{number} = np.linalg.solve(m{number}, {vector}).tolist()")
    return lines


def _pivot_tests(program: Program, dialect: Dialect) -> list[str]:
    """Conditions under which the mass matrix is singular."""
    tests = []
    pivots = iter(zip(program.output("pivots"), program.output("scales"), strict=True))
    for block in program.blocks:
        for k in range(len(block.coordinates) if block.unrolled else 0):
            pivot, scale = next(pivots)
            text = expression(pivot, dialect)
            if block.definite and k and not block.exact:
                bound = expression(Product((Number(ROUNDING), scale), ()), dialect)
                tests.append(f"not {text} > {bound}")
            elif block.definite:
                tests.append(f"not {text} > 0.0")
            else:
                tests.append(f"not abs({text}) > 0.0")
    return tests


def _join(operands: Sequence[Operand], dialect: Dialect) -> str:
    return ", ".join(expression(operand, dialect) for operand in operands)


_RESULTS = {"energy": _scalar_result, "mass_matrix": _matrix_result}
