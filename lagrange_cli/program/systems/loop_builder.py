"""Building of loops: expressions of one shape become one loop with its workspace."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate
from typing import TYPE_CHECKING

from lagrange_cli.program.graph.operands import Cell, Coefficient, Variable
from lagrange_cli.program.graph.schedule import LONGEST_SUM, in_families, order_of, schedule
from lagrange_cli.program.graph.statement_groups import renamed
from lagrange_cli.program.graph.value_graph import (
    ONE,
    InputNode,
    ScaledNode,
    ValueGraph,
    expand_angle_sums,
)
from lagrange_cli.program.systems.loops import IndexColumn, IndexedLoop, ProgramPart, Total
from lagrange_cli.program.systems.shapes import ShapeTable, joint_shape, shared_parts

if TYPE_CHECKING:
    from collections.abc import Hashable

    from sympy import Expr

#: Most loops that members of one shape are divided into so that indices advance by constant
#: steps: beyond it a table of indices is shorter code. Not tuned.
_MOST_EVEN = 6
#: Strides at which constant steps are sought: every member, every second, every third.
_PERIODS = (1, 2, 3)

#: The rank of values in the workspace (see
#: :class:`lagrange_cli.program.graph.value_graph.ValueGraph`).
_RANKS = {"p": 1, "s": 1, "t": 2, "u": 2, "q": 3, "v": 4, "w": 5}


@dataclass(frozen=True)
class ScaledCell:
    """A value: a number times what stands at a place (None: the number alone)."""

    coefficient: Coefficient
    place: Cell | None


@dataclass(frozen=True)
class Formula:
    """Values made of expressions.

    Attributes
    ----------
    kind, expressions
        These, by the shapes of the expressions, determine the values of ``make``.
    make
        Puts the values into a graph.
    targets
        Cells of the results; empty: cells of the workspace are allocated for them.
    """

    kind: Hashable
    expressions: tuple[Expr, ...]
    make: Callable[[ValueGraph], list[ScaledNode]]
    targets: tuple[Cell, ...] = ()

    def to(self, *targets: Cell) -> Formula:
        """Return the same formula with targets."""
        return replace(self, targets=targets)


@dataclass(frozen=True)
class SumOfProducts:
    """Σ coefficient · Π value, with the target of the sum."""

    terms: tuple[tuple[Coefficient, tuple[Cell, ...]], ...]
    target: Cell


@dataclass(frozen=True)
class _Member:
    """One of several values of one shape.

    Attributes
    ----------
    key
        The shape.
    places
        Places of its inputs.
    atoms
        Expressions that the inputs stand for, or empty.
    make
        Puts the value into the graph of a loop, made of the first member.
    targets
        Cells of the results; empty: cells of the workspace are allocated for them.
    """

    key: Hashable
    places: tuple[Cell, ...]
    atoms: tuple[Expr, ...]
    make: Callable[[ValueGraph, list[ScaledNode]], list[ScaledNode]]
    targets: tuple[Cell, ...]


@dataclass
class LoopBuilder:
    """Parts of a program in their order, as they are added.

    Attributes
    ----------
    shapes
        Shapes of the expressions so far.
    parts
        Parts so far.
    size
        Numbers of workspace that they take.
    """

    shapes: ShapeTable
    parts: list[ProgramPart] = field(default_factory=list)
    size: int = 0

    def allocate(self, count: int) -> int:
        """Reserve numbers of workspace; return the index of the first."""
        start, self.size = self.size, self.size + count
        return start

    def evaluate(self, formulas: Sequence[Formula]) -> list[list[ScaledCell]]:
        """Append loops that compute formulas; return the cells of the results of each."""
        groups = [formula.expressions for formula in formulas]
        for level in self._levels(shared_parts(groups, self.shapes, LONGEST_SUM)):
            self._share(level)
        return self._run([self._member(formula) for formula in formulas])

    def combine(self, sums: Sequence[SumOfProducts]) -> None:
        """Compute sums of products of values at cells."""
        self._run([_sum_member(one) for one in sums])

    # -- what several formulas hold ----------------------------------------------

    def _levels(self, expressions: Sequence[Expr]) -> list[list[Expr]]:
        """Group expressions into levels, each of which needs values of earlier levels alone."""
        depth: dict[Expr, int] = {}
        chosen = set(expressions)
        levels: list[list[Expr]] = []
        for expression in expressions:
            inner = max((_depth(a, depth, chosen) for a in expression.args), default=0)
            depth[expression] = inner + 1
            levels += [[] for _ in range(inner + 1 - len(levels))]
            levels[inner].append(expression)
        return levels

    def _share(self, expressions: Sequence[Expr]) -> None:
        """Append loops that compute expressions, which are leaves of later ones."""
        long = [e for e in expressions if e.is_Add and len(e.args) > LONGEST_SUM]
        for expression in long:
            self._add_up(expression)
        short = [e for e in expressions if not (e.is_Add and len(e.args) > LONGEST_SUM)]
        members = [self._member(value_formula(e)) for e in short]
        for expression, (cell,) in zip(short, self._run(members, whole=True), strict=True):
            assert cell.place is not None
            self.shapes.place(expression, cell.place)

    def _add_up(self, expression: Expr) -> None:
        """Compute a long sum: its terms side by side, then their total."""
        start = self.allocate(len(expression.args))
        # SymPy sorts by names, in which x[10] stands before x[2].
        terms = sorted(expression.args, key=self.shapes.shape)
        cells = (Cell("w", start + k) for k in range(len(terms)))
        self._run([self._member(value_formula(*pair)) for pair in zip(terms, cells, strict=True)])
        self.parts.append(Total(start, len(expression.args)))
        self.shapes.place(expression, Cell("w", start))

    # -- members of one shape -------------------------------------------------------

    def _member(self, formula: Formula) -> _Member:
        key, leaves = joint_shape(map(self.shapes.shape, formula.expressions))
        atoms, places = [], []
        for leaf in leaves:
            atom, place = self.shapes.leaves[leaf]
            atoms.append(atom)
            places.append(place)
        return _Member(
            (formula.kind, key),
            tuple(places),
            tuple(atoms),
            lambda values, _: formula.make(values),
            formula.targets,
        )

    def _run(self, members: Sequence[_Member], whole: bool = False) -> list[list[ScaledCell]]:
        """Append loops for members by shape; ``whole`` results are stored with their factors."""
        groups: dict[Hashable, list[int]] = {}
        for number, member in enumerate(members):
            key = (member.key, tuple(place.array for place in member.places))
            groups.setdefault(key, []).append(number)
        results: dict[int, list[ScaledCell]] = {}
        for group in groups.values():
            for numbers in _even(group, [_indices(members[number]) for number in group]):
                cells = self._loop([members[number] for number in numbers], whole)
                results.update(zip(numbers, cells, strict=True))
        return [results[number] for number in range(len(members))]

    def _loop(self, members: Sequence[_Member], whole: bool) -> list[list[ScaledCell]]:
        first = members[0]
        values, results = _prototype(first)
        inputs = [
            IndexColumn(place.array, tuple(member.places[k].number for member in members))
            for k, place in enumerate(first.places)
        ]
        if first.targets:
            columns = [
                IndexColumn(target.array, tuple(member.targets[k].number for member in members))
                for k, target in enumerate(first.targets)
            ]
            self._append(values, results, inputs, columns)
            return [[] for _ in members]
        if whole:
            results = [(1, values.node(result)) for result in results]
        return self._stored(values, results, inputs, len(members))

    def _stored(
        self, values: ValueGraph, results: list[ScaledNode], inputs: list[IndexColumn], members: int
    ) -> list[list[ScaledCell]]:
        """Give each result of a loop a place, each node once and numbers none."""
        once = all(column.is_fixed for column in inputs)
        rows = 1 if once else members
        nodes = list(dict.fromkeys(node for _, node in results if node != ONE))
        starts = {node: self.allocate(rows) for node in nodes}
        columns = [IndexColumn("w", tuple(range(starts[n], starts[n] + rows))) for n in nodes]
        if once:
            inputs = [IndexColumn(column.array, column.indices[:1]) for column in inputs]
        self._append(values, [(1, node) for node in nodes], inputs, columns)
        return [
            [
                ScaledCell(c, None if n == ONE else Cell("w", starts[n] + (0 if once else k)))
                for c, n in results
            ]
            for k in range(members)
        ]

    def _append(
        self,
        values: ValueGraph,
        results: list[ScaledNode],
        inputs: list[IndexColumn],
        columns: list[IndexColumn],
    ) -> None:
        """Append the loop that computes results and stores them."""
        if not results:
            return
        expand_angle_sums(values, order_of(values, [node for _, node in results]))
        assignments, ((_, operands),) = in_families(*schedule(values, [("results", results)]))
        targets = tuple(zip(columns, operands, strict=True))
        loop = IndexedLoop(len(columns[0].indices), tuple(inputs), assignments, targets)
        self.parts.append(_pruned(loop))


def value_formula(expression: Expr, *targets: Cell) -> Formula:
    """Make one value of one expression."""
    return Formula("value", (expression,), lambda values: [values.convert(expression)], targets)


def _depth(expression: Expr, depth: dict[Expr, int], chosen: set[Expr]) -> int:
    """Count the chosen expressions that stand within one another in an expression."""
    deepest, stack, seen = 0, [expression], set()
    while stack:
        part = stack.pop()
        if part in seen:
            continue
        seen.add(part)
        if part in chosen:
            deepest = max(deepest, depth[part])
        else:
            stack.extend(part.args)
    return deepest


def _pruned(loop: IndexedLoop) -> IndexedLoop:
    """Drop the inputs of a loop that nothing reads."""
    read = loop.read
    used = [k for k in range(len(loop.inputs)) if f"l{k}" in read]
    new = {f"l{k}": Variable(f"l{number}") for number, k in enumerate(used)}
    return IndexedLoop(
        loop.members,
        tuple(loop.inputs[k] for k in used),
        tuple((name, renamed(operand, new)) for name, operand in loop.assignments),
        tuple((column, renamed(operand, new)) for column, operand in loop.results),
    )


def _indices(member: _Member) -> tuple[int, ...]:
    return tuple(place.number for place in (*member.places, *member.targets))


def _even(group: list[int], rows: list[tuple[int, ...]]) -> list[list[int]]:
    """Divide a group into the fewest parts in which all indices advance by constant steps.

    It stays undivided where these parts are many.
    """
    best = [group]
    fewest = _MOST_EVEN + 1
    for period in _PERIODS:
        parts = []
        for first in range(period):
            lengths = _runs(rows[first::period])
            ends = list(accumulate(lengths))
            turn = group[first::period]
            parts += [turn[end - n : end] for n, end in zip(lengths, ends, strict=True)]
        if len(parts) < fewest:
            best, fewest = parts, len(parts)
    return best


def _runs(rows: list[tuple[int, ...]]) -> list[int]:
    """Lengths of the longest series of rows that advance by constant steps."""
    lengths: list[int] = []
    step: tuple[int, ...] | None = None
    for k, row in enumerate(rows):
        advance = None if k == 0 else tuple(b - a for a, b in zip(rows[k - 1], row, strict=True))
        if lengths and (lengths[-1] == 1 or advance == step):
            lengths[-1] += 1
            step = advance
        else:
            lengths.append(1)
            step = None
    return lengths


def _prototype(member: _Member) -> tuple[ValueGraph, list[ScaledNode]]:
    """Build the program of a member over local names; return its graph and its results."""
    names = [(f"l{k}", _RANKS[place.array]) for k, place in enumerate(member.places)]
    atoms = zip(member.atoms, names, strict=False)
    values = ValueGraph([(atom, name, rank) for atom, (name, rank) in atoms])
    inputs: list[ScaledNode] = [(1, values.intern(InputNode(name), rank)) for name, rank in names]
    return values, member.make(values, inputs)


def _sum_member(total: SumOfProducts) -> _Member:
    """Make a sum of products a member of those that differ in the places alone."""
    numbers: dict[Cell, int] = {}
    pattern = tuple(
        (coefficient, tuple(numbers.setdefault(place, len(numbers)) for place in places))
        for coefficient, places in total.terms
    )

    def make(values: ValueGraph, inputs: list[ScaledNode]) -> list[ScaledNode]:
        products = [
            values.multiply([((c, ONE), 1), *((inputs[k], 1) for k in factors)])
            for c, factors in pattern
        ]
        return [values.add(products)]

    return _Member((pattern, total.target.array), tuple(numbers), (), make, (total.target,))
