"""A right-hand side in machine code, as integrators take it."""

from __future__ import annotations

import copy
import ctypes
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native.buffers import NativeLandmarks
from lagrange_cli.simulate.integrators.native.c_types import (
    DOUBLE,
    LONG,
    POINTER,
    NativeReal,
    address_of,
    place_of,
)
from lagrange_cli.simulate.integrators.right_hand_side import (
    Expressions,
    InputPieces,
    StructuredRhs,
    Tracer,
)

if TYPE_CHECKING:
    pass

#: void lagrange_compare(samples, n, width, run, one, two, weights, start, largest)
_COMPARE = ctypes.CFUNCTYPE(None, LONG, LONG, LONG, *[POINTER] * 6)

#: void lagrange_table(function, rows, t, y, width, u, p, work, out, columns)
_TABLE = ctypes.CFUNCTYPE(None, POINTER, LONG, POINTER, POINTER, LONG, *[POINTER] * 4, LONG)


class NativeInputs:
    """Pieces of inputs as C functions of a type read them: ``u`` is the address of a row."""

    def __init__(self, pieces: InputPieces, real: NativeReal) -> None:
        self.pieces = pieces
        self.starts = real.array(pieces.starts)
        self.rows = real.array(pieces.rows)
        self._first: int = self.rows.ctypes.data

    def address(self, piece: int) -> int:
        """Return the address of the numbers of a piece."""
        return self._first + piece * int(self.rows.strides[0])


