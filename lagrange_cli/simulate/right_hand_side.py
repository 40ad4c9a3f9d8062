"""Equations → RightHandSide: compiled functions of t and y alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lagrange_cli.emit.python_functions import right_hand_side_source
from lagrange_cli.simulate.disturbance import disturb, off_by_one_ulp
from lagrange_cli.simulate.integrators.base import Array, Rhs

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

__all__ = ["RightHandSide", "compile_right_hand_side"]


@dataclass(frozen=True)
class RightHandSide:
    """Functions of t and y = [q, q̇], parameters bound.

    ``rhs`` gives [q̇, q̈], shape (2n,); ``disturbed`` two more of the same, with
    parameters and operations off by their rounding error; ``energy`` Σ q̇ ∂L/∂q̇ − L;
    ``positions`` and ``velocities`` the scene's Cartesian names. NaN stands
    for what does not exist.
    """

    rhs: Rhs
    disturbed: tuple[Rhs, Rhs]
    energy: Callable[[float, Array], float]
    positions: Rhs
    velocities: Rhs


def compile_right_hand_side(equations: Equations) -> RightHandSide:
    """Compile the equations for the parameters' values, all of which must be known.

    What is executed is made of names and numbers that the program chose: no
    text of a scene is in it.
    """
    values = [parameter.value for parameter in equations.parameters]
    given = [0.0 if value is None else float(value) for value in values]
    functions = _executed(right_hand_side_source(equations))
    return RightHandSide(
        rhs=_bound(functions["rhs"], given),
        disturbed=(_disturbed(equations, given, 1), _disturbed(equations, given, 2)),
        energy=_bound(functions["energy"], given),
        positions=_bound(functions["positions"], given),
        velocities=_bound(functions["velocities"], given),
    )


def _disturbed(equations: Equations, given: list[float], pattern: int) -> Rhs:
    source = right_hand_side_source(equations, ("rhs",), lambda p: disturb(p, pattern))
    return _bound(_executed(source)["rhs"], off_by_one_ulp(given, pattern).tolist())


def _executed(source: str) -> dict[str, Any]:
    namespace: dict[str, Any] = {}
    exec(compile(source, "<right-hand side>", "exec"), namespace)
    return namespace


def _bound(function: Callable[..., Any], parameters: list[float]) -> Callable[[float, Array], Any]:
    return lambda t, y: function(t, y, parameters)
