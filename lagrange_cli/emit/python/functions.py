"""Functions in Python that evaluate programs, for emitted modules.

Scalars run through the ``math`` module, which is several times faster than
NumPy on single numbers; only results are arrays. Functions never raise for
numeric trouble (a singular mass matrix, a domain error, overflow): they
return NaN. What differs for arrays of states stands in names (``array``,
``_holds``, ``_numbers``, …), so that one text serves both
(:mod:`lagrange_cli.emit.python.module`).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from itertools import islice
from textwrap import dedent, fill, indent

from lagrange_cli.emit.python.constraints import (
    HELPERS,
    helper_source,
)
from lagrange_cli.emit.python.derivatives import (
    given_lines,
    jacobian_lines,
    jacobian_shape,
    with_given,
)
from lagrange_cli.emit.python.loops import loops_source
from lagrange_cli.emit.python.statements import (
    LINE_WIDTH,
    assigned,
    operand_list,
    refused_unless,
    regularity,
    solution,
    symmetric,
    vector_text,
)
from lagrange_cli.emit.python.styles import NUMBERS, Style, many_lines
from lagrange_cli.program.emitted_functions import (
    CANONICAL_PARTS,
    INTERNAL_FUNCTIONS,
    SLOPES,
    multipliers_beside,
)
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS, Variable
from lagrange_cli.program.graph.statement_groups import dependents
from lagrange_cli.program.kinds import ProgramKind
from lagrange_cli.program.printing import Dialect, double_literal, expression_text
from lagrange_cli.program.program import Program

#: Names of the standard library that functions may use.
_MATH = sorted({*PROGRAM_FUNCTIONS, "inf", "nan"} - {"abs", "sign", "min", "max"})

#: Functions that the standard library has not, by the names of their templates: those that call
#: others first.
_HELPERS = (*HELPERS, "sign", "min", "max", "undefined")

#: Names for what is done otherwise with arrays of states.
_OF_NUMBERS = {
    "_holds": "_holds = bool",
    "_number": "_number = float",
    "_numbers": "_numbers = np.ndarray.tolist",
    "_shaped": "_shaped = np.ndarray.reshape",
    "_dot": "_dot = np.dot",
    "_product": "_product = np.matmul",
}

_TAB = " " * 4

_DOCS = {
    "rhs": "State derivative [v, a] at time t; all NaN where it does not exist.",
    "disturbed": "State derivative with every operation times a factor of p.",
    "mass_matrix": "Mass matrix M(q, t), n by n, of M a = f.",
    "forcing": "Forcing f(q, v, t) of M a = f.",
    "energy": "Energy function: the sum of v dL/dv, less L (T + V in most systems).",
    "positions": "Cartesian names, in the order of CARTESIAN.",
    "velocities": "Time derivatives of the Cartesian names, in the order of CARTESIAN.",
    "inputs": "Inputs as the scene has them at time t, in the order of INPUTS.",
    "outputs": "What the scene asks for besides, in the order of OUTPUTS.",
    "multipliers": "Multipliers, in the order of MULTIPLIERS; all NaN where they do not exist.",
    "constraints": "What is zero: lhs - rhs of closures of positions, then rates of all closures.",
    "position_error": "Closures of positions, then the magnitudes behind them.",
    "position_reach": "Squares of the gradients of closures of positions, over the masses.",
    "position_change": "The change of q that makes the linearized closures vanish.",
    "shifted_change": "The same of positions in place of v, along the gradients at q.",
    "velocity_error": "Rates of the closures, then the magnitudes behind them.",
    "velocity_change": "The change of v that makes the rates of the closures vanish.",
    "gaps": "The gaps of all one-sided constraints, then the magnitudes behind them.",
    "gap_terms": "Gradients of the gaps, by rows; their rates; biases; restitutions.",
    "surfaces": "What is positive on this side of each switching surface.",
    "landmarks": "What sharp functions are the exponentials of.",
    "continuous": "What jumps at switching surfaces only where an impulse acts.",
    "surface_values": "What vanishes on switching surfaces, then the magnitudes behind it.",
    "surface_rates": "First and second rates of what vanishes on surfaces, then the magnitudes.",
    "jacobian": "Derivatives of the accelerations by q, then by v, n by 2n.",
    "jacobian_u": "Derivatives of the accelerations by the inputs, in the order of INPUTS.",
    "jacobian_p": "Derivatives of the accelerations by the parameters, in their order.",
    "output_jacobian": "Derivatives of the outputs by q, then by v.",
    "output_jacobian_u": "Derivatives of the outputs by the inputs.",
    "constraint_jacobian": "Derivatives of what constraints gives by q, then by v.",
    "momenta": "The momenta dL/dv.",
    "legendre": "Velocities of momenta, which stand in their places.",
    "momentum_rates": "Rates of the momenta at a state.",
    "impulse": "The change of v that changes the rates of what is in contact by the targets.",
}

#: Functions that every module has.
FUNCTIONS_OF_STATE = ("rhs", "mass_matrix", "forcing", "energy", "positions", "velocities")


def prelude(body: str) -> tuple[list[str], list[str]]:
    """Import lines and definitions that the functions in ``body`` need, and no others."""
    helpers: list[str] = []
    for name in _HELPERS:
        if any(f"_{name}(" in text for text in (body, *helpers)):
            helpers.insert(0, helper_source(name))
    words = words_in("\n".join([body, *helpers]))
    aliases = [line for name, line in _OF_NUMBERS.items() if name in words]
    if aliases:
        note = "# What is done otherwise with arrays of states."
        helpers.insert(0, "\n".join([note, *aliases, ""]))
    names = [name for name in _MATH if name in words]
    if not names:
        return [], helpers
    line = f"from math import {', '.join(names)}"
    if len(line) > LINE_WIDTH:
        text = f"{', '.join(names)},"
        listed = fill(text, LINE_WIDTH, initial_indent=_TAB, subsequent_indent=_TAB)
        line = f"from math import (\n{listed}\n)"
    return [line], helpers


def words_in(text: str) -> set[str]:
    """Find the names that stand in a text, those behind a dot left out."""
    return set(re.findall(r"(?<![\w.])\w+", text))


def function_source(
    program: Program,
    name: str,
    names: Mapping[str, str],
    parameter: str,
    sequences: Sequence[tuple[str, int]] = (),
    style: Style = NUMBERS,
) -> str:
    """Return the definition of one evaluator.

    Parameters
    ----------
    program
        With blocks to solve it is that of a right-hand side, of ``multipliers``
        or of a change.
    name
        Of the function; those that others alone call get an underscore.
    names
        Dummy name → local name of the inputs.
    parameter
        The text of the last argument (``p``, or ``p=DEFAULTS``).
    sequences
        Where the parameters are, if not in ``p``: texts of sequences, and how many in each.
    style
        What the function runs over.
    """
    multipliers = {
        name: f"a{number}[{k}]"
        for number, block in enumerate(program.blocks)
        for k, name in enumerate(block.multipliers)
    }
    dialect = Dialect(double_literal, style.functions, {**names, **multipliers})
    if program.parts:
        apart = dict(sequences).get("p") if parameter.endswith("contact") else None
        return defined(name, parameter, _of_parts(program, apart), program, style)
    sequences = sequences or (("p", program.parameters),)
    body = load_inputs(program, dialect, sequences, style)
    if program.jacobian is not None:
        dialect = with_given(program, dialect)
        passed = [argument.split("=")[0] for argument in parameter.split(", ")]
        prefix = "_contact_" if "contact" in passed else ""
        body += given_lines(program, prefix, ", ".join(["t", "y", *passed]))
    late = dict(dependents(program.assignments, multipliers))
    body.extend(assigned([a for a in program.assignments if a[0] not in late], dialect))
    if program.kind is ProgramKind.JACOBIAN:
        body.extend(jacobian_lines(program, dialect, _failure(program)))
        return defined(name, parameter, body, program, style)
    lines, result = _RESULTS[program.kind](program, dialect)
    tests = regularity(program, dialect) if program.blocks else []
    if tests and style.traced:
        result = f"_where([{', '.join(tests)}], {result})"
    elif tests:
        body += refused_unless(tests, _failure(program))
    body += [*lines, f"return {result}"]
    return defined(name, parameter, body, program, style)


def _failure(program: Program) -> str:
    """Write what a function returns where it has no result."""
    if program.kind is ProgramKind.ENERGY:
        return "_number(_undefined((), t, *p))"
    return f"_undefined({_shape(program)}, t, *p)"


def _of_parts(program: Program, apart: int | None) -> list[str]:
    """Return the lines of the function of a large system."""
    lines = loops_source(program, apart)
    if program.blocks:
        return [*lines, f"return out if np.isfinite(out).all() else {_failure(program)}"]
    n = program.coordinates
    form = {
        ProgramKind.ENERGY: "_number(out[0])",
        ProgramKind.MATRIX: f"_shaped(out, {n}, {n})",
    }
    return [*lines, f"return {form.get(program.kind, 'out')}"]


def defined(name: str, parameter: str, body: Sequence[str], program: Program, style: Style) -> str:
    """Return the definition of a function with a body."""
    inner = (
        name in INTERNAL_FUNCTIONS | CANONICAL_PARTS
        or name in SLOPES
        or parameter.endswith("contact")
    )
    label = f"_{name}" if inner else name
    doc = _DOCS[name.removeprefix("sided_").removeprefix("contact_").removeprefix("flight_")]
    lines = [f"def {label}(t, y, {parameter}):", f'    """{doc}"""']
    text = "\n".join(f"        {line}" for line in body)
    if style.traced:
        return "\n".join([*lines, indent(dedent(text), _TAB), ""])
    lines.append("    y = asarray(y, float)")
    if style.takes_arrays:
        lines += many_lines(label, parameter)
    lines += ["    try:", text]
    lines.append("    except (ArithmeticError, ValueError, np.linalg.LinAlgError):")
    lines.append(f"        return {_failure(program)}")
    return "\n".join(lines) + "\n"


def _shape(program: Program) -> str:
    n = program.coordinates
    if program.kind is ProgramKind.MATRIX:
        return f"({n}, {n})"
    if program.kind is ProgramKind.MULTIPLIERS:
        return str(sum(len(block.closures) for block in program.blocks))
    if program.kind is ProgramKind.CHANGE:
        return str(n)
    if program.jacobian is not None:
        return jacobian_shape(program.jacobian)
    if program.parts:
        return str(program.results)
    if program.blocks:
        return str(2 * n)
    return str(len(program.results_in_order))


def load_inputs(
    program: Program, dialect: Dialect, sequences: Sequence[tuple[str, int]], style: Style
) -> list[str]:
    """Unpack parameters, inputs and state, whole or not at all."""
    used = program.reads
    if program.kind is ProgramKind.RIGHT_HAND_SIDE:
        used |= {f"v{i}" for i in range(program.coordinates)}
    lines = []
    parameters = iter([f"p{i}" for i in range(program.parameters)])
    state = [f"{kind}{i}" for kind in "qv" for i in range(program.coordinates)]
    for text, number in sequences:
        names = list(islice(parameters, number))
        if used.intersection(names):
            lines.append(_unpack(names, text, dialect))
    driven = [f"u{i}" for i in range(program.driven)]
    if used.intersection(driven):
        values = "_numbers(u(t, y, p))" if style.traced else "map(_number, u(t, y, p))"
        lines.append(_unpack(driven, values, dialect))
    if used.intersection(state):
        lines.append(_unpack(state, "_numbers(y)", dialect))
    return lines


def _unpack(targets: Sequence[str], source: str, dialect: Dialect) -> str:
    names = [dialect.names.get(name, name) for name in targets]
    return f"{', '.join(names)}{',' if len(names) == 1 else ''} = {source}"


def _vector_result(program: Program, dialect: Dialect) -> tuple[list[str], str]:
    return [], vector_text(program.results_in_order, dialect)


def _scalar_result(program: Program, dialect: Dialect) -> tuple[list[str], str]:
    ((_, (operand,)),) = program.outputs
    return [], f"_number({expression_text(operand, dialect)})"


def _matrix_result(program: Program, dialect: Dialect) -> tuple[list[str], str]:
    ((_, operands),) = program.outputs
    return symmetric("m", operands, program.coordinates, dialect)


def _accelerations(program: Program, dialect: Dialect) -> tuple[list[str], str]:
    """Solve the blocks that are not written out; the text of [v, a]."""
    lines, results, _ = solution(program, dialect)
    velocities = operand_list([Variable(f"v{i}") for i in range(program.coordinates)], dialect)
    accelerations = ", ".join(results[i] for i in range(program.coordinates))
    return lines, f"array([{velocities}, {accelerations}], float)"


def _unknowns(program: Program, dialect: Dialect) -> tuple[list[str], str]:
    """Solve; the text of the multipliers, or of what was found of all coordinates."""
    closures = program.kind is ProgramKind.MULTIPLIERS
    lines, results, multipliers = solution(program, dialect, coordinates=not closures)
    unknowns = [results.get(i, "0.0") for i in range(program.coordinates)]
    if closures:
        unknowns = [multipliers[k] for k in sorted(multipliers)]
    return lines, f"array([{', '.join(unknowns)}], float)"


#: Kind of program → the lines behind its assignments, and the text of what it returns.
_RESULTS: dict[ProgramKind, Callable[[Program, Dialect], tuple[list[str], str]]] = {
    ProgramKind.VALUES: _vector_result,
    ProgramKind.ENERGY: _scalar_result,
    ProgramKind.MATRIX: _matrix_result,
    ProgramKind.RIGHT_HAND_SIDE: _accelerations,
    ProgramKind.MULTIPLIERS: _unknowns,
    ProgramKind.CHANGE: _unknowns,
}


_DOC = '"""Accelerations, then multipliers; raises where they do not exist."""'


def sharing(programs: Mapping[str, Program]) -> list[str]:
    """Return the prefixes (``""``, ``contact_``) whose accelerations and multipliers come from one
    solve, which the functions ``rhs`` and ``multipliers`` can share."""
    sides = {prefix: programs.get(f"{prefix}rhs") for prefix in ("", "contact_")}
    return [
        prefix
        for prefix, side in sides.items()
        if side is not None
        and f"{prefix}multipliers" in programs
        and multipliers_beside(side) == programs[f"{prefix}multipliers"]
    ]


def shared_sources(
    prefix: str,
    side: Program,
    names: Mapping[str, str],
    parameter: str,
    sequences: Sequence[tuple[str, int]],
    style: Style,
) -> list[str]:
    """Write the functions ``_solution``, ``rhs`` and ``multipliers``, whose names begin with
    ``of``; the other arguments are those of :func:`.functions.function_source`."""
    dialect = Dialect(double_literal, style.functions, names)
    passed = ", ".join(argument.split("=")[0] for argument in parameter.split(", "))
    solved, *_ = solution(side, dialect)
    body = load_inputs(side, dialect, sequences or (("p", side.parameters),), style)
    body += [*assigned(side.assignments, dialect), *solved, "return a0"]
    text = indent("\n".join(body), _TAB)
    call = f"_{prefix}solution(t, y, {passed})"
    head = f"def _{prefix}solution(t, y, {passed}):\n    {_DOC}\n"
    n = side.coordinates
    rates = f"*_numbers(y)[{n}:], *{call}[:{n}]"
    multipliers = multipliers_beside(side)
    assert multipliers is not None
    return [
        f"{head}{text}\n",
        defined(f"{prefix}rhs", parameter, [f"return array([{rates}], float)"], side, style),
        defined(
            f"{prefix}multipliers",
            parameter,
            [f"return array({call}[{n}:], float)"],
            multipliers,
            style,
        ),
    ]
