"""Programs as the functions that simulation interprets."""

from __future__ import annotations

from collections.abc import Mapping

from lagrange_cli.program.lowered.lowering import lowered
from lagrange_cli.program.program import Program
from lagrange_cli.simulate.system.tracing import InterpretedFunctions


def interpreted(programs: Mapping[str, Program]) -> InterpretedFunctions:
    """The functions by name, of t, y, p and u."""
    return InterpretedFunctions({name: lowered(p, name) for name, p in programs.items()})
