"""Symbol table of a scene: the meaning of each name during the reduction.

Every component of a particle's position is one *raw* symbol: the Cartesian
name where the scene writes a bare name, ``x_NAME`` where it writes an
expression. Constraints and potentials are converted over raw symbols first,
so that the geometry of the constraints and the forces on particles are seen
before the coordinates are. Elements of families are converted once for all that differ in
names alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Hashable, Iterator
from copy import copy
from operator import attrgetter

import sympy as sp

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.algebra.substitution import (
    Element,
    Shape,
    Shapes,
    single_element,
)
from lagrange_cli.mechanics.free_symbols import unknown_function
from lagrange_cli.mechanics.symbols.convert import Lookup, Rate, to_sympy
from lagrange_cli.scene.bodies import ComposedExpression, bodies_of
from lagrange_cli.scene.checks.external import rated_inputs
from lagrange_cli.scene.checks.table import name_table
from lagrange_cli.scene.language.expression import (
    FUNCTIONS,
    TIME_DERIVATIVES,
    Call,
    Expression,
    Name,
    Node,
    walk,
)
from lagrange_cli.scene.language.templates import shape_of
from lagrange_cli.scene.model import Particle, Point, Scene

_AXES = ("x", "y", "z")

#: Most nodes of a syntax tree with all definitions put in. Derivatives and the text of this many
#: take some ten seconds; those of shipped scenes have up to 261.
_LONGEST = 20_000

#: Most nodes of what frames imply beside constraints, counted likewise, though the axes of frames
#: below are shared: of a spatial chain of 16 joints. Without constraints recursion over the frames
#: (:mod:`.dynamics.body_recursion`) never walks through their expressions, and any length will do.
_LONGEST_CHAIN = 100_000

#: Most terms of a sum that frames imply without constraints, beyond which sums that hold it keep it
#: as one term: all bodies of a chain in space would have as many terms as joints below them.
_LONGEST_SUM = 25

#: Parts of the longest shape of a syntax tree whose conversion is kept.
_LONGEST_SHAPE = 200


class Names:
    """Symbols of a scene, and the meaning of each of its names over raw symbols.

    Attributes
    ----------
    t
        Time.
    parameters, inputs, states, coordinates
        Symbols by name, in declaration order; ``coordinates`` only the declared ones.
    cartesian
        Raw symbols by name, particles' first, in reading order, dependent names last.
    dependent
        Raw symbols that belong to no particle or point: constraints determine them.
    particle_symbols
        For each particle, in order, its three raw symbols.
    bodies, body_symbols
        Particles, then points, and the three raw symbols of each.
    given
        Raw symbols that a definition or a position expression gives, with its expression.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.t = sp.Symbol("t", real=True)
        masses = {p.mass.node.name for p in scene.particles if isinstance(p.mass.node, Name)}
        self.parameters = {
            p.name: sp.Symbol(p.name, positive=True)
            if p.positive or p.name in masses
            else sp.Symbol(p.name, real=True)
            for p in scene.parameters
        }
        # Inputs with rates are functions of t that derivations differentiate.
        self.rated = rated_inputs(scene, name_table(scene).cartesian)
        self.inputs: dict[str, sp.Expr] = {
            u.name: unknown_function(u.name, self.t)
            if u.name in self.rated
            else sp.Symbol(u.name, real=True)
            for u in scene.inputs
        }
        self.states = {state.name: sp.Symbol(state.name, real=True) for state in scene.states}
        self.coordinates = {c.name: self._place(c.name) for c in scene.coordinates or ()}
        self._definitions = {d.name: d.expression for d in scene.definitions}
        self._functions = {f.name: f for f in scene.functions}
        is_open = not (scene.constraints or scene.unilateral)
        self._nests = is_open and not any(body.planar for body in bodies_of(scene))
        self._meanings: dict[str, sp.Expr] = {}
        #: Meanings of names, each equal to itself: two equal ones are one object. Those of a chain
        #: of frames hold each other, and SymPy compares equal expressions that are two objects
        #: part by part, in a time that grows with a power of their depth.
        self._distinct: dict[sp.Expr, sp.Expr] = {}
        self._lengths: dict[str, int] = {}
        self._open: list[str] = []
        self._elements = ConvertedElements()
        self._shapes = Shapes()
        self._position_entries: dict[str, Expression] = {}
        self.bodies: tuple[Particle | Point, ...] = (*scene.particles, *scene.points)
        named = [
            (f"{axis}_{body.name}", entry.node)
            for body in self.bodies
            for axis, entry in zip(_AXES, body.position, strict=True)
        ]
        self._components = {name for name, _ in named}
        # A component that is a bare name in its own position is its own Cartesian name.
        self._own_defaults = {
            name for name, node in named if isinstance(node, Name) and node.name == name
        }
        self.cartesian: dict[str, sp.Symbol] = {}
        self.particle_symbols = tuple(
            tuple(self._raw(p, axis) for axis in range(3)) for p in scene.particles
        )
        self.point_symbols = tuple(
            tuple(self._raw(p, axis) for axis in range(3)) for p in scene.points
        )
        self.body_symbols = (*self.particle_symbols, *self.point_symbols)
        self.dependent = tuple(self._dependent(scene))
        self._aliases = dict(self._alias_pairs())
        self._rewrite: Callable[[sp.Expr], sp.Expr] | None = None
        self._gone: frozenset[str] = frozenset()
        self.given = dict(self._given())

    @property
    def external(self) -> dict[str, sp.Expr]:
        """Inputs and states by name, which virtual displacements leave alone."""
        return {**self.inputs, **self.states}

    @property
    def external_symbols(self) -> list[sp.Symbol]:
        """Symbols of inputs and states, but of inputs with rates, which are functions of t."""
        return [symbol for symbol in self.external.values() if symbol.is_Symbol]

    def _raw(self, body: Particle | Point, axis: int) -> sp.Symbol:
        entry = body.position[axis]
        if self._is_bare_name(entry):
            assert isinstance(entry.node, Name)
            name = entry.node.name
        else:
            name = f"{_AXES[axis]}_{body.name}"
            self._position_entries[name] = entry
        return self.cartesian.setdefault(name, self._place(name))

    def _place(self, name: str) -> sp.Symbol:
        """Make the symbol of a coordinate or component, positive if so declared."""
        declared = name in self.scene.positive
        return sp.Symbol(name, positive=True) if declared else sp.Symbol(name, real=True)

    def _dependent(self, scene: Scene) -> Iterator[sp.Symbol]:
        """Declare names that occur in ``kinetic`` and a constraint, and nowhere else."""
        components = {s.name for body in self.body_symbols for s in body}
        for name in name_table(scene).cartesian:
            if name not in components and name not in self.coordinates:
                yield self.cartesian.setdefault(name, self._place(name))

    def _is_bare_name(self, entry: Expression) -> bool:
        """Say whether an entry is a Cartesian name: fresh, a coordinate, or defined."""
        node = entry.node
        known = (*self.parameters, *self.external, "t", "pi")
        if not isinstance(node, Name) or node.name in known:
            return False
        return node.name not in self._components or node.name in self._own_defaults

    def _alias_pairs(self) -> Iterator[tuple[str, sp.Symbol]]:
        for body, components in zip(self.bodies, self.body_symbols, strict=True):
            for axis, symbol in zip(_AXES, components, strict=True):
                yield f"{axis}_{body.name}", symbol

    def _given(self) -> Iterator[tuple[sp.Symbol, sp.Expr]]:
        for name, symbol in self.cartesian.items():
            entry = self._position_entries.get(name) or self._definitions.get(name)
            if entry is not None and name not in self.coordinates:
                yield symbol, self._converted(name, entry)

    def _converted(self, name: str, expression: Expression) -> sp.Expr:
        if name in self._open:
            cycle = " -> ".join([*self._open[self._open.index(name) :], name])
            raise InputError(
                Problem(f"definitions go in a circle: {cycle}", expression.mark(), rule="cycle")
            )
        self._require_length(expression)
        self._open.append(name)
        try:
            meaning, _ = self._elements.converted(
                expression,
                self._symbol,
                lambda: self._to_sympy(expression, self.lookup),
            )
            return self._distinct.setdefault(meaning, meaning)
        finally:
            self._open.pop()

    def lookup(self, name: str) -> sp.Expr | None:
        """Look up a name over raw symbols, coordinates, parameters and t; None if unknown."""
        if name == "t":
            return self.t
        tables = (self.parameters, self.external, self.coordinates, self.cartesian, self._aliases)
        for table in tables:
            if name in table:
                return table[name]
        if name in self._definitions:
            if name not in self._meanings:
                self._meanings[name] = self._converted(name, self._definitions[name])
            return self._meanings[name]
        return None

    def convert(
        self,
        expression: Expression,
        rate: Rate | None = None,
        meanings: dict[str, sp.Expr] | None = None,
    ) -> sp.Expr:
        """Convert an expression over raw symbols; abbreviations that hold rates need ``rate``.

        ``meanings`` are those of abbreviations with this ``rate`` that are known; it is added to.
        """
        return self._converted_element(expression, rate, {} if meanings is None else meanings)[0]

    def element(
        self, expression: Expression, rate: Rate | None, meanings: dict[str, sp.Expr]
    ) -> Element:
        """Convert an expression as :meth:`convert` does, to an element with its shape."""
        expr, element = self._converted_element(expression, rate, meanings)
        if element is not None:
            return element
        # No two frames of a chain have expressions of one shape.
        is_implied = isinstance(expression, ComposedExpression)
        return single_element(expr) if is_implied else self._shapes.element(expr)

    def _converted_element(
        self, expression: Expression, rate: Rate | None, meanings: dict[str, sp.Expr]
    ) -> tuple[sp.Expr, Element | None]:
        """Convert an expression, to an element if its names alone determine its shape."""
        # Known shapes too are checked: names of earlier elements may have shorter definitions.
        self._require_length(expression)

        def converted() -> sp.Expr:
            if rate is None:
                return self._to_sympy(expression, self.lookup)
            return self._converted_with_rate(expression, rate, meanings)

        expr, element = self._elements.converted(expression, self._symbol, converted)
        return (expr, element) if self._rewrite is None else (self._rewrite(expr), None)

    def _symbol(self, name: str) -> sp.Symbol | None:
        """Look up a name that stands for a symbol itself, not for an expression."""
        if name in self._definitions and name not in self.cartesian:
            return None
        return self.lookup(name)

    def _require_length(self, expression: Expression) -> None:
        """Refuse an expression that would grow without bound.

        Each of twenty definitions that names the one before it twice doubles it.
        """
        implied = isinstance(expression, ComposedExpression)
        closed = self.scene.unilateral or len(self.scene.constraints) > len(self.scene.lengths)
        if implied and not closed:
            return
        if self._length(expression) <= (_LONGEST_CHAIN if implied else _LONGEST):
            return
        if implied:
            fault = (
                "this chain of frames is too long beside constraints: with those below put in,"
                f" {expression.text} has more than {_LONGEST_CHAIN} numbers, names and operations"
            )
            hint = (
                "every joint about another axis makes positions longer by half or more; chains in"
                " a plane do not grow so"
            )
        else:
            fault = (
                f"with definitions in place of their names, this has more than {_LONGEST} numbers,"
                " names and operations"
            )
            hint = ""
        raise InputError(Problem(fault, expression.mark(), hint=hint, rule="too-large"))

    def _length(self, expression: Expression) -> int:
        """Count the nodes of an expression with all definitions put in place of names.

        Parts that frames imply are shared, and count only in others of these.
        """
        implied = isinstance(expression, ComposedExpression)
        total = 0
        for node in walk(expression.node):
            total += 1
            if not isinstance(node, Name):
                continue
            definition = self._definitions.get(node.name) or self._position_entries.get(node.name)
            if definition is None:
                continue
            if node.name not in self._lengths:
                self._lengths[node.name] = 0  # of a circle, which is refused elsewhere
                self._lengths[node.name] = self._length(definition)
            if implied or not isinstance(definition, ComposedExpression):
                total += self._lengths[node.name]
        return total

    def rewriting(
        self, rewrite: Callable[[sp.Expr], sp.Expr], gone: Collection[sp.Symbol]
    ) -> Names:
        """Copy the names without some coordinates, which ``rewrite`` replaces in expressions."""
        names = copy(self)
        names._rewrite = rewrite
        names._gone = frozenset(s.name for s in gone)
        return names

    def _converted_with_rate(
        self, expression: Expression, rate: Rate, meanings: dict[str, sp.Expr]
    ) -> sp.Expr:
        """Convert an expression with rates; ``meanings`` are those of earlier definitions."""

        def lookup(name: str) -> sp.Expr | None:
            if name not in self._definitions or name in self.cartesian:
                return self.lookup(name)
            if name not in meanings:
                meaning = self._converted_with_rate(self._definitions[name], rate, meanings)
                meanings[name] = self._distinct.setdefault(meaning, meaning)
            return meanings[name]

        return self._to_sympy(expression, lookup, rate)

    def _to_sympy(
        self, expression: Expression, lookup: Lookup, rate: Rate | None = None
    ) -> sp.Expr:
        nests = self._nests and isinstance(expression, ComposedExpression)
        longest_sum = _LONGEST_SUM if nests else math.inf
        return to_sympy(expression, lookup, rate, self._functions, longest_sum)

    def holds_rate(self, expression: Expression) -> bool:
        """Say whether ``dot`` stands in an expression or in an abbreviation that it names."""
        return any(isinstance(x, Call) and x.function == "dot" for x in self._all_of(expression))

    def mentioned(self, expression: Expression) -> set[str]:
        """List declared coordinates in an expression and in abbreviations that it names."""
        names = {node.name for node in self._all_of(expression) if isinstance(node, Name)}
        return names & self.coordinates.keys()

    def _all_of(self, expression: Expression) -> Iterator[Node]:
        """Walk an expression and the abbreviations that it names, each once."""
        pending, visited = [expression], set[str]()
        while pending:
            for node in walk(pending.pop().node):
                yield node
                if isinstance(node, Name) and self._abbreviates(node.name, visited):
                    visited.add(node.name)
                    pending.append(self._definitions[node.name])

    def _abbreviates(self, name: str, visited: Collection[str]) -> bool:
        moving = name in self.coordinates or name in self.cartesian
        return name in self._definitions and name not in visited and not moving

    def abbreviations(self) -> Iterator[tuple[str, Expression]]:
        """Yield definitions of names that are not Cartesian, over coordinates that remain.

        Those that frames imply are not among them.
        """
        for name, expression in self._definitions.items():
            if name in self.cartesian or isinstance(expression, ComposedExpression):
                continue
            if self._gone.isdisjoint(self.mentioned(expression)):
                yield name, expression


