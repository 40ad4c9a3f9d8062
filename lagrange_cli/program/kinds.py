"""Kinds of programs: the quantity that a program computes."""

from __future__ import annotations

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
