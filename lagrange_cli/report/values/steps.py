"""The steps of a derivation as JSON values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lagrange_cli.analysis.equilibria.laws import laws_of_equilibrium
from lagrange_cli.analysis.equilibria.rest_system import rest_system
from lagrange_cli.notation.scene_language import ScenePrinter
from lagrange_cli.report.contents.steps.writer import StepsWriter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from sympy import Expr, Symbol

    from lagrange_cli.analysis.values import Equilibrium
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.step_values import BodySteps, DerivationSteps, ForceSteps, TermSteps


def closed_form(
    point: Equilibrium, names: Sequence[str], say: Callable[[Expr], str]
) -> dict[str, Any]:
    """Return an equilibrium in closed form, with the conditions for it to exist, as JSON values.

    ``names``: those of the coordinates; ``say`` writes an expression.
    """
    pairs = zip(names, map(say, point.exact or ()), strict=False)
    return {
        "exact": None if point.exact is None else dict(pairs),
        "exists": [f"{say(c.smaller)} {c.relation} {say(c.larger)}" for c in point.conditions],
        "free": list(point.free),
    }


def steps_report(equations: Equations, steps: DerivationSteps) -> dict[str, Any]:
    """Return the steps as a JSON value; expressions are in the scene language."""
    return {"steps": _Reporter(StepsWriter(equations, steps=steps)).report()}


class _Reporter:
    def __init__(self, writer: StepsWriter) -> None:
        self._writer = writer
        self._printer = ScenePrinter()

    def _say(self, expression: Expr) -> str:
        return self._printer.inline(self._writer.tree(expression))

    def report(self) -> dict[str, Any]:
        steps, equations = self._writer.steps, self._writer.equations
        names = [c.name for c in equations.system.coordinates]
        return {
            "by": steps.way,
            "bodies": [self._body(body) for body in steps.bodies],
            "kinetic": [self._term(term) for term in steps.kinetic],
            "potentials": [self._term(term) for term in steps.potentials],
            "forces": [self._force(force) for force in steps.forces],
            "coordinates": [
                {
                    "coordinate": shown.coordinate,
                    "momentum": self._say(parts.momentum),
                    "momentum_rate": self._say(parts.momentum_rate),
                    "lagrangian_slope": self._say(parts.slope),
                    "dissipation_slope": self._say(parts.drag),
                    "residual": self._say(parts.residual),
                    "divided_by": self._say(shown.divided_by),
                }
                for parts, shown in zip(steps.coordinates, equations.derivation.shown, strict=True)
            ],
            "virtual_work": [
                {
                    "coordinate": name,
                    "inertia": self._say(parts.inertia),
                    "work": self._say(parts.work),
                    "in_coordinates": self._say(parts.coordinates),
                }
                for name, parts in zip(names, steps.balances, strict=False)
            ],
            **({} if steps.of_motion else {"equilibrium": self._equilibrium()}),
            "certificate": {
                "points": steps.states,
                "digits": equations.derivation.certificate.digits,
                "mismatch": steps.mismatch,
                "difference": steps.difference,
            },
        }

    def _equilibrium(self) -> dict[str, Any]:
        """Return the equilibria in closed form, for all values of the parameters."""
        forms = laws_of_equilibrium(rest_system(self._writer.equations, {}))
        names = [c.name for c in self._writer.equations.system.coordinates]
        return {
            "points": [closed_form(p, names, self._say) for p in (forms.points if forms else ())],
            "complete": forms is not None and forms.complete,
            "nonzero": list(forms.nonzero) if forms else [],
        }

    def _body(self, body: BodySteps) -> dict[str, Any]:
        return {
            "name": body.name,
            "mass": None if body.mass is None else self._say(body.mass),
            "speed_squared": None if body.square is None else self._say(body.square),
            "components": [
                {
                    "name": part.name,
                    "position": self._say(part.position),
                    "partials": self._by_symbol(part.partials),
                    "velocity": self._say(part.velocity),
                    "acceleration": self._say(part.acceleration),
                    "force": self._say(part.force),
                }
                for part in body.components
            ],
        }

    def _term(self, term: TermSteps) -> dict[str, str]:
        return {
            "name": term.name,
            "written": self._say(term.written),
            "expression": self._say(term.resolved),
        }

    def _force(self, force: ForceSteps) -> dict[str, Any]:
        return {
            "name": force.name,
            "on": force.on,
            "components": {name: self._say(e) for name, e in force.components},
            "generalized": self._by_symbol(force.generalized),
        }

    def _by_symbol(self, values: Iterable[tuple[Symbol, Expr]]) -> dict[str, str]:
        return {symbol.name: self._say(value) for symbol, value in values}
