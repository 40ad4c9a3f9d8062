"""``NAME_project`` of emitted C: a state led back to the closures that it has left."""

from __future__ import annotations

from collections.abc import Mapping

from lagrange_cli.emit.c_body import work_size
from lagrange_cli.emit.c_names import CNames, Real
from lagrange_cli.emit.c_solvers import fill
from lagrange_cli.emit.constraints import INTERNAL
from lagrange_cli.emit.program import Program

__all__ = ["project_text", "workspace"]

_SIZE = """\
/* The largest of m residuals, each in units of the last place of the magnitude m behind it. */
static @REAL@ @NAME@_residual(int m, const @REAL@ *out)
{
    @REAL@ largest = @ZERO@;
    int k;
    for (k = 0; k < m; ++k) {
        const @REAL@ one = @FABS@(out[k]), of = out[m + k];
        const @REAL@ size = one > @ZERO@ ? one/(@NEXT@(of, INFINITY) - of) : @ZERO@;
        largest = size > largest ? size : largest;
    }
    return largest;
}
"""

_HEAD = """\
int @NAME@_project(@ARGUMENTS@)
{
    @REAL@ *const out = work + @START@;
"""

_POSITIONS = """\
    @REAL@ size, last = @ZERO@;
    int i, round, status;
    for (round = 0; ; ++round) {
        status = @NAME@_position_error(t, y, u, p, work, out);
        if (status != 0) {
            return status;
        }
        size = @NAME@_residual(@POSITIONS@, out);
        /* Only rounding is left, or little more that no change makes smaller. */
        if (size <= @NEAR@ || (round > 0 && size <= @FAR@ && @TWO@*size > last)) {
            break;
        }
        if (round == @ROUNDS@) {
            return 3;
        }
        last = size;
        status = @NAME@_position_change(t, y, u, p, work, out);
        if (status != 0) {
            return status;
        }
        for (i = 0; i < @N@; ++i) {
            y[i] += out[i];
        }
    }
"""

_NO_POSITIONS = """\
    int i, status;
"""

_VELOCITIES = """\
    status = @NAME@_velocity_error(t, y, u, p, work, out);
    if (status != 0 || @NAME@_residual(@CLOSURES@, out) <= @NEAR@) {
        return status;
    }
    status = @NAME@_velocity_change(t, y, u, p, work, out);
    for (i = 0; status == 0 && i < @N@; ++i) {
        y[@N@ + i] += out[i];
    }
    return status;
}
"""

#: Residuals of as many units in the last place are left alone.
NEAR = 1.0

#: Larger ones are not taken for rounding, however slowly they shrink.
FAR = 1024.0

#: Steps of Newton's method before giving up.
ROUNDS = 50


def project_text(programs: Mapping[str, Program], names: CNames, real: Real) -> str:
    """The definition of ``NAME_project``, empty where there are no closures."""
    if "velocity_change" not in programs:
        return ""
    positions = "position_change" in programs
    text = "".join([_SIZE, "\n", _HEAD, _POSITIONS if positions else _NO_POSITIONS, _VELOCITIES])
    return fill(
        text,
        names,
        real,
        {
            "@ARGUMENTS@": names.state_arguments(real),
            "@NEXT@": "nextafter" + real.suffix,
            "@START@": str(_inner(programs)),
            "@N@": str(programs["velocity_change"].coordinates),
            "@POSITIONS@": str(_closures(programs, "position_change")),
            "@CLOSURES@": str(_closures(programs, "velocity_change")),
            "@ROUNDS@": str(ROUNDS),
            "@NEAR@": real.value(NEAR),
            "@FAR@": real.value(FAR),
            "@TWO@": real.value(2.0),
        },
    )


def workspace(programs: Mapping[str, Program]) -> int:
    """Numbers of workspace with which every function has enough."""
    work = max(map(work_size, programs.values()))
    if "velocity_change" not in programs:
        return work
    results = max(programs["velocity_change"].coordinates, 2 * _closures(programs, "multipliers"))
    return max(work, _inner(programs) + results)


def _inner(programs: Mapping[str, Program]) -> int:
    """What the functions that ``project`` calls need of it."""
    return max(work_size(program) for name, program in programs.items() if name in INTERNAL)


def _closures(programs: Mapping[str, Program], function: str) -> int:
    if function not in programs:
        return 0
    return sum(len(block.closures) for block in programs[function].blocks)
