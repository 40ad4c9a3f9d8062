"""A right-hand side at eight states at once: C whose loop over states compilers make vectors of.

No statement of the loop branches. If a pivot is too small or a result not finite at any of the
states, the function returns 1 and the caller evaluates them one by one.
"""

from __future__ import annotations

from dataclasses import replace

from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.program.graph.operands import cell_named
from lagrange_cli.program.kinds import STATE_RATES
from lagrange_cli.program.printing import Dialect, expression_text, functions_in
from lagrange_cli.program.program import Program

#: The header with the functions that are called.
LANES_HEADER = "lanes.h"

#: Functions that a loop may call and remain a loop over vectors.
_CALLEES = {"sin": "lagrange_lane_sin", "cos": "lagrange_lane_cos", "sqrt": "sqrt", "abs": "fabs"}

#: Pivots below this multiple of their scale are left to the function of one state.
_SMALLEST_PIVOT = "1e-14"


def lanes_text(function: str, program: Program, target: CTarget) -> str:
    """Write ``PREFIX_FUNCTION_lanes``; empty if the program has no such form.

    It reads ``t[l]`` and ``y[8*i + l]`` and writes ``dydt[8*i + l]`` for l below 8; where the
    program finds no accelerations, its outputs in their order.
    """
    operands = [operand for _, operand in program.assignments]
    operands += [operand for _, group in program.outputs for operand in group]
    called = functions_in(operands)
    unrolled = all(block.unrolled for block in program.blocks)
    if program.is_large or not unrolled or not called <= _CALLEES.keys():
        return ""
    dialect = target.dialect
    dialect = replace(dialect, functions=_CALLEES, names={**dialect.names, "t": "t[l]"})
    head = (
        f"int {target.prefix}_{function}_lanes(const double *restrict t,\n"
        "    const double *restrict y, const double *u,\n"
        f"    const {target.prefix}_params *restrict p, double *work,\n"
        "    double *restrict dydt)\n"
    )
    results = _results if program.blocks else _values
    body = [*_loads(program), *_assignments(program, dialect), *results(program, dialect)]
    unused = {"u": True, "work": True, **_unread(program)}
    return "\n".join(
        [
            f"{head}{{",
            "    int l, bad = 0;",
            *(f"    (void){name};" for name, is_so in unused.items() if is_so),
            "    for (l = 0; l < 8; ++l) {",
            *(f"        {line}" for line in body),
            "    }",
            "    return bad;",
            "}",
            "",
        ]
    )


def _unread(program: Program) -> dict[str, bool]:
    arrays = {cell_named(name).array for name in program.reads}
    state = program.blocks or arrays & {"q", "v", "z"}
    return {"t": "t" not in arrays, "y": not state, "p": "p" not in arrays}


def _loads(program: Program) -> list[str]:
    n = program.coordinates
    reads = program.reads | {f"v{i}" for i in range(n) if program.blocks}
    return [
        f"const double {name} = y[{8 * k} + l];"
        for k, name in enumerate(program.layout.variables)
        if name in reads
    ]


def _assignments(program: Program, dialect: Dialect) -> list[str]:
    return [
        f"const double {name} = {expression_text(operand, dialect)};"
        for name, operand in program.assignments
    ]


def _results(program: Program, dialect: Dialect) -> list[str]:
    """Write the accelerations, the test of pivots and results, and the stores."""
    n = program.coordinates
    solved = [i for block in program.blocks for i in block.coordinates]
    accelerations = zip(solved, program.output("acceleration"), strict=True)
    rates = program.output(STATE_RATES) if program.states else ()
    first = program.layout.first_order.start
    sums = "".join(f" + 0.0*a{i}" for i in sorted(solved))
    sums += "".join(f" + 0.0*r{k}" for k in range(len(rates)))
    return [
        *(
            f"const double a{i} = {expression_text(operand, dialect)};"
            for i, operand in accelerations
        ),
        *(
            f"const double r{k} = {expression_text(operand, dialect)};"
            for k, operand in enumerate(rates)
        ),
        *_pivots(program, dialect),
        f"bad |= !(0.0{sums} == 0.0);",
        *(f"dydt[{8 * i} + l] = v{i};" for i in range(n)),
        *(f"dydt[{8 * (first + k)} + l] = r{k};" for k in range(len(rates))),
        *(f"dydt[{8 * (n + i)} + l] = a{i};" for i in sorted(solved)),
    ]


def _values(program: Program, dialect: Dialect) -> list[str]:
    """Write the outputs, and the test of them."""
    operands = [operand for _, group in program.outputs for operand in group]
    sums = "".join(f" + 0.0*x{i}" for i in range(len(operands)))
    return [
        *(
            f"const double x{i} = {expression_text(operand, dialect)};"
            for i, operand in enumerate(operands)
        ),
        f"bad |= !(0.0{sums} == 0.0);",
        *(f"dydt[{8 * i} + l] = x{i};" for i in range(len(operands))),
    ]


def _pivots(program: Program, dialect: Dialect) -> list[str]:
    definite = [block.definite for block in program.blocks for _ in block.coordinates]
    tests = zip(definite, program.output("pivots"), program.output("scales"), strict=True)
    return [
        f"bad |= !({'' if is_definite else 'fabs'}({expression_text(pivot, dialect)})"
        f" > {_SMALLEST_PIVOT}*fabs({expression_text(scale, dialect)}));"
        for is_definite, pivot, scale in tests
    ]
