"""The account of constraints on velocities: those that count to K, redundant ones, and remarks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from lagrange_cli.errors import Problem
from lagrange_cli.mechanics.findings import Account, ConstraintLine
from lagrange_cli.mechanics.reduction.dof_account import redundant_warning
from lagrange_cli.mechanics.reduction.rate_redundancy import RedundantRate
from lagrange_cli.mechanics.reduction.velocity_constraints import (
    IndependentPart,
    VelocityConstraint,
)
from lagrange_cli.scene.language.expression import Equation


def with_velocities(
    account: Account, levels: Sequence[VelocityConstraint], independent: IndependentPart
) -> Account:
    """Add constraints on velocities to the account; integrable ones count to K."""
    redundant = {levels[k].constraint: by for k, by in independent.redundant.items()}
    idle = [levels[k].constraint for k in independent.redundant]
    names = {levels[k].constraint for k in independent.numbers}
    integrable = independent.integrable == len(independent.numbers)

    moving = {x.constraint for x in levels if _holds_time(x)}

    def line(line: ConstraintLine) -> ConstraintLine:
        line = replace(line, rheonomic=line.rheonomic or line.name in moving)
        if line.name in names:
            if line.joint:
                line = replace(line, idle=line.idle + idle.count(line.name))
            return line if integrable else replace(line, status="nonholonomic")
        if line.name in redundant:
            return replace(line, status="redundant", implied_by=redundant[line.name])
        return line

    return replace(
        account,
        constraints=account.constraints + independent.integrable,
        dof=account.dof - independent.integrable,
        lines=tuple(map(line, account.lines)),
        nonholonomic=len(independent.numbers) - independent.integrable,
    )


def without_redundant_rates(
    account: Account, dropped: Sequence[RedundantRate], remaining: Sequence[tuple[str, Equation]]
) -> Account:
    """Add constraints on velocities that others imply to the account; ``remaining`` stay."""
    by: dict[str, tuple[str, ...]] = {}
    for one in dropped:
        by[one.constraint] = (*by.get(one.constraint, ()), *one.implied_by)
    gone = by.keys() - {name for name, _ in remaining}

    idle = [one.constraint for one in dropped]

    def line(line: ConstraintLine) -> ConstraintLine:
        if line.joint:
            line = replace(line, idle=line.idle + idle.count(line.name))
        if line.name not in gone or line.status != "independent":
            return line
        others = dict.fromkeys(n for n in by[line.name] if n != line.name)
        return replace(line, status="redundant", implied_by=tuple(others))

    return replace(account, lines=tuple(map(line, account.lines)))


def redundant_rate_warnings(dropped: Sequence[RedundantRate]) -> list[Problem]:
    """Warnings for constraints on velocities that others, or their rates, imply."""
    return [
        redundant_warning(one.constraint, one.equation, one.implied_by, one.by_definitions)
        for one in dropped
    ]


def velocity_warnings(
    levels: Sequence[VelocityConstraint], independent: IndependentPart
) -> list[Problem]:
    """Warnings for constraints on velocities that others imply."""
    return [
        redundant_warning(levels[k].constraint, levels[k].equation, by)
        for k, by in independent.redundant.items()
    ]


def velocity_remarks(
    levels: Sequence[VelocityConstraint], independent: IndependentPart
) -> list[str]:
    """Remarks on integrable constraints that stay constraints on velocities."""
    if not independent.integrable:
        return []
    named = ", ".join(
        f"'{n}'" for n in dict.fromkeys(levels[k].constraint for k in independent.numbers)
    )
    return [
        f"of {named}, {independent.integrable} can be integrated, though not in closed form here:"
        " counted to K, kept as constraints on velocities"
    ]


def _holds_time(level: VelocityConstraint) -> bool:
    """Tell whether t stands in a constraint on velocities."""
    return any(s.name == "t" for s in (level.left - level.right).free_symbols)
