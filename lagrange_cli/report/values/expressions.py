"""JSON types of expressions, equations and matrices, which a printer writes in its language."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, get_args

from lagrange_cli.analysis.values import Verdict
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.notation.build import display_sum, display_terms
from lagrange_cli.report.values.json_types import (
    EXPRESSION,
    INTEGER,
    NUMBER,
    TEXT,
    ConvertedType,
    JsonObject,
    Key,
    list_of,
    one_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.findings import Certificate
    from lagrange_cli.notation.scene_language import ExpressionPrinter

#: The terms of a sum in their order; 0 without any.
SUM = ConvertedType(
    TEXT.schema, lambda terms, say: say.tree(display_sum(terms, say.words)) if terms else "0"
)

#: The left side of an equation in its textbook form, the rate of a momentum written out.
ROW = ConvertedType(TEXT.schema, lambda shown, say: say.tree(display_terms(shown, say.words)))

#: Rows of expressions.
ROWS = list_of(list_of(EXPRESSION))

#: Matrices of more rows are given by their entries.
LARGEST_DENSE = 64


def _matrix(rows: Sequence[Sequence[Expr]], say: ExpressionPrinter) -> Any:
    """Return all entries, or (row, column, entry) of those that are not 0, counted from 0."""
    if len(rows) <= LARGEST_DENSE:
        return ROWS.write(rows, say)
    terms = [[i, j, say(entry)] for i, row in enumerate(rows) for j, entry in entries(row).items()]
    return {"shape": [len(rows), len(rows)], "entries": terms}


_ENTRY = {
    "type": "array",
    "prefixItems": [INTEGER.schema, INTEGER.schema, TEXT.schema],
    "minItems": 3,
    "items": False,
}
_SPARSE: JsonObject[Any] = JsonObject(
    Key("shape", list_of(INTEGER, 2), "Number of rows and columns."),
    Key(
        "entries",
        list_of(ConvertedType(_ENTRY)),
        "Row and column from 0, and entry, of those that are not 0.",
    ),
)

#: A square matrix, by the entries that are not 0 where it is large.
MATRIX = ConvertedType({"anyOf": [ROWS.schema, _SPARSE.schema]}, _matrix)

_CONDITION = ConvertedType(
    TEXT.schema, lambda c, say: f"{say(c.smaller)} {c.relation} {say(c.larger)}"
)

#: Conditions on the parameters.
CONDITIONS = list_of(_CONDITION)

#: A complex number: its real and imaginary part.
COMPLEX = ConvertedType(list_of(NUMBER, 2).schema, lambda z, _: [z.real, z.imag])

#: The strongest proven statement on the stability of an equilibrium.
VERDICT = one_of(*get_args(Verdict))

CERTIFICATE: JsonObject[Certificate] = JsonObject(
    Key("points", INTEGER, "Number of random states."),
    Key("digits", INTEGER, "Decimal digits that had to agree."),
    Key("mismatch", NUMBER, "Largest relative mismatch."),
)


def named_expression(description: str) -> JsonObject[Any]:
    """Return the type of an expression with its name; values have both as attributes."""
    return JsonObject(Key("name", TEXT, "Its name."), Key("expression", EXPRESSION, description))


def coordinate_names(equations: Equations) -> list[str]:
    """List the names of the coordinates."""
    return [c.name for c in equations.system.coordinates]


def by_symbol(values: Iterable[tuple[Symbol, Expr]]) -> dict[str, Expr]:
    """Return expressions by the names of symbols."""
    return {symbol.name: value for symbol, value in values}


def residuals(unknown: str, row: ConvertedType = ROW) -> JsonObject[tuple[str, Any]]:
    """Return the type of an equation of an unknown: pairs of its name and the equation."""
    return JsonObject(
        Key(unknown, TEXT, f"Name of the {unknown}.", lambda pair: pair[0]),
        Key("residual", row, "The equation, which equals zero.", lambda pair: pair[1]),
    )
