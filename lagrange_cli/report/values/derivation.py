"""The derivation as JSON: what ``lagrange derive --format json`` writes.

Expressions are in the scene language, so that they can be read back;
``lambda_NAME`` is the multiplier of the constraint of that name.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from lagrange_cli.mechanics.dynamics.accelerations import (
    differentiated,
    explicit_form,
    forcing_with_reactions,
)
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.notation.build import display
from lagrange_cli.notation.ordering import sum_of
from lagrange_cli.notation.printers.latex import LatexPrinter
from lagrange_cli.notation.printers.scene import ScenePrinter
from lagrange_cli.notation.scene_language import ExpressionPrinter
from lagrange_cli.notation.tree import DisplayNode, SignedNode, as_terms
from lagrange_cli.notation.vocabulary import vocabulary
from lagrange_cli.report.contents.derivation.writer import has_quaternion
from lagrange_cli.report.values.expressions import (
    MATRIX,
    ROW,
    coordinate_names,
    residuals,
)
from lagrange_cli.report.values.json_types import (
    EXPRESSION,
    TEXT,
    ConvertedType,
    JsonObject,
    Key,
    by_name,
    list_of,
    optional,
    through,
)
from lagrange_cli.report.values.system import FINDINGS, SYSTEM

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations, ShownEquation
    from lagrange_cli.notation.vocabulary import Vocabulary


#: Keys whose values hold expressions, which ``latex`` has too.
_EXPRESSIONS = (
    *("singular", "kinetic", "potential", "lagrangian", "equations", "multiplier_equations"),
    *("mass_matrix", "forcing", "conserved", "energy_balance", "closure", "contacts"),
    *("states", "controllers", "inputs", "outputs"),
    *("constraint_forces", "constraint_multipliers"),
    *("hamiltonian", "canonical", "routhian", "effective_potential", "gyroscopic", "recovered"),
    *("first_order", "small_oscillations", "euler"),
)


def derivation_report(
    equations: Equations, form: str = "lagrange", *, latex: bool = False
) -> dict[str, Any]:
    """Return the derivation as values that JSON can hold.

    Parameters
    ----------
    equations
        The equations of motion.
    form
        ``lagrange``: each residual is the shown form of Lagrange's equation.
        ``explicit``: it is ``ddot(q) - (acceleration)``, or the row of M q̈ − f where too many
        accelerations are coupled; ``multiplier_equations`` hold ``lambda - (value)`` of each
        closure, or the closure differentiated. ``hamiltonian``: H and the canonical equations
        beside Lagrange's. ``routhian``: those of the coordinates that are not ignored.
        ``first-order``: with velocities as unknowns, ``small-oscillations``: about an
        equilibrium, both beside Lagrange's. ``euler``: Euler's equations of one body, beside
        Lagrange's, as those of a body by a quaternion are without being asked for.
    latex
        The key ``latex`` has the values that hold expressions once more, these in LaTeX, and
        how the symbols print.

    Raises
    ------
    InternalError
        An expression has no exact form in the scene language.
    """
    words = vocabulary(equations)
    report = _report(equations, form, ExpressionPrinter(words, ScenePrinter()))
    if latex:
        printer = LatexPrinter()
        typeset = _report(equations, form, ExpressionPrinter(words, printer))
        symbols = {symbol.name: printer.inline(node) for symbol, node in words.atoms.items()}
        typeset_values = {key: typeset[key] for key in _EXPRESSIONS if key in typeset}
        report["latex"] = {"symbols": symbols, **typeset_values}
    return report


def derivation_type() -> JsonObject[Any]:
    """Return the type of the reports of all forms; keys that some have alone may be missing."""
    from lagrange_cli.report.values import forms

    further: list[JsonObject[Any]] = [forms.HAMILTONIAN, forms.BRACKETS, forms.ROUTHIAN]
    further += [_EXPLICIT, forms.FIRST_ORDER, forms.SMALL_OSCILLATIONS, forms.EULER]
    always = {key.name: key for key in (*SYSTEM.keys, *_LAGRANGE.keys)}
    others = {key.name: key for kind in further for key in optional(*kind.keys)}
    keys: tuple[Key[Any], ...] = (*(always | others | always).values(), *FINDINGS.keys)
    typeset: JsonObject[Any] = JsonObject(
        Key("symbols", by_name(TEXT), "LaTeX of each name."),
        *optional(*(key for key in keys if key.name in _EXPRESSIONS)),
    )
    description = "With --with latex: the expressions in LaTeX."
    return JsonObject(*keys, Key("latex", typeset, description, optional=True))


def _report(equations: Equations, form: str, say: ExpressionPrinter) -> dict[str, Any]:
    """Return the report, with expressions as they are said."""
    return (
        SYSTEM.write(equations, say)
        | _in_form(equations, form, say)
        | FINDINGS.write(equations, say)
    )


def _in_form(equations: Equations, form: str, say: ExpressionPrinter) -> dict[str, Any]:
    """Return the equations of motion in a form, with M and f of their rows."""
    if form == "routhian":
        from lagrange_cli.report.values.forms import routhian_report

        return routhian_report(equations, say)
    if form == "explicit":
        return _EXPLICIT.write(_explicit(equations), say)
    report = _LAGRANGE.write(equations, say)
    if form == "hamiltonian":
        from lagrange_cli.report.values.forms import hamiltonian_report

        return report | hamiltonian_report(equations, say)
    if form == "first-order":
        from lagrange_cli.report.values.forms import first_order_report

        return report | first_order_report(equations, say)
    if form == "small-oscillations":
        from lagrange_cli.report.values.forms import small_oscillations_report

        return report | small_oscillations_report(equations, say)
    if form == "euler" or has_quaternion(equations):
        from lagrange_cli.report.values.forms import euler_report

        return report | euler_report(equations, say, is_required=form == "euler")
    return report


# Equations of motion.


_ROWS: tuple[Key[Equations], ...] = (
    Key("mass_matrix", MATRIX, "M in M ddot(q) = f, unscaled.", lambda e: e.system.mass_matrix),
    Key(
        "forcing",
        list_of(EXPRESSION),
        "The right side f, with multipliers beside it.",
        lambda e: e.system.forcing,
    ),
)
_LAGRANGE: JsonObject[Equations] = JsonObject(
    Key(
        "equations",
        list_of(residuals("coordinate")),
        "The equation of motion of each coordinate.",
        lambda equations: zip(coordinate_names(equations), equations.derivation.shown, strict=True),
    ),
    *_ROWS,
)


@dataclass(frozen=True)
class _Difference:
    """``Σ unknown − value``, the unknowns first."""

    unknowns: Sequence[Expr]
    value: Expr

    def displayed(self, words: Vocabulary) -> DisplayNode:
        terms = [term for e in self.unknowns for term in as_terms(display(e, words))]
        terms += [SignedNode(not t.negative, t.node) for t in as_terms(display(self.value, words))]
        return sum_of(terms, ordered=True)


#: A row that is solved for an unknown, or that is not.
_SOLVED = ConvertedType(
    TEXT.schema,
    lambda row, say: (
        say.tree(row.displayed(say.words)) if isinstance(row, _Difference) else ROW.write(row, say)
    ),
)


class _Explicit(NamedTuple):
    """Rows for coordinates, and those for the multipliers of closures."""

    whole: Equations
    rows: list[_Difference]
    multipliers: list[tuple[str, _Difference | ShownEquation]]


def _explicit(equations: Equations) -> _Explicit:
    system, right = equations.system, forcing_with_reactions(equations)
    solved = explicit_form(equations)
    rows = []
    for i, (c, value) in enumerate(zip(system.coordinates, solved.accelerations, strict=True)):
        if value is not None:
            rows.append(_Difference([c.a], value))
        else:
            row = entries(system.mass_matrix[i]).items()
            rows.append(_Difference([m * system.coordinates[j].a for j, m in row], right[i]))
    multipliers = [
        (
            closure.multiplier.name,
            differentiated(equations, closure)
            if value is None
            else _Difference([closure.multiplier], value),
        )
        for closure, value in zip(system.closures, solved.multipliers, strict=True)
    ]
    return _Explicit(equations, rows, multipliers)


_EXPLICIT: JsonObject[_Explicit] = JsonObject(
    Key(
        "equations",
        list_of(residuals("coordinate", _SOLVED)),
        "The equation of motion of each coordinate.",
        lambda explicit: zip(coordinate_names(explicit.whole), explicit.rows, strict=True),
    ),
    Key(
        "multiplier_equations",
        list_of(residuals("multiplier", _SOLVED)),
        "With --form explicit: the value of each multiplier, or its constraint differentiated.",
        lambda explicit: explicit.multipliers,
    ),
    *through(lambda explicit: explicit.whole, *_ROWS),
)
