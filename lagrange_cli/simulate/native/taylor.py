"""A right-hand side as recurrences of Taylor coefficients of many motions at once: C."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence

from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.program.kinds import STATE_RATES
from lagrange_cli.program.printing import Dialect, expression_text, functions_in
from lagrange_cli.program.program import Program
from lagrange_cli.simulate.native.taylor_recurrences import (
    FIRST,
    NOW,
    NoSeriesError,
    Recurrence,
    Recurrences,
    SeriesSum,
    SeriesTerm,
    series_rows,
)

#: The header with the functions that are called.
TAYLOR_HEADER = "taylor.h"

#: Pivots below this multiple of their scale count as singular.
_SMALLEST_PIVOT = "1e-14"

#: Sums by their names, and how many of them a loop finds, each for two coefficients: with more,
#: the stack of registers of x87, which wider numbers take, runs over.
_SUM = re.compile(r"\bs(\d+)\b")
_AT_ONCE = 2


def taylor_text(function: str, program: Program, target: CTarget) -> str:
    """Write ``PREFIX_FUNCTION_taylor`` and the number of rows it needs; empty without such a form.

    It is a ``lagrange_series`` of the header; the first rows are those of the state, and
    behind them that of the time.
    """
    layout = program.layout
    if program.is_large or not all(block.unrolled for block in program.blocks):
        return ""
    if functions_in((*program.output("pivots"), *program.output("scales"))):
        return ""
    recurrences = Recurrences(target.real.literal, layout, layout.size + 1)
    try:
        for name, operand in program.assignments:
            series = recurrences.series_of(operand)
            recurrences.known[name] = _kept(recurrences, series)
        accelerations = [
            recurrences.series_of(operand) for operand in program.output("acceleration")
        ]
        rates = [
            recurrences.series_of(operand)
            for operand in (program.output(STATE_RATES) if program.states else ())
        ]
        tests = _tests(program, recurrences)
    except NoSeriesError:
        return ""
    first = layout.velocities.start
    rows = [first + i for block in program.blocks for i in block.coordinates]
    rows += range(layout.size)[layout.first_order]
    return _function(
        f"{target.prefix}_{function}_taylor",
        recurrences,
        dict(zip(rows, [*accelerations, *rates], strict=True)),
        tests,
    )


def _kept(recurrences: Recurrences, series: SeriesSum) -> SeriesSum:
    """Give a series that is used more than once a row of its own, unless it is nearly one."""
    if len(series.terms) == 1 and not series.constant and len(series.terms[0].rows) == 1:
        return series
    return SeriesSum("", (SeriesTerm("", (recurrences.row(series),)),)) if series.terms else series


def _tests(program: Program, recurrences: Recurrences) -> list[str]:
    """Write values that are NaN where a pivot is not above its least size."""
    values = {
        name: f"({recurrences.text(series, FIRST) or '0.0'})"
        for name, series in recurrences.known.items()
    }
    values |= {f"p{i}": f"p[{i}]" for i in range(program.parameters)}
    layout = program.layout
    values |= {name: f"c[{k}]" for k, name in enumerate(layout.variables)}
    dialect = Dialect(recurrences.literal, {}, {**values, "t": f"c[{layout.size}]"})
    definite = [block.definite for block in program.blocks for _ in block.coordinates]
    pairs = zip(definite, program.output("pivots"), program.output("scales"), strict=True)
    lines = []
    for is_definite, pivot, scale in pairs:
        tested, size = (f"zero + {expression_text(operand, dialect)}" for operand in (pivot, scale))
        tested = tested if is_definite else f"lagrange_size({tested})"
        lines.append(f"lagrange_require_above({tested}, {_SMALLEST_PIVOT}*lagrange_size({size}))")
    return lines


def _function(
    name: str, recurrences: Recurrences, outputs: Mapping[int, SeriesSum], tests: Sequence[str]
) -> str:
    return f"""\
int {name}_rows(void)
{{
    return {recurrences.rows};
}}

