"""Members of an ensemble in blocks, and what they share.

How members are divided does not depend on where they are run.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.plan.enumeration import Members
from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues, Recipe
from lagrange_cli.simulate.ensemble.reduce.selection import Kept
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import SimulationOptions

#: Members of the largest block that is run one by one; set by hand.
_LARGEST_BLOCK = 32

#: Members of the largest block that is run batched; set by hand.
_LARGEST_BATCHED = 256

#: The same where nothing is kept of every sample; set by hand.
_LARGEST_OF_NUMBERS = 8192

#: Blocks into which fewer members are divided; set by hand.
_FEWEST_BLOCKS = 16


@dataclass(frozen=True)
class Plan:
    """Options and model that all members share; plans of one key are one plan.

    Attributes
    ----------
    key
        Hash of all that results depend on.
    recipe
        The scene, and what options say of it.
    names
        Parameters and initial values that differ.
    member, model
        Values of one of the members, and its model.
    alone
        Members differ in numbers alone.
    samples
        Number of samples of each.
    options
        What is asked for of each.
    extra
        Further columns.
    kept
        What is kept of each beside figures.
    """

    key: str
    recipe: Recipe = field(compare=False)
    names: tuple[str, ...] = field(compare=False)
    member: MemberValues = field(compare=False)
    model: Model = field(compare=False)
    alone: bool = field(compare=False)
    samples: int = field(compare=False)
    options: SimulationOptions = field(compare=False)
    extra: tuple[str, ...] = field(compare=False, default=())
    kept: Kept = field(compare=False, default=Kept())


@dataclass(frozen=True)
class Task:
    """A block of members that is still to be run.

    Attributes
    ----------
    plan
        Options and model that all members share.
    number
        Number of the block.
    rows
        For each member a text for each of the plan's names.
    numbers
        For each of these names the numbers of all members; None where a text is no plain number.
    """

    plan: Plan
    number: int
    rows: tuple[tuple[str, ...], ...]
    numbers: list[Array] | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Blocks:
    """The members of a plan in blocks, which do not depend on where they are run.

    Attributes
    ----------
    plan
        Options and model that all members share.
    members
        All of them.
    size
        Members of each block but the last.
    """

    plan: Plan
    members: Members
    size: int

    def __len__(self) -> int:
        return -(-len(self.members) // self.size)

    def first(self, number: int) -> int:
        """Return the number of the first member of a block."""
        return number * self.size

    def length(self, number: int) -> int:
        """Count the members of a block."""
        return min(self.size, len(self.members) - self.first(number))

    def task(self, number: int) -> Task:
        """Return a block, with the values of its members."""
        first, last = self.first(number), self.first(number) + self.length(number)
        rows = tuple(self.members.rows(first, last))
        return Task(self.plan, number, rows, self.members.numbers(first, last))


def blocks_of(plan: Plan, members: Members) -> Blocks:
    """Divide members into blocks."""
    many = plan.alone and bool(plan.model.code.taylor)
    largest = _LARGEST_BLOCK
    if many:
        largest = _LARGEST_BATCHED if plan.kept.columns != () else _LARGEST_OF_NUMBERS
    return Blocks(plan, members, max(1, min(largest, len(members) // _FEWEST_BLOCKS)))
