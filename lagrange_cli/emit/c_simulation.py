"""C for the simulation: the emitted functions over dummy names, in one text to compile and load.

The function bodies are those of :mod:`lagrange_cli.emit.c`; coordinates and
parameters have numbers instead of the scene's names, so that no text of a
scene reaches the compiler and equal systems have equal texts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.emit.c import function_names, function_text, functions_used
from lagrange_cli.emit.c_names import CNames, real_type
from lagrange_cli.emit.c_solvers import helper_text, solver_text, work_size
from lagrange_cli.emit.printing import Dialect
from lagrange_cli.emit.program import Program, build_program

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

__all__ = ["SimulationSource", "simulation_source"]

#: Function of the library → output of the program.
_OUTPUTS = {
    "rhs": "acceleration",
    "energy": "energy",
    "positions": "positions",
    "velocities": "velocities",
}

#: Evaluates a function at many states; what does not exist becomes NaN.
_TABLE = """\
typedef int (*function)(double, const double *, const double *, const system_params *, double *,
                        double *);

/* out[i*columns ..]: a function at t[i] and y[i*width ..], for i below rows. */
void system_table(function f, long rows, const double *t, const double *y, long width,
                  const system_params *p, double *work, double *out, long columns)
{
    long i, k;
    for (i = 0; i < rows; ++i) {
        double *row = out + i*columns;
        if (f(t[i], y + i*width, 0, p, work, row) != 0) {
            for (k = 0; k < columns; ++k) {
                row[k] = NAN;
            }
        }
    }
}
"""


@dataclass(frozen=True)
class SimulationSource:
    """A text of C with ``system_rhs``, ``system_disturbed``, ``system_energy``,
    ``system_positions``, ``system_velocities`` and ``system_table``.

    ``work`` is the size of the workspace; ``parameters`` the number of doubles
    at ``p`` that ``system_disturbed`` reads: the scene's, then its factors.
    """

    text: str
    work: int
    parameters: int


def simulation_source(
    equations: Equations, disturb: Callable[[Program], Program]
) -> SimulationSource:
    """The functions that a simulation calls.

    Parameters
    ----------
    disturb
        Turns the program of the right-hand side into that of ``system_disturbed``.
    """
    programs = {
        function: build_program(equations, [output]) for function, output in _OUTPUTS.items()
    }
    programs["disturbed"] = disturb(programs["rhs"])
    parameters = programs["disturbed"].parameters
    real = real_type("double")
    names = _dummy_names(len(equations.coordinates), parameters)
    dialect = Dialect(real.literal, function_names(names, real), names.inputs)
    used = set().union(*(functions_used(program) for program in programs.values()))
    blocks = programs["rhs"].blocks
    parts = [
        "#include <math.h>\n",
        f"typedef struct {{ double p[{max(parameters, 1)}]; }} system_params;\n",
        helper_text(used, names, real),
        solver_text(blocks, names, real),
        *(function_text(f, p, names, real, dialect) for f, p in programs.items()),
        _TABLE,
    ]
    return SimulationSource("\n".join(filter(None, parts)), work_size(blocks), parameters)


def _dummy_names(coordinates: int, parameters: int) -> CNames:
    inputs = {f"p{i}": f"p->p[{i}]" for i in range(parameters)}
    inputs |= {f"{kind}{i}": f"{kind}{i}" for kind in "qv" for i in range(coordinates)}
    return CNames("system", (), inputs)
