"""Branches of equilibria as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, get_args

import numpy as np

from lagrange_cli.analysis.branches.values import EndKind, MarkKind
from lagrange_cli.report.values.expressions import (
    VERDICT,
    coordinate_names,
)
from lagrange_cli.report.values.json_types import (
    INTEGER,
    MAYBE_NUMBER,
    NAMES,
    NUMBER,
    TEXT,
    ConvertedType,
    JsonObject,
    Key,
    by_name,
    list_of,
    one_of,
    through,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lagrange_cli.analysis.branches.values import Branch, Branches, MarkedPoint, Stretch
    from lagrange_cli.analysis.result import Analysis


class _Mark(NamedTuple):
    mark: MarkedPoint
    names: Sequence[str]

    @property
    def at(self) -> dict[str, float]:
        return dict(zip(self.names, self.mark.position, strict=True))


class _Curve(NamedTuple):
    """A branch with the names of the parameter and of all coordinates."""

    branch: Branch
    parameter: str
    names: Sequence[str]

    @property
    def points(self) -> dict[str, Any]:
        columns = dict(zip(self.names, self.branch.positions.T, strict=True))
        return {self.parameter: self.branch.values} | columns


_MARK: JsonObject[_Mark] = JsonObject(
    *through(
        lambda value: value.mark,
        Key("kind", one_of(*get_args(MarkKind)), "Its kind."),
        Key("value", NUMBER, "The parameter there."),
        Key("error", NUMBER, "Estimated error of that."),
    ),
    Key(
        "at",
        by_name(NUMBER),
        "All coordinates.",
        lambda value: value.at,
    ),
    Key(
        "frequency",
        MAYBE_NUMBER,
        "Angular frequency of the oscillation that begins at flutter, else null.",
        lambda value: value.mark.frequency,
    ),
)
_POLE: JsonObject[NDArray[np.complex128]] = JsonObject(
    Key("real", list_of(MAYBE_NUMBER), "Real parts; null where there are fewer poles."),
    Key("imag", list_of(MAYBE_NUMBER), "Imaginary parts; null where there are fewer poles."),
)
_POLES = ConvertedType(
    {
        "type": "object",
        "properties": {
            "columns": list_of(_POLE).schema | {"description": "Poles that move with it."}
        },
        "required": ["columns"],
        "additionalProperties": list_of(NUMBER).schema | {"description": "The parameter."},
    },
    lambda curve, say: {
        curve.parameter: curve.branch.locus.values.tolist(),
        "columns": list_of(_POLE).write(list(curve.branch.locus.poles.T), say),
    },
)
_ON_CURVE: JsonObject[tuple[int, int]] = JsonObject(
    Key("point", INTEGER, "Number of the point on the curve.", lambda pair: pair[0]),
    Key("mark", INTEGER, "Number of the mark there, from 0.", lambda pair: pair[1]),
)
_STRETCH: JsonObject[Stretch] = JsonObject(
    Key("first", INTEGER, "Number of its first point."),
    Key("last", INTEGER, "Number of its last point."),
    Key("stability", VERDICT, "What is proven of points within.", lambda s: s.stability.verdict),
    Key("reason", TEXT, "The theorem that proves this.", lambda s: s.stability.reason),
)
_CURVE: JsonObject[_Curve] = JsonObject(
    Key(
        "ends",
        list_of(one_of(*get_args(EndKind)), 2),
        "How it ends on both sides; branch point: it begins at one; pole: forces grow without"
        " bound.",
        lambda curve: curve.branch.ends,
    ),
    Key("points", by_name(list_of(NUMBER)), "The parameter and all coordinates."),
    Key("poles", _POLES, "The poles along it.", lambda curve: curve),
    Key("marks", list_of(_ON_CURVE), "The marks on it.", lambda curve: curve.branch.marks),
    Key(
        "stretches",
        list_of(_STRETCH),
        "Its parts; points within the error of a mark are in none.",
        lambda curve: curve.branch.stretches,
    ),
)


class NamedBranches(NamedTuple):
    """Branches with the names of all coordinates."""

    branches: Branches
    names: Sequence[str]


BRANCHES: JsonObject[NamedBranches] = JsonObject(
    *through(
        lambda value: value.branches,
        Key("parameter", TEXT, "Its name."),
        Key("from", NUMBER, "Begin of its range.", lambda branches: branches.low),
        Key("to", NUMBER, "End of its range.", lambda branches: branches.high),
        Key("values", INTEGER, "Number of values at which equilibria were sought."),
        Key("starts", INTEGER, "Number of starts of these searches."),
        Key("skipped", INTEGER, "Number of equilibria that are degenerate."),
        Key(
            "left", INTEGER, "Number of those that were not followed since there were 32 branches."
        ),
        Key(
            "held",
            by_name(NUMBER),
            "Inputs that vary with time, and their values here.",
            lambda branches: branches.held_inputs,
        ),
        Key("free", NAMES, "Coordinates that may have any value."),
    ),
    Key(
        "marks",
        list_of(_MARK),
        "Marked points of all branches, by the parameter.",
        lambda value: [_Mark(mark, value.names) for mark in value.branches.marks],
    ),
    Key(
        "curves",
        list_of(_CURVE),
        "The branches.",
        lambda value: [
            _Curve(branch, value.branches.parameter, value.names)
            for branch in value.branches.branches
        ],
    ),
)


def named_branches(analysis: Analysis) -> NamedBranches | None:
    """Return the branches of an analysis, None without any."""
    branches = analysis.branches
    return (
        None if branches is None else NamedBranches(branches, coordinate_names(analysis.equations))
    )
