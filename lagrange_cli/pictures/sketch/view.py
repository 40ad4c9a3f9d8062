"""Gravity in a sketch, and the plane of the picture: that of the motion, or an oblique view."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.pictures.sketch.configurations import Function

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from sympy import Expr, Symbol

    from lagrange_cli.pictures.sketch.configurations import Configurations

    Array: TypeAlias = NDArray[np.float64]

_SAME = 1e-9


def gravity(configurations: Configurations) -> Array | None:
    """Return the acceleration with which all heavy particles fall; None if there is none.

    A potential is a weight if it is −m a·r of one or more particles of mass m, with the same a for
    all of them, and the parameters in a are not those in masses.
    """
    try:
        fields = _fields(configurations)
    except DomainError:
        return None
    if not fields:
        return None
    size = np.linalg.norm(fields[0])
    alike = all(np.abs(field - fields[0]).max() <= _SAME * size for field in fields)
    return fields[0] if alike and size > 0 else None


def _fields(configurations: Configurations) -> list[Array]:
    """Return accelerations of all potentials that are weights; raises DomainError as they do."""
    potentials = [potential for _, potential in configurations.depiction.potentials]
    fields = [field for v in potentials for field in _of_names(configurations, v)]
    if fields or not potentials:
        return fields
    moments = _moments(configurations)
    return [field for v in potentials for field in _of_motion(configurations, v, moments)]


def _of_names(configurations: Configurations, potential: Expr) -> list[Array]:
    """Return accelerations of terms that are linear in the Cartesian names of particles."""
    import sympy

    particles = configurations.equations.system.particles
    owners = {s: p for p in particles for s in p.components}
    weights: dict[str, dict[int, Expr]] = {}
    for term in sympy.Add.make_args(sympy.expand_mul(potential)):
        names = [s for s in term.free_symbols if s.name in owners]
        slope = sympy.diff(term, names[0]) if len(names) == 1 else sympy.Integer(0)
        if not _is_constant(configurations, slope):
            continue
        particle = owners[names[0].name]
        axis = particle.components.index(names[0].name)
        fields = weights.setdefault(particle.name, {})
        fields[axis] = fields.get(axis, 0) - slope / particle.mass
    masses = {s for p in particles for s in p.mass.free_symbols}
    if any(not e.free_symbols.isdisjoint(masses) for f in weights.values() for e in f.values()):
        return []
    return [_vector(configurations, field) for field in weights.values()]


def _is_constant(configurations: Configurations, slope: Expr) -> bool:
    return bool(slope != 0 and slope.free_symbols <= configurations.values.keys())


def _vector(configurations: Configurations, field: dict[int, Expr]) -> Array:
    values = configurations.values
    vector = np.zeros(3)
    vector[list(field)] = Function(list(field.values()), list(values))(list(values.values()))
    return vector


@dataclass(frozen=True)
class _Moments:
    """Σ m r of the particles in all configurations, shape (K, 3), for some parameters."""

    values: Mapping[Symbol, float]
    rows: Array


def _moments(configurations: Configurations) -> list[_Moments]:
    """Moments with the parameters of the picture, and with other masses."""
    particles = configurations.equations.system.particles
    masses = {s for p in particles for s in p.mass.free_symbols}
    values = dict(configurations.values)
    heavier = {s: v * (1.3 + 0.2 * k) for k, (s, v) in enumerate(values.items()) if s in masses}
    sizes = Function([p.mass for p in particles], list(values))
    states = list(zip(configurations.q, configurations.times, strict=True))
    moments = []
    for chosen in (values, values | heavier):
        places = [configurations.moved(q, float(t), chosen)[: len(particles)] for q, t in states]
        moments.append(
            _Moments(chosen, np.array([sizes(list(chosen.values())) @ r for r in places]))
        )
    return moments


def _of_motion(
    configurations: Configurations, potential: Expr, moments: Sequence[_Moments]
) -> list[Array]:
    """The acceleration of a potential that is a weight at all configurations, whatever the masses.

    Coordinates may stand for positions here: −m g l cos θ. Directions in which nothing moves are
    left out; the others must all be told apart by the configurations.
    """
    try:
        fits = [_fitted(configurations, potential, moment) for moment in moments]
    except DomainError:
        return []
    if len(fits) < 2 or fits[0] is None or fits[1] is None:
        return []
    size = float(np.linalg.norm(fits[0]))
    return [fits[0]] if size > 0 and np.abs(fits[0] - fits[1]).max() <= 1e-8 * size else []


def _fitted(configurations: Configurations, potential: Expr, moments: _Moments) -> Array | None:
    """Fit a in V = −Σ m a·r + constant over the axes along which particles move."""
    symbols = sorted(potential.free_symbols, key=lambda s: s.name)
    changed = {s.name: v for s, v in moments.values.items()}
    known = [configurations.symbol_values(k) | changed for k in range(len(moments.rows))]
    if not all(s.name in known[0] for s in symbols):
        return None
    function = Function([potential], symbols)
    energies = np.array([function([k[s.name] for s in symbols])[0] for k in known])
    spread = np.ptp(moments.rows, axis=0)
    moving = np.flatnonzero(spread > 1e-6 * max(spread.max(), 1e-300))
    columns = np.column_stack([-moments.rows[:, moving], np.ones(len(energies))])
    fit, _, rank, _ = np.linalg.lstsq(columns, energies, rcond=1e-10)
    off = np.abs(columns @ fit - energies).max()
    if rank < columns.shape[1] or len(energies) <= rank + 1 or off > 1e-9 * np.ptp(energies):
        return None
    acceleration = np.zeros(3)
    acceleration[moving] = fit[:-1]
    return acceleration


#: Where an axis that comes towards the viewer goes in the picture (cabinet projection).
_TOWARDS_VIEWER = np.array([-0.38, -0.30])


@dataclass(frozen=True)
class View:
    """A linear map from space to the picture.

    Attributes
    ----------
    matrix
        Shape (2, 3): to the right, and up.
    axes
        Numbers of the axes that are shown: two of a plane, or three.
    """

    matrix: Array
    axes: tuple[int, ...]

    @property
    def is_flat(self) -> bool:
        return len(self.axes) == 2

    def project(self, places: Array) -> Array:
        """Project places, shape (..., 3), to the picture, shape (..., 2)."""
        projected: Array = places @ self.matrix.T
        return projected


def view_of(configurations: Configurations, down: Array | None, *lines: Array) -> View:
    """Choose the plane in which all bodies are and stay, or else an oblique view; down is down.

    ``lines`` are in the picture too, each of shape (P, 3).
    """
    places = np.concatenate([configurations.places.reshape(-1, 3), *lines])
    spread = np.ptp(places, axis=0)
    moving = [axis for axis in range(3) if spread[axis] > 1e-9 * configurations.size]
    vertical = _axis_of(down)
    if len(moving) == 3:
        return _oblique(vertical)
    return _flat(_plane(moving, vertical), vertical)


def _axis_of(down: Array | None) -> tuple[int, int] | None:
    """Return the axis along which gravity points and the sign of up; None if it is along none."""
    if down is None:
        return None
    axis = int(np.abs(down).argmax())
    across = np.delete(down, axis)
    alone = np.abs(across).max() <= 1e-9 * abs(down[axis])
    return (axis, -int(np.sign(down[axis]))) if alone else None


def _plane(moving: list[int], vertical: tuple[int, int] | None) -> tuple[int, int]:
    """Two axes: those of the motion, of gravity, then x with z."""
    wanted = [*moving, *([] if vertical is None else [vertical[0]]), 0, 2]
    first, second = sorted(list(dict.fromkeys(wanted))[:2])
    return first, second


def _flat(plane: tuple[int, int], vertical: tuple[int, int] | None) -> View:
    right, up = plane
    sign = 1
    if vertical is not None and vertical[0] in plane:
        up, sign = vertical
        right = plane[0] if up == plane[1] else plane[1]
    matrix = np.zeros((2, 3))
    matrix[0, right], matrix[1, up] = 1, sign
    return View(matrix, (right, up))


def _oblique(vertical: tuple[int, int] | None) -> View:
    """Return a right-handed picture: towards the viewer × right = up."""
    up, sign = vertical or (2, 1)
    towards, right = (up + 1) % 3, (up + 2) % 3
    if sign < 0:
        towards, right = right, towards
    matrix = np.zeros((2, 3))
    matrix[0, right], matrix[1, up] = 1, sign
    matrix[:, towards] = _TOWARDS_VIEWER
    return View(matrix, (towards, right, up))
