"""A right-hand side in machine code, as integrators take it."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from lagrange_cli.simulate.integrators.base import Array

__all__ = ["RHS", "NativeRhs"]

_DOUBLE = ctypes.c_double
_POINTER = ctypes.c_void_p

#: int f(double t, const double *y, const double *u, const void *p, double *work, double *out)
RHS = ctypes.CFUNCTYPE(ctypes.c_int, _DOUBLE, *[_POINTER] * 5)


class NativeRhs:
    """A C function of the emitted interface with its parameters bound.

    It is called like any right-hand side, rhs(t, y), and gives NaN where the C
    function returns nonzero. Compiled integrators call ``address`` themselves.

    Parameters
    ----------
    function
        The C function, of type :data:`RHS`.
    parameters
        Doubles, laid out as the function reads them.
    work
        Workspace; used by one call at a time.
    kernels
        The library of compiled integrators for this dimension, None where only
        the right-hand side is compiled.
    """

    def __init__(
        self,
        function: Any,
        parameters: Array,
        work: Array,
        kernels: ctypes.CDLL | None = None,
    ) -> None:
        self.function = function
        self.parameters = np.ascontiguousarray(parameters, dtype=float)
        self.work = np.ascontiguousarray(work, dtype=float)
        self.kernels = kernels

    @property
    def address(self) -> int:
        """Address of the C function."""
        return int(ctypes.cast(self.function, _POINTER).value or 0)

    def __call__(self, t: float, y: Array) -> Array:
        state = np.ascontiguousarray(y, dtype=float)
        out = np.empty_like(state)
        failed = self.function(
            t,
            state.ctypes.data,
            None,
            self.parameters.ctypes.data,
            self.work.ctypes.data,
            out.ctypes.data,
        )
        if failed:
            out.fill(np.nan)
        return out
