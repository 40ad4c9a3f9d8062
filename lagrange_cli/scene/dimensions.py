"""Dimensions of the names of a scene: how each scales with masses, lengths and times.

Two sides of an equation, and the terms of a sum, scale alike; arguments of functions do not
scale; potentials scale as energies do. That is one linear equation for exponents each, over
rational numbers (P. W. Bridgman, *Dimensional Analysis*, 1922). A number in a scene has no
dimension, so that ``x + 1`` keeps x from being scaled.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, TypeAlias

from lagrange_cli.errors import InputError, Mark
from lagrange_cli.scene.language.expression import (
    TIME_DERIVATIVES,
    Add,
    Call,
    Expression,
    Mul,
    Name,
    Neg,
    Node,
    Number,
    Pow,
    names_in,
    walk,
)
from lagrange_cli.scene.language.grammar import parse_expression
from lagrange_cli.scene.model import Scene
from lagrange_cli.scene.reading.declarations import AXES

Base: TypeAlias = Literal["mass", "length", "time"]

_BASES: tuple[Base, ...] = ("mass", "length", "time")

#: Scenes of more names than this are not looked at: the work grows as the cube. Set by hand.
_MOST_NAMES = 300

_LinearForm: TypeAlias = dict[str, Fraction]
"""A linear form in the exponents of names."""

#: Key of the exponent of time in a linear form.
_TIME = "t"
#: Key of the exponent of lengths; blanks set it apart from names of a scene.
_LENGTH = "a length"
#: Key of the exponent of energies.
ENERGY = "an energy"

#: Exponents of time, length and energy in each base dimension.
_GENERATORS: dict[Base, tuple[int, int, int]] = {
    "mass": (0, 0, 1),
    "length": (0, 1, 2),
    "time": (1, 0, -2),
}

#: Units of mechanics: powers of energy, length and time.
_UNITS: dict[str, _LinearForm] = {
    unit: {name: Fraction(k) for name, k in zip((ENERGY, _LENGTH, _TIME), powers, strict=True) if k}
    for unit, powers in {
        "kg": (1, -2, 2),
        "m": (0, 1, 0),
        "s": (0, 0, 1),
        "rad": (0, 0, 0),
        "Hz": (0, 0, -1),
        "N": (1, -1, 0),
        "J": (1, 0, 0),
        "W": (1, 0, -1),
        "Pa": (1, -3, 0),
    }.items()
}

#: The blank in ``kg m^2``.
_BETWEEN = re.compile(r"(?<=[\w)])\s+(?=[\w(])")


@dataclass(frozen=True)
class Dimensions:
    """Exponents of names, ``dot(NAME)`` not among them, under the scalings that there are.

    A base is missing where numbers in the scene stand in its way.
    """

    exponents: Mapping[Base, Mapping[str, Fraction]]

    def of(self, name: str) -> tuple[Fraction, ...]:
        """Exponents of mass, length and time of a name; 0 for those that are missing."""
        return tuple(self.exponents.get(base, {}).get(name, Fraction(0)) for base in _BASES)

    def of_value(self, expression: Expression) -> tuple[Fraction, ...]:
        """Exponents of mass, length and time of a value, as :meth:`of`."""
        form = _Reader()._of(expression.node) or {}
        powers = [[value * e for e in self.of(name)] for name, value in form.items()]
        return tuple(sum(column, Fraction(0)) for column in zip(*powers, strict=True)) or self.of(
            ""
        )

    def factor(self, name: str, factors: Mapping[Base, float]) -> float:
        """Multiplier of ``NAME`` or ``dot(NAME)`` if bases are multiplied by ``factors``."""
        rate = name.startswith("dot(")
        powers = zip(_BASES, self.of(name[4:-1] if rate else name), strict=True)
        product = math.prod([math.pow(factors.get(base, 1.0), power) for base, power in powers])
        return product / factors.get("time", 1.0) if rate else product

    @property
    def complete(self) -> bool:
        """Say whether masses, lengths and times can all be scaled."""
        return len(self.exponents) == len(_BASES)


def dimensions(scene: Scene) -> Dimensions:
    """Scalings of masses, lengths and times under which a scene stays the same."""
    needed, said = _Reader(), _Reader()
    needed.read(scene)
    said.read(scene)
    said.read_hints(scene)
    # Names of coordinates are open first: a scene that leaves it open takes them as angles.
    last = {c.name for c in scene.coordinates or ()}
    names = sorted({name for form in said.equations for name in form})
    names.sort(key=lambda name: name in last)
    if len(names) > _MOST_NAMES:
        return Dimensions({})
    exponents: dict[Base, Mapping[str, Fraction]] = {}
    for base, values in _GENERATORS.items():
        generator = dict(zip((_TIME, _LENGTH, ENERGY), map(Fraction, values), strict=True))
        for equations in (said.equations, needed.equations):
            solution = _solved(equations, generator, names)
            if solution is not None:
                exponents[base] = solution
                break
    return Dimensions(exponents)


class _Reader:
    """Collect equations between exponents, each a linear form that is zero."""

    def __init__(self) -> None:
        self.equations: list[_LinearForm] = []

    def read(self, scene: Scene) -> None:
        self._numbers(scene)
        self._bodies(scene)
        self._relations(scene)
        energy, power = _form(ENERGY), _form(ENERGY, **{_TIME: -1})
        for term in (*scene.potentials, *scene.kinetic):
            self._is(term.expression, energy)
        for term in scene.dissipation:
            self._is(term.expression, power)
        moved = {p.name for p in scene.particles} | {p.name for p in scene.points}
        for force in scene.forces:
            along = _LENGTH if force.on in moved else force.on
            for component in force.components:
                self._is(component, _sum(energy, _form(along), -1))

    def read_hints(self, scene: Scene) -> None:
        """Units, and values of the start and the end: they need not fit, as numbers are in them."""
        units = {p.name: p.unit for p in scene.parameters}
        units |= {c.name: c.unit for c in scene.coordinates or ()}
        for name, text in units.items():
            unit = None if text is None else _unit(text)
            if unit is not None:
                self._same(_form(name), unit)
        for value in (*scene.initial, *scene.near):
            if any(_names(value.value)):
                self._is(value.value, _form(value.name, **({_TIME: -1} if value.order else {})))
        for time in (scene.simulate.until, scene.simulate.start):
            if time is not None and any(_names(time)):
                self._is(time, _form(_TIME))

    def _numbers(self, scene: Scene) -> None:
        for parameter in scene.parameters:
            if parameter.value is not None and any(_names(parameter.value)):
                self._is(parameter.value, _form(parameter.name))
        for declared in scene.inputs:
            if declared.expression is not None:
                self._is(declared.expression, _form(declared.name))
            else:
                self.equations += [_form(declared.name), _form(_TIME)]

    def _bodies(self, scene: Scene) -> None:
        length, mass = _form(_LENGTH), _form(ENERGY, **{_LENGTH: -2, _TIME: 2})
        for particle in scene.particles:
            self._is(particle.mass, mass)
        positions = {particle.name: particle.position for particle in scene.particles}
        positions |= {point.name: point.position for point in scene.points}
        for name, position in positions.items():
            for axis, entry in zip(AXES, position, strict=True):
                self._is(entry, length)
                self._same(_form(f"{axis}_{name}"), length)

    def _relations(self, scene: Scene) -> None:
        for definition in scene.definitions:
            self._is(definition.expression, _form(definition.name))
        for constraint in scene.constraints:
            for equation in constraint.equations:
                self._alike([equation.left.node, equation.right.node])
        for one_sided in scene.unilateral:
            self._alike([one_sided.inequality.left.node, one_sided.inequality.right.node])
            if one_sided.restitution is not None:
                self._is(one_sided.restitution, {})

    def _is(self, expression: Expression, form: _LinearForm) -> None:
        scaling = self._of(expression.node)
        if scaling is not None:
            self._same(scaling, form)

    def _same(self, left: _LinearForm, right: _LinearForm) -> None:
        difference = _sum(left, right, -1)
        if difference and difference not in self.equations:
            self.equations.append(difference)

    def _alike(self, nodes: Iterable[Node]) -> _LinearForm | None:
        """The common form of all of these, None if all are 0."""
        common: _LinearForm | None = None
        for node in nodes:
            form = self._of(node)
            if common is None:
                common = form
            elif form is not None:
                self._same(common, form)
        return common

    def _of(self, node: Node) -> _LinearForm | None:
        """The form of an expression, None for 0, which scales in any way."""
        if isinstance(node, Number):
            return {} if node.value else None
        if isinstance(node, Name):
            return {} if node.name == "pi" else _form(node.name)
        if isinstance(node, Neg):
            return self._of(node.operand)
        if isinstance(node, Add):
            return self._alike(part for _, part in node.terms)
        if isinstance(node, Mul):
            return self._product(node)
        if isinstance(node, Pow):
            return self._power(node)
        return self._call(node)

    def _product(self, node: Mul) -> _LinearForm | None:
        total: _LinearForm = {}
        for operator, factor in node.factors:
            form = self._of(factor)
            if form is None:
                return None
            total = _sum(total, form, -1 if operator == "/" else 1)
        return total

    def _power(self, node: Pow) -> _LinearForm | None:
        exponent = _constant(node.exponent)
        base = self._of(node.base)
        if exponent is not None:
            return None if base is None else _sum({}, base, exponent)
        for form in (base, self._of(node.exponent)):
            self._same(form or {}, {})
        return {}

    def _call(self, node: Call) -> _LinearForm | None:
        order = TIME_DERIVATIVES.get(node.function)
        if order is not None:
            form = self._of(node.arguments[0])
            return None if form is None else _sum(form, _form(_TIME), -order)
        common = self._alike(node.arguments)
        if node.function in ("abs", "min", "max", "norm"):
            return common
        if node.function == "sqrt":
            return None if common is None else _sum({}, common, Fraction(1, 2))
        if node.function not in ("atan2", "sign"):
            self._same(common or {}, {})
        return {}


def _form(name: str, **others: int) -> _LinearForm:
    return {name: Fraction(1)} | {symbol: Fraction(value) for symbol, value in others.items()}


def _unit(text: str) -> _LinearForm | None:
    """The form of a unit, None if the text is not one.

    Units that are not in the table, as of electricity, are bases themselves.
    """
    product = _BETWEEN.sub("*", text)
    try:
        form = _Reader()._of(parse_expression(product, Mark("unit", 1, 1, product)).node)
    except InputError:
        return None
    total: _LinearForm = {}
    for name, exponent in (form or {}).items():
        total = _sum(total, _UNITS.get(name, _form(f"unit {name}")), exponent)
    return total


def unit_symbols(text: str) -> frozenset[str] | None:
    """Return the symbols in the text of a unit; None if it is no product of powers."""
    product = _BETWEEN.sub("*", text)
    try:
        read = parse_expression(product, Mark("unit", 1, 1, product))
    except InputError:
        return None
    return None if any(isinstance(n, Add) for n in walk(read.node)) else frozenset(_names(read))


def _names(expression: Expression) -> Iterator[str]:
    return (name.name for name in names_in(expression.node) if name.name != "pi")


def _sum(form: _LinearForm, added: _LinearForm, factor: Fraction | int) -> _LinearForm:
    """One form plus a multiple of another, without zeros."""
    total = dict(form)
    for name, value in added.items():
        total[name] = total.get(name, Fraction(0)) + factor * value
    return {name: value for name, value in total.items() if value}


def _constant(node: Node) -> Fraction | None:
    """The value of an exponent that is made of numbers, else None."""
    if isinstance(node, Number):
        return node.value
    if isinstance(node, Neg):
        value = _constant(node.operand)
        return None if value is None else -value
    if isinstance(node, Mul):
        product = Fraction(1)
        for operator, factor in node.factors:
            value = _constant(factor)
            if value is None or (operator == "/" and value == 0):
                return None
            product = product / value if operator == "/" else product * value
        return product
    return None


def _solved(
    equations: Iterable[_LinearForm], generator: _LinearForm, names: list[str]
) -> _LinearForm | None:
    """Solve equations for exponents, undetermined ones being 0; None if they contradict."""
    rows: list[tuple[_LinearForm, Fraction]] = []  # a form, and what it comes to
    for equation in equations:
        form = {name: value for name, value in equation.items() if name not in generator}
        fixed = (equation[name] * generator[name] for name in generator if name in equation)
        rows.append((form, -sum(fixed, Fraction(0))))
    solved: list[tuple[str, _LinearForm, Fraction]] = []
    for name in names:
        if name in generator:
            continue
        pivot = next((k for k, (form, _) in enumerate(rows) if name in form), None)
        if pivot is None:
            continue
        form, known = rows.pop(pivot)
        scale = form[name]
        form, known = {n: value / scale for n, value in form.items()}, known / scale
        rows = [_without(name, row, form, known) for row in rows]
        solved.append((name, form, known))
    if any(known for _, known in rows):
        return None
    solution = dict(generator)
    for name, form, known in reversed(solved):
        others = (value * solution.get(n, Fraction(0)) for n, value in form.items() if n != name)
        solution[name] = known - sum(others, Fraction(0))
    return solution


def _without(
    name: str, row: tuple[_LinearForm, Fraction], form: _LinearForm, known: Fraction
) -> tuple[_LinearForm, Fraction]:
    """Eliminate a name from a row."""
    row_form, right = row
    factor = row_form.get(name)
    if factor is None:
        return row
    return _sum(row_form, form, -factor), right - factor * known
