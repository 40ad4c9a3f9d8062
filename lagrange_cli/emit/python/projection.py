"""Python code of systems with closures: a solver, and ``project``."""

from __future__ import annotations

from collections.abc import Collection

from lagrange_cli.emit.constants import (
    LARGEST_EXPONENT,
    LEAST_INERTIA,
    NEWTON_STEPS,
    RESIDUAL_AT_REST,
    RESIDUAL_ROUNDING,
    UNEVEN_PIVOT,
)
from lagrange_cli.emit.python.styles import NUMBERS, Style, many_lines
from lagrange_cli.emit.template_files import filled, python_template

#: Functions that evaluators and ``project`` call, by the names of their templates: those that call
#: others first.
HELPERS = (
    "solve_saddle",
    "solve_banded",
    "solve_definite",
    "solve_symmetric",
    "solve_sparse",
    "solve_columns",
    "coupled_residual",
    "residual",
)

#: Token → text in all templates.
_CONSTANTS = {
    "@UNEVEN@": repr(UNEVEN_PIVOT),
    "@SMALL@": repr(LEAST_INERTIA),
    "@WIDEST@": str(LARGEST_EXPONENT),
}


def helper_source(name: str) -> str:
    """Return the definition of a helper, with functions that it alone calls."""
    return filled(python_template(name), _CONSTANTS)


def project_source(
    functions: Collection[str], parameter: str, kind: str = "", style: Style = NUMBERS
) -> str:
    """Return the definition of ``project``; empty if there are no closures.

    Parameters
    ----------
    functions
        The other functions of the module.
    parameter
        The text of the last argument (``p``, or ``p=DEFAULTS``).
    kind
        ``contact_`` for the projection onto closures and closed contacts; else empty.
    style
        What the function runs over; of many states each is projected by itself.
    """
    if f"{kind}velocity_change" not in functions:
        return ""
    has_positions = f"{kind}position_change" in functions
    positions = python_template("project_positions") if has_positions else ""
    apart = parameter.endswith("contact")
    name = f"_{kind}project" if apart else f"{kind}project"
    many = many_lines(name, parameter, ", few=inf") if style.takes_arrays else []
    replacements = {
        "@MANY@": "".join(f"{line}\n" for line in many),
        "@LED@": positions,
        "@NAME@": name,
        "@OF@": kind,
        "@CALL@": "p, contact" if apart else "p",
        "@P@": parameter,
        "@ROUNDS@": str(NEWTON_STEPS),
        "@NEAR@": repr(RESIDUAL_AT_REST),
        "@FAR@": repr(RESIDUAL_ROUNDING),
    }
    return filled(python_template("project"), replacements)
