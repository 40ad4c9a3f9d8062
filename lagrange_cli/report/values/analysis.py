"""An analysis as JSON: what ``lagrange analyze --json`` writes.

Closed forms are in the scene language, so that they can be read back.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from lagrange_cli.notation.printers.scene import ScenePrinter
from lagrange_cli.notation.scene_language import ExpressionPrinter
from lagrange_cli.notation.vocabulary import vocabulary
from lagrange_cli.report.contents.analysis.contacts import with_results
from lagrange_cli.report.values.branches import BRANCHES, named_branches
from lagrange_cli.report.values.equilibria import EQUILIBRIA, STEADY, found_equilibria
from lagrange_cli.report.values.expressions import (
    coordinate_names,
)
from lagrange_cli.report.values.json_types import (
    BOOLEAN,
    EXPRESSION,
    INTEGER,
    MAYBE_NUMBER,
    NAMES,
    NUMBER,
    REASON,
    TEXT,
    ConvertedType,
    JsonObject,
    Key,
    by_name,
    list_of,
    optional,
    or_null,
    through,
)
from lagrange_cli.report.values.linear import (
    ALONG,
    EXPONENTS,
    LINEARIZATION,
    MODE,
    RESPONSE,
    SAMPLED,
    named_linearization,
)

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.analysis.contacts.loss import ContactLoss, ContactLosses
    from lagrange_cli.analysis.contacts.zeros import Zero
    from lagrange_cli.analysis.result import Analysis, LeftOut
    from lagrange_cli.analysis.symmetries.linear_symmetries import Symmetries


def analysis_report(analysis: Analysis) -> dict[str, Any]:
    """Return an analysis as values that JSON can hold.

    Parts that were not asked for, or are left out, are null or missing.
    """
    words = with_results(analysis, vocabulary(analysis.equations))
    return ANALYSIS.write(analysis, ExpressionPrinter(words, ScenePrinter()))


# Conserved quantities.


class _Conserved(NamedTuple):
    """A conserved quantity; ``field``: displacements of a symmetry, None of cyclic coordinates."""

    name: str
    expression: Expr
    symmetry: str
    field: dict[str, Expr] | None = None


def _conserved(analysis: Analysis) -> list[_Conserved]:
    names, symmetries = coordinate_names(analysis.equations), analysis.symmetries
    conserved = analysis.equations.derivation.conserved
    return [_Conserved(c.name, c.expression, c.reason) for c in conserved] + [
        _Conserved(
            s.name,
            s.expression,
            s.described(names),
            {n: x for n, x in zip(names, s.field, strict=True) if x != 0},
        )
        for s in (symmetries.proven if symmetries else ())
    ]


_CONSERVED: JsonObject[_Conserved] = JsonObject(
    Key("name", TEXT, "Its name."),
    Key("expression", EXPRESSION, "The quantity."),
    Key("symmetry", TEXT, "Why it is conserved."),
    Key(
        "field",
        by_name(EXPRESSION),
        "The displacement ξ of each coordinate that a symmetry moves.",
        optional=True,
    ),
)
_SYMMETRIES: JsonObject[Symmetries] = JsonObject(
    Key("matrices", BOOLEAN, "True if ξ was looked for with a matrix.", lambda s: s.complete),
    Key("unproven", INTEGER, "Number of symmetries in numbers that could not be proven."),
)

# Contacts.

_EQUALITY = ConvertedType(TEXT.schema, lambda sides, say: " = ".join(map(say, sides)))
_ZERO: JsonObject[Zero] = JsonObject(
    Key("condition", _EQUALITY, "The place.", lambda zero: (zero.left, zero.right)),
    Key("angle", or_null(_EQUALITY), "The same of an output that is the angle, or null."),
    Key(
        "value",
        MAYBE_NUMBER,
        "The right side in numbers; null of a condition that is not solved.",
        lambda zero: zero.number,
    ),
)
_CLOSED: JsonObject[ContactLoss] = JsonObject(
    Key("name", TEXT, "Name of the constraint."),
    Key("force", EXPRESSION, "Its force without velocities."),
    Key("at_start", MAYBE_NUMBER, "The force at the start, 0 if that is rounding; null without."),
    Key("zeros", list_of(_ZERO), "Places at which it vanishes."),
    Key("reason", REASON, "Why velocities remain; null if none do."),
    Key(
        "continuous", BOOLEAN, "True if it is proven to be continuous.", lambda loss: not loss.jumps
    ),
)
_CONTACTS: JsonObject[ContactLosses] = JsonObject(
    Key("closed", list_of(_CLOSED), "Contacts closed at the start.", lambda c: c.contacts),
    Key(
        "constants",
        by_name(NUMBER),
        "Constants of the start in these.",
        lambda losses: {c.symbol.name: c.value for c in losses.constants},
    ),
)

# The whole.

_LEFT_OUT: JsonObject[LeftOut] = JsonObject(
    Key("part", TEXT, "The part."), Key("reason", TEXT, "Why it has no result.")
)
ANALYSIS: JsonObject[Analysis] = JsonObject(
    Key("name", TEXT, "Name of the scene.", lambda a: a.equations.presentation.name),
    Key("coordinates", NAMES, "Names of the coordinates.", lambda a: coordinate_names(a.equations)),
    Key("cyclic", NAMES, "Cyclic coordinates.", lambda a: a.equations.derivation.cyclic),
    Key("conserved", list_of(_CONSERVED), "Conserved quantities.", _conserved),
    Key("symmetries", or_null(_SYMMETRIES), "How symmetries were looked for, if they were."),
    Key("steady", or_null(STEADY), "The reduced system of --steady, else null."),
    *through(found_equilibria, *EQUILIBRIA),
    Key(
        "linearization",
        or_null(LINEARIZATION),
        "The linear system, or null.",
        named_linearization,
    ),
    Key("modes", or_null(list_of(MODE)), "Its modes, or null."),
    Key("left_out", list_of(_LEFT_OUT), "Parts without a result."),
    *optional(
        Key("lyapunov", EXPONENTS, "With --lyapunov: exponents.", lambda a: a.exponents),
        Key("branches", BRANCHES, "With --branches: branches of equilibria.", named_branches),
        Key("along", ALONG, "With --along: the linear system along a motion."),
        Key("response", RESPONSE, "With --response: frequency responses."),
        Key("contacts", _CONTACTS, "Forces of contacts and where they vanish."),
        Key("sampled", SAMPLED, "With controllers: the linear system from sample to sample."),
    ),
)
