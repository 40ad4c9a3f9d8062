"""Equations of large systems → kernels: what is asked for, form by form.

Systems are wide whose mass matrix is diagonal and proven positive definite: what a closure or
a coordinate needs then holds a few neighbours alone. With Φ the gradients of the closures and
f/M the accelerations without them, S λ = −bias − Φ f/M with S = Φ M⁻¹ Φᵀ
(:mod:`lagrange_cli.program.solvers.sparse_factorization`), and a = f/M + M⁻¹ Φᵀ λ.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import count
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.program.graph.value_graph import ONE, ProductNode, ScaledNode, ValueGraph
from lagrange_cli.program.solvers.bandwidth import FEWEST_UNKNOWNS
from lagrange_cli.program.solvers.sparse_factorization import choose_factorization
from lagrange_cli.program.systems.loops import (
    Formula,
    LoopBuilder,
    ProgramPart,
    ScaledCell,
    SparseSolve,
    SumOfProducts,
    Zeros,
)
from lagrange_cli.program.systems.shapes import ArrayCell, ShapeTable

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Closure, Coordinate, Equations
    from lagrange_cli.program.systems.contact_systems import WeightedClosures

__all__ = ["LargeSystem", "is_large_system", "large_system"]

#: Coordinates without closures that are worth loops over their forms.
_FEWEST_FREE = 100

#: Programs of more parts have too little in common for loops.
_MOST_PARTS = 256

_Row: TypeAlias = dict[int, tuple[ScaledCell, ScaledCell]]
"""Coordinate → entry of a gradient, and the same over the mass."""


class LargeSystem(NamedTuple):
    """Parts of a program, what they take of the workspace, and how many results they store.

    ``solves``: accelerations or what else is found with the mass matrix, beside ``closures``.
    """

    parts: tuple[ProgramPart, ...]
    work: int
    results: int
    solves: bool = False
    closures: tuple[int, ...] = ()


def is_large_system(equations: Equations) -> bool:
    """Whether the programs of a system are made of kernels."""
    n, m = len(equations.coordinates), len(equations.closures) + len(equations.contacts)
    large = n + m >= FEWEST_UNKNOWNS if m else n >= _FEWEST_FREE
    if not large or not equations.facts.positive_definite_mass_matrix:
        return False
    rows = enumerate(equations.mass_matrix)
    return equations.facts.diagonal_mass_matrix or all(entries(r).keys() == {i} for i, r in rows)


def large_system(
    asked: WeightedClosures, plain: Callable[[str], Sequence[Expr]]
) -> LargeSystem | None:
    """The program of what is asked for, None where loops would not shorten it.

    Parameters
    ----------
    asked
        Names as :func:`lagrange_cli.program.program.build_program` takes them, and what they are
        of.
    plain
        Gives the expressions of outputs that closures have no part in.
    """
    equations, outputs = asked.equations, asked.outputs
    if outputs[0] in _SYSTEMS:
        return _System(asked, _SYSTEMS[outputs[0]]).program()
    kernels = LoopBuilder(ShapeTable(_inputs(asked)))
    formulas: list[Formula] = []
    for name in outputs:
        if name == "mass_matrix":
            formulas += _mass_matrix(kernels, equations)
        elif name == "gap_gradients":
            formulas += _gradients(kernels, equations)
        elif name == "closure_gradient_squares":
            formulas += _gradient_squares(equations)
        elif name in _OF_CLOSURES:
            formulas += _of_closures(equations, *_OF_CLOSURES[name])
        else:
            formulas += [Formula("value", (e,), _Values((e,))) for e in plain(name)]
    # Matrices are by rows, and stand first.
    first = len(equations.coordinates) * _rows(equations, outputs[0])
    targets = (ArrayCell("out", k) for k in count(first))
    kernels.evaluate([f if f.targets else f.to(next(targets)) for f in formulas])
    if len(kernels.parts) > _MOST_PARTS:
        return None
    return LargeSystem(tuple(kernels.parts), kernels.size, next(targets).number)


def _rows(equations: Equations, output: str) -> int:
    """How many rows an output has that is a matrix, 0 for others."""
    rows = {"mass_matrix": equations.coordinates, "gap_gradients": equations.contacts}
    return len(rows.get(output, ()))


def _inputs(asked: WeightedClosures) -> dict[Expr, ArrayCell]:
    """Where every input stands. Flags of contacts and targets of impulses, behind the
    parameters, are told from these: emitted code has them in an array of their own."""
    equations = asked.equations
    places: dict[Expr, ArrayCell] = {equations.t: ArrayCell("t", 0)}
    own = len(equations.parameters) - asked.flags
    places |= {
        p.symbol: ArrayCell("p" if i < own else "s", i) for i, p in enumerate(equations.parameters)
    }
    places |= {given.symbol: ArrayCell("u", i) for i, given in enumerate(equations.inputs)}
    places |= {c.q: ArrayCell("q", i) for i, c in enumerate(equations.coordinates)}
    return places | {c.v: ArrayCell("v", i) for i, c in enumerate(equations.coordinates)}


@dataclass(frozen=True)
class _Values:
    """Puts expressions into a program."""

    expressions: tuple[Expr, ...]

    def __call__(self, values: ValueGraph) -> list[ScaledNode]:
        return [values.convert(expression) for expression in self.expressions]


def _mass_matrix(kernels: LoopBuilder, equations: Equations) -> list[Formula]:
    """The diagonal, in a matrix by rows that is zero elsewhere."""
    n = len(equations.coordinates)
    kernels.parts.append(Zeros("out", 0, n * n))
    diagonal = [row[i] for i, row in enumerate(equations.mass_matrix)]
    return [
        Formula("value", (e,), _Values((e,)), (ArrayCell("out", i * n + i),))
        for i, e in enumerate(diagonal)
    ]


def _gradients(kernels: LoopBuilder, equations: Equations) -> list[Formula]:
    """Those of the gaps by rows."""
    n = len(equations.coordinates)
    kernels.parts.append(Zeros("out", 0, n * len(equations.contacts)))
    return [
        Formula("value", (e,), _Values((e,)), (ArrayCell("out", k * n + j),))
        for k, contact in enumerate(equations.contacts)
        for j, e in entries(contact.closure.gradient).items()
    ]


@dataclass(frozen=True)
class _GradientSquare:
    """Puts Σ gradient²/M into a program."""

    gradient: tuple[Expr, ...]
    masses: tuple[Expr, ...]

    def __call__(self, values: ValueGraph) -> list[ScaledNode]:
        pairs = zip(self.gradient, self.masses, strict=True)
        terms = [
            values.multiply([(values.convert(g), 2), (values.convert(m), -1)]) for g, m in pairs
        ]
        return [values.add(terms)]


def _gradient_squares(equations: Equations) -> list[Formula]:
    """Those of the closures of positions."""
    formulas = []
    for closure in equations.closures:
        if closure.kind == "position":
            row = entries(closure.gradient)
            masses = tuple(equations.mass_matrix[j][j] for j in row)
            make = _GradientSquare(tuple(row.values()), masses)
            formulas.append(Formula("square", (*make.gradient, *masses), make))
    return formulas


_OfClosure: TypeAlias = "Callable[[ValueGraph, Closure, Sequence[Coordinate]], ScaledNode]"


def _products(values: ValueGraph, closure: Closure, by: Sequence[Expr]) -> list[ScaledNode]:
    """The terms of gradient·x, of which ``by`` has those that the closure holds."""
    gradient = entries(closure.gradient).values()
    pairs = zip(gradient, by, strict=True)
    return [values.multiply([(values.convert(g), 1), (values.convert(x), 1)]) for g, x in pairs]


def _rate_terms(
    values: ValueGraph, closure: Closure, held: Sequence[Coordinate]
) -> list[ScaledNode]:
    return [*_products(values, closure, [c.v for c in held]), values.convert(closure.rate)]


def _rate(values: ValueGraph, closure: Closure, held: Sequence[Coordinate]) -> ScaledNode:
    """What is zero of the velocities: φ̇ or ψ."""
    return values.add(_rate_terms(values, closure, held))


def _rate_size(values: ValueGraph, closure: Closure, held: Sequence[Coordinate]) -> ScaledNode:
    """The magnitudes that a rate is the difference of."""
    return _magnitude(values, _rate_terms(values, closure, held))


def _size(values: ValueGraph, closure: Closure, held: Sequence[Coordinate]) -> ScaledNode:
    """Those of φ: its terms, and what the coordinates contribute to first order."""
    terms = [values.convert(term) for term in _terms(closure.expression)]
    return _magnitude(values, [*terms, *_products(values, closure, [c.q for c in held])])


def _magnitude(values: ValueGraph, terms: Sequence[ScaledNode]) -> ScaledNode:
    return values.add(
        (abs(c), n) if n == ONE else values.call("abs", (c, n)) for c, n in terms if c
    )


def _terms(expression: Expr) -> tuple[Expr, ...]:
    return tuple(expression.args) if expression.is_Add else (expression,)


def _expression(values: ValueGraph, closure: Closure, _: Sequence[Coordinate]) -> ScaledNode:
    return values.convert(closure.expression)


def _bias(values: ValueGraph, closure: Closure, _: Sequence[Coordinate]) -> ScaledNode:
    return values.convert(closure.bias)


#: Outputs of closures, and those (of all of them if empty) that they are of.
_OF_CLOSURES: dict[str, tuple[str, _OfClosure]] = {
    "closure_sizes": ("position", _size),
    "closure_rates": ("", _rate),
    "closure_rate_sizes": ("", _rate_size),
}


def _of_closures(equations: Equations, kind: str, of: _OfClosure) -> list[Formula]:
    closures = [c for c in equations.closures if kind in c.kind]
    return [
        Formula(of.__name__, _parts(of, c, equations), _Derived(of, c, equations)) for c in closures
    ]


def _parts(of: _OfClosure, closure: Closure, equations: Equations) -> tuple[Expr, ...]:
    """What a value of a closure is made of."""
    if of is _expression:
        return (closure.expression,)
    if of is _bias:
        return (closure.bias,)
    coordinates = [equations.coordinates[j] for j in closure.held]
    gradient = entries(closure.gradient).values()
    if of is _size:
        return (*_terms(closure.expression), *gradient, *(c.q for c in coordinates))
    return (closure.rate, *gradient, *(c.v for c in coordinates))


@dataclass(frozen=True)
class _Derived:
    """Puts what follows from a closure into a program."""

    of: _OfClosure
    closure: Closure
    equations: Equations

    def __call__(self, values: ValueGraph) -> list[ScaledNode]:
        return [self.value(values)]

    def value(self, values: ValueGraph) -> ScaledNode:
        held = [self.equations.coordinates[j] for j in self.closure.held]
        return self.of(values, self.closure, held)


@dataclass(frozen=True)
class _Asked:
    """A system: of which closures (``kind``, or all), with what residual; whether with forces,
    and whether multipliers or accelerations alone are asked for."""

    residual: _OfClosure
    kind: str = ""
    forced: bool = False
    multipliers: bool = False


_SYSTEMS = {
    "acceleration": _Asked(_bias, forced=True),
    "multipliers": _Asked(_bias, forced=True, multipliers=True),
    "position_change": _Asked(_expression, kind="position"),
    "velocity_change": _Asked(_rate),
    "impulse": _Asked(_bias),
}


@dataclass(frozen=True)
class _OfRow:
    """Puts a gradient, the same over the masses, and the residual into a program."""

    residual: _Derived
    masses: tuple[Expr, ...]

    def __call__(self, values: ValueGraph) -> list[ScaledNode]:
        held = entries(self.residual.closure.gradient).values()
        gradient = [values.convert(g) for g in held]
        # Reciprocals are nodes of their own: one division for all that has one mass.
        inverse = [values.multiply([(values.convert(m), -1)]) for m in self.masses]
        over = [values.multiply([(g, 1), (i, 1)]) for g, i in zip(gradient, inverse, strict=True)]
        return [*gradient, *over, self.residual.value(values)]


@dataclass(frozen=True)
class _Free:
    """Puts f/M of a coordinate into a program."""

    forcing: Expr
    mass: Expr

    def __call__(self, values: ValueGraph) -> list[ScaledNode]:
        coefficient, number = values.convert(self.forcing)
        node = values.nodes[number]
        # A weight m·g loses its mass.
        choose_factorization = node.factors if isinstance(node, ProductNode) else ((number, 1),)
        powers = [((Fraction(1), of), exponent) for of, exponent in choose_factorization]
        mass = values.convert(self.mass)
        return [values.multiply([((coefficient, ONE), 1), *powers, (mass, -1)])]


class _System:
    """Accelerations, multipliers or changes: one system with the mass matrix."""

    def __init__(self, of: WeightedClosures, asked: _Asked) -> None:
        self.equations = of.equations
        self.asked = asked
        self.kernels = LoopBuilder(ShapeTable(_inputs(of)))
        closures = enumerate(of.equations.closures)
        self.closures = [k for k, c in closures if asked.kind in c.kind]
        self.compliance = {k: c for k, c in enumerate(of.compliance) if c != 0}
        self.compliant: dict[int, ScaledCell] = {}
        self.free: dict[int, ScaledCell] = {}
        self.rows: list[_Row] = []
        self.residuals: list[ScaledCell] = []

    def program(self) -> LargeSystem:
        """The kernels, in their order."""
        self._formulas()
        multipliers: list[ArrayCell] = []
        if self.closures:
            multipliers = self._multipliers()
        if self.asked.multipliers:
            copies = enumerate(multipliers)
            self._combine([(((Fraction(1), (p,)),), ArrayCell("out", k)) for k, p in copies])
            results = len(multipliers)
        else:
            results = self._accelerations(multipliers)
        parts = tuple(self.kernels.parts)
        return LargeSystem(parts, self.kernels.size, results, True, tuple(self.closures))

    def _combine(
        self, sums: Sequence[tuple[tuple[tuple[Fraction, tuple[ArrayCell, ...]], ...], ArrayCell]]
    ) -> None:
        self.kernels.combine([SumOfProducts(terms, target) for terms, target in sums])

    def _formulas(self) -> None:
        """Gradients, residuals, and accelerations without closures."""
        e = self.equations
        mass = [row[i] for i, row in enumerate(e.mass_matrix)]
        formulas = []
        for k in self.closures:
            closure = e.closures[k]
            masses = tuple(mass[j] for j in closure.held)
            residual = _Derived(self.asked.residual, closure, e)
            gradient = entries(closure.gradient).values()
            parts = _parts(self.asked.residual, closure, e)
            make = _OfRow(residual, masses)
            formulas.append(Formula(len(masses), (*gradient, *masses, *parts), make))
        forced = range(len(mass)) if self.asked.forced else ()
        formulas += [
            Formula("free", (e.forcing[j], mass[j]), _Free(e.forcing[j], mass[j])) for j in forced
        ]
        compliant = [k for k in self.closures if k in self.compliance]
        for c in (self.compliance[k] for k in compliant):
            formulas.append(Formula("value", (c,), _Values((c,))))
        found = self.kernels.evaluate(formulas)
        self.compliant = {
            k: f for k, (f,) in zip(compliant, found[len(found) - len(compliant) :], strict=True)
        }
        for k, of in zip(self.closures, found, strict=False):
            held = e.closures[k].held
            self.rows.append({j: (of[i], of[len(held) + i]) for i, j in enumerate(held)})
            self.residuals.append(of[-1])
        self.free = {j: f for j, (f,) in zip(forced, found[len(self.closures) :], strict=False)}

    def _multipliers(self) -> list[ArrayCell]:
        """S λ = r and its solution: where the multiplier of each closure stands."""
        kernels = self.kernels
        of = choose_factorization([tuple(row) for row in self.rows])
        matrix, vector = kernels.allocate(of.numbers), kernels.allocate(of.workspace_size)
        position = {k: p for p, k in enumerate(of.order)}
        found = self._matrix(position)
        if len(found) < of.numbers:
            kernels.parts.append(Zeros("w", matrix, of.numbers))
        sums = [
            (tuple(terms), ArrayCell("w", matrix + of.place(*at))) for at, terms in found.items()
        ]
        right = [
            (tuple(self._drive(k)), ArrayCell("w", vector + position[k]))
            for k in range(len(self.rows))
        ]
        self._combine([*sums, *right])
        kernels.parts.append(SparseSolve(of, matrix, vector))
        return [ArrayCell("w", vector + position[k]) for k in range(len(self.rows))]

    def _matrix(
        self, position: dict[int, int]
    ) -> dict[tuple[int, int], list[tuple[Fraction, tuple[ArrayCell, ...]]]]:
        """The lower triangle of S, by positions: Σ over the coordinates that two closures hold."""
        at: dict[int, list[int]] = {}
        for k, row in enumerate(self.rows):
            for j in row:
                at.setdefault(j, []).append(k)
        found: dict[tuple[int, int], list[tuple[Fraction, tuple[ArrayCell, ...]]]] = {}
        for j, holding in at.items():
            for index, k in enumerate(holding):
                for other in holding[: index + 1]:
                    places = position[k], position[other]
                    pair = (max(places), min(places))
                    found.setdefault(pair, []).append(
                        _product(self.rows[other][j][0], self.rows[k][j][1])
                    )
        for number, closure in enumerate(self.closures):
            if closure in self.compliant:
                diagonal = position[number], position[number]
                found[diagonal].append(_product(self.compliant[closure]))
        return found

    def _drive(self, k: int) -> list[tuple[Fraction, tuple[ArrayCell, ...]]]:
        """−residual − gradient·(f/M) of a closure."""
        terms = [_product(self.residuals[k])]
        terms += [_product(g, self.free[j]) for j, (g, _) in self.rows[k].items() if j in self.free]
        return [(-c, places) for c, places in terms if c]

    def _accelerations(self, multipliers: Sequence[ArrayCell]) -> int:
        """What is found of the coordinates, behind the velocities in a right-hand side; how
        many results these are."""
        n = len(self.equations.coordinates)
        terms = [[_product(self.free[j])] if j in self.free else [] for j in range(n)]
        for row, multiplier in zip(self.rows, multipliers, strict=True):
            for j, (_, over) in row.items():
                terms[j].append(_product(over, ScaledCell(Fraction(1), multiplier)))
        start = n if self.asked.forced else 0
        sums = [
            (tuple(t for t in of if t[0]), ArrayCell("out", start + j))
            for j, of in enumerate(terms)
        ]
        if self.asked.forced:
            one = Fraction(1)
            sums += [(((one, (ArrayCell("v", j),)),), ArrayCell("out", j)) for j in range(n)]
        self._combine(sums)
        return len(sums)


def _product(*of: ScaledCell) -> tuple[Fraction, tuple[ArrayCell, ...]]:
    """Found values multiplied."""
    coefficient = Fraction(1)
    for value in of:
        coefficient *= value.coefficient
    return coefficient, tuple(value.place for value in of if value.place is not None)
