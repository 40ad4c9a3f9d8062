"""``NAME_project`` of emitted C: lead a state back to closures that it has left."""

from __future__ import annotations

from collections.abc import Mapping

from lagrange_cli.emit.c.body import given_size, program_workspace_size
from lagrange_cli.emit.c.impact import impact_workspace_size
from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.emit.constants import NEWTON_STEPS, RESIDUAL_AT_REST, RESIDUAL_ROUNDING
from lagrange_cli.emit.template_files import c_template
from lagrange_cli.program.emitted_functions import INTERNAL_FUNCTIONS
from lagrange_cli.program.program import Program


def residual_text(programs: Mapping[str, Program], target: CTarget) -> str:
    """Return the helpers of all projections; empty if there is none."""
    used = any(name.endswith("velocity_change") for name in programs)
    more = {"@NEXT@": "nextafter" + target.real.suffix}
    text = target.fill(c_template("residual"), more) if used else ""
    positions = any(name.endswith("position_change") for name in programs)
    return "\n".join([text, target.fill(c_template("coupled_residual"))]) if positions else text


def project_text(programs: Mapping[str, Program], target: CTarget, prefix: str = "") -> str:
    """Return the definition of ``NAME_project``; empty if there are no closures.

    Parameters
    ----------
    prefix
        ``contact_`` for the projection onto closures and closed contacts; else empty.
    """
    if f"{prefix}velocity_change" not in programs:
        return ""
    positions = f"{prefix}position_change" in programs
    names, real = target.names, target.real
    return target.fill(
        c_template("project"),
        {
            "@LED@": c_template("project_positions") if positions else "    int i, status;\n",
            "@OF@": prefix,
            "@STATIC@": "" if names.contact_from is None else "static ",
            "@ARGUMENTS@": target.state_arguments(),
            "@PASSED@": names.passed,
            "@START@": str(_inner(programs, prefix)),
            "@N@": str(programs[f"{prefix}velocity_change"].coordinates),
            "@POSITIONS@": str(_closures(programs, f"{prefix}position_change")),
            "@CLOSURES@": str(_closures(programs, f"{prefix}velocity_change")),
            "@ROUNDS@": str(NEWTON_STEPS),
            "@NEAR@": real.value(RESIDUAL_AT_REST),
            "@FAR@": real.value(RESIDUAL_ROUNDING),
            "@TWO@": real.value(2.0),
        },
    )


def workspace_size(programs: Mapping[str, Program]) -> int:
    """Return the numbers of workspace that suffice for every function."""
    each = max(map(program_workspace_size, programs.values()))
    projections = (_workspace(programs, prefix) for prefix in ("", "contact_"))
    behind = max(map(given_size, programs.values()))
    return behind + max(each, *projections, impact_workspace_size(programs))


def _workspace(programs: Mapping[str, Program], prefix: str) -> int:
    if f"{prefix}velocity_change" not in programs:
        return 0
    closures = _closures(programs, f"{prefix}velocity_change")
    results = max(programs[f"{prefix}velocity_change"].coordinates, 3 * closures)
    return _inner(programs, prefix) + results


def _inner(programs: Mapping[str, Program], prefix: str) -> int:
    """Return the numbers of workspace that functions called by ``project`` need."""
    called = INTERNAL_FUNCTIONS.intersection(name for name in programs if name.startswith(prefix))
    return max(program_workspace_size(programs[name]) for name in called)


def _closures(programs: Mapping[str, Program], function: str) -> int:
    if function not in programs:
        return 0
    return sum(len(block.closures) for block in programs[function].blocks)
