"""Kinds of programs: the quantity that a program computes."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum, auto

#: Output of a right-hand side that has the rates of the states of first order.
STATE_RATES = "state_rates"


class ProgramKind(Enum):
    """The quantity that a program computes, by which targets arrange its results."""

    VALUES = auto()  # numbers, one after the other
    ENERGY = auto()  # one number
    MATRIX = auto()  # the upper triangle of the mass matrix
    RIGHT_HAND_SIDE = auto()  # accelerations, which the velocities precede
    SOLUTION = auto()  # accelerations, which the multipliers of all closures follow
    MULTIPLIERS = auto()  # those of all closures
    CHANGE = auto()  # a change of coordinates or of velocities, or velocities of momenta
    JACOBIAN = auto()  # derivatives of the state's rates or of outputs, by rows


#: Kinds of programs of one output alone; all other programs give values.
_KINDS = {
    "energy": ProgramKind.ENERGY,
    "mass_matrix": ProgramKind.MATRIX,
    "acceleration": ProgramKind.RIGHT_HAND_SIDE,
    "multipliers": ProgramKind.MULTIPLIERS,
    **dict.fromkeys(
        ("position_change", "shifted_change", "velocity_change", "impulse", "legendre"),
        ProgramKind.CHANGE,
    ),
}


def kind_of(outputs: Sequence[str], *, solves: bool) -> ProgramKind:
    """Return the kind of a program with these outputs, which ``solves`` none where none moves."""
    name = outputs[0].removeprefix("contact_") if len(outputs) == 1 else ""
    kind = _KINDS.get(name, ProgramKind.VALUES)
    return ProgramKind.VALUES if kind is ProgramKind.RIGHT_HAND_SIDE and not solves else kind


def is_right_hand_side(output: str) -> bool:
    """Tell whether an output is that of a right-hand side, with contacts or without."""
    return _KINDS.get(output.removeprefix("contact_")) is ProgramKind.RIGHT_HAND_SIDE
