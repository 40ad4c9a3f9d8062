"""Rows of families: elements that are alike but for their indices stand as one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from lagrange_cli.report.contents.sentences import common_kind, remark_on
from lagrange_cli.report.inlines import Written

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.families.families import Families, FamilyName
    from lagrange_cli.mechanics.families.forms import FamilyRow, Range
    from lagrange_cli.mechanics.findings import ConstraintLine
    from lagrange_cli.mechanics.system import Coordinate


def with_families(rows: Sequence[FamilyRow], count: int) -> Iterator[int | FamilyRow]:
    """Numbers of rows, of which those of a family give way to its row at the first of them."""
    families = {row.covers[0]: row for row in rows}
    covered = {k for row in rows for k in row.covers}
    for k in range(count):
        if k in families:
            yield families[k]
        elif k not in covered:
            yield k


def coordinates_by_ranges(
    families: Families, equations: Equations
) -> list[tuple[list[tuple[str, Coordinate]], tuple[Range, ...]]]:
    """Return coordinates with the ranges of their indices; those of a family as one, with letters.

    Each has a name and the coordinate, of a family the first of its elements. Without ranges are
    those of no family, and of one of which not all are positive.
    """
    first: dict[int, FamilyName] = {}
    covered = set[int]()
    for one in families.coordinates:
        if len({equations.system.coordinates[k].is_positive for k in one.covers}) == 1:
            first[one.covers[0]] = one
            covered.update(one.covers)
    groups: list[tuple[list[tuple[str, Coordinate]], tuple[Range, ...]]] = []
    for k, coordinate in enumerate(equations.system.coordinates):
        if k in covered and k not in first:
            continue
        family = first.get(k)
        name = coordinate.name if family is None else family.name
        ranges = () if family is None else family.ranges
        if groups and groups[-1][1] == ranges:
            groups[-1][0].append((name, coordinate))
        else:
            groups.append(([(name, coordinate)], ranges))
    return groups


class AccountLine(NamedTuple):
    """A constraint of the account.

    Attributes
    ----------
    name
        Its name.
    equations
        Its equations with the ranges of their indices; of a joint its kind and parts, with tabs
        between them.
    is_joint
        True if it is a joint.
    remark
        What is said of it, if anything.
    """

    name: str
    equations: list[tuple[str, tuple[Range, ...]]]
    is_joint: bool
    remark: Written | None


def account_lines(equations: Equations, families: Families | None) -> list[AccountLine]:
    """Constraints of the account; those that are alike but for their indices are one line."""
    lines = equations.derivation.account.lines
    remark_of = partial(remark_on, classified=not common_kind(equations))
    if families is None:
        return [
            AccountLine(c.name, [(e, ()) for e in _statements(c)], bool(c.joint), remark_of(c))
            for c in lines
        ]
    account: list[AccountLine] = []
    for text in families.texts(list(map(_whole, lines))):
        line = lines[text.covers[0]]
        name, *statements, implied, restitution, _ = text.text.split("\n")
        by = tuple(implied.split("\t")) if implied else ()
        remark = remark_of(replace(line, implied_by=by, restitution=restitution))
        if text.ranges:
            shown = [(e, text.ranges) for e in statements]
        else:
            shown = [(t.text, t.ranges) for t in families.texts(statements)]
        account.append(AccountLine(name, shown, bool(line.joint), remark))
    return account


def _whole(line: ConstraintLine) -> str:
    """Return all that tells a constraint from others; its parts hold no line breaks."""
    kind = f"{line.status} {line.on_a_part} {line.rheonomic} {line.idle} {line.satisfied}"
    implied, restitution = "\t".join(line.implied_by), line.restitution or ""
    return "\n".join((line.name, *_statements(line), implied, restitution, kind))


def _statements(line: ConstraintLine) -> Sequence[str]:
    return ["\t".join(line.joint)] if line.joint else line.equations


def sizes_line(families: Families) -> str:
    """Return values of the sizes that ranges on the page end with: ``n = 4``."""
    return ", ".join(f"{size} = {value}" for size, value in families.sizes_shown.items())
