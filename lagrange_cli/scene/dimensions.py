"""Dimensions: what becomes of every name of a scene when masses, lengths or times are scaled.

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
)
from lagrange_cli.scene.language.grammar import parse_expression
from lagrange_cli.scene.model import Scene
from lagrange_cli.scene.reading.declarations import AXES

Base: TypeAlias = Literal["mass", "length", "time"]

_BASES: tuple[Base, ...] = ("mass", "length", "time")

#: Scenes of more names than this are not looked at: the work grows as the cube.
_MOST_NAMES = 300

_LinearForm: TypeAlias = dict[str, Fraction]
"""A linear form in the exponents of names."""

#: Exponents that are not of names of a scene, whose names have no blanks.
_TIME, _LENGTH, _ENERGY = "t", "a length", "an energy"

#: What of a number of dimension 1 is said of time, length and energy.
_GENERATORS: dict[Base, tuple[int, int, int]] = {
    "mass": (0, 0, 1),
    "length": (0, 1, 2),
    "time": (1, 0, -2),
}

#: Units of mechanics: powers of energy, length and time.
_UNITS: dict[str, _LinearForm] = {
    unit: {
        name: Fraction(k) for name, k in zip((_ENERGY, _LENGTH, _TIME), powers, strict=True) if k
    }
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

#: Functions that take derivatives by time, so many.
_RATES = {"dot": 1, "ddot": 2}


@dataclass(frozen=True)
class Dimensions:
    """Exponents of names, ``dot(NAME)`` not among them, under the scalings that there are.

    A base is missing where numbers in the scene stand in its way.
    """

    exponents: Mapping[Base, Mapping[str, Fraction]]

    def of(self, name: str) -> tuple[Fraction, ...]:
        """Exponents of mass, length and time of a name; 0 for those that are missing."""
        return tuple(self.exponents.get(base, {}).get(name, Fraction(0)) for base in _BASES)

    def factor(self, name: str, factors: Mapping[Base, float]) -> float:
        """By what ``NAME`` or ``dot(NAME)`` is multiplied where masses, lengths, times are."""
        rate = name.startswith("dot(")
        powers = zip(_BASES, self.of(name[4:-1] if rate else name), strict=True)
        found = math.prod([math.pow(factors.get(base, 1.0), power) for base, power in powers])
        return found / factors.get("time", 1.0) if rate else found

    @property
    def complete(self) -> bool:
        """Say whether masses, lengths and times can all be scaled."""
        return len(self.exponents) == len(_BASES)


def dimensions(scene: Scene) -> Dimensions:
    """The scalings of masses, lengths and times that leave a scene what it is."""
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
    found: dict[Base, Mapping[str, Fraction]] = {}
    for base, values in _GENERATORS.items():
        given = dict(zip((_TIME, _LENGTH, _ENERGY), map(Fraction, values), strict=True))
        for equations in (said.equations, needed.equations):
            solution = _solved(equations, given, names)
            if solution is not None:
                found[base] = solution
                break
    return Dimensions(found)


class _Reader:
    """Equations between exponents, each a form that is zero, as expressions are read."""

    def __init__(self) -> None:
        self.equations: list[_LinearForm] = []

    def read(self, scene: Scene) -> None:
        self._numbers(scene)
        self._bodies(scene)
        self._relations(scene)
        energy, power = _form(_ENERGY), _form(_ENERGY, **{_TIME: -1})
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
        for given in scene.inputs:
            if given.expression is not None:
                self._is(given.expression, _form(given.name))
            else:
                self.equations += [_form(given.name), _form(_TIME)]

    def _bodies(self, scene: Scene) -> None:
        length, mass = _form(_LENGTH), _form(_ENERGY, **{_LENGTH: -2, _TIME: 2})
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
        found = self._of(expression.node)
        if found is not None:
            self._same(found, form)

    def _same(self, one: _LinearForm, other: _LinearForm) -> None:
        difference = _sum(one, other, -1)
        if difference and difference not in self.equations:
            self.equations.append(difference)

    def _alike(self, nodes: Iterable[Node]) -> _LinearForm | None:
        """The form of all of these, which is one."""
        found: _LinearForm | None = None
        for node in nodes:
            form = self._of(node)
            if found is None:
                found = form
            elif form is not None:
                self._same(found, form)
        return found

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
        found: _LinearForm = {}
        for operator, factor in node.factors:
            form = self._of(factor)
            if form is None:
                return None
            found = _sum(found, form, -1 if operator == "/" else 1)
        return found

    def _power(self, node: Pow) -> _LinearForm | None:
        exponent = _constant(node.exponent)
        base = self._of(node.base)
        if exponent is not None:
            return None if base is None else _sum({}, base, exponent)
        for form in (base, self._of(node.exponent)):
            self._same(form or {}, {})
        return {}

    def _call(self, node: Call) -> _LinearForm | None:
        if node.function in _RATES:
            form = self._of(node.arguments[0])
            return None if form is None else _sum(form, _form(_TIME), -_RATES[node.function])
        found = self._alike(node.arguments)
        if node.function in ("abs", "min", "max", "norm"):
            return found
        if node.function == "sqrt":
            return None if found is None else _sum({}, found, Fraction(1, 2))
        if node.function not in ("atan2", "sign"):
            self._same(found or {}, {})
        return {}


def _form(name: str, **others: int) -> _LinearForm:
    return {name: Fraction(1)} | {other: Fraction(value) for other, value in others.items()}


def _unit(text: str) -> _LinearForm | None:
    """The form of a unit, those of electricity being names of their own; None where it is none."""
    product = _BETWEEN.sub("*", text)
    try:
        form = _Reader()._of(parse_expression(product, Mark("unit", 1, 1, product)).node)
    except InputError:
        return None
    found: _LinearForm = {}
    for name, exponent in (form or {}).items():
        found = _sum(found, _UNITS.get(name, _form(f"unit {name}")), exponent)
    return found


def _names(expression: Expression) -> Iterator[str]:
    return (name.name for name in names_in(expression.node) if name.name != "pi")


def _sum(one: _LinearForm, other: _LinearForm, factor: Fraction | int) -> _LinearForm:
    """One form plus a multiple of another, without zeros."""
    found = dict(one)
    for name, value in other.items():
        found[name] = found.get(name, Fraction(0)) + factor * value
    return {name: value for name, value in found.items() if value}


def _constant(node: Node) -> Fraction | None:
    """The value of an exponent that is made of numbers, else None."""
    if isinstance(node, Number):
        return node.value
    if isinstance(node, Neg):
        value = _constant(node.operand)
        return None if value is None else -value
    if isinstance(node, Mul):
        found = Fraction(1)
        for operator, factor in node.factors:
            value = _constant(factor)
            if value is None or (operator == "/" and value == 0):
                return None
            found = found / value if operator == "/" else found * value
        return found
    return None


def _solved(
    equations: Iterable[_LinearForm], given: _LinearForm, names: list[str]
) -> _LinearForm | None:
    """Exponents that satisfy equations, those that stay open being 0; None where there are none."""
    rows: list[tuple[_LinearForm, Fraction]] = []  # a form, and what it comes to
    for equation in equations:
        form = {name: value for name, value in equation.items() if name not in given}
        fixed = (equation[name] * given[name] for name in given if name in equation)
        rows.append((form, -sum(fixed, Fraction(0))))
    solved: list[tuple[str, _LinearForm, Fraction]] = []
    for name in names:
        if name in given:
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
    found = dict(given)
    for name, form, known in reversed(solved):
        rest = (value * found.get(n, Fraction(0)) for n, value in form.items() if n != name)
        found[name] = known - sum(rest, Fraction(0))
    return found


def _without(
    name: str, row: tuple[_LinearForm, Fraction], form: _LinearForm, known: Fraction
) -> tuple[_LinearForm, Fraction]:
    """A row from which a name is eliminated."""
    own, right = row
    factor = own.get(name)
    if factor is None:
        return row
    return _sum(own, form, -factor), right - factor * known
