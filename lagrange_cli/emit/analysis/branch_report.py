"""Branches of equilibria as JSON values."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from lagrange_cli.analysis.branches.values import Branch, Branches, MarkedPoint


def branches_report(found: Branches | None, names: Sequence[str]) -> dict[str, Any]:
    """Return branches as values that JSON can hold; nothing if they were not asked for.

    ``names``: those of all coordinates.
    """
    if found is None:
        return {}
    return {
        "branches": {
            "parameter": found.parameter,
            "from": found.low,
            "to": found.high,
            "values": found.values,
            "starts": found.starts,
            "skipped": found.skipped,
            "left": found.left,
            "held": dict(found.held),
            "free": list(found.free),
            "marks": [_mark(mark, names) for mark in found.marks],
            "curves": [_branch(branch, found.parameter, names) for branch in found.branches],
        }
    }


def _mark(mark: MarkedPoint, names: Sequence[str]) -> dict[str, Any]:
    return {
        "kind": mark.kind,
        "value": mark.value,
        "error": mark.error,
        "at": dict(zip(names, mark.position, strict=True)),
        "frequency": mark.frequency,
    }


def _branch(branch: Branch, parameter: str, names: Sequence[str]) -> dict[str, Any]:
    columns = zip(names, branch.positions.T.tolist(), strict=True)
    poles = [_pole(column) for column in branch.locus.poles.T]
    return {
        "ends": list(branch.ends),
        "points": {parameter: branch.values.tolist(), **dict(columns)},
        "poles": {parameter: branch.locus.values.tolist(), "columns": poles},
        "marks": [{"point": k, "mark": number} for k, number in branch.marks],
        "stretches": [
            {
                "first": s.first,
                "last": s.last,
                "stability": s.stability.verdict,
                "reason": s.stability.reason,
            }
            for s in branch.stretches
        ],
    }


def _pole(column: NDArray[np.complex128]) -> dict[str, list[float | None]]:
    parts = {"real": column.real.tolist(), "imag": column.imag.tolist()}
    return {
        name: [x if math.isfinite(x) else None for x in values] for name, values in parts.items()
    }
