"""Many motions stepped at once by their Taylor series, in machine code.

The C is :file:`kernels/members/taylor.c`; the series of a system are emitted by
:mod:`lagrange_cli.simulate.native.taylor`. The result of a motion does not depend on which others
are stepped beside it.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native.c_types import (
    DOUBLE,
    LONG,
    POINTER,
    NativeReal,
    aligned_zeros,
    structure,
)

_ROWS = ctypes.CFUNCTYPE(ctypes.c_int)
_WIDTH = ctypes.CFUNCTYPE(LONG)
_MEMORY = ctypes.CFUNCTYPE(LONG, POINTER)
_ADVANCE = ctypes.CFUNCTYPE(ctypes.c_int, POINTER, LONG)
_TABLE = ctypes.CFUNCTYPE(
    *(None, POINTER, POINTER, LONG, LONG, POINTER, POINTER),
    *(LONG, ctypes.c_double, POINTER, LONG, POINTER, POINTER, LONG),
)

_EXTENT = ctypes.CFUNCTYPE(None, LONG, LONG, LONG, POINTER, ctypes.c_double, POINTER)
_ERRORS = ctypes.CFUNCTYPE(None, *[LONG] * 3, POINTER, LONG, *[POINTER] * 3)

#: Steps in each lane of one call.
_AT_ONCE = 512

_Integers = NDArray[np.int64]


@dataclass(frozen=True)
class TaylorSteps:
    """Order, tolerance and limits of the steps.

    Attributes
    ----------
    tolerance
        Of each step, relative to the scales so far.
    longest, most
        Largest step, a time, and number of steps.
    glance
        Time after which slopes of the series are compared with the right-hand side; 0: never.
    forgiven
        Error of these slopes over a step, relative to the scales.
    """

    order: int
    tolerance: float
    longest: float
    most: int
    glance: float = 0.0
    forgiven: float = 0.0


@dataclass(frozen=True)
class BatchedMotions:
    """Results of batched motions.

    Attributes
    ----------
    states
        Shape (members, samples, 2n), NaN behind the first ``filled`` samples.
    filled, steps
        Samples and steps of each member, shape (members,).
    """

    states: Array
    filled: _Integers
    steps: _Integers


class BatchedTaylor:
    """The series of a system with what steps them.

    Parameters
    ----------
    system, stepper
        Libraries that hold ``system_NAME_taylor``, and the functions of taylor.c.
    kinds
        A number for the kind of each coordinate, 0 for an angle.
    real
        What they compute with. Callers give and receive doubles.
    """

    def __init__(
        self, system: ctypes.CDLL, stepper: ctypes.CDLL, kinds: _Integers, real: NativeReal = DOUBLE
    ) -> None:
        self.system, self._stepper, self._kinds, self.real = system, stepper, kinds, real
        self._type = structure("members", real, _WIDTH(("lagrange_taylor_width", stepper))())
        self._advance = _ADVANCE(("lagrange_taylor_advance", stepper))

    def run(
        self,
        name: str,
        times: Array,
        starts: Array,
        parameters: Array,
        steps: TaylorSteps,
        between: Callable[[], None] = lambda: None,
        out: Array | None = None,
    ) -> BatchedMotions:
        """Step all motions through the sample times.

        Parameters
        ----------
        name
            Of the right-hand side, ``rhs`` or ``disturbed``.
        starts, parameters
            Shapes (members, 2n) and (members, parameters).
        between
            Called now and then.
        out
            Where states are put that are doubles, of their shape.
        """
        members, n = starts.shape
        states = out
        if states is None or self.real is not DOUBLE:
            states = np.empty((members, len(times), n), self.real.dtype)
        filled, made = np.zeros((2, members), np.int64)
        numbers = (np.ascontiguousarray(a, self.real.dtype) for a in (times, starts, parameters))
        times, starts, parameters = numbers
        run = self._type()
        run.series = ctypes.cast(self.system[f"system_{name}_taylor"], POINTER).value
        run.rows = _ROWS((f"system_{name}_taylor_rows", self.system))()
        arrays = (times, starts, parameters, self._kinds, states, filled, made)
        places = ("times", "starts", "p", "kinds", "states", "filled", "steps")
        for place, array in zip(places, arrays, strict=True):
            setattr(run, place, array.ctypes.data)
        run.n, run.members, run.samples, run.parameters = (
            n,
            members,
            len(times),
            parameters.shape[1],
        )
        run.order, run.tolerance, run.most_steps = steps.order, steps.tolerance, steps.most
        run.longest, run.glance, run.forgiven = steps.longest, steps.glance, steps.forgiven
        size = _MEMORY(("lagrange_taylor_memory", self._stepper))(ctypes.byref(run))
        memory = aligned_zeros(size, np.uint8)
        run.memory = memory.ctypes.data
        while self._advance(ctypes.byref(run), _AT_ONCE):
            between()
        for member in np.flatnonzero(filled < len(times)).tolist():
            states[member, filled[member] :] = np.nan
        return BatchedMotions(states.astype(float, copy=False), filled, made)


class BatchedSamples:
    """Functions of the samples of batched motions, in doubles (samples.c)."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._table = _TABLE(("lagrange_members_table", library))
        self._extent = _EXTENT(("lagrange_members_extent", library))
        self._errors = _ERRORS(("lagrange_members_errors", library))

    def table(
        self,
        functions: tuple[Any, Any],
        times: Array,
        states: Array,
        parameters: Array,
        work: int,
        out: Array,
        moving: float = 1.0,
    ) -> Array:
        """Evaluate a function of the emitted interface at all samples of motions without inputs.

        Parameters
        ----------
        functions
            It and its form for eight states at once, which may be None.
        work
            Numbers of its workspace.
        out
            Where it is put, shape (columns, members, samples); NaN where it does not exist.
        moving
            A factor of the velocities.
        """
        members, samples, n = states.shape
        columns = len(out)
        if columns == 0:
            return out
        arrays = (np.ascontiguousarray(a, dtype=float) for a in (times, states, parameters))
        times, states, parameters = arrays
        space = np.empty(work + 9 * n + 9 * columns + 8)
        self._table(
            *(None if entry is None else ctypes.cast(entry, POINTER).value for entry in functions),
            members,
            samples,
            times.ctypes.data,
            states.ctypes.data,
            n,
            moving,
            parameters.ctypes.data,
            parameters.shape[1],
            space.ctypes.data,
            out.ctypes.data,
            columns,
        )
        return out

    def extent(self, states: Array, *, from_start: bool) -> Array:
        """Return the largest distance of coordinates from 0 or their start, and largest speeds, of
        each member, (members, 2n)."""
        states = np.ascontiguousarray(states)
        extents = np.empty((len(states), states.shape[2]))
        self._extent(*states.shape, states.ctypes.data, float(from_start), extents.ctypes.data)
        return extents

    def errors(self, states: Array, companions: Sequence[Array], weights: Sequence[float]) -> Array:
        """Return the largest sum of ``weight·|companion - own|`` of each number of a member
        over its samples, (members, 2n); NaN if there are any."""
        states, *companions = (np.ascontiguousarray(a) for a in (states, *companions))
        errors, count = np.empty((len(states), states.shape[2])), len(companions)
        places = (POINTER * count)(*(companion.ctypes.data for companion in companions))
        weighs = (ctypes.c_double * count)(*weights)
        arguments = states.ctypes.data, count, places, weighs, errors.ctypes.data
        self._errors(*states.shape, *arguments)
        return errors


def digits_of(stepper: ctypes.CDLL) -> int:
    """Return the binary digits of the numbers that the compiler made of the type."""
    return int(_WIDTH(("lagrange_taylor_digits", stepper))())
