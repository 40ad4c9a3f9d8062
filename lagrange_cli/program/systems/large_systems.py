"""Programs of large sparse systems: loops over expressions of one shape.

A system is large if its mass matrix is diagonal and proven positive definite and its
unknowns are many: closures and coordinates then couple few neighbours each.
With Φ the gradients of the closures and f/M the accelerations without them,
S λ = −bias − Φ f/M with S = Φ M⁻¹ Φᵀ (:mod:`.solvers.sparse_factorization`), and
a = f/M + M⁻¹ Φᵀ λ.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import count
from math import prod
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.program.graph.operands import Cell, Coefficient
from lagrange_cli.program.graph.value_graph import ONE, ProductNode, ScaledNode, ValueGraph
from lagrange_cli.program.solvers.sparse_factorization import FEWEST_UNKNOWNS, choose_factorization
from lagrange_cli.program.systems.closure_formulas import (
    CLOSURE_FORMULAS,
    ClosureFunction,
    ClosureValue,
    closure_bias,
    closure_expression,
    closure_formulas,
    closure_rate,
    gradient_squares,
)
from lagrange_cli.program.systems.loop_builder import (
    Formula,
    LoopBuilder,
    ScaledCell,
    SumOfProducts,
    value_formula,
)
from lagrange_cli.program.systems.loops import ProgramPart, SparseSolve, Zeros
from lagrange_cli.program.systems.shapes import ShapeTable

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.program.systems.contact_systems import WeightedClosures

#: Fewest coordinates of a system without closures that is written as loops.
_FEWEST_FREE = 100

#: Most parts of a program of loops: expressions that need more have too little in common.
_MOST_PARTS = 256

_Row: TypeAlias = dict[int, tuple[ScaledCell, ScaledCell]]
"""Coordinate → entry of a gradient, and the same over the mass."""

_Product: TypeAlias = tuple[Coefficient, tuple[Cell, ...]]
"""A coefficient, and the cells that it is multiplied by."""


class LargeSystem(NamedTuple):
    """The loops of a program of a large system.

    Attributes
    ----------
    parts
        Loops and solvers, in their order.
    work, results
        Numbers of workspace that the parts take, and numbers that they store.
    solves
        A system with the mass matrix is solved.
    closures
        Indices of those solved with it.
    """

    parts: tuple[ProgramPart, ...]
    work: int
    results: int
    solves: bool = False
    closures: tuple[int, ...] = ()


def is_large_system(equations: Equations) -> bool:
    """Tell whether the programs of a system are made of loops."""
    n, m = (
        len(equations.system.coordinates),
        len(equations.system.closures) + len(equations.system.contacts),
    )
    large = n + m >= FEWEST_UNKNOWNS if m else n >= _FEWEST_FREE
    if not large or not equations.derivation.facts.positive_definite_mass_matrix:
        return False
    if equations.system.sensitivities or equations.system.states:
        return False
    sources = equations.derivation.sources
    if sources is not None and sources.tree is not None:
        return False  # its joints move what stands on them together
    rows = enumerate(equations.system.mass_matrix)
    return equations.derivation.facts.diagonal_mass_matrix or all(
        entries(r).keys() == {i} for i, r in rows
    )


def large_system(
    asked: WeightedClosures, plain: Callable[[str], Sequence[Expr]]
) -> LargeSystem | None:
    """Build the program of some outputs as loops; None if loops would not shorten it.

    Parameters
    ----------
    asked
        Equations, and names as :func:`lagrange_cli.program.program.build_program` takes them.
    plain
        Gives the expressions of outputs that closures have no part in.
    """
    equations, outputs = asked.equations, asked.outputs
    if outputs[0] in _SYSTEMS:
        return _System(asked, _SYSTEMS[outputs[0]]).program()
    loops = LoopBuilder(ShapeTable(_inputs(asked)))
    formulas: list[Formula] = []
    n = len(equations.system.coordinates)
    for name in outputs:
        if rows := _matrix_rows(equations, name):
            loops.parts.append(Zeros("out", 0, n * len(rows)))
            for i, row in enumerate(rows):
                formulas += (value_formula(e, Cell("out", i * n + j)) for j, e in row.items())
        elif name == "closure_gradient_squares":
            formulas += gradient_squares(equations)
        elif name in CLOSURE_FORMULAS:
            formulas += closure_formulas(equations, name)
        else:
            formulas += map(value_formula, plain(name))
    # Matrices are by rows, and stand first.
    targets = (Cell("out", k) for k in count(n * len(_matrix_rows(equations, outputs[0]))))
    loops.evaluate([f if f.targets else f.to(next(targets)) for f in formulas])
    if len(loops.parts) > _MOST_PARTS:
        return None
    return LargeSystem(tuple(loops.parts), loops.size, next(targets).number)


def _matrix_rows(equations: Equations, output: str) -> list[Mapping[int, Expr]]:
    """List the nonzero entries of each row of an output that is a matrix, none of others."""
    if output == "mass_matrix":
        return [{i: row[i]} for i, row in enumerate(equations.system.mass_matrix)]
    contacts = equations.system.contacts if output == "gap_gradients" else ()
    return [entries(contact.closure.gradient) for contact in contacts]


def _inputs(asked: WeightedClosures) -> dict[Expr, Cell]:
    """Map every input to its cell.

    Flags of contacts and targets of impulses, behind the parameters, have an array of their own in
    emitted code.
    """
    equations = asked.equations
    places: dict[Expr, Cell] = {equations.system.t: Cell("t", 0)}
    flags_from = len(equations.system.parameters) - asked.flags
    for i, p in enumerate(equations.system.parameters):
        places[p.symbol] = Cell("p" if i < flags_from else "s", i)
    places |= {u.symbol: Cell("u", i) for i, u in enumerate(equations.system.inputs)}
    places |= {c.q: Cell("q", i) for i, c in enumerate(equations.system.coordinates)}
    return places | {c.v: Cell("v", i) for i, c in enumerate(equations.system.coordinates)}


@dataclass(frozen=True)
class _Asked:
    """A system that a program solves.

    Attributes
    ----------
    residual
        Residual of each closure.
    kind
        Kind of its closures, empty for all.
    forced
        True if forces are on the right-hand side.
    multipliers
        True if the multipliers are asked for, instead of accelerations.
    """

    residual: ClosureFunction
    kind: str = ""
    forced: bool = False
    multipliers: bool = False


_SYSTEMS = {
    "acceleration": _Asked(closure_bias, forced=True),
    "multipliers": _Asked(closure_bias, forced=True, multipliers=True),
    "position_change": _Asked(closure_expression, kind="position"),
    "velocity_change": _Asked(closure_rate),
    "impulse": _Asked(closure_bias),
}


def _of_row(residual: ClosureValue, masses: Sequence[Expr], values: ValueGraph) -> list[ScaledNode]:
    """Add a gradient, the gradient over the masses, and the residual to a graph."""
    gradient = [values.convert(g) for g in entries(residual.closure.gradient).values()]
    # Reciprocals are nodes of their own: one division for all that has one mass.
    inverse = [values.multiply([(values.convert(m), -1)]) for m in masses]
    over = [values.multiply([(g, 1), (i, 1)]) for g, i in zip(gradient, inverse, strict=True)]
    return [*gradient, *over, *residual(values)]


def _free(forcing: Expr, mass: Expr, values: ValueGraph) -> list[ScaledNode]:
    """Add f/M of a coordinate to a graph."""
    coefficient, number = values.convert(forcing)
    node = values.nodes[number]
    # The mass cancels in a weight m·g.
    factors = node.factors if isinstance(node, ProductNode) else ((number, 1),)
    powers = [((1, factor), exponent) for factor, exponent in factors]
    return [values.multiply([((coefficient, ONE), 1), *powers, (values.convert(mass), -1)])]


class _System:
    """Accelerations, multipliers or changes: one system with the mass matrix."""

    def __init__(self, weighted: WeightedClosures, asked: _Asked) -> None:
        self.equations = weighted.equations
        self.asked = asked
        self.loops = LoopBuilder(ShapeTable(_inputs(weighted)))
        closures = enumerate(weighted.equations.system.closures)
        self.closures = [k for k, c in closures if asked.kind in c.kind]
        self.compliance = {k: c for k, c in enumerate(weighted.compliance) if c != 0}
        self.compliant: dict[int, ScaledCell] = {}
        self.free: dict[int, ScaledCell] = {}
        self.rows: list[_Row] = []
        self.residuals: list[ScaledCell] = []

    def program(self) -> LargeSystem:
        """The loops, in their order."""
        self._formulas()
        multipliers = self._multipliers() if self.closures else []
        if self.asked.multipliers:
            copies = enumerate(multipliers)
            self._combine([(((1, (p,)),), Cell("out", k)) for k, p in copies])
            results = len(multipliers)
        else:
            results = self._accelerations(multipliers)
        parts = tuple(self.loops.parts)
        return LargeSystem(parts, self.loops.size, results, True, tuple(self.closures))

    def _combine(self, sums: Sequence[tuple[tuple[_Product, ...], Cell]]) -> None:
        self.loops.combine([SumOfProducts(terms, target) for terms, target in sums])

    def _formulas(self) -> None:
        """Gradients, residuals, and accelerations without closures."""
        e = self.equations
        mass = [row[i] for i, row in enumerate(e.system.mass_matrix)]
        formulas = []
        for k in self.closures:
            closure = e.system.closures[k]
            masses = tuple(mass[j] for j in closure.coordinate_numbers)
            residual = ClosureValue(self.asked.residual, closure, e)
            parts = (*entries(closure.gradient).values(), *masses, *residual.parts)
            formulas.append(Formula(len(masses), parts, partial(_of_row, residual, masses)))
        forced = range(len(mass)) if self.asked.forced else ()
        both = ((e.system.forcing[j], mass[j]) for j in forced)
        formulas += [Formula("free", pair, partial(_free, *pair)) for pair in both]
        compliant = [k for k in self.closures if k in self.compliance]
        formulas += (value_formula(self.compliance[k]) for k in compliant)
        results = iter(self.loops.evaluate(formulas))
        for k in self.closures:
            *cells, residual_cell = next(results)
            pairs = zip(cells[: len(cells) // 2], cells[len(cells) // 2 :], strict=True)
            self.rows.append(dict(zip(e.system.closures[k].coordinate_numbers, pairs, strict=True)))
            self.residuals.append(residual_cell)
        self.free = {j: next(results)[0] for j in forced}
        self.compliant = {k: next(results)[0] for k in compliant}

    def _multipliers(self) -> list[Cell]:
        """S λ = r and its solution: where the multiplier of each closure stands."""
        loops = self.loops
        factors = choose_factorization([tuple(row) for row in self.rows])
        matrix, vector = loops.allocate(factors.numbers), loops.allocate(factors.workspace_size)
        position = {k: p for p, k in enumerate(factors.order)}
        lower = self._matrix(position)
        if len(lower) < factors.numbers:
            loops.parts.append(Zeros("w", matrix, factors.numbers))
        cells = (Cell("w", matrix + factors.place(*pair)) for pair in lower)
        sums = list(zip(map(tuple, lower.values()), cells, strict=True))
        unknowns = [Cell("w", vector + position[k]) for k in range(len(self.rows))]
        right = [(tuple(self._right_side(k)), cell) for k, cell in enumerate(unknowns)]
        self._combine([*sums, *right])
        loops.parts.append(SparseSolve(factors, matrix, vector))
        return unknowns

    def _matrix(self, position: dict[int, int]) -> dict[tuple[int, int], list[_Product]]:
        """The lower triangle of S, by positions: Σ over the coordinates that two closures hold."""
        sharing: defaultdict[int, list[int]] = defaultdict(list)
        triangle: defaultdict[tuple[int, int], list[_Product]] = defaultdict(list)
        for k, row in enumerate(self.rows):
            for j in row:
                sharing[j].append(k)
        for j, closures in sharing.items():
            for index, k in enumerate(closures):
                for before in closures[: index + 1]:
                    places = position[k], position[before]
                    product = _product(self.rows[before][j][0], self.rows[k][j][1])
                    triangle[max(places), min(places)].append(product)
        for number, closure in enumerate(self.closures):
            if closure in self.compliant:
                diagonal = position[number], position[number]
                triangle[diagonal].append(_product(self.compliant[closure]))
        return triangle

    def _right_side(self, k: int) -> list[_Product]:
        """−residual − gradient·(f/M) of a closure."""
        terms = [_product(self.residuals[k])]
        terms += [_product(g, self.free[j]) for j, (g, _) in self.rows[k].items() if j in self.free]
        return [(-c, places) for c, places in terms if c]

    def _accelerations(self, multipliers: Sequence[Cell]) -> int:
        """Combine accelerations, after the velocities in a right-hand side; count the results."""
        n = len(self.equations.system.coordinates)
        terms = [[_product(self.free[j])] if j in self.free else [] for j in range(n)]
        for row, multiplier in zip(self.rows, multipliers, strict=True):
            for j, (_, over) in row.items():
                terms[j].append(_product(over, ScaledCell(1, multiplier)))
        start = n if self.asked.forced else 0
        sums = [
            (tuple(t for t in row if t[0]), Cell("out", start + j)) for j, row in enumerate(terms)
        ]
        if self.asked.forced:
            sums += [(((1, (Cell("v", j),)),), Cell("out", j)) for j in range(n)]
        self._combine(sums)
        return len(sums)


def _product(*values: ScaledCell) -> _Product:
    """Multiply values at cells."""
    coefficient = prod((value.coefficient for value in values), start=1)
    return coefficient, tuple(value.place for value in values if value.place is not None)
