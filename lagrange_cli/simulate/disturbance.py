"""A program in which every operation is off by its rounding error.

Each result is multiplied by 1 + 2⁻⁵² or 1 − 2⁻⁵³, in a fixed pattern, after
the stochastic arithmetic of Vignes, *Math. Comput. Simul.* 35 (1993) 233. How
far its value is from that of the program itself shows how much of it is
rounding: a sum in which digits cancel amplifies the errors of its terms.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from random import Random

import numpy as np

from lagrange_cli.emit.program import Call, Number, Operand, Product, Program, Sum
from lagrange_cli.simulate.integrators.base import Array

__all__ = ["disturb", "off_by_one_ulp"]

UP = Number(1 + Fraction(1, 2**52))
DOWN = Number(1 - Fraction(1, 2**53))


def disturb(program: Program, pattern: int) -> Program:
    """The program with every sum, product and call off by its rounding error.

    Each ``pattern``, a number, is another choice of up and down.
    """
    chance = Random(pattern)
    errors = iter(lambda: chance.choice((UP, DOWN)), None)
    return replace(
        program,
        assignments=tuple((name, _off(operand, errors)) for name, operand in program.assignments),
        outputs=tuple(
            (name, tuple(_off(operand, errors) for operand in operands))
            for name, operands in program.outputs
        ),
    )


def _off(operand: Operand, errors: Iterator[Number]) -> Operand:
    if isinstance(operand, Sum):
        terms = tuple((c, _off(o, errors)) for c, o in operand.terms)
        exact = len(terms) == 1 and abs(terms[0][0]) == 1
        return Sum(terms) if exact else Product((Sum(terms), next(errors)), ())
    if isinstance(operand, Product):
        numerator = tuple(_off(o, errors) for o in operand.numerator)
        denominator = tuple(_off(o, errors) for o in operand.denominator)
        return Product((*numerator, next(errors)), denominator)
    if isinstance(operand, Call):
        of = tuple(_off(o, errors) for o in operand.arguments)
        return Product((Call(operand.function, of), next(errors)), ())
    return operand


def off_by_one_ulp(values: Sequence[float] | Array, pattern: int) -> Array:
    """Each value moved by one unit in the last place, up or down by ``pattern``; 0 stays."""
    given = np.asarray(values, dtype=float)
    signs = np.random.default_rng(pattern).choice([-1.0, 1.0], size=given.shape)
    return np.where(given == 0, 0.0, given + signs * np.spacing(np.abs(given)))
