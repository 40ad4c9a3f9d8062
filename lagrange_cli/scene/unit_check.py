"""Consistency of the units that a scene declares, with warnings.

Every term of an energy, force, constraint, definition and output is checked. Names without a unit
take the dimension of the first place that determines it. Expressions without any declared unit are
not checked, so that a scene without units gets no warnings.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import TypeAlias

from lagrange_cli.errors import nearest
from lagrange_cli.scene.declared_numbers import DeclaredParameter, DeclaredState
from lagrange_cli.scene.dimensions import (
    ENERGY,
    LENGTH,
    TIME,
    LinearForm,
    ScalingReader,
    form_of,
    quotient,
    sum_of,
    whole,
)
from lagrange_cli.scene.language.expression import Expression, Node, names_in
from lagrange_cli.scene.language.problems import Problems, shown
from lagrange_cli.scene.model import DeclaredCoordinate, Scene
from lagrange_cli.scene.unit_table import (
    BASES,
    UnknownUnitError,
    factor_of,
    unit_names,
    unit_powers,
)

#: Marks keys of units in forms whose other keys are names.
_UNIT = "unit "

#: Marks the factor of the scene's own unit of time, length or energy, which is unknown at first.
_OWN = "own "

#: Powers of bases of time, length and energy.
_DIMENSIONS = {TIME: {"s": 1}, LENGTH: {"m": 1}, ENERGY: {"kg": 1, "m": 2, "s": -2}}

#: The same as forms.
_GENERATORS: dict[str, LinearForm] = {
    name: form_of(_OWN + name, **{_UNIT + base: power for base, power in powers.items()})
    for name, powers in _DIMENSIONS.items()
}

#: What may have a unit of its own.
_Declared: TypeAlias = DeclaredParameter | DeclaredCoordinate | DeclaredState

#: Longest part of an expression that a message repeats.
_LONGEST_QUOTE = 50


def check_units(scene: Scene, problems: Problems) -> None:
    """Warn of declared units that do not fit together."""
    checker = _Checker(problems)
    declared: list[_Declared]
    declared = [*scene.parameters, *(scene.coordinates or ()), *scene.states]
    for named in declared:
        if named.unit is not None:
            checker.declare(named, named.unit)
    if checker.declared:
        checker.follow(scene)
        checker.read(scene)


class _Checker(ScalingReader):
    """Solve for the dimensions of names one equation at a time; warn of each that contradicts."""

    def __init__(self, problems: Problems) -> None:
        super().__init__()
        self.problems = problems
        #: Names whose dimension the scene declares, or that are defined by such names.
        self.declared: set[str] = set()
        self._solved: dict[str, LinearForm] = {}

    def declare(self, named: _Declared, unit: str) -> None:
        """Record the declared unit of a name; warn of one that is not known."""
        try:
            powers = unit_powers(unit)
        except UnknownUnitError as error:
            what = shown(error.symbol or unit)
            self.problems.warn(
                f"the unit {what} of '{named.name}' is not known: it is printed, not checked",
                named.mark,
                hint=nearest(error.symbol, unit_names()) or "write units as kg*m^2/s",
                rule="unit",
            )
            return
        self._solved[named.name] = {_UNIT + key: whole(power) for key, power in powers.items()}
        if powers:  # Radians alone leave a scene in scaled units.
            self.declared.add(named.name)

    def follow(self, scene: Scene) -> None:
        """Add the definitions that are made of names with units."""
        for definition in scene.definitions:
            if self._is_told(definition.expression):
                self.declared.add(definition.name)

    def read(self, scene: Scene) -> None:
        """Read the scene, and the sums in its outputs."""
        super().read(scene)
        for output in scene.outputs:
            self.expression = output.expression
            self.form_of(output.expression.node)

    def same(
        self, left: LinearForm, right: LinearForm, node: Node | None = None, meaning: str = ""
    ) -> None:
        """Record that two forms are equal, or warn if they cannot be."""
        first, second = self._reduced(left), self._reduced(right)
        if first == second:
            return
        difference = sum_of(first, second, -1)
        names = [key for key in difference if not key.startswith((_UNIT, _OWN))]
        if not names and not _differs(difference):
            names = [key for key in difference if key.startswith(_OWN)]
        if names:
            scale = difference.pop(names[0])
            self._solved[names[0]] = {
                key: quotient(-value, scale) for key, value in difference.items()
            }
        elif difference and node and self.expression and self._is_told(self.expression):
            self._warn(first, second, node, self.expression, meaning)

    def _is_told(self, expression: Expression) -> bool:
        return any(name.name in self.declared for name in names_in(expression.node))

    def _reduced(self, form: LinearForm) -> LinearForm:
        """Substitute the known dimensions of names in a form."""
        if self._solved.keys().isdisjoint(form) and _GENERATORS.keys().isdisjoint(form):
            return form
        total: LinearForm = {}
        for name, power in form.items():
            if name in self._solved:
                self._solved[name] = self._reduced(self._solved[name])
                total = sum_of(total, self._solved[name], power)
            elif name in _GENERATORS:
                total = sum_of(total, self._reduced(_GENERATORS[name]), power)
            else:
                total = sum_of(total, {name: power}, 1)
        return total

    def _warn(
        self, first: LinearForm, second: LinearForm, node: Node, whole: Expression, meaning: str
    ) -> None:
        text = _quoted(whole.text, *node.span) if whole.exact else whole.text
        subject = f"'{text}'" if 0 < len(text) <= _LONGEST_QUOTE else "this"
        difference = sum_of(first, second, -1)
        if not _differs(difference):
            factor = factor_of(
                {key.removeprefix(_UNIT): Fraction(k) for key, k in difference.items()}
            )
            message = f"{subject} is in a unit {factor:.6g} times that of {meaning}"
            hint = "numbers are not converted: write all of them in units that fit together"
        elif all(key.startswith((_UNIT, _OWN)) for key in (*first, *second)):
            message = f"{subject} has {_dimension(first)}, but {meaning} has {_dimension(second)}"
            hint = ""
        else:
            message = f"{subject} has {_dimension(difference)} times the dimension of {meaning}"
            hint = ""
        self.problems.warn(message, whole.mark(node.span), hint=hint, rule="unit")


def _quoted(text: str, start: int, end: int) -> str:
    """Quote a part of an expression with the parentheses around its ends."""
    while start and text.count(")", start, end) > text.count("(", start, end):
        start = text.rindex("(", 0, start)
    while end < len(text) and text.count("(", start, end) > text.count(")", start, end):
        end = text.index(")", end) + 1
    return text[start:end]


def _differs(difference: LinearForm) -> bool:
    """Tell whether two forms differ in more than factors of numbers."""
    return any(key.startswith(_UNIT) and key[len(_UNIT) :] in BASES for key in difference)


def _dimension(form: LinearForm) -> str:
    """Write the dimension of a form, as ``kg m^2/s^2``."""
    powers = [(base, form[_UNIT + base]) for base in BASES if _UNIT + base in form]
    above = " ".join(_powers((base, k) for base, k in powers if k > 0))
    below = _powers((base, -k) for base, k in powers if k < 0)
    if not above and not below:
        return "no dimension"
    quotient = below[0] if len(below) == 1 else f"({' '.join(below)})"
    return f"the dimension {above or 1}/{quotient}" if below else f"the dimension {above}"


def _powers(powers: Iterable[tuple[str, object]]) -> list[str]:
    return [base if k == 1 else f"{base}^{k}" for base, k in powers]