class ConvertedElements:
    """Conversions by the shape of the syntax tree, and by the order and kind of the symbols."""

    def __init__(self) -> None:
        self._shapes: dict[Hashable, Shape] = {}

    def converted(
        self,
        expression: Expression,
        symbol: Callable[[str], sp.Symbol | None],
        convert: Callable[[], sp.Expr],
    ) -> tuple[sp.Expr, Element | None]:
        """Convert an expression, by ``convert`` if none of its shape has been.

        ``symbol`` maps a name to its symbol, if it has one. An expression with other names is
        converted anew, and is no element.
        """
        shape, names = shape_of(expression.node)
        written = [s for s in map(symbol, names) if s is not None and s.is_Symbol]
        if len(shape) > _LONGEST_SHAPE or not 1 < len(written) == len(names):
            return convert(), None
        symbols = tuple(sorted(set(written), key=attrgetter("name")))
        place = {s: k for k, s in enumerate(symbols)}
        key = shape, *[place[s] for s in written], *[s.is_positive for s in symbols]
        if key in self._shapes:
            known = self._shapes[key]
            element = Element(known.template.over(symbols), known, symbols)
            return element.expr, element
        expr = convert()
        if not all(_is_plain(part) for part in walk(expression.node) if isinstance(part, Call)):
            return expr, None
        self._shapes[key] = Shape(expr, symbols)
        return expr, Element(expr, self._shapes[key], symbols)


def _is_plain(call: Call) -> bool:
    """Say whether the value of a function holds its arguments alone."""
    return call.function in FUNCTIONS and call.function not in TIME_DERIVATIVES
