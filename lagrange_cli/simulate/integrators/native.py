"""A right-hand side in machine code, as integrators take it."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from lagrange_cli.simulate.integrators.base import Array

__all__ = ["LANES", "RHS", "NativeRhs"]

_DOUBLE = ctypes.c_double
_POINTER = ctypes.c_void_p

#: int f(double t, const double *y, const double *u, const void *p, double *work, double *out)
RHS = ctypes.CFUNCTYPE(ctypes.c_int, _DOUBLE, *[_POINTER] * 5)

#: The same at eight states: t and every array with the state as last index.
LANES = ctypes.CFUNCTYPE(ctypes.c_int, *[_POINTER] * 6)


def _address(function: Any) -> int:
    return int(ctypes.cast(function, _POINTER).value or 0)


class NativeRhs:
    """A C function of the emitted interface with its parameters bound.

    It is called like any right-hand side, rhs(t, y), and gives NaN where the C
    function returns nonzero. Compiled integrators call the functions at ``address`` and
    ``lanes_address`` themselves.

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
    lanes
        The same C function at eight states at once, of type :data:`LANES`, where there is
        one: ``out[8*i + l]`` from ``t[l]`` and ``y[8*i + l]``. It may return nonzero at any
        state; then the states are evaluated one by one.
    """

    def __init__(
        self,
        function: Any,
        parameters: Array,
        work: Array,
        kernels: ctypes.CDLL | None = None,
        lanes: Any = None,
    ) -> None:
        self.function = function
        self.parameters = np.ascontiguousarray(parameters, dtype=float)
        self.work = np.ascontiguousarray(work, dtype=float)
        self.kernels = kernels
        self._lanes = lanes  # kept alive
        self.address = _address(function)
        self.lanes_address = None if lanes is None else _address(lanes)
        self.parameters_address: int = self.parameters.ctypes.data

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
