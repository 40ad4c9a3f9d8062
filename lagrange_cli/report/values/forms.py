"""Other forms of the equations as JSON values, in the scene language."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from lagrange_cli.analysis.forms.hamiltonian import hamiltonian_form
from lagrange_cli.analysis.forms.routhian import routhian_form
from lagrange_cli.analysis.small_oscillations import small_oscillations
from lagrange_cli.mechanics.dynamics.accelerations import differentiated, explicit_form
from lagrange_cli.notation.build import display_row, display_sum
from lagrange_cli.notation.scene_language import ExpressionPrinter, matrix
from lagrange_cli.notation.vocabulary import with_symbols
from lagrange_cli.report.contents.forms.brackets import quantity_names
from lagrange_cli.report.contents.forms.contents import velocity_letter, with_velocities
from lagrange_cli.report.contents.forms.small_oscillations import ModeLetters, with_displacements
from lagrange_cli.report.contents.forms.writer import with_momenta

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sympy import Expr

    from lagrange_cli.analysis.forms.momenta import Momentum
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.findings import PoissonBrackets


#: Digits of numbers that have no closed form: those of doubles.
_DIGITS = 17


def hamiltonian_report(equations: Equations, say: ExpressionPrinter) -> dict[str, Any]:
    """H, the names of the momenta, and the canonical equations of each coordinate.

    ``velocity`` is None where the momenta determine velocities as a linear system; these stay in
    H and in the rates.
    """
    form = hamiltonian_form(equations)
    momenta = [pair.momentum for pair in form.pairs]
    say = _knowing(say, momenta)
    return {
        "hamiltonian": _total(say, form.parts),
        "momenta": [m.name for m in momenta],
        "canonical": [
            {
                "coordinate": pair.momentum.coordinate.name,
                "momentum": pair.momentum.name,
                "definition": say(pair.momentum.expression),
                "velocity": None if pair.velocity is None else say(pair.velocity),
                "rate": _total(say, pair.rate),
            }
            for pair in form.pairs
        ],
        "hamiltonian_facts": {
            "is_energy_sum": form.is_sum,
            "conserved": form.conserved is not None,
            "certificate": asdict(form.certificate),
        },
        **bracket_report(equations.derivation.brackets, say),
    }


def bracket_report(brackets: PoissonBrackets | None, say: ExpressionPrinter) -> dict[str, Any]:
    """Return the brackets in the scene language; empty if none were asked for."""
    if brackets is None:
        return {}
    names = [(symbol, name, None) for symbol, name in quantity_names(brackets).items()]
    say = say.knowing(with_symbols(say.words, names))
    return {
        "brackets": [
            {
                "first": say(b.first),
                "second": say(b.second),
                "value": say(b.value),
                "rate": None if b.rate is None else say(b.rate),
                "conserved": b.conserved,
            }
            for b in brackets.brackets
        ],
        "quantities": {q.name: say(q.expression) for q in brackets.quantities},
        "bracket_certificate": asdict(brackets.certificate),
    }


def routhian_report(equations: Equations, say: ExpressionPrinter) -> dict[str, Any]:
    """R, V_eff and the equations of the coordinates that are not ignored."""
    form = routhian_form(equations)
    say = _knowing(say, form.momenta)
    return {
        "coordinates": [c.name for c in form.coordinates],
        "ignored": [m.coordinate.name for m in form.momenta],
        "momenta": [m.name for m in form.momenta],
        "routhian": say(form.expression),
        "effective_potential": _total(say, form.potential),
        "gyroscopic": say(form.gyroscopic),
        "equations": [
            {"coordinate": c.name, "residual": say.tree(display_row(shown, say.words))}
            for c, shown in zip(form.coordinates, form.shown, strict=True)
        ],
        "mass_matrix": matrix(form.mass_matrix, say),
        "forcing": [say(f) for f in form.forcing],
        "recovered": [
            {
                "coordinate": m.coordinate.name,
                "momentum": m.name,
                "definition": say(m.expression),
                "velocity": say(velocity),
                "start": form.start[k] if form.start else None,
            }
            for k, (m, velocity) in enumerate(zip(form.momenta, form.velocities, strict=True))
        ],
        "routhian_certificate": asdict(form.certificate),
    }


def first_order_report(equations: Equations, say: ExpressionPrinter) -> dict[str, Any]:
    """Return names of the velocities, and the rate of each state.

    Those that are not solved for have null, and their equations stand in ``coupled``.
    """
    letter = velocity_letter(equations)
    say = say.knowing(with_velocities(say.words, equations, letter))
    solved = explicit_form(equations)
    pairs = list(zip(equations.system.coordinates, solved.accelerations, strict=True))
    closures = list(zip(equations.system.closures, solved.multipliers, strict=True))
    names = {c.name: f"{letter}_{c.name}" for c in equations.system.coordinates}
    return {
        "first_order": {
            "velocities": names,
            "rates": [
                *({"state": name, "rate": velocity} for name, velocity in names.items()),
                *(
                    {"state": names[c.name], "rate": None if value is None else say(value)}
                    for c, value in pairs
                ),
            ],
            "multipliers": [
                {"name": closure.multiplier.name, "value": None if value is None else say(value)}
                for closure, value in closures
            ],
            "coupled": [
                *(
                    say.tree(display_row(shown, say.words))
                    for (_, value), shown in zip(pairs, equations.derivation.shown, strict=True)
                    if value is None
                ),
                *(
                    say.tree(display_row(differentiated(equations, closure), say.words))
                    for closure, value in closures
                    if value is None
                ),
            ],
        }
    }


def small_oscillations_report(equations: Equations, say: ExpressionPrinter) -> dict[str, Any]:
    """Quadratic energies, linear equations and normal modes at an equilibrium."""
    form = small_oscillations(equations, _DIGITS)
    letters = ModeLetters.of(equations, form)
    say = say.knowing(with_displacements(say.words, form, letters))
    stability = form.at.stability
    return {
        "small_oscillations": {
            "at": {c.name: say(x) for c, x in zip(form.coordinates, form.rest_values, strict=True)},
            "stability": None if stability is None else stability.verdict,
            "displacements": [d.name for d in form.displacements],
            "kinetic": _total(say, form.kinetic),
            "potential": _total(say, form.potential) if form.potential else None,
            "M": [[say(e) for e in row] for row in form.mass],
            "C": [[say(e) for e in row] for row in form.damping],
            "K": [[say(e) for e in row] for row in form.stiffness],
            "equations": [
                {"coordinate": d.name, "residual": say.tree(display_row(shown, say.words))}
                for d, shown in zip(form.displacements, form.shown, strict=True)
            ],
            "modes": [
                {
                    "frequency": mode.frequency,
                    "square": say(mode.square),
                    "shape": [say(x) for x in mode.shape],
                    "closed": mode.is_closed,
                }
                for mode in form.modes
            ],
            "poles": [[s.real, s.imag] for s in form.poles],
        }
    }


def _knowing(say: ExpressionPrinter, momenta: Sequence[Momentum]) -> ExpressionPrinter:
    return say.knowing(with_momenta(say.words, momenta))


def _total(say: ExpressionPrinter, parts: Sequence[Expr]) -> str:
    """Return the sum of terms in their order; 0 without any."""
    return say.tree(display_sum(parts, say.words)) if parts else "0"
