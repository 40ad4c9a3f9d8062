"""Three angles of a turn along a motion whose orientation a unit quaternion gives.

A turn by α, β, γ about three axes, where the second one is across the others, is a pair of complex
numbers: a quaternion q with cos(β/2) e^{iσ} = q₀ + i q₁ and sin(β/2) e^{iδ} = q₂ ± i q₃, numbered
by the axes, where σ = (α + γ)/2 and δ = (α − γ)/2 (E. Bernardes and S. Viollet, Quaternion to Euler
angles conversion, PLoS ONE 17, 2022). A third axis across the first one is brought onto it by a
quarter turn about the second. At gimbal lock one of the numbers is 0: σ or δ is its argument, which
follows from sample to sample on the cubic with its rates, also past 0. Closer to 0 than the
orientation is known, nothing tells how it turns: then it goes on as smoothly as it came.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.charts.continuation import ContinuedCoordinates, KnownMotion

_Complex = NDArray[np.complex128]

#: Least distance of a number from 0 at which its argument is known, as a multiple of the
#: uncertainty of numbers.
_CLEAR = 10.0

#: Largest fourth derivative's part in the error of a cubic between two samples with rates.
_CUBIC = 1 / 384


@dataclass(frozen=True)
class _Argument:
    """The argument of a complex number along a motion, continuous where it is known.

    Attributes
    ----------
    angle
        The argument of the number or of its negative, in radians, shape (m,).
    size
        The number is ``size·exp(i·angle)``, and ``size`` is continuous, shape (m,).
    lost
        Numbers of the intervals in which nothing tells how the argument turns.
    """

    angle: Array
    size: Array
    lost: list[int]


def angles_of_turn(samples: KnownMotion, axes: str, start: Array | None) -> ContinuedCoordinates:
    """Return the angles of a turn about three axes and their rates.

    Parameters
    ----------
    samples
        Parts of the quaternion, that of the scalar first, with their rates and uncertainties.
    axes
        The axes, such as ``zxz``; the second one differs from the others.
    start
        [q, v] of the angles at the first sample; None if it is not known.
    """
    error, offset = np.sqrt(2.0) * float(samples.errors.max()), _offset(axes)
    pair, rates = (_pair(parts, axes, offset) for parts in (samples.positions, samples.velocities))
    begun = _start_of(pair, offset) if start is None else start
    half = (begun[1] + offset) / 2
    outer, sizes = (begun[0] + np.array([1, -1]) * begun[2]) / 2, (np.cos(half), np.sin(half))
    with np.errstate(all="ignore"):
        total, difference = (
            _argument(samples.t, z, rate, angle, -1.0 if size < 0 else 1.0, error)
            for z, rate, angle, size in zip(pair, rates, outer, sizes, strict=True)
        )
        read = _angles(total, difference, rates, error)
    turns = np.round((half - read.q[0, 1] / 2) / (2 * np.pi))
    read.q[:, 1] += 4 * np.pi * turns - offset
    if start is not None:
        # Angles that are given stay, also where they are one choice of several.
        read.q[0], read.v[0], read.amplification[0] = start[:3], start[3:], 0.0
    times = samples.t.tolist()
    numbers = sorted({*total.lost, *difference.lost})
    return replace(read, lost=tuple((times[k], times[k + 1]) for k in numbers))


def _start_of(pair: tuple[_Complex, _Complex], offset: float) -> Array:
    """Return the angles of the first numbers that are smallest."""
    total, difference = (float(np.angle(z[0])) for z in pair)
    middle = 2 * np.arctan2(abs(pair[1][0]), abs(pair[0][0])) - offset
    return np.array([total + difference, middle, total - difference])


def _angles(
    total: _Argument, difference: _Argument, rates: tuple[_Complex, _Complex], error: float
) -> ContinuedCoordinates:
    """Return angles and their rates by half their sum, half their difference and their sizes."""
    turning = [
        rate * np.exp(-1j * x.angle) for x, rate in zip((total, difference), rates, strict=True)
    ]
    s, d = ((z.imag / x.size) for z, x in zip(turning, (total, difference), strict=True))
    slope = 2 * (total.size * turning[1].real - difference.size * turning[0].real)
    middle = 2 * np.unwrap(np.arctan2(difference.size, total.size))
    outer = error / np.abs(total.size) + error / np.abs(difference.size)
    sums = total.angle + difference.angle, total.angle - difference.angle
    return ContinuedCoordinates(
        np.column_stack([sums[0], middle, sums[1]]),
        np.column_stack([s + d, slope, s - d]),
        np.column_stack([outer, np.full(len(outer), 2 * error), outer]),
        (),
    )


def _offset(axes: str) -> float:
    """Return the angle about the second axis by which the third one is brought onto the first."""
    if axes[0] == axes[2]:
        return 0.0
    return -np.pi / 2 if axes in "xyzxy" else np.pi / 2


def _pair(parts: Array, axes: str, offset: float) -> tuple[_Complex, _Complex]:
    """Return the two complex numbers of quaternions, shape (m, 4)."""
    i, j = (1 + "xyz".index(axis) for axis in axes[:2])
    k = 6 - i - j
    sense = 1 if axes[:2] in "xyzx" else -1
    scalar, first, second, third = (parts[:, n] for n in (0, i, j, k))
    cos, sin = np.cos(offset / 2), np.sin(offset / 2)
    # q ∘ (cos + sin e_j), in which e_i ∘ e_j = sense·e_k
    return (
        (scalar * cos - second * sin) + 1j * (first * cos - sense * third * sin),
        (second * cos + scalar * sin) + 1j * (sense * third * cos + first * sin),
    )


def _argument(
    t: Array, z: _Complex, rate: _Complex, angle: float, sign: float, error: float
) -> _Argument:
    """Follow the argument of numbers, shape (m,), with their rates.

    It is that of ``sign·z``, and ``angle`` at first, where z may be 0.
    """
    step = np.diff(t)
    near = _CLEAR * (error + _error_of_cubics(step, rate))
    controls = z[:-1], z[:-1] + step * rate[:-1] / 3, z[1:] - step * rate[1:] / 3, z[1:]
    cubics = np.column_stack(controls)
    before = z[0] if abs(z[0]) > near else sign * np.exp(1j * angle)
    angles, signs, lost = [angle], [sign], list[int]()
    for k, is_clear in enumerate(_clear(cubics, near).tolist()):
        parts = [(z[k], z[k + 1])] if is_clear else [*_clear_parts(cubics[k], near)]
        for first, last in parts:
            if first != before and (first / before).real < 0:
                before, sign = -before, -sign
            angle += float(np.angle(first / before) + np.angle(last / first))
            before = last
        if not is_clear and not _join(parts, z[k], z[k + 1]):
            lost.append(k)
        angles.append(angle)
        signs.append(sign)
    followed, factors = np.array(angles), np.array(signs)
    known = np.angle(factors * z)
    known += 2 * np.pi * np.round((followed - known) / (2 * np.pi))
    argument = np.where(np.abs(z) > near, known, followed)
    return _Argument(argument, (np.exp(-1j * argument) * z).real, lost)


def _join(parts: Sequence[tuple[complex, complex]], first: complex, last: complex) -> bool:
    """Tell whether parts of a cubic leave nothing out between its ends."""
    after = [*(part[0] for part in parts), last]
    return len(parts) > 0 and [first, *(part[1] for part in parts)] == after


def _error_of_cubics(step: Array, rate: _Complex) -> float:
    """Return the largest error of the cubics between samples, by differences of their rates."""
    differences = np.abs(np.diff(rate, 3))
    return float(step.max(initial=0.0) * differences.max(initial=0.0)) * _CUBIC


def _clear(cubics: _Complex, near: float) -> NDArray[np.bool_]:
    """Tell which cubics, shape (m, 4) by Bézier's points, lie on one side of 0 and not near."""
    middle = cubics.sum(axis=1, keepdims=True)
    distance = (cubics * middle.conj()).real.min(axis=1)
    return np.asarray(distance > near * np.abs(middle[:, 0]))


def _clear_parts(cubic: _Complex, near: float) -> Iterator[tuple[complex, complex]]:
    """Yield the ends of parts of a cubic that lie on one side of 0 and not near, in order."""
    if _clear(cubic[None], near)[0]:
        yield cubic[0], cubic[3]
    elif np.abs(cubic).max() > 2 * near:
        # De Casteljau's halves
        a = (cubic[1:] + cubic[:-1]) / 2
        b = (a[1:] + a[:-1]) / 2
        c = (b[1] + b[0]) / 2
        yield from _clear_parts(np.array([cubic[0], a[0], b[0], c]), near)
        yield from _clear_parts(np.array([c, b[1], a[2], cubic[3]]), near)
