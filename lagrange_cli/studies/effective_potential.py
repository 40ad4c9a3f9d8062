"""The effective potential of one coordinate, with the turning points of the motion.

With the ignored momenta of the start, ½ S(q) q̇² + V_eff(q) = E: the motion stays where V_eff ≤ E,
and turns where both are equal (L. D. Landau and E. M. Lifshitz, Mechanics, 3rd ed., § 11 and 14).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.forms.routhian import Routhian, routhian_form
from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape
from lagrange_cli.simulate.model.labels import Labels, labels_of

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Coordinate
    from lagrange_cli.simulate.arrays import Array

#: The first step of the search for a turning point, as a part of the size of the coordinate, the
#: factor from one step to the next, and the distance at which it ends, in sizes.
_FIRST, _GROWTH, _FARTHEST = 2e-3, 1.02, 20.0

#: Part of the width between turning points that is shown beside them, and the part of the height
#: between the least V_eff and E that is shown above E.
_BESIDE, _ABOVE = 0.6, 0.8

#: Width that is shown of a motion that stays where it is, as a part of the size.
_AROUND = 0.5

#: Points of the curve.
_POINTS = 401

#: Halvings of an interval that holds a turning point.
_HALVINGS = 60


@dataclass(frozen=True)
class EffectivePotential:
    """V_eff of one coordinate with the momenta of the start.

    Attributes
    ----------
    coordinate
        The coordinate that is left.
    start
        Its initial value.
    energy
        ½ S q̇² + V_eff at the start; conserved unless ``turning`` is None.
    turning
        The nearest turning points below and above the start, each None where there is none; None
        where friction, forces or the time change the energy.
    q, values
        The curve, shapes (m,).
    labels
        Names and units for pictures.
    """

    coordinate: Coordinate
    start: float
    energy: float
    turning: tuple[float | None, float | None] | None
    q: Array
    values: Array
    labels: Labels

    @property
    def phrase(self) -> str:
        """The turning points in words."""
        name = self.labels.symbol(self.coordinate.name).plain
        if self.turning is None:
            return f"no turning points of {name}: V_eff and its motion exchange energy with others"
        places = [f"{x:.6g}" for x in self.turning if x is not None]
        if not places:
            return f"{name} has no turning points near the start"
        return f"{name} turns at {' and '.join(places)}, where V_eff = {self.energy:.6g}"


def effective_potential(equations: Equations) -> EffectivePotential:
    """Evaluate V_eff about the initial configuration.

    Raises
    ------
    InputError
        Located: as :func:`.analysis.routhian.routhian_form`; more coordinates are left than one, or
        none; V_eff depends on time or on inputs; the start, or a parameter, is not known.
    """
    form = routhian_form(equations)
    coordinate, q0, v0, values = _start(equations, form)
    total = form.effective_potential

    def evaluator(expression: sp.Expr) -> Callable[[float], float]:
        tape = Tape([expression], [coordinate.q, *values])

        def at(q: float) -> float:
            try:
                inputs = [(mpf(x), mpf(0), mpf(0)) for x in (q, *values.values())]
                return float(tape.run(inputs, 0).values[0])
            except (DomainError, ZeroDivisionError, ValueError, TypeError, OverflowError):
                return math.nan

        return at

    potential = evaluator(total)
    inertia = evaluator(form.mass_matrix[0][0])
    energy = inertia(q0) * v0**2 / 2 + potential(q0)
    if not math.isfinite(energy):
        message = f"the effective potential has no value at the start, {coordinate.name} = {q0:.6g}"
        raise _refused(equations, message)
    size = math.pi if coordinate.is_angle else abs(q0) or 1.0
    limits = tuple(_turning(potential, energy, q0, sign * size) for sign in (-1, 1))
    is_kept = any(c.kind != "momentum" for c in equations.derivation.conserved)
    q, curve = _curve(potential, energy, q0, size, limits)
    turning = (limits[0], limits[1]) if is_kept else None
    return EffectivePotential(coordinate, q0, energy, turning, q, curve, labels_of(equations))


def _start(
    equations: Equations, form: Routhian
) -> tuple[Coordinate, float, float, dict[sp.Symbol, float]]:
    """Return the coordinate, its place and velocity, and the values of all other symbols."""
    if len(form.coordinates) != 1 or form.closures:
        listed = ", ".join(f"'{c.name}'" for c in form.coordinates) or "none"
        message = (
            f"a picture of the effective potential needs one coordinate, and {listed} are left"
        )
        raise _refused(equations, message)
    (coordinate,) = form.coordinates
    initial = equations.system.initial
    if initial is None or not form.start:
        raise _refused(equations, "the momenta in the effective potential need an initial state")
    values = dict(zip((m.symbol for m in form.momenta), form.start, strict=True))
    values |= {p.symbol: float(p.value) for p in equations.system.parameters if p.value is not None}
    known = {coordinate.q, *values}
    unknown = symbols_in(form.effective_potential) | symbols_in(form.mass_matrix[0][0])
    missing = sorted(symbol.name for symbol in unknown - known)
    if missing:
        message = f"the effective potential depends on {', '.join(missing)}, which has no value"
        raise _refused(equations, message)
    number = equations.system.coordinates.index(coordinate)
    place, velocity = initial.positions[number], initial.velocities[number]
    return coordinate, float(place), float(velocity), values


def _refused(equations: Equations, message: str) -> InputError:
    return InputError(Problem(message, Mark(equations.presentation.file, 1, 1), rule="no-picture"))


def _turning(
    potential: Callable[[float], float], energy: float, start: float, size: float
) -> float | None:
    """Return the first place in the direction of ``size`` where V_eff passes E, or None."""
    inside, step = start, _FIRST * size
    while abs(inside + step - start) <= _FARTHEST * abs(size):
        outside = inside + step
        value = potential(outside)
        if math.isnan(value):
            return None
        if value > energy:
            for _ in range(_HALVINGS):
                middle = (inside + outside) / 2
                if potential(middle) > energy:
                    outside = middle
                else:
                    inside = middle
            return inside
        inside, step = outside, step * _GROWTH
    return None


def _curve(
    potential: Callable[[float], float],
    energy: float,
    start: float,
    size: float,
    limits: tuple[float | None, ...],
) -> tuple[Array, Array]:
    """Return V_eff over the range of the motion with a margin, up to some height above E."""
    below, above = limits
    reach = max((abs(x - start) for x in limits if x is not None), default=0.0)
    far = 2 * max(reach, _AROUND * size)
    low = start - far if below is None else below
    high = start + far if above is None else above
    width = high - low
    margin = _BESIDE * width if width > _FIRST * size else _AROUND * size
    inside = [potential(x) for x in np.linspace(low, high, _POINTS).tolist()]
    least = min([x for x in inside if math.isfinite(x)], default=energy)
    height = energy - least
    if height <= 1e-9 * (abs(energy) + abs(least)) or width <= _FIRST * size:
        # The motion stays at a minimum: the curve beside it tells the height.
        near = [potential(start + k * margin / 4) for k in (-1, 1)]
        height = max([abs(x - energy) for x in near if math.isfinite(x)], default=1.0) or 1.0
    top = energy + _ABOVE * height
    low, high = (_edge(potential, top, end, sign * margin) for end, sign in ((low, -1), (high, 1)))
    q = np.linspace(low, high, _POINTS)
    values = np.array([potential(x) for x in q.tolist()])
    finite = np.isfinite(values)
    return q[finite], values[finite]


def _edge(potential: Callable[[float], float], top: float, end: float, margin: float) -> float:
    """Return the last place up to ``end + margin`` at which V_eff has a value, at most ``top``."""
    last = end
    for part in np.linspace(0.0, 1.0, _POINTS)[1:].tolist():
        value = potential(end + part * margin)
        if not value <= top:
            break
        last = end + part * margin
    return last
