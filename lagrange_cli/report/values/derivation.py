"""The derivation as JSON values: what ``lagrange derive --format json`` writes.

Expressions are in the scene language, so that they can be read back;
``lambda_NAME`` is the multiplier of the constraint of that name.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from lagrange_cli.mechanics.dynamics.accelerations import (
    differentiated,
    explicit_form,
    forcing_with_reactions,
)
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.notation.build import display, display_row, display_terms
from lagrange_cli.notation.ordering import sum_of
from lagrange_cli.notation.printers.latex import LatexPrinter
from lagrange_cli.notation.scene_language import ExpressionPrinter, ScenePrinter, matrix
from lagrange_cli.notation.tree import DisplayNode, SignedNode, as_terms
from lagrange_cli.notation.vocabulary import vocabulary
from lagrange_cli.report.contents.forces import forces_report
from lagrange_cli.report.contents.sentences import undecided
from lagrange_cli.report.values.check import PROBLEM

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Input


#: Keys whose values hold expressions, which ``latex`` has too.
_EXPRESSIONS = (
    *("singular", "kinetic", "potential", "lagrangian", "equations", "multiplier_equations"),
    *("mass_matrix", "forcing", "conserved", "energy_balance", "closure", "contacts"),
    *("inputs", "outputs", "constraint_forces", "constraint_multipliers"),
    *("hamiltonian", "canonical", "routhian", "effective_potential", "gyroscopic", "recovered"),
    *("first_order", "small_oscillations"),
)


def derivation_report(
    equations: Equations, form: str = "lagrange", *, latex: bool = False
) -> dict[str, Any]:
    """Return the derivation as values that JSON can hold.

    Parameters
    ----------
    equations
        What a derivation yields.
    form
        ``lagrange``: each residual is the shown form of Lagrange's equation.
        ``explicit``: it is ``ddot(q) - (acceleration)``, or the row of M q̈ − f where too many
        accelerations are coupled; ``multiplier_equations`` hold ``lambda - (value)`` of each
        closure, or the closure differentiated. ``hamiltonian``: H and the canonical equations
        beside Lagrange's. ``routhian``: those of the coordinates that are not ignored.
        ``first-order``: with velocities as unknowns, ``small-oscillations``: about an
        equilibrium, both beside Lagrange's.
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


def _report(equations: Equations, form: str, say: ExpressionPrinter) -> dict[str, Any]:
    """Return the report, with expressions as they are said."""
    forces = equations.derivation.constraint_forces
    account, unused = equations.derivation.account, equations.derivation.facts.unused_parameters
    return {
        "name": equations.presentation.name,
        "cartesian": account.cartesian,
        "extra": account.extra,
        "constraints": account.constraints,
        "dof": account.dof,
        "nonholonomic": account.nonholonomic,
        "unilateral": account.unilateral,
        "coordinates": [c.name for c in equations.system.coordinates],
        "formulation": equations.system.formulation,
        "predicted": _predicted(equations),
        "singular": [
            {"coordinate": name, "where": f"{say(place.where)} = 0"}
            for place in equations.derivation.singular
            for name in place.coordinates
        ],
        "positive": [name for name, _ in equations.system.positive],
        "kinetic": say(equations.system.kinetic),
        "potential": say(equations.system.potential),
        "lagrangian": say(equations.system.lagrangian),
        **_in_form(equations, form, say),
        "cyclic": list(equations.derivation.cyclic),
        "conserved": [
            {"name": c.name, "expression": say(c.expression)}
            for c in equations.derivation.conserved
        ],
        "undecided": undecided(equations),
        "energy_balance": _balance(equations, say),
        "multipliers": [c.multiplier.name for c in equations.system.pushing],
        "closure": [
            {"name": c.name, "kind": c.kind, "expression": say(c.expression)}
            for c in equations.system.closures
        ],
        "contacts": _contacts(equations, say),
        "inputs": [_input(source, say) for source in equations.system.inputs],
        "outputs": [{"name": name, "expression": say(e)} for name, e in equations.system.outputs],
        "facts": asdict(equations.derivation.facts) | {"unused_parameters": list(unused)},
        **({} if forces is None else forces_report(equations, forces, say)),
        **_steps(equations),
        "certificate": asdict(equations.derivation.certificate),
        "warnings": [PROBLEM.write(warning) for warning in equations.derivation.warnings],
    }


