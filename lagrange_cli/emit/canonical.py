"""Canonical equations that emitted code has beside Lagrange's: which can be, and their names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.program.emitted_functions import canonical_programs
from lagrange_cli.program.program import Program

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations


def programs_of_momenta(equations: Equations) -> dict[str, Program]:
    """Programs of :mod:`lagrange_cli.program.emitted_functions`.

    Velocities are solved for with the mass matrix, or have a closed form where L is not quadratic
    in them.

    Raises
    ------
    InputError
        There are multipliers, or momenta do not determine the velocities.
    """
    # Here and not above: simulation prints C too, and never this.
    from lagrange_cli.analysis.forms.hamiltonian import hamiltonian_form
    from lagrange_cli.analysis.forms.legendre import is_quadratic

    if equations.pushing:
        name = equations.pushing[0].name
        message = (
            "canonical equations are emitted where no constraint is kept with a multiplier, as"
            f" '{name}' is here"
        )
        hint = "--formulation minimal finds coordinates that obey constraints, where there are some"
        raise _refused(equations, message, hint)
    if is_quadratic(equations, range(len(equations.coordinates))):
        return canonical_programs(equations)
    form = hamiltonian_form(equations)
    places = {p.momentum.symbol: p.momentum.coordinate.v for p in form.pairs}
    velocities: list[Expr] = [
        p.velocity.xreplace(places) for p in form.pairs if p.velocity is not None
    ]
    if len(velocities) < len(form.pairs):
        raise _refused(equations, "velocities have no closed form over the momenta", "")
    return canonical_programs(equations, velocities)


def _refused(equations: Equations, message: str, hint: str) -> InputError:
    return InputError(Problem(message, Mark(equations.file, 1, 1), hint, "canonical"))


def momentum_names(equations: Equations) -> list[str]:
    """Names of the momenta, in the order of the coordinates."""
    from lagrange_cli.analysis.forms.momenta import momentum_letter

    letter = momentum_letter(equations)
    return [f"{letter}_{c.name}" for c in equations.coordinates]