class NativeRhs(StructuredRhs):
    """A C function of the emitted interface with its parameters bound.

    ``landmarks`` are the exponents of sharp functions that compiled integrators watch,
    ``surfaces`` those of its kinks, and ``series`` the address of its Taylor recurrences and
    their number of rows; None at first.

    It is called like any right-hand side, rhs(t, y), and gives NaN where the C
    function returns nonzero. Compiled integrators call the functions at ``address`` and
    ``lanes_address`` themselves.

    Parameters
    ----------
    function
        The C function, of the :func:`function_type` of ``real``, or a :class:`ByReference`.
    parameters
        Numbers of the type ``real``, laid out as the function reads them.
    work
        Workspace; used by one call at a time.
    kernels
        The library that holds a compiled integrator for this dimension, by the name of its
        kernel, None if it is not to be had; None if only the right-hand side is compiled.
    lanes
        The same C function at eight states at once, of type :data:`LANES`, where there is
        one: ``out[8*i + l]`` from ``t[l]`` and ``y[8*i + l]``. It may return nonzero at any
        state; then the states are evaluated one by one.
    real
        What the C function computes with. Callers give and receive doubles.
    projection
        Where states obey constraints, a C function of the :func:`projection_type` of
        ``real`` with the same parameters, that moves a state onto them.
    native_inputs
        What the C function reads at ``u``, by the time, where it has inputs.
    trace
        The same function over objects, where its text is at hand.
    shift
        Where states obey constraints, a C function of the :func:`function_type` of ``real``
        that gives the change of a :data:`.right_hand_side.Shift`, of [q, q′].
    """

    def __init__(
        self,
        function: Any,
        parameters: Array,
        work: Array,
        kernels: Callable[[str], ctypes.CDLL | None] | None = None,
        lanes: Any = None,
        real: NativeReal = DOUBLE,
        projection: Any = None,
        native_inputs: NativeInputs | None = None,
        trace: Tracer | None = None,
        shift: Any = None,
    ) -> None:
        self.function = function
        self.landmarks: NativeLandmarks | None = None
        self.series: tuple[int, int] | None = None
        self._trace = trace
        self.native_inputs = native_inputs
        self.pieces = None if native_inputs is None else native_inputs.pieces
        self._fixed: int | None = None
        self.real = real
        self.parameters = real.array(parameters)
        self.work = real.array(work)
        self.kernels = kernels
        self._lanes = lanes  # kept alive
        self._projection = projection
        self.project = None if projection is None else self._projected
        self._shift = shift
        self.shift = None if shift is None else self._shifted
        self.shift_address = None if shift is None else address_of(shift)
        self.address = address_of(function)
        self.projection_address = None if projection is None else address_of(projection)
        self.lanes_address = None if lanes is None else address_of(lanes)
        self.parameters_address: int = self.parameters.ctypes.data
        self.work_address: int = self.work.ctypes.data
        # Memory in which states are handed over, made at the first call.
        self._state = self._slope = np.empty(0)
        self._pointers: tuple[int, ...] = ()

    def __call__(self, t: float, y: Array) -> Array:
        if len(y) != len(self._state):
            self._state, self._slope = np.empty((2, len(y)), self.real.dtype)
            arrays = self._state, self._slope, self.work
            self._pointers = tuple(map(place_of, arrays))
        self._state[:] = self.real.array(y)
        state, slope, work = self._pointers
        if self.function(t, state, self.inputs(t), self.parameters_address, work, slope):
            return np.full(len(y), np.nan)
        return np.array(self.real.doubles(self._slope))

    def table(self, t: Array, y: Array, columns: int) -> Array:
        """Evaluate it, with its kernels, at many states: t (m,), y (m, width) → (m, columns)."""
        t, y = self.real.array(t), self.real.array(y)
        out = np.empty((len(t), columns), self.real.dtype)
        width = y.shape[1]
        times, states, values = place_of(t), place_of(y), place_of(out)
        known, size = (self.parameters_address, self.work_address), t.itemsize
        for rows, inputs in self._alike(t):
            self._table(self.address, rows, times, states, width, inputs, *known, values, columns)
            times, states = times + rows * size, states + rows * width * size
            values += rows * columns * size
        return self.real.doubles(out)

    @cached_property
    def _table(self) -> Any:
        library = None if self.kernels is None else self.kernels("dop853")
        assert library is not None
        return _TABLE(("lagrange_table", library))

    @cached_property
    def compare(self) -> Callable[[Sequence[Array], Array, Array, Array], None] | None:
        """Bring what is largest of some samples up to date (kernels/compare.c): of those of a run
        and two others, (m, 2n), for weights of these, (2,), a start, (2n,), and values before,
        (2·2n + n,), of doubles; None where that is not compiled."""
        library = self.kernels("dop853") if self.kernels and self.real is DOUBLE else None
        if library is None:
            return None
        call = _COMPARE(("lagrange_compare", library))

        def compare(runs: Sequence[Array], weights: Array, start: Array, largest: Array) -> None:
            arrays = [np.ascontiguousarray(array) for array in (*runs, weights, start)]
            width = runs[0].shape[1]
            call(
                len(runs[0]),
                len(largest) - 2 * width,
                width,
                *map(place_of, arrays),
                place_of(largest),
            )

        return compare

    def _alike(self, t: Array) -> list[tuple[int, int | None]]:
        """Return how many times have the same inputs, range by range, and the address of these."""
        if self.pieces is None:
            return [(len(t), self.inputs(0.0))]
        assert self.native_inputs is not None
        piece = np.maximum(
            self.pieces.starts.searchsorted(self.real.doubles(t), side="right") - 1, 0
        )
        ends = [*(np.flatnonzero(np.diff(piece)) + 1).tolist(), len(t)] if len(t) else []
        rows = np.diff(ends, prepend=0).tolist()
        inputs = [self.native_inputs.address(int(piece[end - 1])) for end in ends]
        return list(zip(rows, inputs, strict=True))

    def in_piece(self, piece: int) -> NativeRhs:
        rhs = copy.copy(self)
        rhs._fixed, rhs.pieces = piece, None
        return rhs

    @property
    def expressions(self) -> Expressions | None:
        """Its tracer and numbers, with the inputs of the one piece that it has."""
        if self._trace is None:
            return None
        rows = np.empty((1, 0)) if self.native_inputs is None else self.native_inputs.pieces.rows
        return Expressions(self._trace, self.real.doubles(self.parameters), rows[self._fixed or 0])

    def inputs(self, t: float) -> int | None:
        """Return the address of the inputs; None without inputs."""
        if self.native_inputs is None:
            return None
        piece = self.native_inputs.pieces.at(t) if self._fixed is None else self._fixed
        return self.native_inputs.address(piece)

    def _shifted(self, t: float, q: Array, there: Array) -> Array:
        """Return the change that leads positions back, NaN where the C function returns nonzero."""
        both = self.real.array(np.concatenate([q, there]))
        change = np.empty(len(q), self.real.dtype)
        parameters, work = self.parameters_address, self.work.ctypes.data
        arguments = self.inputs(t), parameters, work, change.ctypes.data
        if self._shift(t, both.ctypes.data, *arguments):
            return np.full(len(q), np.nan)
        return self.real.doubles(change)

    def _projected(self, t: float, y: Array) -> Array:
        """Move a state onto the constraints; NaN if the C function returns nonzero."""
        state = self.real.array(np.array(y))
        parameters, work = self.parameters_address, self.work.ctypes.data
        if self._projection(t, state.ctypes.data, self.inputs(t), parameters, work):
            return np.full(len(y), np.nan)
        return self.real.doubles(state)
