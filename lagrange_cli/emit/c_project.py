"""``NAME_project`` of emitted C: a state led back to the closures that it has left."""

from __future__ import annotations

from collections.abc import Mapping

from lagrange_cli.emit.c_body import work_size
from lagrange_cli.emit.c_reset import reset_workspace
from lagrange_cli.emit.c_target import CTarget
from lagrange_cli.emit.constants import NEWTON_STEPS, RESIDUAL_AT_REST, RESIDUAL_ROUNDING
from lagrange_cli.emit.constraints import INTERNAL
from lagrange_cli.emit.program import Program

__all__ = ["project_text", "residual_text", "workspace"]

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

_COUPLED = """\
/*
 * The same, where changes of all coordinates are found together, and rounded together: the
 * magnitude of one residual counts for another as far as a change of the coordinates that
 * makes the one does the other. One that is the difference of nothing (a height that is zero)
 * has no magnitude of its own. Behind the magnitudes stand squares of gradients.
 */
static @REAL@ @NAME@_coupled_residual(int m, @REAL@ *out)
{
    const @REAL@ *const square = out + 2*m;
    @REAL@ reach = @ZERO@;
    int k;
    for (k = 0; k < m; ++k) {
        const @REAL@ length = square[k] > @ZERO@ ? out[m + k]/@SQRT@(square[k]) : @ZERO@;
        reach = length > reach ? length : reach;
    }
    for (k = 0; k < m; ++k) {
        const @REAL@ beside = reach*@SQRT@(square[k]);
        out[m + k] = beside > out[m + k] && beside < (@REAL@)INFINITY ? beside : out[m + k];
    }
    return @NAME@_residual(m, out);
}
"""

_HEAD = """\
@STATIC@int @NAME@_@OF@project(@ARGUMENTS@)
{
    @REAL@ *const out = work + @START@;
"""

_POSITIONS = """\
    @REAL@ size, last = INFINITY;
    int i, round, status;
    for (round = 0; ; ++round) {
        status = @NAME@_@OF@position_error(@PASSED@, work, out);
        if (status != 0) {
            return status;
        }
        size = @NAME@_residual(@POSITIONS@, out);
        /* Only rounding is left, or little more that no change makes smaller. */
        if (size <= @NEAR@) {
            break;
        }
        if (round > 0) {
            status = @NAME@_@OF@position_reach(@PASSED@, work, out + 2*@POSITIONS@);
            if (status != 0) {
                return status;
            }
            size = @NAME@_coupled_residual(@POSITIONS@, out);
            if (size <= @NEAR@ || (size <= @FAR@ && @TWO@*size > last)) {
                break;
            }
        }
        if (round == @ROUNDS@) {
            return 3;
        }
        last = size;
        status = @NAME@_@OF@position_change(@PASSED@, work, out);
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
    status = @NAME@_@OF@velocity_error(@PASSED@, work, out);
    if (status != 0 || @NAME@_residual(@CLOSURES@, out) <= @NEAR@) {
        return status;
    }
    status = @NAME@_@OF@velocity_change(@PASSED@, work, out);
    for (i = 0; status == 0 && i < @N@; ++i) {
        y[@N@ + i] += out[i];
    }
    return status;
}
"""


def residual_text(programs: Mapping[str, Program], target: CTarget) -> str:
    """The helpers of all projections, empty where there is none."""
    used = any(name.endswith("velocity_change") for name in programs)
    more = {"@NEXT@": "nextafter" + target.real.suffix}
    text = target.fill(_SIZE, more) if used else ""
    positions = any(name.endswith("position_change") for name in programs)
    return "\n".join([text, target.fill(_COUPLED)]) if positions else text


def project_text(programs: Mapping[str, Program], target: CTarget, of: str = "") -> str:
    """The definition of ``NAME_project``, empty where there are no closures.

    Parameters
    ----------
    of
        ``contact_`` for that of closures and of what is in contact.
    """
    if f"{of}velocity_change" not in programs:
        return ""
    positions = f"{of}position_change" in programs
    names, real = target.names, target.real
    return target.fill(
        "".join([_HEAD, _POSITIONS if positions else _NO_POSITIONS, _VELOCITIES]),
        {
            "@OF@": of,
            "@STATIC@": "" if names.contact_from is None else "static ",
            "@ARGUMENTS@": target.state_arguments(),
            "@PASSED@": names.passed,
            "@START@": str(_inner(programs, of)),
            "@N@": str(programs[f"{of}velocity_change"].coordinates),
            "@POSITIONS@": str(_closures(programs, f"{of}position_change")),
            "@CLOSURES@": str(_closures(programs, f"{of}velocity_change")),
            "@ROUNDS@": str(NEWTON_STEPS),
            "@NEAR@": real.value(RESIDUAL_AT_REST),
            "@FAR@": real.value(RESIDUAL_ROUNDING),
            "@TWO@": real.value(2.0),
        },
    )


def workspace(programs: Mapping[str, Program]) -> int:
    """Numbers of workspace with which every function has enough."""
    each = max(map(work_size, programs.values()))
    projections = (_workspace(programs, of) for of in ("", "contact_"))
    return max(each, *projections, reset_workspace(programs))


def _workspace(programs: Mapping[str, Program], of: str) -> int:
    if f"{of}velocity_change" not in programs:
        return 0
    closures = _closures(programs, f"{of}velocity_change")
    results = max(programs[f"{of}velocity_change"].coordinates, 3 * closures)
    return _inner(programs, of) + results


def _inner(programs: Mapping[str, Program], of: str) -> int:
    """What the functions that ``project`` calls need of it."""
    called = INTERNAL.intersection(name for name in programs if name.startswith(of))
    return max(work_size(programs[name]) for name in called)


def _closures(programs: Mapping[str, Program], function: str) -> int:
    if function not in programs:
        return 0
    return sum(len(block.closures) for block in programs[function].blocks)
