"""Elimination for accelerations and multipliers together, as text of C.

Mass matrices may be singular by themselves where closures make the whole regular; then
scales are taken from both, and the solution is refined.
"""

from __future__ import annotations

from lagrange_cli.emit.c.names import Real
from lagrange_cli.emit.constants import LARGEST_EXPONENT, LEAST_INERTIA, UNEVEN_PIVOT
from lagrange_cli.emit.template_files import c_template, filled

__all__ = ["saddle_template"]

#: Below the exponent of every number.
_LEAST = -65536.0


#: More of the comment where the diagonal of the closures is given.
_COMPLIANT = """\
 * The diagonal behind M is given too: 0, or 1 where a row of G and g are zero,
 * which makes that number of l zero.
"""


def saddle_template(real: Real, *, compliant: bool) -> str:
    """``PREFIX_solve_saddle`` and what it calls, but for names and type.

    Parameters
    ----------
    compliant
        Whether the diagonal of the closures is given too.
    """
    replacements = {
        "@CORNER@": "(i == j ? a[i*s + i] : @ZERO@)" if compliant else "@ZERO@",
        "@COMPLIANT@": _COMPLIANT if compliant else "",
        "@LEAST@": real.value(_LEAST),
        "@SMALL@": real.value(LEAST_INERTIA),
        "@UNEVEN@": real.value(UNEVEN_PIVOT),
        "@WIDEST@": str(LARGEST_EXPONENT),
    }
    return filled(c_template("solve_saddle"), replacements)
