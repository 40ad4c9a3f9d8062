"""Rows of families: elements that are alike but for their indices stand as one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.report.contents.sentences import common_kind, remark_on
from lagrange_cli.report.phrases.language import ENGLISH, Language

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.families.families import Families, FamilyName
    from lagrange_cli.mechanics.families.forms import FamilyRow, Range
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


#: A constraint of the account: its name, its equations with ranges, a remark.
AccountLine: TypeAlias = "tuple[str, list[tuple[str, tuple[Range, ...]]], str]"


def account_lines(
    equations: Equations, families: Families | None, say: Language = ENGLISH
) -> list[AccountLine]:
    """Constraints of the account; those that are alike but for their indices are one line."""
    lines = equations.derivation.account.lines
    remark_of = partial(remark_on, say=say, classified=not common_kind(equations))
    if families is None:
        return [(c.name, [(e, ()) for e in c.equations], remark_of(c)) for c in lines]
    account: list[AccountLine] = []
    # Neither names nor equations nor remarks hold line breaks.
    whole = ["\n".join((c.name, *c.equations, remark_of(c))) for c in lines]
    for text in families.texts(whole):
        name, *statements, remark = text.text.split("\n")
        if text.ranges:
            account.append((name, [(e, text.ranges) for e in statements], remark))
        else:
            shown = families.texts(statements)
            account.append((name, [(t.text, t.ranges) for t in shown], remark))
    return account


def sizes_line(families: Families) -> str:
    """Return values of the sizes that ranges on the page end with: ``n = 4``."""
    return ", ".join(f"{size} = {value}" for size, value in families.sizes_shown.items())
