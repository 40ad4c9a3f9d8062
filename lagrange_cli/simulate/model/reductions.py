"""Reductions of a motion to a number: ``max(abs(theta2))``, ``first(abs(theta2) > pi)``.

What is reduced is written in the scene language, and becomes an output of the equations.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from lagrange_cli.scene.language.written_text import INEQUALITIES, WrittenText
from lagrange_cli.simulate.model.written_values import output_names, with_values

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations

#: Kind → what its number is.
KINDS = {
    "max": "largest value",
    "min": "least value",
    "mean": "mean over the time",
    "first": "first time at which a condition holds",
}

_CALL = re.compile(r"\s*([a-z]+)\s*\((.*)\)\s*", re.DOTALL)

_EXAMPLE = "'max(abs(theta2))', 'mean(energy)', 'first(abs(theta2) > pi)'"


@dataclass(frozen=True)
class Reduction(WrittenText):
    """A number of a motion; its results are named by its text.

    Attributes
    ----------
    kind
        One of :data:`KINDS`.
    start, end
        Bounds in the text of what is reduced.
    """

    kind: str
    start: int
    end: int

    rule: ClassVar[str] = "reduce"


def read_reduction(text: str, source: str = "--reduce") -> Reduction:
    """Read the kind of a reduction; what is reduced is read with the equations.

    Raises
    ------
    InputError
        Located: there is no such kind.
    """
    text = text.strip()
    called = _CALL.fullmatch(text)
    if called is None or called[1] not in KINDS:
        whole = Reduction(text, source, "", 0, len(text))
        hint = "; ".join(f"{kind}(...): {meaning}" for kind, meaning in KINDS.items())
        raise whole.refusal("this is no reduction", whole.start, whole.end, hint)
    return Reduction(text, source, called[1], *called.span(2))


def reduction_outputs(number: int, coordinates: int) -> tuple[str, ...]:
    """Names of the outputs of a reduction: its value, then the 2n derivatives by the state."""
    return output_names("reduced", number, coordinates)


def with_reductions(equations: Equations, reductions: Sequence[Reduction]) -> Equations:
    """Return equations whose outputs include those of :func:`reduction_outputs`.

    The condition of ``first`` holds where its value is positive.

    Raises
    ------
    InputError
        Located: what is reduced is no expression over the state.
    """
    values = [_value(equations, reduction) for reduction in reductions]
    return with_values(equations, "reduced", values)


def _value(equations: Equations, reduction: Reduction) -> Expr:
    from lagrange_cli.mechanics.interpretation import value_of

    further = {**dict(equations.outputs), "energy": equations.energy}
    start, end = reduction.start, reduction.end
    if reduction.kind != "first":
        return value_of(equations, reduction, start, end, further)
    signs = reduction.relations(start, end)
    if len(signs) != 1 or signs[0][0] not in INEQUALITIES:
        raise reduction.refusal("a condition has one of <, <=, >, >=", start, end, _EXAMPLE)
    (sign,) = signs
    left = value_of(equations, reduction, start, sign.start(), further)
    right = value_of(equations, reduction, sign.end(), end, further)
    return INEQUALITIES[sign[0]] * (left - right)
