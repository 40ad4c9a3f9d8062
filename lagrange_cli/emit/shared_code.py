"""Parts of emitted code that languages share: recorded inputs, canonical programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.files.interpolation import Polynomials, polynomials
from lagrange_cli.program.emitted_functions import canonical_programs
from lagrange_cli.program.program import Program

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations

#: Numbers of a recording that are written into code.
MOST_WRITTEN = 100_000

#: How far beyond a recording, as a part of it, rounding of times may lead.
RECORDED_ROUNDING = 1e-9


def recorded_inputs(equations: Equations) -> list[tuple[int, Polynomials]]:
    """Return the recorded inputs by number.

    Raises
    ------
    InputError
        Located: one of them is too long to be written into code, or cannot be read.
    """
    recordings = [
        (number, polynomials(source.recording).rates(source.order))
        for number, source in enumerate(equations.system.inputs)
        if source.recording is not None
    ]
    for _, pieces in recordings:
        if pieces.coefficients.size > MOST_WRITTEN:
            raise InputError(
                Problem(
                    f"'{pieces.recording.file}' is too long to be written into code:"
                    f" {pieces.coefficients.size:,} numbers, the most are {MOST_WRITTEN:,}",
                    pieces.recording.mark,
                    hint="lagrange simulate reads it whole; the functions of emitted C"
                    " take inputs from their caller",
                    rule="limit",
                )
            )
    return recordings


def polynomial_rows(pieces: Polynomials) -> list[tuple[float, ...]]:
    """List the start and the coefficients of each piece, lowest first."""
    rows = zip(pieces.starts, pieces.coefficients, strict=True)
    return [(float(start), *map(float, coefficients)) for start, coefficients in rows]


def described_input(equations: Equations, number: int) -> str:
    source: Any = equations.system.inputs[number]
    return f"{source.name}: {source.recording.described}"


def input_lines(equations: Equations) -> list[str]:
    """Return a line for each input, with where it is recorded, or that a controller holds it."""
    held_names = {name for c in equations.system.controllers for name, _ in c.held_inputs}
    lines = []
    for number, source in enumerate(equations.system.inputs):
        if source.recording is not None:
            lines.append(described_input(equations, number))
        elif source.name in held_names:
            lines.append(f"{source.name}: held by a controller of the scene; 0 until you set it")
        else:
            lines.append(source.name)
    return lines


def switch_places(equations: Equations) -> tuple[int, ...]:
    """Return the places of the states with two values in a state y."""
    system = equations.system
    numbers = (k for k, state in enumerate(system.states) if state.switch is not None)
    return tuple(system.layout.place("z", k) for k in numbers)


def programs_of_momenta(equations: Equations) -> dict[str, Program]:
    """Programs of :mod:`lagrange_cli.program.emitted_functions`.

    Velocities are solved for with the mass matrix, or have a closed form where L is not quadratic
    in them.

    Raises
    ------
    InputError
        There are multipliers or states, or momenta do not determine the velocities.
    """
    # Here and not above: simulation prints C too, and never this.
    from lagrange_cli.analysis.forms.hamiltonian import hamiltonian_form
    from lagrange_cli.analysis.forms.legendre import is_quadratic

    if equations.system.pushing:
        name = equations.system.pushing[0].name
        message = (
            "canonical equations are emitted where no constraint is kept with a multiplier, as"
            f" '{name}' is here"
        )
        hint = "--formulation minimal finds coordinates that obey constraints, where there are some"
        raise _refused(equations, message, hint)
    if equations.system.states:
        message = f"the state '{equations.system.states[0].name}' has no momentum"
        hint = "emit the equations of motion, without --with canonical"
        raise _refused(equations, f"canonical equations are not emitted: {message}", hint)
    if is_quadratic(equations, range(len(equations.system.coordinates))):
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
    return InputError(Problem(message, Mark(equations.presentation.file, 1, 1), hint, "canonical"))


def momentum_names(equations: Equations) -> list[str]:
    """Return names of the momenta, in the order of the coordinates."""
    from lagrange_cli.analysis.forms.momenta import momentum_letter

    letter = momentum_letter(equations)
    return [f"{letter}_{c.name}" for c in equations.system.coordinates]
