"""Packages that compute in emitted Python: what they call functions, and how they are imported."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS

#: Functions that NumPy calls otherwise than a program.
_OF_NUMPY = {
    **{f"{arc}": f"arc{arc[1:]}" for arc in ("asin", "acos", "atan", "asinh", "acosh", "atanh")},
    "atan2": "arctan2",
    "pow": "power",
    "min": "minimum",
    "max": "maximum",
}

_OF_CASADI = {"abs": "fabs", "pow": "power", "min": "fmin", "max": "fmax"}


@dataclass(frozen=True)
class Vocabulary:
    """A package that computes.

    Attributes
    ----------
    functions
        Function of a program → text of the callee.
    imports
        Lines that import the package.
    decorator
        The line above each function that computes; empty where there is none.
    """

    functions: Mapping[str, str]
    imports: tuple[str, ...]
    decorator: str = ""

    @property
    def compiled(self) -> bool:
        """Tell whether loops are compiled, so that nothing has to take their place."""
        return bool(self.decorator)


def _functions(module: str, otherwise: Mapping[str, str]) -> dict[str, str]:
    return {name: f"{module}.{otherwise.get(name, name)}" for name in PROGRAM_FUNCTIONS}


NUMPY = Vocabulary(_functions("np", _OF_NUMPY), ("import numpy as np",))

NUMBA = Vocabulary(
    _functions("np", _OF_NUMPY),
    ("import numpy as np", "from numba import njit"),
    '@njit(error_model="numpy")',
)

JAX = Vocabulary(_functions("jnp", _OF_NUMPY), ("import jax", "import jax.numpy as jnp"))

CASADI = Vocabulary(_functions("casadi", _OF_CASADI), ("import casadi",))

#: Style → package.
VOCABULARIES = {"numpy": NUMPY, "numba": NUMBA, "jax": JAX, "casadi": CASADI}
