"""Frequency responses G(iω) = C (iω − A)⁻¹ B + D of a linear system of first order.

Rates of an input are that input times iω and (iω)²: B is B₀ + iω B₁ − ω² B₂, and so is D.

A is balanced by powers of two; each value is one backward stable solution, with the rounding bound
|L| |s − A| |R| of its left and right solutions L and R (N. J. Higham, Accuracy and Stability of
Numerical Algorithms, 2nd ed., 2002, ch. 7). The bound holds also the rounding of the matrices to
doubles, on any processor. Poles on the imaginary axis are told apart by the coefficients of Laurent
series of G about them, integrals over circles: where one of a negative power is larger than its
bound an input moves such a motion, an output sees it, and the gain is infinite. Largest gains are
told where values beside them are smaller by more than the bounds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import matrix_balance
from scipy.optimize import minimize_scalar

from lagrange_cli.analysis.values import (
    Channel,
    Complexes,
    FrequencyResponse,
    Matrix,
    ResponsePeak,
    StateSpace,
)

# Frequencies are dense enough that a curve through them looks smooth. Thresholds lie between the
# rounding of eigenvalues in doubles and the smallest damping that a scene means.

#: Frequencies a decade, and distances from a pole in its decay rates.
_A_DECADE, _AROUND = 60, (0.0, 0.1, 0.3, 1.0, 3.0, 10.0)

#: Part of its size by which a pole may be off the imaginary axis and be on it; part of the largest
#: below which one is zero, where A is singular; part by which poles on the axis may differ.
_ON_AXIS, _ZERO, _TOGETHER = 1e-10, 1e-6, 1e-9

#: Singular value of A that is rounding.
_SINGULAR = 1e-13

#: Points of a circle about a pole, half as far as the next one: powers of 1/2 that are rounding.
_CIRCLE = 64

_EPSILON = float(np.finfo(float).eps)


def frequency_response(
    space: StateSpace, low: float, high: float, orders: Sequence[int]
) -> FrequencyResponse:
    """Compute the responses between two positive angular frequencies.

    Parameters
    ----------
    space
        The linear system, with one input at least.
    orders
        For each of its inputs 0, or 1 and 2 for the rates of the input before.
    """
    system = _System(space, orders)
    sources = tuple(u for u, order in zip(space.inputs, orders, strict=True) if order == 0)
    frequencies = _frequencies(system, low, high)
    gains, bounds = _responses(system, frequencies)
    names = sources, space.outputs
    channels = tuple(_channels(system, names, _Curves(frequencies, gains, bounds)))
    # The relative error of a gain that vanishes is not defined.
    seen = np.abs(gains) > bounds
    worst = float((bounds[seen] / np.abs(gains[seen])).max(initial=0.0))
    shown = np.where(seen | np.isnan(gains), gains, 0.0)
    return FrequencyResponse(
        low,
        high,
        sources,
        space.outputs,
        frequencies,
        shown,
        channels,
        worst,
        _settles(system),
    )


def _settles(system: _System) -> Literal["yes", "undamped", "unstable"]:
    poles = system.poles
    size = np.abs(poles).max(initial=0.0)
    zero = max([_ON_AXIS * size, *(_ZERO * size for p in system.axis if p.frequency == 0)])
    beyond = poles[np.abs(poles) > zero].real
    if (beyond > _ON_AXIS * size).any():
        return "unstable"
    return "undamped" if system.axis else "yes"


@dataclass(frozen=True)
class _AxisPart:
    """The part of a system that belongs to poles on the imaginary axis at one frequency.

    Attributes
    ----------
    frequency
        Their |Im s|.
    infinite
        1 where the gain is infinite, else 0; shape (outputs, inputs).
    """

    frequency: float
    infinite: Matrix


@dataclass(frozen=True)
class _Curves:
    """Gains over frequencies, shape (m, outputs, inputs), with bounds of their rounding errors."""

    frequencies: Matrix
    gains: Complexes
    bounds: Matrix


class _System:
    """A balanced linear system, with its poles on the imaginary axis."""

    def __init__(self, space: StateSpace, orders: Sequence[int]) -> None:
        balanced, scaling = matrix_balance(space.a, permute=False)
        inverse = np.diag(1 / np.diag(scaling))
        self.a, self.c = balanced, space.c @ scaling
        self.b, self.d = (_by_powers(m, orders) for m in (inverse @ space.b, space.d))
        self.shape = self.d.shape[1:]
        self.poles: Complexes = np.linalg.eigvals(balanced).astype(complex)
        self.size = float(np.abs(self.poles).max(initial=0.0))
        self.zero = self._zero_limit()
        self.axis = list(self._axis_parts())

    def at(self, place: complex) -> tuple[Complexes, Matrix]:
        """Return G at a complex frequency s, and a bound of its rounding error."""
        matrix = place * np.eye(len(self.a)) - self.a
        powers = place ** np.arange(len(self.b))
        b, d = (np.tensordot(powers, m, 1).astype(complex) for m in (self.b, self.d))
        size_b, size_d = (np.tensordot(np.abs(powers), np.abs(m), 1) for m in (self.b, self.d))
        right = np.linalg.solve(matrix, b)
        left = np.linalg.solve(matrix.T, self.c.T.astype(complex)).T
        gain: Complexes = np.asarray(self.c @ right + d, dtype=complex)
        size = np.abs(left) @ (np.abs(matrix) @ np.abs(right) + size_b)
        size += np.abs(self.c) @ np.abs(right) + size_d
        return gain, max(1, len(matrix)) * _EPSILON * size

    # -- poles on the axis ----------------------------------------------------------------

    def _axis_parts(self) -> Iterator[_AxisPart]:
        if self.zero > 0:
            yield _AxisPart(0.0, self._infinite(0.0, self.zero))
        done: list[float] = []
        for pole in sorted(self.poles, key=lambda s: abs(s.imag)):
            w = abs(float(pole.imag))
            if abs(pole.real) > _ON_AXIS * self.size or w <= self.zero or w == 0:
                continue
            if not any(abs(w - earlier) <= _TOGETHER * self.size for earlier in done):
                done.append(w)
                yield _AxisPart(w, self._infinite(w, _TOGETHER * self.size))

    def _zero_limit(self) -> float:
        """Return the size of poles that are zero but for rounding; 0 where A is regular."""
        values = np.linalg.svd(self.a, compute_uv=False)
        least, largest = values.min(initial=np.inf), values.max(initial=0.0)
        is_singular = least <= _SINGULAR * len(values) * largest
        return _ZERO * (self.size or 1.0) if is_singular else 0.0

    def _infinite(self, frequency: float, within: float) -> Matrix:
        """Say for which pairs of output and input the poles near iω make the gain infinite."""
        inside = int((np.abs(self.poles - 1j * frequency) <= within).sum())
        infinite = np.zeros(self.shape, dtype=bool)
        for power in range(1, inside + 1):
            coefficient, bound = self._laurent(frequency, within, -power)
            infinite |= np.abs(coefficient) > bound
        return infinite.astype(float)

    def _laurent(self, frequency: float, within: float, power: int) -> tuple[Complexes, Matrix]:
        """Return a coefficient of the Laurent series of G about iω, and a bound of its error.

        ``within``: the distance of the poles that are taken for iω.
        """
        distances = np.abs(self.poles - 1j * frequency)
        next_one = distances[distances > within].min(initial=np.inf)
        radius = next_one / 2 if np.isfinite(next_one) else max(1.0, self.size)
        total, bound = np.zeros(self.shape, dtype=complex), np.zeros(self.shape)
        for turn in np.exp(2j * np.pi * (np.arange(_CIRCLE) + 0.5) / _CIRCLE):
            gain, error = self.at(1j * frequency + radius * turn)
            total += gain * turn**-power
            bound += error + _EPSILON * (_CIRCLE + abs(power)) * np.abs(gain)
        mean: Complexes = np.asarray(total * (radius**-power / _CIRCLE), dtype=complex)
        return mean, bound * (radius**-power / _CIRCLE)

    def static(self) -> Complexes:
        """Return G(0) without the part of poles at zero, shape (outputs, inputs).

        Gains that rounding errors do not tell from 0 are 0.
        """
        gain, bound = self._laurent(0.0, self.zero, 0) if self.zero else self.at(0.0)
        return np.where(np.abs(gain) > bound, gain, 0.0)


def _by_powers(matrix: Matrix, orders: Sequence[int]) -> Matrix:
    """Gather the columns of inputs and of their rates by order, shape (orders, rows, inputs)."""
    gathered = np.zeros((max(orders) + 1, len(matrix), list(orders).count(0)))
    source = -1
    for column, order in zip(matrix.T, orders, strict=True):
        source += order == 0
        gathered[order, :, source] = column
    return gathered


def _frequencies(system: _System, low: float, high: float) -> Matrix:
    """Spread frequencies evenly over decades, with more of them about each pole."""
    count = max(2, round(_A_DECADE * np.log10(high / low)) + 1)
    spread = [*np.geomspace(low, high, count)]
    for pole in system.poles:
        width = max(abs(pole.real), 1e-6 * abs(pole.imag))
        for centre in {abs(pole.imag), abs(pole)}:
            spread += [centre + sign * k * width for k in _AROUND for sign in (1, -1)]
    spread += [part.frequency for part in system.axis]
    inside = np.array([w for w in spread if low < w < high])
    return np.unique(np.concatenate([[low], inside, [high]]))


def _responses(system: _System, frequencies: Matrix) -> tuple[Complexes, Matrix]:
    """Return gains, not a number at undamped poles, with bounds of their rounding errors."""
    shape = len(frequencies), *system.shape
    gains, bounds = np.full(shape, np.nan, dtype=complex), np.full(shape, np.inf)
    undamped = {part.frequency for part in system.axis if part.infinite.any()}
    for k, w in enumerate(frequencies.tolist()):
        if w in undamped:
            continue
        try:
            gains[k], bounds[k] = system.at(1j * w)
        except np.linalg.LinAlgError:
            continue
    return gains, bounds


def _channels(
    system: _System, names: tuple[tuple[str, ...], tuple[str, ...]], curves: _Curves
) -> Iterator[Channel]:
    """``names``: of inputs and of outputs."""
    static = system.static()
    at_zero = next((p.infinite for p in system.axis if p.frequency == 0), np.zeros(static.shape))
    sources, outputs = names
    for i, output in enumerate(outputs):
        for j, source in enumerate(sources):
            if not (np.abs(curves.gains[:, i, j]) > curves.bounds[:, i, j]).any():
                continue
            static_gain = None if at_zero[i, j] else float(static[i, j].real)
            peaks = [*_undamped(system, curves.frequencies, i, j)]
            peaks += _largest(system, curves, i, j)
            peaks.sort(key=lambda peak: peak.frequency)
            yield Channel(source, output, static_gain, tuple(peaks))


def _undamped(system: _System, frequencies: Matrix, i: int, j: int) -> Iterator[ResponsePeak]:
    low, high = float(frequencies[0]), float(frequencies[-1])
    for part in system.axis:
        if part.frequency > 0 and part.infinite[i, j] and low <= part.frequency <= high:
            yield ResponsePeak(part.frequency, None, None)


def _largest(system: _System, curves: _Curves, i: int, j: int) -> Iterator[ResponsePeak]:
    """Find the largest gains between smaller ones."""
    sizes, bounds = np.abs(curves.gains[:, i, j]), curves.bounds[:, i, j]
    for k in _maxima(sizes - bounds, sizes + bounds):
        # Distances from the middle have more digits than frequencies beside a narrow resonance.
        low, middle, high = (float(w) for w in curves.frequencies[k - 1 : k + 2])
        optimum = minimize_scalar(
            lambda step, centre=middle: -abs(system.at(1j * (centre + float(step)))[0][i, j]),
            bounds=(low - middle, high - middle),
            method="bounded",
            options={"xatol": 1e-9 * (high - low)},
        )
        place = middle + float(optimum.x)
        gain = complex(system.at(1j * place)[0][i, j])
        if abs(gain) < sizes[k]:
            place, gain = middle, complex(curves.gains[k, i, j])
        yield ResponsePeak(place, abs(gain), float(np.angle(gain)))


def _maxima(lower: Matrix, upper: Matrix) -> Iterator[int]:
    """Number the values of a curve that are above earlier and later ones, whatever their errors.

    ``lower``, ``upper``: what a value is at least and at most; not a number where it is infinite.
    """
    floor, best = np.inf, -1
    for k, (least, most) in enumerate(zip(lower.tolist(), upper.tolist(), strict=True)):
        if np.isnan(least):
            floor, best = np.inf, -1
        elif best >= 0 and most < lower[best]:
            yield best
            floor, best = most, -1
        else:
            if least > (floor if best < 0 else lower[best]):
                best = k
            floor = min(floor, most)