void {name}(int order, const lagrange_lane *p, lagrange_lane *c)
{{
{_indented(_body(recurrences, outputs, tests))}
}}
"""


def _indented(lines: Iterable[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)


def _body(
    recurrences: Recurrences, outputs: Mapping[int, SeriesSum], tests: Sequence[str]
) -> Iterator[str]:
    """Write first coefficients, second ones of the state, and the loop for all others."""
    layout, rows = recurrences.layout, recurrences.rows
    n = layout.coordinates
    yield "const lagrange_lane zero = {0.0};"
    yield from (
        f"const lagrange_lane k{k} = {constant};"
        for k, constant in enumerate(recurrences.constants)
    )
    for step in recurrences.steps:
        yield from (_declared(line) for line in step.first)
    yield f"const lagrange_lane bad = {' + '.join(['zero', *tests])};"
    yield "int k;"
    for i, series in sorted(outputs.items()):
        if i < layout.first_order.start:
            yield f"c[{rows + i - n}] = c[{i}];"
        yield f"c[{rows + i}] = bad + ({recurrences.text(series, FIRST) or '0.0'});"
    yield from _loop(recurrences, outputs)


def _loop(recurrences: Recurrences, outputs: Mapping[int, SeriesSum]) -> Iterator[str]:
    """Write the loop for further coefficients: number 1, then two in a turn with shared sums.

    The terms that number k adds to the sums of number k + 1 follow between the two.
    """
    statements, rows = _statements(recurrences, outputs), recurrences.rows
    read = sorted({int(number) for line in statements for number in _SUM.findall(line)})
    yield "for (k = 1; k < order; ++k) {"
    if read:
        yield f"    lagrange_lane {', '.join(f's{number} = zero' for number in read)};"
        yield f"    lagrange_lane {', '.join(f'f{number} = zero' for number in read)};"
    yield "    int last = k == 1;"
    yield from (f"    {line}" for line in _sums(recurrences, read))
    yield "    for (;;) {"
    yield f"        lagrange_lane *const now = c + k*{rows}, *const next = now + {rows};"
    yield "        const double part = 1.0/(double)k, further = 1.0/(double)(k + 1);"
    yield from (f"        {line}" for line in statements)
    yield "        (void)part;"
    yield "        if (last || k + 1 == order) {"
    yield "            break;"
    yield "        }"
    for number in read:
        left, right = recurrences.sums[number]
        ends = f"c[{rows + left}]*now[{right}] + now[{left}]*c[{rows + right}]"
        yield f"        s{number} = f{number} + {ends};"
    yield "        last = 1;"
    yield "        ++k;"
    yield "    }"
    yield "}"


def _statements(recurrences: Recurrences, outputs: Mapping[int, SeriesSum]) -> list[str]:
    """Write the coefficients number k, and those of the state that follow."""
    layout, live = recurrences.layout, _live(recurrences.steps, outputs.values())
    n = layout.coordinates
    lines = [line for step in recurrences.steps if set(step.rows) & live for line in step.further]
    for i, series in sorted(outputs.items()):
        if i < layout.first_order.start:
            lines.append(f"next[{i - n}] = now[{i}]*further;")
        lines.append(f"next[{i}] = ({recurrences.text(series, NOW) or 'zero'})*further;")
    return lines


def _sums(recurrences: Recurrences, read: Sequence[int]) -> Iterator[str]:
    """Write the sums of number k, and those of number k + 1 as far as they are known: several in a
    loop, since they do not wait for each other."""
    if not read:
        return
    rows = recurrences.rows
    yield "if (k > 1) {"
    yield f"    const lagrange_lane *const d = c + {rows}, *const e = c + (k - 1)*{rows};"
    yield "    int j;"
    groups = -(-len(read) // _AT_ONCE)
    for group in range(groups):
        some = read[len(read) * group // groups : len(read) * (group + 1) // groups]
        yield "    {"
        yield from (f"        {line}" for line in _group(recurrences, some))
        yield "    }"
    yield "}"


def _group(recurrences: Recurrences, some: Sequence[int]) -> Iterator[str]:
    """Write some sums: ``d``, ``e`` are coefficients 1 and k - 1; each ``eI`` serves both sums."""
    products = [(number, *recurrences.sums[number]) for number in some]
    behind = sorted({two for _, _, two in products})
    yield f"lagrange_lane {', '.join(f'e{two} = e[{two}]' for two in behind)};"
    yield from (f"s{number} = d[{one}]*e{two};" for number, one, two in products)
    yield "for (j = 2; j < k; ++j) {"
    yield f"    const lagrange_lane *const a = c + j*{recurrences.rows};"
    yield f"    const lagrange_lane *const b = c + (k - j)*{recurrences.rows};"
    yield from (f"    f{number} += a[{one}]*e{two};" for number, one, two in products)
    yield from (f"    e{two} = b[{two}];" for two in behind)
    yield from (f"    s{number} += a[{one}]*e{two};" for number, one, two in products)
    yield "}"


def _declared(line: str) -> str:
    return f"const lagrange_lane {line}" if line.startswith("i") else line


def _live(steps: list[Recurrence], outputs: Iterable[SeriesSum]) -> set[int]:
    """Find the rows whose further coefficients the outputs need."""
    live = {row for series in outputs for row in series_rows(series)}
    for step in reversed(steps):
        if set(step.rows) & live:
            live |= set(step.needs)
    return live