def _in_form(equations: Equations, form: str, say: ExpressionPrinter) -> dict[str, Any]:
    """Return the equations of motion in a form, with M and f of their rows."""
    if form == "routhian":
        from lagrange_cli.report.values.forms import routhian_report

        return routhian_report(equations, say)
    whole = {
        "mass_matrix": matrix(equations.system.mass_matrix, say),
        "forcing": [say(f) for f in equations.system.forcing],
    }
    if form == "hamiltonian":
        from lagrange_cli.report.values.forms import hamiltonian_report

        return _lagrange(equations, say) | whole | hamiltonian_report(equations, say)
    if form == "first-order":
        from lagrange_cli.report.values.forms import first_order_report

        return _lagrange(equations, say) | whole | first_order_report(equations, say)
    if form == "small-oscillations":
        from lagrange_cli.report.values.forms import small_oscillations_report

        return _lagrange(equations, say) | whole | small_oscillations_report(equations, say)
    return (_explicit if form == "explicit" else _lagrange)(equations, say) | whole


def _steps(equations: Equations) -> dict[str, Any]:
    """Return the steps, where they were asked for."""
    if equations.derivation.steps is None:
        return {}
    from lagrange_cli.report.values.steps import steps_report

    return steps_report(equations, equations.derivation.steps)


def _contacts(equations: Equations, say: ExpressionPrinter) -> list[dict[str, Any]]:
    names = [c.name for c in equations.system.coordinates]
    return [
        {
            "name": contact.name,
            "gap": say(contact.closure.expression),
            "gradient": [
                {"coordinate": names[j], "entry": say(entry)}
                for j, entry in entries(contact.closure.gradient).items()
            ],
            "multiplier": contact.closure.multiplier.name,
            "restitution": say(contact.restitution),
        }
        for contact in equations.system.contacts
    ]


def _lagrange(equations: Equations, say: ExpressionPrinter) -> dict[str, Any]:
    rows = [display_terms(shown, say.words) for shown in equations.derivation.shown]
    return {"equations": _residuals(equations, rows, say)}


def _explicit(equations: Equations, say: ExpressionPrinter) -> dict[str, Any]:
    """Return the rows for coordinates, and those for the multipliers of closures."""
    explicit, right = explicit_form(equations), forcing_with_reactions(equations)
    rows = []
    for i, (c, value) in enumerate(
        zip(equations.system.coordinates, explicit.accelerations, strict=True)
    ):
        if value is not None:
            rows.append(_difference([c.a], value, say))
        else:
            row = entries(equations.system.mass_matrix[i]).items()
            left = [m * equations.system.coordinates[j].a for j, m in row]
            rows.append(_difference(left, right[i], say))
    return {
        "equations": _residuals(equations, rows, say),
        "multiplier_equations": [
            {
                "multiplier": closure.multiplier.name,
                "residual": say.tree(
                    display_row(differentiated(equations, closure), say.words)
                    if value is None
                    else _difference([closure.multiplier], value, say)
                ),
            }
            for closure, value in zip(equations.system.closures, explicit.multipliers, strict=True)
        ],
    }


def _residuals(
    equations: Equations, rows: Sequence[DisplayNode], say: ExpressionPrinter
) -> list[dict[str, str]]:
    return [
        {"coordinate": c.name, "residual": say.tree(row)}
        for c, row in zip(equations.system.coordinates, rows, strict=True)
    ]


def _difference(unknowns: Sequence[Expr], value: Expr, say: ExpressionPrinter) -> DisplayNode:
    """``Σ unknown − value``, the unknowns first."""
    left = [display(unknown, say.words) for unknown in unknowns]
    terms = [term for node in left for term in as_terms(node)]
    terms += [SignedNode(not t.negative, t.node) for t in as_terms(display(value, say.words))]
    return sum_of(terms, ordered=True)


def _predicted(equations: Equations) -> dict[str, int] | None:
    """Operations of a right-hand side in each formulation, where there are two."""
    choice = equations.derivation.choice
    if choice is None:
        return None
    return {"minimal": choice.minimal, "multiplier": choice.multiplier}


def _balance(equations: Equations, say: ExpressionPrinter) -> dict[str, str] | None:
    """The energy that is not conserved and its rate; None if it is conserved or that is long."""
    balance = equations.derivation.balance
    if balance is None:
        return None
    return {
        "name": balance.kind,
        "expression": say(equations.system.energy),
        "rate": say(balance.rate),
    }


def _input(source: Input, say: ExpressionPrinter) -> dict[str, Any]:
    """Return an input: its expression, or the file and column of its values."""
    record = source.recording
    if record is None:
        return {"name": source.name, "expression": say(source.expression)}
    where = {"file": record.file, "column": record.column, "interpolation": record.interpolation}
    return {"name": source.name, "expression": None, **where}
