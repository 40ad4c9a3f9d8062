"""Canonical equations in emitted C: functions of [q, p] around those of [q, v]."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from lagrange_cli.emit.c.projection import workspace_size
from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.emit.canonical import momentum_names
from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.template_files import c_template
from lagrange_cli.program.program import Program

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Numbers of the function ``energy``, of which the last is H.
_ENERGIES = 3


def canonical_workspace_size(programs: Mapping[str, Program], coordinates: int) -> int:
    """Numbers of workspace with a state [q, v] and energies."""
    return workspace_size(programs) + 2 * coordinates + _ENERGIES


def canonical_declarations(equations: Equations, target: CTarget) -> str:
    """Declare the functions, with their comments."""
    n = len(equations.coordinates)
    momenta = "\n".join(
        f" *   z[{n + k}]  {comment_text(name)}" for k, name in enumerate(momentum_names(equations))
    )
    text = c_template("interface_canonical").replace("@MOMENTA@", momenta)
    return "\n" + _filled(text, target)


def canonical_text(equations: Equations, target: CTarget) -> str:
    """Define the functions."""
    n = len(equations.coordinates)
    text = c_template("canonical")
    replacements = {"@N@": str(n), "@BEHIND@": str(2 * n), "@ENERGIES@": str(_ENERGIES)}
    for token, value in replacements.items():
        text = text.replace(token, value)
    return target.fill(_filled(text, target))


def _filled(text: str, target: CTarget) -> str:
    """Put in lists of arguments, of which the state is z or y and the result named."""
    for token, state, result in (
        ("@TO@", "y", "z"),
        ("@FROM@", "z", "y"),
        ("@RATES@", "z", "dzdt"),
        ("@H@", "z", "out"),
    ):
        text = text.replace(
            token, target.arguments(result).replace("*y, const", f"*{state}, const")
        )
    return text
