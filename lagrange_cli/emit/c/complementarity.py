"""The templates of C that find which contacts push (see :mod:`lagrange_cli.emit.c.impact`)."""

from __future__ import annotations

from lagrange_cli.emit.c.names import Real
from lagrange_cli.emit.constants import COMPLEMENTARITY_STEPS

#: Contacts from which on those that push are guessed first.
_FEWEST_GUESSED = 8

#: Rounds of guesses, and pivots (of a matrix with ones on the diagonal) that end them.
ROUNDS, SMALLEST = 12, 1e-6


def complementarity_templates(contacts: int) -> list[str]:
    """The names of the templates, in their order."""
    return ["among_active", *(["guess"] if contacts >= _FEWEST_GUESSED else []), "push"]


def complementarity_replacements(contacts: int, real: Real) -> dict[str, str]:
    """What stands for their tokens."""
    many = contacts >= _FEWEST_GUESSED
    return {
        "@STEPS@": str(COMPLEMENTARITY_STEPS),
        "@ROUNDS@": str(ROUNDS),
        "@SMALLEST@": real.value(max(SMALLEST, 64 * float(real.epsilon))),
        "@GUESSED@": "    @NAME@_guess(n, w, size, c);\n" if many else "",
    }
