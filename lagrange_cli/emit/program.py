"""Equations → Program: straight-line code that every target language prints.

A program has inputs, assignments in an order in which each needs only what
stands before it, and outputs by name. It names nothing after the scene: the
inputs are ``t``, ``q0, q1, …``, ``v0, …``, ``p0, …``, ``u0, …`` (coordinates, velocities,
parameters, what the user drives, in the order of the Equations) and the assigned
names ``w0, w1, …``.
Only what the requested outputs need is computed, and each value once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.emit import values as graph
from lagrange_cli.emit.angles import expand_angle_sums
from lagrange_cli.emit.closures import CLOSURE_OUTPUTS, SYSTEMS
from lagrange_cli.emit.factoring import factor_sums
from lagrange_cli.emit.families import Assignment, by_family, ordered, rename
from lagrange_cli.emit.operands import (
    FUNCTIONS,
    Call,
    Number,
    Operand,
    Product,
    Sum,
    Variable,
    variables,
)
from lagrange_cli.emit.sharing import share_products, share_scaled, share_sums
from lagrange_cli.emit.solve import Block, solve_blocks
from lagrange_cli.emit.values import ONE, Scaled, Values

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations

__all__ = [
    "FUNCTIONS",
    "OUTPUTS",
    "Call",
    "Number",
    "Operand",
    "Operations",
    "Product",
    "Program",
    "Sum",
    "Variable",
    "asked_for",
    "build_program",
    "following",
    "input_names",
    "operations",
]

#: An expression with more leaves than this gets a name of its own.
LARGEST_INLINE = 12

#: The terms of a sum with more terms than this get names of their own.
LONGEST_INLINE_SUM = 20

#: A program of more statements has those of one form brought together.
LARGEST_IN_ORDER = 100

#: Sums with more terms than this are added up in groups.
LONGEST_SUM = 24


@dataclass(frozen=True)
class Program:
    """Straight-line code for ``outputs`` (name, operands).

    ``blocks`` says how accelerations, or what else solves a system, are found
    where they are an output (see :mod:`lagrange_cli.emit.solve`). ``driven`` is the
    number of inputs ``u0, …``.
    """

    coordinates: int
    parameters: int
    assignments: tuple[tuple[str, Operand], ...]
    outputs: tuple[tuple[str, tuple[Operand, ...]], ...]
    blocks: tuple[Block, ...] = ()
    driven: int = 0

    @property
    def is_large(self) -> bool:
        """Whether statements of one form stand together, to be written as loops."""
        results = sum(len(operands) for _, operands in self.outputs)
        return len(self.assignments) + results > LARGEST_IN_ORDER

    def output(self, name: str) -> tuple[Operand, ...]:
        """The operands of one output."""
        return dict(self.outputs)[name]


def _momenta(e: Equations) -> Iterable[Expr]:
    return (e.lagrangian.diff(c.v) for c in e.coordinates)


def _upper_triangle(e: Equations) -> Iterable[Expr]:
    n = len(e.coordinates)
    return (e.mass_matrix[i][j] for i in range(n) for j in range(i, n))


#: What can be asked for, besides what solves a system: each a function to its expressions.
OUTPUTS: dict[str, Callable[[Equations], Iterable[Expr]]] = {
    "mass_matrix": _upper_triangle,
    "forcing": lambda e: e.forcing,
    "energy": lambda e: (e.energy,),
    "kinetic": lambda e: (e.kinetic,),
    "potential": lambda e: (e.potential,),
    "positions": lambda e: (c.position for c in e.cartesian_names),
    "velocities": lambda e: (c.velocity for c in e.cartesian_names),
    "momenta": _momenta,
    "inputs": lambda e: (given.expression for given in e.inputs),
    "outputs": lambda e: (expression for _, expression in e.outputs),
    **CLOSURE_OUTPUTS,
}


def asked_for(equations: Equations) -> list[str]:
    """Which of ``inputs`` and ``outputs`` the scene has."""
    sections = (("inputs", equations.inputs), ("outputs", equations.outputs))
    return [name for name, entries in sections if entries]


def build_program(equations: Equations, outputs: Sequence[str]) -> Program:
    """The program that computes the named outputs.

    Parameters
    ----------
    outputs
        Names from :data:`OUTPUTS`, or one of :data:`SYSTEMS` (``acceleration``),
        which stands for the outputs ``acceleration``, ``pivots``, ``scales``,
        ``dense_matrix`` and ``dense_forcing`` that
        :func:`lagrange_cli.emit.solve.solve_blocks` explains.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in emitted code.
    """
    values = Values(_inputs(equations))
    wanted: list[tuple[str, list[Scaled]]] = []
    blocks: tuple[Block, ...] = ()
    for name in outputs:
        if name in SYSTEMS:
            blocks, solution = solve_blocks(values, equations, SYSTEMS[name](equations))
            wanted.extend(solution)
        else:
            wanted.append((name, [values.convert(e) for e in OUTPUTS[name](equations)]))
    if not any(block.exact for block in blocks):
        expand_angle_sums(values, _order(values, [number for _, of in wanted for _, number in of]))
    assignments, results = _schedule(values, wanted)
    return Program(
        len(equations.coordinates),
        len(equations.parameters),
        assignments,
        results,
        blocks,
        len(equations.inputs),
    )


def _inputs(equations: Equations) -> list[tuple[Expr, str, int]]:
    """Symbol, dummy name and rank of every input."""
    inputs = [(p.symbol, f"p{i}", 1) for i, p in enumerate(equations.parameters)]
    inputs.append((equations.t, "t", 2))
    inputs.extend((given.symbol, f"u{i}", 2) for i, given in enumerate(equations.inputs))
    inputs.extend((c.q, f"q{i}", 3) for i, c in enumerate(equations.coordinates))
    inputs.extend((c.v, f"v{i}", 4) for i, c in enumerate(equations.coordinates))
    return inputs


_Assignments: TypeAlias = tuple[Assignment, ...]
_Results: TypeAlias = tuple[tuple[str, tuple[Operand, ...]], ...]


def _schedule(
    values: Values, wanted: list[tuple[str, list[Scaled]]]
) -> tuple[_Assignments, _Results]:
    """Order the nodes that ``wanted`` needs and write them as assignments."""
    scaled = [value for _, of in wanted for value in of]
    roots = [number for _, number in scaled]
    share_products(values, _order(values, roots))
    factor_sums(values, _order(values, roots))
    share_products(values, _order(values, roots))
    share_sums(values, _order(values, roots))
    scaled = share_scaled(values, _order(values, roots), scaled)
    roots = [number for _, number in scaled]
    _split_long_sums(values)
    order = _order(values, roots)
    uses = _count_uses(values, order, roots)
    writer = _Writer(values)
    for number in order:
        writer.write(number, uses[number])
    operands = iter([writer.scaled(*value) for value in scaled])
    results = tuple((name, tuple(next(operands) for _ in of)) for name, of in wanted)
    if len(writer.assignments) + len(scaled) > LARGEST_IN_ORDER:
        return _in_families(writer.assignments, results)
    return tuple(writer.assignments), results


def _in_families(assignments: list[Assignment], results: _Results) -> tuple[_Assignments, _Results]:
    """Assignments of one form together, and named in their new order."""
    grouped, new = by_family(assignments)
    return tuple(grouped), tuple(
        (name, tuple(ordered(rename(operand, new)) for operand in operands))
        for name, operands in results
    )


def _order(values: Values, roots: Iterable[int]) -> list[int]:
    """Every node that the roots need, parts first, in the order of first need."""
    order: list[int] = []
    done: set[int] = set()
    stack = [(root, False) for root in reversed(list(roots))]
    while stack:
        number, parts_done = stack.pop()
        if number in done:
            continue
        if parts_done:
            done.add(number)
            order.append(number)
        else:
            stack.append((number, True))
            stack.extend((part, False) for part in reversed(values.parts(number)))
    return order


def _split_long_sums(values: Values) -> None:
    """Replace sums of many terms by sums of sums: shallow trees, and less rounding."""
    for number in range(len(values.nodes)):
        node = values.nodes[number]
        while isinstance(node, graph.Sum) and len(node.terms) > LONGEST_SUM:
            groups = []
            for start in range(0, len(node.terms), LONGEST_SUM):
                part = node.terms[start : start + LONGEST_SUM]
                rank = max(values.rank[n] for n, _ in part)
                groups.append((values.intern(graph.Sum(part), rank), Fraction(1)))
            node = values.nodes[number] = graph.Sum(tuple(groups))


def _count_uses(values: Values, order: list[int], roots: list[int]) -> dict[int, int]:
    uses = dict.fromkeys(order, 0)
    for root in roots:
        uses[root] += 1
    for number in order:
        node = values.nodes[number]
        if isinstance(node, graph.Product):
            for part, exponent in node.factors:
                uses[part] += abs(exponent)
        else:
            for part in values.parts(number):
                uses[part] += 1
    return uses


class _Writer:
    """Turns nodes into operands, naming those that are used twice or large."""

    def __init__(self, values: Values) -> None:
        self.values = values
        self.assignments: list[tuple[str, Operand]] = []
        self.operands: dict[int, Operand] = {ONE: Number(Fraction(1))}
        self.sizes: dict[int, int] = {ONE: 1}

    def write(self, number: int, uses: int) -> None:
        """Write a node whose parts are written."""
        node = self.values.nodes[number]
        if number == ONE:
            return
        if isinstance(node, graph.Input):
            operand: Operand = Variable(node.name)
            size = 1
        else:
            operand = self._operand(node)
            size = sum(self.sizes[part] for part in self.values.parts(number))
        if uses > 1 or size > LARGEST_INLINE:
            operand, size = self._named(operand), 1
        self.operands[number] = operand
        self.sizes[number] = size

    def _named(self, operand: Operand) -> Operand:
        """A name for what is not one (or a number) already."""
        if isinstance(operand, Variable | Number):
            return operand
        name = f"w{len(self.assignments)}"
        self.assignments.append((name, operand))
        return Variable(name)

    def scaled(self, coefficient: Fraction, number: int) -> Operand:
        """A coefficient times a written node."""
        operand = self.operands[number]
        if number == ONE:
            return Number(coefficient)
        if coefficient == 1:
            return operand
        if isinstance(operand, Sum) and coefficient == -1:
            return Sum(tuple((-c, o) for c, o in operand.terms))
        return Sum(((coefficient, operand),))

    def _operand(self, node: graph.Sum | graph.Product | graph.Call) -> Operand:
        operands = self.operands
        if isinstance(node, graph.Call):
            return Call(node.function, tuple(operands[a] for a in node.arguments))
        if isinstance(node, graph.Product):
            return self._product(node)
        if len(node.terms) == 1:
            ((number, coefficient),) = node.terms
            return self.scaled(coefficient, number)
        # A sum starts with a positive term where it has one.
        terms = sorted(node.terms, key=lambda term: term[1] < 0)
        if len(terms) > LONGEST_INLINE_SUM:
            return Sum(tuple((c, self._named(operands[n])) for n, c in terms))
        return Sum(tuple((c, operands[n]) for n, c in terms)) if terms else Number(Fraction(0))

    def _product(self, node: graph.Product) -> Operand:
        numerator: list[Operand] = []
        denominator: list[Operand] = []
        for number, exponent in node.factors:
            side = numerator if exponent > 0 else denominator
            side.extend([self.operands[number]] * abs(exponent))
        if len(numerator) == 1 and not denominator:
            return numerator[0]
        return Product(tuple(numerator), tuple(denominator))


@dataclass(frozen=True)
class Operations:
    """Floating-point operations of a program, by kind."""

    additions: int = 0
    multiplications: int = 0
    divisions: int = 0
    calls: int = 0

    @property
    def total(self) -> int:
        return self.additions + self.multiplications + self.divisions + self.calls

    def __add__(self, other: Operations) -> Operations:
        return Operations(
            self.additions + other.additions,
            self.multiplications + other.multiplications,
            self.divisions + other.divisions,
            self.calls + other.calls,
        )


def operations(program: Program) -> Operations:
    """Count the operations of all assignments and outputs (a negation is an addition)."""
    total = Operations()
    stack: list[Operand] = [operand for _, operand in program.assignments]
    stack.extend(operand for _, of in program.outputs for operand in of)
    while stack:
        operand = stack.pop()
        if isinstance(operand, Sum):
            total += _sum_operations(operand)
            stack.extend(o for _, o in operand.terms)
        elif isinstance(operand, Product):
            total += _product_operations(operand)
            stack.extend((*operand.numerator, *operand.denominator))
        elif isinstance(operand, Call):
            total = replace(total, calls=total.calls + 1)
            stack.extend(operand.arguments)
    return total


def _sum_operations(operand: Sum) -> Operations:
    scaled = sum(abs(c) != 1 and not isinstance(o, Number) for c, o in operand.terms)
    negated = len(operand.terms) == 1 and operand.terms[0][0] == -1
    return Operations(additions=len(operand.terms) - 1 + negated, multiplications=scaled)


def _product_operations(operand: Product) -> Operations:
    factors = max(0, len(operand.numerator) - 1) + max(0, len(operand.denominator) - 1)
    return Operations(multiplications=factors, divisions=bool(operand.denominator))


def following(program: Program, names: Iterable[str]) -> tuple[Assignment, ...]:
    """The assignments that need one of the names, in their order."""
    late = set(names)
    found = []
    for name, operand in program.assignments if late else ():
        if any(variable.name in late for variable in variables(operand)):
            late.add(name)
            found.append((name, operand))
    return tuple(found)


def input_names(program: Program) -> frozenset[str]:
    """The inputs that the program reads."""
    operands = [operand for _, operand in program.assignments]
    operands += [operand for _, of in program.outputs for operand in of]
    names = {variable.name for operand in operands for variable in variables(operand)}
    return frozenset(names - {name for name, _ in program.assignments})
