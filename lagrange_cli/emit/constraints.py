"""The functions that emitted code has more of where closure equations are kept.

``multipliers`` and ``constraints`` belong to the interface. The others are what
``project`` is made of: changes of q and of v that lead back to the closures,
and the residuals with the sums of magnitudes that tell them from rounding.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.emit.program import Program, build_program

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

__all__ = ["INTERNAL", "constraint_programs"]

#: Function → outputs that it writes, one after the other.
_OUTPUTS: dict[str, tuple[str, ...]] = {
    "multipliers": ("multipliers",),
    "constraints": ("closures", "closure_rates"),
    "position_error": ("closures", "closure_sizes"),
    "position_change": ("position_change",),
    "velocity_error": ("closure_rates", "closure_rate_sizes"),
    "velocity_change": ("velocity_change",),
}

#: Functions that only ``project`` calls.
INTERNAL = frozenset({"position_error", "position_change", "velocity_error", "velocity_change"})


def constraint_programs(equations: Equations) -> dict[str, Program]:
    """Function → program; none in minimal scenes, none for positions without such closures."""
    kinds = {closure.kind for closure in equations.closures}
    return {
        function: build_program(equations, outputs)
        for function, outputs in _OUTPUTS.items()
        if kinds and ("position" in kinds or not function.startswith("position_"))
    }
