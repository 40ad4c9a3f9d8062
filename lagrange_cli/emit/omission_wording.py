"""Words in place of expressions that are too long to be read."""

from __future__ import annotations

from lagrange_cli.emit.language import Language
from lagrange_cli.notation.omission import MOST_OPERATIONS


def operations_told(count: int, say: Language) -> str:
    """``(27,909 operations)``, in place of an expression."""
    return say("({count} operations)", count=say.number(count))


def omission_told(option: str, say: Language) -> str:
    """A sentence for a page that leaves out expressions; ``option`` of a command prints them."""
    return say(
        "Expressions of more than {most} operations are left out; {option} prints them.",
        most=say.number(MOST_OPERATIONS),
        option=option,
    )
