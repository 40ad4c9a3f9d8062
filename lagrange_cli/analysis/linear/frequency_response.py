"""Frequency responses G(iω) = C (iω − A)⁻¹ B + D of a linear system of first order.

A is balanced and brought to Hessenberg form once; each frequency is then one backward stable
solution (A. J. Laub, Efficient multivariable frequency response computations, IEEE Trans. Autom.
Control 26 (1981) 407), with the rounding bound |L| |iω − A| |X| of its left and right solutions.
Poles on the imaginary axis are split off by their invariant subspace: where an input moves such a
motion and an output sees it, the gain is infinite, and reported as such.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.linalg import hessenberg, matrix_balance, schur, solve_sylvester
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
#: below which one is zero, where A is singular.
_ON_AXIS, _ZERO = 1e-10, 1e-6

#: Singular value of A, and part of a residue's factors, that is rounding.
_SINGULAR, _UNSEEN = 1e-13, 1e-9

#: Part by which a gain is above its neighbours at a peak.
_ABOVE = 1e-9

_EPSILON = float(np.finfo(float).eps)


def frequency_response(space: StateSpace, low: float, high: float) -> FrequencyResponse:
    """Compute the responses between two positive angular frequencies.

    Parameters
    ----------
    space
        The linear system, with one input at least.
    """
    system = _System(space)
    frequencies = _frequencies(system, low, high)
    gains, error = _responses(system, frequencies)
    channels = tuple(_channels(system, space, frequencies, gains))
    return FrequencyResponse(
        low,
        high,
        space.inputs,
        space.outputs,
        frequencies,
        gains,
        channels,
        error,
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


class _System:
    """A balanced linear system, with its poles on the imaginary axis."""

    def __init__(self, space: StateSpace) -> None:
        balanced, scaling = matrix_balance(space.a, permute=False)
        inverse = np.diag(1 / np.diag(scaling))
        self.a, self.b, self.c, self.d = balanced, inverse @ space.b, space.c @ scaling, space.d
        self.poles: Complexes = np.linalg.eigvals(balanced).astype(complex)
        self.upper, turned = hessenberg(balanced, calc_q=True)
        self.source, self.seen = turned.T @ self.b, self.c @ turned
        self.axis = list(self._axis_parts())

    def at(self, frequency: float) -> tuple[Complexes, Matrix]:
        """Return G at a frequency, and a bound of its rounding error."""
        matrix = 1j * frequency * np.eye(len(self.upper)) - self.upper
        right = np.linalg.solve(matrix, self.source.astype(complex))
        left = np.linalg.solve(matrix.T, self.seen.T.astype(complex)).T
        gain: Complexes = np.asarray(self.seen @ right + self.d, dtype=complex)
        size = np.abs(left) @ np.abs(matrix) @ np.abs(right) + np.abs(self.seen) @ np.abs(right)
        return gain, len(matrix) * _EPSILON * (size + np.abs(self.d))

    # -- poles on the axis ----------------------------------------------------------------

    def _axis_parts(self) -> Iterator[_AxisPart]:
        size = float(np.abs(self.poles).max(initial=0.0))
        zero = self._zero_limit(size)
        if zero > 0:
            yield _AxisPart(0.0, self._infinite(lambda s: abs(s) <= zero))
        done: list[float] = []
        for pole in sorted(self.poles, key=lambda s: abs(s.imag)):
            w = abs(float(pole.imag))
            if abs(pole.real) > _ON_AXIS * size or w <= zero or w == 0:
                continue
            if not any(abs(w - earlier) <= 1e-9 * size for earlier in done):
                done.append(w)
                near = _NearAxis(w, _ON_AXIS * size, 1e-9 * size)
                yield _AxisPart(w, self._infinite(near))

    def _zero_limit(self, size: float) -> float:
        """Return the size of poles that are zero but for rounding; 0 where A is regular."""
        values = np.linalg.svd(self.a, compute_uv=False)
        least, largest = values.min(initial=np.inf), values.max(initial=0.0)
        return _ZERO * size if least <= _SINGULAR * len(values) * largest else 0.0

    def _infinite(self, chosen: Callable[[complex], bool]) -> Matrix:
        """Tell for which pairs of output and input the chosen poles have residues."""
        part, b, c = self._split(chosen)
        scale = np.abs(self.c).sum(axis=1)[:, None] * np.abs(self.b).sum(axis=0)
        power = np.eye(len(part), dtype=complex)
        seen = np.zeros(scale.shape, dtype=bool)
        largest = max(1.0, float(np.abs(self.a).max(initial=0.0)))
        for k in range(len(part)):
            seen |= np.abs(c @ power @ b) > _UNSEEN * scale * largest**k
            power = part @ power
        return seen.astype(float)

    def _split(self, chosen: Callable[[complex], bool]) -> tuple[Complexes, Complexes, Complexes]:
        """Return the subsystem on the invariant subspace of the chosen poles."""
        # The stubs of schur type "sort" for real matrices only.
        sorted_schur: Any = schur
        triangular, basis, count = sorted_schur(
            self.a.astype(complex), output="complex", sort=chosen
        )
        first, last = triangular[:count, :count], triangular[count:, count:]
        coupling_block = triangular[:count, count:]
        b, c = basis.conj().T @ self.b, self.c @ basis
        if not len(last):
            return first, b[:count], c[:, :count]
        # R with T₁₁ R − R T₂₂ = −T₁₂ decouples the parts.
        coupling = solve_sylvester(first, -last, -coupling_block)
        return first, b[:count] - coupling @ b[count:], c[:, :count]

    def static(self) -> Complexes:
        """Return G(0) without the part of poles at zero, shape (outputs, inputs)."""
        size = float(np.abs(self.poles).max(initial=0.0))
        zero = self._zero_limit(size)
        if zero == 0:
            return self.at(0.0)[0]
        regular, b, c = self._split(lambda s: abs(s) > zero)
        if not len(regular):
            return self.d.astype(complex)
        static: Complexes = np.asarray(self.d - c @ np.linalg.solve(regular, b), dtype=complex)
        return static


@dataclass(frozen=True)
class _NearAxis:
    """Tells whether a pole is one of those at ±iω."""

    frequency: float
    width: float
    height: float

    def __call__(self, pole: complex) -> bool:
        near = abs(abs(pole.imag) - self.frequency) <= self.height
        return bool(abs(pole.real) <= self.width and near)


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


def _responses(system: _System, frequencies: Matrix) -> tuple[Complexes, float]:
    """Return gains, set to zero below their rounding error, and its largest relative bound."""
    shape = len(frequencies), *system.d.shape
    gains, worst = np.full(shape, np.nan, dtype=complex), 0.0
    undamped = {part.frequency for part in system.axis if part.infinite.any()}
    for k, w in enumerate(frequencies.tolist()):
        if w in undamped:
            continue
        try:
            gains[k], bound = system.at(w)
        except np.linalg.LinAlgError:
            continue
        size = np.abs(gains[k])
        # The relative error of a gain that vanishes is not defined.
        seen = size > bound
        gains[k] = np.where(seen, gains[k], 0.0)
        worst = max(worst, float((bound[seen] / size[seen]).max(initial=0.0)))
    return gains, worst


def _channels(
    system: _System, space: StateSpace, frequencies: Matrix, gains: Complexes
) -> Iterator[Channel]:
    static = system.static()
    at_zero = next((p.infinite for p in system.axis if p.frequency == 0), np.zeros(static.shape))
    for i, output in enumerate(space.outputs):
        for j, source in enumerate(space.inputs):
            sizes = np.abs(gains[:, i, j])
            scale = float(np.abs(system.c[i]).sum() * np.abs(system.b[:, j]).sum())
            if not np.nanmax(sizes, initial=0.0) > 1e-14 * scale:
                continue
            static_gain = None if at_zero[i, j] else float(static[i, j].real)
            peaks = [*_undamped(system, frequencies, i, j)]
            peaks += _largest(system, frequencies, sizes, i, j)
            peaks.sort(key=lambda peak: peak.frequency)
            yield Channel(source, output, static_gain, tuple(peaks))


def _undamped(system: _System, frequencies: Matrix, i: int, j: int) -> Iterator[ResponsePeak]:
    low, high = float(frequencies[0]), float(frequencies[-1])
    for part in system.axis:
        if part.frequency > 0 and part.infinite[i, j] and low <= part.frequency <= high:
            yield ResponsePeak(part.frequency, None, None)


def _largest(
    system: _System, frequencies: Matrix, sizes: Matrix, i: int, j: int
) -> Iterator[ResponsePeak]:
    """Find the largest gains between smaller ones."""
    for k in range(1, len(frequencies) - 1):
        around = sizes[k - 1 : k + 2]
        if not np.isfinite(around).all() or around[1] < max(around[0], around[2]):
            continue
        # Distances from the middle have more digits than frequencies beside a narrow resonance.
        low, middle, high = (float(w) for w in frequencies[k - 1 : k + 2])
        optimum = minimize_scalar(
            lambda step, centre=middle: -abs(system.at(centre + float(step))[0][i, j]),
            bounds=(low - middle, high - middle),
            method="bounded",
            options={"xatol": 1e-9 * (high - low)},
        )
        place = middle + float(optimum.x)
        gains, bounds = system.at(place)
        gain = complex(gains[i, j])
        if abs(gain) > (1 + _ABOVE) * min(around[0], around[2]) + 3 * bounds[i, j]:
            yield ResponsePeak(place, abs(gain), float(np.angle(gain)))
