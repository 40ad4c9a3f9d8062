"""The complementarity problem of contacts in C (see :mod:`lagrange_cli.emit.c.impact`)."""

from __future__ import annotations

from lagrange_cli.emit.c.names import Real
from lagrange_cli.emit.constants import COMPLEMENTARITY_STEPS

#: Number of contacts from which on those that push are guessed first; set by hand.
_FEWEST_GUESSED = 8

#: Rounds of guesses of the contacts that push; set by hand.
_ROUNDS = 12

#: Pivot of a matrix with ones on the diagonal that ends the guesses; set by hand.
_SMALLEST = 1e-6


def complementarity_templates(contacts: int) -> list[str]:
    """Return the names of the templates, in their order."""
    return ["among_active", *(["guess"] if contacts >= _FEWEST_GUESSED else []), "push"]


def complementarity_replacements(contacts: int, real: Real) -> dict[str, str]:
    """Return token → text for the templates."""
    many = contacts >= _FEWEST_GUESSED
    return {
        "@STEPS@": str(COMPLEMENTARITY_STEPS),
        "@ROUNDS@": str(_ROUNDS),
        "@SMALLEST@": real.value(max(_SMALLEST, 64 * float(real.epsilon))),
        "@GUESSED@": "    @NAME@_guess(n, w, size, c);\n" if many else "",
    }
