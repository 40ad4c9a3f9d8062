"""Members of a plan that a test lists, in blocks."""

from __future__ import annotations

from collections.abc import Sequence

from lagrange_cli.errors import Mark
from lagrange_cli.simulate.ensemble.plan.enumeration import listed
from lagrange_cli.simulate.ensemble.plan.plan import Blocks, Plan, Task, blocks_of
from lagrange_cli.simulate.ensemble.store.blocks import MemberBlock


def blocks_of_rows(plan: Plan, rows: Sequence[Sequence[str]]) -> Blocks:
    """Divide members, each a text for each of the plan's names, into blocks."""
    mark = Mark("members", 1, 1)
    cells = [[(text, mark) for text in row] for row in rows]
    return blocks_of(plan, listed(plan.names, [mark] * len(plan.names), cells))


def tasks_of(plan: Plan, rows: Sequence[Sequence[str]]) -> list[Task]:
    """Return all of them as tasks."""
    blocks = blocks_of_rows(plan, rows)
    return [blocks.task(number) for number in range(len(blocks))]


def unchanged(block: MemberBlock) -> MemberBlock:
    """Keep a block as it is."""
    return block
