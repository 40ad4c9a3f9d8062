"""Steps of the turning of rigid bodies: angular velocities, the rates of their angular momenta
about the centres of mass by Euler's law, and torques.

Components are along the axes of a body, where its inertia is constant; of a body whose moments are
equal along those of space, where these are shorter (L. D. Landau and E. M. Lifshitz, *Mechanics*,
3rd ed. 1976, sections 32 to 36).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.shorten import shortened
from lagrange_cli.mechanics.elements.motion import Turning
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.step_values import (
    BodySteps,
    SpinAxes,
    SpinSteps,
    TurningSteps,
    moment_symbol,
    rate_symbol,
    spin_symbol,
)
from lagrange_cli.mechanics.symbols.convert import total_derivative
from lagrange_cli.mechanics.system import BodyForce
from lagrange_cli.scene.bodies import Body

_ZERO = sp.Integer(0)
_UNITS = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
#: Signs of e_i · (e_j × e_k).
_HANDED = {(0, 1, 2): 1, (1, 2, 0): 1, (2, 0, 1): 1, (0, 2, 1): -1, (2, 1, 0): -1, (1, 0, 2): -1}


def turning_steps(
    reduced: Reduced,
    body: Body,
    turning: Turning,
    torques: Sequence[BodyForce],
    collected: Callable[[sp.Expr], sp.Expr],
) -> TurningSteps | None:
    """Return the steps of the turning of a body, None if it does not turn.

    Parameters
    ----------
    torques
        Those on the body, along the axes of space.
    collected
        Gathers the terms of a sum.
    """
    axes = _axes(body, turning)
    pairs = [
        (d, collected(spin))
        for d in _directions(axes, turning)
        if (spin := _along(d, turning.spin_in_space if axes == "space" else turning.spin)) != 0
    ]
    names = _axis_names(axes, [d for d, _ in pairs])
    symbols = {d: spin_symbol(body.name, name) for (d, _), name in zip(pairs, names, strict=True)}
    rates = {spin: _Rates.of(reduced, spin, collected) for _, spin in pairs}
    moved = {
        s: rates[spin].along_motion for s, (_, spin) in zip(symbols.values(), pairs, strict=True)
    }
    tensor, moments = _named_moments(body.name, axes, turning.inertia, [d for d, _ in pairs])
    inertia = _TurningInertia(axes, tensor, symbols)
    values = dict(zip(symbols.values(), (spin for _, spin in pairs), strict=True))
    values |= {rate_symbol(s.name): rate for s, rate in moved.items()}
    components = tuple(
        SpinSteps(
            axis=name,
            direction=d,
            spin=spin,
            rate=rates[spin].along_motion,
            partials=rates[spin].partials,
            law=(law := inertia.rate_of_momentum(d)),
            inertia=collected(law.xreplace(values)),
            torque=collected(sp.Add(*(_torque_along(axes, d, turning, m) for m in torques))),
        )
        for (d, spin), name in zip(pairs, names, strict=True)
    )
    energy = inertia.energy()
    return TurningSteps(axes, turning, components, moments, energy) if components else None


def turning_energy(body: BodySteps) -> sp.Expr:
    """Return ½ ω·Iω of a body that turns over q, v, t and named moments."""
    turning = body.turning
    assert turning is not None
    values = {spin_symbol(body.name, c.axis): c.spin for c in turning.components}
    return turning.energy.xreplace(values)


def _named_moments(
    body: str,
    axes: SpinAxes,
    inertia: Sequence[sp.Expr],
    directions: Sequence[tuple[int, int, int]],
) -> tuple[list[sp.Expr], tuple[tuple[str, sp.Expr], ...]]:
    """Name the entries of a tensor that are sums, equal ones by one name."""
    tensor, names = list(inertia), dict[sp.Expr, str]()
    numbers = sorted(map(_number, directions))
    for i, j in ((i, j) for i in numbers for j in numbers if i <= j):
        entry = inertia[3 * i + j]
        if entry.is_Add:
            name = f"{i + 1}" if i == j else f"{i + 1}{j + 1}"
            name = names.setdefault(entry, "" if axes == "plane" else name)
            tensor[3 * i + j] = tensor[3 * j + i] = moment_symbol(body, name)
    return tensor, tuple((name, entry) for entry, name in names.items())


def _axes(body: Body, turning: Turning) -> SpinAxes:
    if body.planar:
        return "plane"
    moments = turning.inertia[0::4]
    is_spherical = len(set(moments)) == 1 and not any(_products(turning.inertia))
    along_axes, in_space = (
        sum(int(e.count_ops()) for e in spin) for spin in (turning.spin, turning.spin_in_space)
    )
    return "space" if is_spherical and in_space < along_axes else "body"


def _products(inertia: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    return inertia[1], inertia[2], inertia[5]


def _directions(axes: SpinAxes, turning: Turning) -> Sequence[tuple[int, int, int]]:
    if axes != "plane":
        return _UNITS
    # From x to z a turn is about −y.
    (number,) = [k for k, e in enumerate(turning.spin) if e != 0] or [0]
    return [(0, -1, 0) if number == 1 else _UNITS[number]]


def _axis_names(axes: SpinAxes, directions: Sequence[tuple[int, int, int]]) -> list[str]:
    letters = {"body": "123", "space": "xyz"}.get(axes)
    return ["" if letters is None else letters[d.index(1)] for d in directions]


def _along(direction: Sequence[int], vector: Sequence[sp.Expr]) -> sp.Expr:
    parts = [e if d == 1 else -e for d, e in zip(direction, vector, strict=True) if d]
    return sp.Add(*parts)


def torque_components(turning: TurningSteps, torque: BodyForce) -> Iterator[tuple[str, sp.Expr]]:
    """Yield the axis of each component of ω with the torque along it."""
    for component in turning.components:
        along = _torque_along(turning.axes, component.direction, turning.turning, torque)
        yield component.axis, along


def _torque_along(
    axes: SpinAxes, direction: Sequence[int], turning: Turning, torque: BodyForce
) -> sp.Expr:
    if axes != "body":
        return _along(direction, torque.components)
    column = turning.rotation[direction.index(1) :: 3]
    pairs = zip(column, torque.components, strict=True)
    return shortened(sp.Add(*(r * m for r, m in pairs if m != 0)))


@dataclass(frozen=True)
class _Rates:
    """Derivatives of a component of ω.

    Attributes
    ----------
    along_motion
        ω̇.
    partials
        q → ∂ω/∂v, t → what of ω holds no v; zero ones absent.
    """

    along_motion: sp.Expr
    partials: tuple[tuple[sp.Symbol, sp.Expr], ...]

    @classmethod
    def of(cls, reduced: Reduced, spin: sp.Expr, collected: Callable[[sp.Expr], sp.Expr]) -> _Rates:
        speeds = [c.v for c in reduced.coordinates]
        partials = [(c.q, collected(derivative(spin, c.v))) for c in reduced.coordinates]
        partials.append((reduced.names.t, collected(spin.xreplace(dict.fromkeys(speeds, _ZERO)))))
        chain = [(c.q, c.v) for c in reduced.coordinates] + [
            (c.v, c.a) for c in reduced.coordinates
        ]
        rate = total_derivative(spin, reduced.names.t, chain)
        return cls(collected(rate), tuple((s, slope) for s, slope in partials if slope != 0))


@dataclass(frozen=True)
class _TurningInertia:
    """Inertia of a turning body over the symbols of the components of ω.

    Attributes
    ----------
    axes
        The axes of the components.
    tensor
        Entries of the tensor about the centre of mass, along the axes of the body.
    symbols
        Direction → symbol of the component, absent where it vanishes.
    """

    axes: SpinAxes
    tensor: Sequence[sp.Expr]
    symbols: Mapping[tuple[int, int, int], sp.Symbol]

    def rate_of_momentum(self, direction: tuple[int, int, int]) -> sp.Expr:
        """I ω̇ + ω × I ω along a direction."""
        numbers = {_number(d): s for d, s in self.symbols.items()}
        i = _number(direction)
        if self.axes != "body":
            return self.tensor[4 * i] * rate_symbol(numbers[i].name)
        terms = [self.tensor[3 * i + j] * rate_symbol(s.name) for j, s in numbers.items()]
        products: dict[sp.Expr, sp.Expr] = {}
        for (first, k, row), sign in _HANDED.items():
            if first == i and k in numbers:
                for m, s in numbers.items():
                    both = numbers[k] * s
                    moment = sign * self.tensor[3 * row + m]
                    products[both] = products.get(both, _ZERO) + moment
        return sp.Add(*terms, *(moment * both for both, moment in products.items()))

    def energy(self) -> sp.Expr:
        """½ ω·Iω, squares with one moment together."""
        numbers = {_number(d): s for d, s in self.symbols.items()}
        groups: dict[sp.Expr, list[sp.Expr]] = {}
        for k, s in numbers.items():
            groups.setdefault(self.tensor[4 * k], []).append(s**2)
        half = sp.Rational(1, 2)
        squares = [
            sp.Mul(half, moment, sp.Add(*parts), evaluate=False)
            for moment, parts in groups.items()
            if moment != 0
        ]
        return sp.Add(*squares, *self._mixed(numbers))

    def _mixed(self, numbers: Mapping[int, sp.Symbol]) -> Iterator[sp.Expr]:
        for j, k in ((0, 1), (0, 2), (1, 2)):
            if j in numbers and k in numbers:
                yield self.tensor[3 * j + k] * numbers[j] * numbers[k]


def _number(direction: Sequence[int]) -> int:
    return next(k for k, d in enumerate(direction) if d)
