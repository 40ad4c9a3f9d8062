"""Lines of Python that solve the systems of a program, and what prints its statements."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from textwrap import wrap

from lagrange_cli.program.graph.operands import Constant, Operand, Product, Variable
from lagrange_cli.program.graph.statement_groups import Assignment, dependents
from lagrange_cli.program.printing import Dialect, expression_text
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.blocks import MatrixBlock

#: Longer expressions are broken into lines.
LINE_WIDTH = 84

#: A pivot below this multiple of its diagonal entry is rounding error.
DOUBLE_ROUNDING = Fraction(1, 2**53)


def solution(
    program: Program, dialect: Dialect, *, coordinates: bool = True
) -> tuple[list[str], dict[int, str], dict[int, str]]:
    """Lines that solve the blocks; the texts of what is found for coordinates and closures."""
    lines = []
    written = iter(program.output("acceleration"))
    dense_matrix = iter(program.output("dense_matrix"))
    dense_forcing = iter(program.output("dense_forcing"))
    results: dict[int, str] = {}
    multipliers: dict[int, str] = {}
    for number, block in enumerate(program.blocks):
        if block.unrolled:
            results |= {i: expression_text(next(written), dialect) for i in block.coordinates}
            continue
        n, m = len(block.coordinates), len(block.closures)
        multipliers |= {i: f"a{number}[{n + k}]" for k, i in enumerate(block.closures)}
        if block.band is not None:
            entries = [next(dense_matrix) for _ in range(m * (block.band + 1))]
            drive = [next(dense_forcing) for _ in range(m)]
            lines.append(_band(number, block, entries, drive, dialect))
            lines.extend(assigned(dependents(program.assignments, block.multipliers), dialect))
            multipliers |= {i: f"a{number}[{k}]" for k, i in enumerate(block.closures)}
            if coordinates:
                results |= {i: expression_text(next(written), dialect) for i in block.coordinates}
            continue
        count = n * (n + 1) // 2 + n * m + m * block.compliant
        matrix = [next(dense_matrix) for _ in range(count)]
        right = [next(dense_forcing) for _ in range(block.size)]
        lines.extend(_dense_block(number, block, matrix, right, dialect))
        results |= {i: f"a{number}[{k}]" for k, i in enumerate(block.coordinates)}
    return lines, results, multipliers


def _band(
    number: int,
    block: MatrixBlock,
    entries: Sequence[Operand],
    drive: Sequence[Operand],
    dialect: Dialect,
) -> str:
    """Solve for the multipliers of a band."""
    m = len(block.closures)
    band = matrix_text([expression_text(e, dialect) for e in entries], m, len(entries) // m)
    return f"a{number} = _numbers(_solve_banded({band}, {vector_text(drive, dialect)}))"


def _dense_block(
    number: int,
    block: MatrixBlock,
    matrix: Sequence[Operand],
    right: Sequence[Operand],
    dialect: Dialect,
) -> list[str]:
    """Solve a block by a function of the module."""
    n, m = len(block.coordinates), len(block.closures)
    upper = bordered(n, m, matrix) if block.closures else matrix
    lines, text = symmetric(f"m{number}_", upper, block.size, dialect)
    lines += [f"m{number} = {text}", f"b{number} = {vector_text(right, dialect)}"]
    if block.closures:
        return [*lines, f"a{number} = _numbers(_solve_saddle(m{number}, b{number}, {n}))"]
    name = "_solve_definite" if block.definite else "_solve_symmetric"
    return [*lines, f"a{number} = _numbers({name}(m{number}, b{number}))"]


def bordered(n: int, m: int, matrix: Sequence[Operand]) -> list[Operand]:
    """The upper triangle, by rows, of [[M, Gᵀ], [G, C]], from that of M, the rows of G and the
    diagonal C (zero if not given)."""
    entries, gradients = iter(matrix[: n * (n + 1) // 2]), matrix[n * (n + 1) // 2 :]
    upper: list[Operand] = []
    for i in range(n):
        upper.extend(next(entries) for _ in range(i, n))
        upper.extend(gradients[k * n + i] for k in range(m))
    zero = Constant(Fraction(0))
    diagonal = gradients[n * m :] or [zero] * m
    for k, entry in enumerate(diagonal):
        upper += [entry, *[zero] * (m - 1 - k)]
    return upper


def regularity(program: Program, dialect: Dialect) -> list[str]:
    """Conditions under which the mass matrix is regular, as far as pivots are written out."""
    return list(dict.fromkeys(_pivot_tests(program, dialect)))


def refused_unless(tests: Sequence[str], failure: str) -> list[str]:
    """Return lines that return what stands for no result unless all conditions hold."""
    whole = " & ".join(f"({test})" for test in tests) if len(tests) > 1 else tests[0]
    return [
        _statement("regular", whole),
        f"if not _holds(regular):\n            return {failure}",
    ]


def _pivot_tests(program: Program, dialect: Dialect) -> list[str]:
    """Conditions under which the mass matrix is regular."""
    tests = []
    pivots = iter(zip(program.output("pivots"), program.output("scales"), strict=True))
    for block in program.blocks:
        for k in range(len(block.coordinates) if block.unrolled else 0):
            pivot, scale = next(pivots)
            text = expression_text(pivot, dialect)
            if block.definite and k and not block.exact:
                bound = expression_text(Product((Constant(DOUBLE_ROUNDING), scale), ()), dialect)
                tests.append(f"{text} > {bound}")
            elif block.definite:
                tests.append(f"{text} > 0.0")
            else:
                tests.append(f"abs({text}) > 0.0")
    return tests


def symmetric(
    prefix: str, upper: Sequence[Operand], n: int, dialect: Dialect
) -> tuple[list[str], str]:
    """Return lines that name compound entries, and the text of the full array."""
    lines, texts = [], []
    for k, operand in enumerate(upper):
        text = expression_text(operand, dialect)
        if not isinstance(operand, Variable | Constant):
            lines.append(f"{prefix}{k} = {text}")
            text = f"{prefix}{k}"
        texts.append(text)
    start = [i * n - i * (i - 1) // 2 for i in range(n)]
    rows = [[texts[start[min(i, j)] + abs(i - j)] for j in range(n)] for i in range(n)]
    return lines, matrix_text([text for row in rows for text in row], n, n)


def assigned(assignments: Iterable[Assignment], dialect: Dialect) -> list[str]:
    return [
        _statement(target, expression_text(operand, dialect)) for target, operand in assignments
    ]


def _statement(target: str, text: str) -> str:
    """Return an assignment, over several lines where it is long."""
    if len(text) <= LINE_WIDTH:
        return f"{target} = {text}"
    lines = wrap(text, LINE_WIDTH, break_long_words=False, break_on_hyphens=False)
    return "\n            ".join([f"{target} = (", *lines]) + "\n        )"


def vector_text(operands: Sequence[Operand], dialect: Dialect) -> str:
    """Write the array of some operands."""
    return f"array([{operand_list(operands, dialect)}], float)"


def matrix_text(entries: Sequence[str], rows: int, columns: int) -> str:
    """Write the array of the texts of some entries, by rows."""
    return f"_shaped(array([{', '.join(entries)}], float), {rows}, {columns})"


def operand_list(operands: Sequence[Operand], dialect: Dialect) -> str:
    return ", ".join(expression_text(operand, dialect) for operand in operands)
