"""Dimensions of the names of a scene: how each scales with masses, lengths and times.

Two sides of an equation, and the terms of a sum, scale alike; arguments of functions do not
scale; potentials scale as energies do. That is one linear equation for exponents each, over
rational numbers (P. W. Bridgman, *Dimensional Analysis*, 1922). A number in a scene has no
dimension, so that ``x + 1`` keeps x from being scaled.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, TypeAlias

from lagrange_cli.scene.language.expression import (
    CONDITIONS,
    FUNCTIONS,
    PIECEWISE,
    TIME_DERIVATIVES,
    Add,
    Call,
    Equation,
    Expression,
    Mul,
    Name,
    Neg,
    Node,
    Number,
    Pow,
    names_in,
    own_function,
)
from lagrange_cli.scene.model import Scene
from lagrange_cli.scene.reading.declarations import AXES
from lagrange_cli.scene.unit_table import BASES, UnknownUnitError, unit_powers

Base: TypeAlias = Literal["mass", "length", "time"]

_BASES: tuple[Base, ...] = ("mass", "length", "time")

#: Scenes with more names have no known dimensions: the work grows as the cube of the number.
_MOST_NAMES = 300

Exponent: TypeAlias = Fraction | int
"""An exponent; whole ones are ints, whose arithmetic is much faster."""

LinearForm: TypeAlias = dict[str, Exponent]
"""A linear form in the exponents of names."""

#: Key of the exponent of time in a linear form.
TIME = "t"
#: Key of the exponent of lengths; blanks set it apart from names of a scene.
LENGTH = "a length"
#: Key of the exponent of energies.
ENERGY = "an energy"

#: Exponents of time, length and energy in each base dimension.
_GENERATORS: dict[Base, tuple[int, int, int]] = {
    "mass": (0, 0, 1),
    "length": (0, 1, 2),
    "time": (1, 0, -2),
}

#: Base units of mechanics: powers of energy, length and time.
_UNITS: dict[str, LinearForm] = {
    "kg": {ENERGY: 1, LENGTH: -2, TIME: 2},
    "m": {LENGTH: 1},
    "s": {TIME: 1},
}


@dataclass(frozen=True)
class Dimensions:
    """Exponents of names, without ``dot(NAME)``, under the scalings of a scene.

    A base is missing if numbers in the scene forbid to scale it.
    """

    exponents: Mapping[Base, Mapping[str, Exponent]]

    def exponents_of(self, name: str) -> tuple[Exponent, ...]:
        """Return the exponents of mass, length and time of a name; 0 for missing bases."""
        return tuple(self.exponents.get(base, {}).get(name, 0) for base in _BASES)

    def exponents_of_value(self, expression: Expression) -> tuple[Exponent, ...]:
        """Return the exponents of mass, length and time of a value, as :meth:`exponents_of`."""
        form = ScalingReader().form_of(expression.node) or {}
        powers = [[value * e for e in self.exponents_of(name)] for name, value in form.items()]
        return tuple(map(sum, zip(*powers, strict=True))) or self.exponents_of("")

    def factor(self, name: str, factors: Mapping[Base, float]) -> float:
        """Return the factor of ``NAME`` or ``dot(NAME)`` if bases are multiplied by ``factors``."""
        rate = name.startswith("dot(")
        powers = zip(_BASES, self.exponents_of(name[4:-1] if rate else name), strict=True)
        product = math.prod([math.pow(factors.get(base, 1.0), power) for base, power in powers])
        return product / factors.get("time", 1.0) if rate else product

    @property
    def complete(self) -> bool:
        """True if masses, lengths and times can all be scaled."""
        return len(self.exponents) == len(_BASES)


def dimensions(scene: Scene) -> Dimensions:
    """Find the scalings of masses, lengths and times under which a scene stays the same."""
    if len(scene.coordinates or ()) + len(scene.particles) > _MOST_NAMES:
        return Dimensions({})
    needed = ScalingReader()
    needed.read(scene)
    said = needed.copy()
    said.read_hints(scene)
    # Coordinates are eliminated last: where exponents stay open, theirs are 0, as of angles.
    last = {c.name for c in scene.coordinates or ()}
    names = sorted({name for form in said.equations for name in form})
    names.sort(key=lambda name: name in last)
    if len(names) > _MOST_NAMES:
        return Dimensions({})
    exponents: dict[Base, Mapping[str, Exponent]] = {}
    for base, values in _GENERATORS.items():
        generator: LinearForm = dict(zip((TIME, LENGTH, ENERGY), values, strict=True))
        for equations in (said.equations, needed.equations):
            solution = _solved(equations, generator, names)
            if solution is not None:
                exponents[base] = solution
                break
    return Dimensions(exponents)


class ScalingReader:
    """Collect equations between exponents, each a linear form that is zero.

    Attributes
    ----------
    equations
        The equations so far.
    expression
        The expression that is read; None between expressions.
    """

    def __init__(self) -> None:
        self.equations: list[LinearForm] = []
        self.expression: Expression | None = None
        self._known: set[frozenset[tuple[str, Exponent]]] = set()

    def copy(self) -> ScalingReader:
        """Return a reader that goes on from these equations."""
        copied = ScalingReader()
        copied.equations, copied._known = list(self.equations), set(self._known)
        return copied

    def read(self, scene: Scene) -> None:
        self._numbers(scene)
        self._bodies(scene)
        self._relations(scene)
        energy, power = form_of(ENERGY), form_of(ENERGY, **{TIME: -1})
        for term in (*scene.potentials, *scene.kinetic):
            self._is(term.expression, energy, "an energy")
        for term in scene.dissipation:
            self._is(term.expression, power, "a power")
        moved = {p.name for p in scene.particles} | {p.name for p in scene.points}
        for force in scene.forces:
            along = LENGTH if force.on in moved else force.on
            for component in force.components:
                works = sum_of(energy, form_of(along), -1)
                if force.is_torque:
                    self._is(component, energy, "a torque")
                    continue
                self._is(
                    component,
                    works,
                    "a force" if along == LENGTH else f"an energy over '{along}'",
                )

    def read_hints(self, scene: Scene) -> None:
        """Read units, and values of start and end: with numbers in them, they need not fit."""
        units = {p.name: p.unit for p in scene.parameters}
        units |= {c.name: c.unit for c in scene.coordinates or ()}
        units |= {s.name: s.unit for s in scene.states}
        for name, text in units.items():
            unit = None if text is None else _unit(text)
            if unit is not None:
                self.same(form_of(name), unit)
        for value in (*scene.initial, *scene.state_starts, *scene.near):
            if any(_names(value.value)):
                self._is(value.value, form_of(value.name, **({TIME: -1} if value.order else {})))
        for time in (scene.simulate.until, scene.simulate.start):
            if time is not None and any(_names(time)):
                self._is(time, form_of(TIME))

    def _numbers(self, scene: Scene) -> None:
        for parameter in scene.parameters:
            if parameter.value is not None and any(_names(parameter.value)):
                self._is(parameter.value, form_of(parameter.name), f"'{parameter.name}'")
        for state in scene.states:
            rate = form_of(state.name, **{TIME: -1})
            self._is(state.rate, rate, f"the rate of '{state.name}'")
            if state.switch is not None:
                self.same(form_of(state.name), {})
                self._equated(state.switch.on)
                self._equated(state.switch.off)
        for controller in scene.controllers:
            if any(_names(controller.every)):
                self._is(controller.every, form_of(TIME), "a time")
            for value in controller.values:
                self._is(value.expression, form_of(value.name), f"'{value.name}'")
        for declared in scene.inputs:
            if declared.expression is not None:
                self._is(declared.expression, form_of(declared.name), f"'{declared.name}'")
            else:
                self.equations += [form_of(declared.name), form_of(TIME)]

    def _bodies(self, scene: Scene) -> None:
        length, mass = form_of(LENGTH), form_of(ENERGY, **{LENGTH: -2, TIME: 2})
        for particle in scene.particles:
            self._is(particle.mass, mass, "a mass")
        positions = {particle.name: particle.position for particle in scene.particles}
        positions |= {point.name: point.position for point in scene.points}
        for name, position in positions.items():
            for axis, entry in zip(AXES, position, strict=True):
                self._is(entry, length, "a length")
                self.same(form_of(f"{axis}_{name}"), length)

    def _relations(self, scene: Scene) -> None:
        for definition in scene.definitions:
            self._is(
                definition.expression, form_of(definition.name), f"that of '{definition.name}'"
            )
        for constraint in scene.constraints:
            for equation in constraint.equations:
                self._equated(equation)
        for one_sided in scene.unilateral:
            self._equated(one_sided.inequality)
            if one_sided.restitution is not None:
                self._is(one_sided.restitution, {}, "a number")

    def _is(self, expression: Expression, form: LinearForm, meaning: str = "") -> None:
        self.expression = expression
        scaling = self.form_of(expression.node)
        if scaling is not None:
            self.same(scaling, form, expression.node, meaning)
        self.expression = None

    def _equated(self, equation: Equation) -> None:
        self.expression = equation.left
        self._alike([equation.left.node, equation.right.node])
        self.expression = None

    def same(
        self, left: LinearForm, right: LinearForm, node: Node | None = None, meaning: str = ""
    ) -> None:
        """Add the equation that two forms are equal.

        Parameters
        ----------
        node
            The part of ``expression`` that the first form belongs to.
        meaning
            A description of the second form.
        """
        difference = sum_of(left, right, -1)
        key = frozenset(difference.items())
        if difference and key not in self._known:
            self._known.add(key)
            self.equations.append(difference)

    def _alike(
        self, nodes: Iterable[Node], meaning: str = "what stands before it"
    ) -> LinearForm | None:
        """Return the common form of some expressions, None if all are 0."""
        common: LinearForm | None = None
        for node in nodes:
            form = self.form_of(node)
            if common is None:
                common = form
            elif form is not None:
                self.same(form, common, node, meaning)
        return common

    def form_of(self, node: Node) -> LinearForm | None:
        """Return the form of an expression, None for 0, which scales in any way."""
        if isinstance(node, Number):
            return {} if node.value else None
        if isinstance(node, Name):
            return {} if node.name == "pi" else form_of(node.name)
        if isinstance(node, Neg):
            return self.form_of(node.operand)
        if isinstance(node, Add):
            return self._alike(part for _, part in node.terms)
        if isinstance(node, Mul):
            return self._product(node)
        if isinstance(node, Pow):
            return self._power(node)
        return self._call(node)

    def _product(self, node: Mul) -> LinearForm | None:
        total: LinearForm = {}
        for operator, factor in node.factors:
            form = self.form_of(factor)
            if form is None:
                return None
            total = sum_of(total, form, -1 if operator == "/" else 1)
        return total

    def _own(self, node: Call) -> LinearForm:
        """Return the form of a function of the scene, or of its derivative by the argument."""
        argument = self.form_of(node.arguments[0]) or {}
        name = own_function(node.function)
        return sum_of(form_of(name), argument, len(name) - len(node.function))

    def _power(self, node: Pow) -> LinearForm | None:
        exponent = _constant(node.exponent)
        base = self.form_of(node.base)
        if exponent is not None:
            return None if base is None else sum_of({}, base, exponent)
        self.same(base or {}, {}, node.base, "the base of such a power")
        self.same(self.form_of(node.exponent) or {}, {}, node.exponent, "an exponent")
        return {}

    def _call(self, node: Call) -> LinearForm | None:
        order = TIME_DERIVATIVES.get(node.function)
        if order is not None:
            form = self.form_of(node.arguments[0])
            return None if form is None else sum_of(form, form_of(TIME), -order)
        if node.function in CONDITIONS:
            self._alike(node.arguments[1:])
            return self.form_of(node.arguments[0])
        if node.function not in FUNCTIONS:
            return self._own(node)
        common = self._alike(node.arguments)
        if node.function in ("abs", "min", "max", "norm", PIECEWISE):
            return common
        if node.function == "sqrt":
            return None if common is None else sum_of({}, common, Fraction(1, 2))
        if node.function not in ("atan2", "sign", "heaviside"):
            meaning = f"the argument of {node.function}"
            self.same(common or {}, {}, node.arguments[0], meaning)
        return {}


def form_of(name: str, **others: int) -> LinearForm:
    return {name: 1, **others}


def _unit(text: str) -> LinearForm | None:
    """Return the form of a unit, None if the text is not one.

    Factors of numbers do not matter; base units beside those of mechanics are names.
    """
    try:
        powers = unit_powers(text)
    except UnknownUnitError:
        return None
    total: LinearForm = {}
    for base in BASES:
        total = sum_of(total, _UNITS.get(base, form_of(f"unit {base}")), powers.get(base, 0))
    return total


def _names(expression: Expression) -> Iterator[str]:
    return (name.name for name in names_in(expression.node) if name.name != "pi")


def sum_of(form: LinearForm, added: LinearForm, factor: Exponent) -> LinearForm:
    """Return one form plus a multiple of another, without zeros."""
    total = dict(form)
    for name, value in added.items():
        total[name] = total.get(name, 0) + factor * value
    return {name: value for name, value in total.items() if value}


def quotient(a: Exponent, b: Exponent) -> Exponent:
    """Divide a by b; return an int if the quotient is one."""
    return whole(Fraction(a) / b)


def whole(number: Fraction) -> Exponent:
    """Return an int for a whole number."""
    return number.numerator if number.denominator == 1 else number


def _constant(node: Node) -> Exponent | None:
    """Return the value of an exponent that consists of numbers, else None."""
    if isinstance(node, Number):
        return whole(node.value)
    if isinstance(node, Neg):
        value = _constant(node.operand)
        return None if value is None else -value
    if isinstance(node, Mul):
        product: Exponent = 1
        for operator, factor in node.factors:
            value = _constant(factor)
            if value is None or (operator == "/" and value == 0):
                return None
            product = quotient(product, value) if operator == "/" else product * value
        return product
    return None


def _solved(
    equations: Iterable[LinearForm], generator: LinearForm, names: list[str]
) -> LinearForm | None:
    """Solve equations for exponents, undetermined ones being 0; None if they contradict."""
    rows: list[tuple[LinearForm, Exponent]] = []  # a form, and what it comes to
    for equation in equations:
        form = {name: value for name, value in equation.items() if name not in generator}
        fixed = (equation[name] * generator[name] for name in generator if name in equation)
        rows.append((form, -sum(fixed)))
    solved: list[tuple[str, LinearForm, Exponent]] = []
    for name in names:
        if name in generator:
            continue
        pivot = next((k for k, (form, _) in enumerate(rows) if name in form), None)
        if pivot is None:
            continue
        form, known = rows.pop(pivot)
        scale = form[name]
        form = {n: quotient(value, scale) for n, value in form.items()}
        known = quotient(known, scale)
        rows = [_without(name, row, form, known) for row in rows]
        solved.append((name, form, known))
    if any(known for _, known in rows):
        return None
    solution = dict(generator)
    for name, form, known in reversed(solved):
        others = (value * solution.get(n, 0) for n, value in form.items() if n != name)
        solution[name] = known - sum(others)
    return solution


def _without(
    name: str, row: tuple[LinearForm, Exponent], form: LinearForm, known: Exponent
) -> tuple[LinearForm, Exponent]:
    """Eliminate a name from a row."""
    row_form, right = row
    factor = row_form.get(name)
    if factor is None:
        return row
    return sum_of(row_form, form, -factor), right - factor * known
