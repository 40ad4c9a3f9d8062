"""The independent route: SymPy's LagrangesMethod, and SciPy's DOP853 at its tightest."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from sympy import Expr, Symbol
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

Array = NDArray[np.float64]
Names = SimpleNamespace
Typed = Callable[[Names, Names, Names, Symbol], Expr]
TypedForces = Callable[[Names, Names, Names, Symbol], dict[str, Expr]]
TypedClosures = Callable[[Names, Names, Symbol], list[Expr]]
TypedRolling = Callable[[Names, Names, Names, Symbol], list[Expr]]


@dataclass(frozen=True)
class Dynamics:
    """M(q, t) and f(q, v, t) as numerical functions of (t, q, v, parameters), M a = f."""

    mass_matrix: Callable[..., Array]
    forcing: Callable[..., Array]

    def accelerations(self, t: float, q: Array, v: Array, p: Sequence[float]) -> Array:
        m = self.mass_matrix(t, q, v, p)
        return np.asarray(np.linalg.solve(m, self.forcing(t, q, v, p).ravel()))


@dataclass(frozen=True)
class Constrained(Dynamics):
    """The same beside φ(q, t) = 0 and ψ(q, v, t) = 0, of ``closures`` and ``rolling``.

    ``slopes`` is ∂φ/∂q. ``jacobian``, ``rate`` and ``bias`` are those of φ̇ and ψ:
    Φ v + rate = 0 and Φ a + bias = 0.
    """

    closures: Callable[..., Array]
    slopes: Callable[..., Array]
    jacobian: Callable[..., Array]
    rate: Callable[..., Array]
    bias: Callable[..., Array]

    def accelerations(self, t: float, q: Array, v: Array, p: Sequence[float]) -> Array:
        """From M a − Φᵀλ = f and Φ a = −bias."""
        arguments = t, q, v, p
        m, jacobian = self.mass_matrix(*arguments), self.jacobian(*arguments)
        k = len(jacobian)
        matrix = np.block([[m, -jacobian.T], [jacobian, np.zeros((k, k))]])
        right = [self.forcing(*arguments).ravel(), -self.bias(*arguments).ravel()]
        return np.asarray(np.linalg.solve(matrix, np.concatenate(right))[: len(q)])

    def nearest(self, t: float, q: Array, v: Array, p: Sequence[float]) -> tuple[Array, Array]:
        """A state that the closures allow, near to this one (Gauss and Newton)."""
        for _ in range(50 if len(self.closures(t, q, v, p)) else 0):
            step = np.linalg.lstsq(
                self.slopes(t, q, v, p), -self.closures(t, q, v, p).ravel(), rcond=None
            )[0]
            q = q + step
        jacobian = self.jacobian(t, q, v, p)
        excess = jacobian @ v + self.rate(t, q, v, p).ravel()
        return q, v - np.linalg.lstsq(jacobian, excess, rcond=None)[0]


def constrained(
    dynamics: Dynamics,
    typed: TypedClosures | None,
    rolling: TypedRolling | None,
    coordinates: Sequence[str],
    parameters: Sequence[str],
) -> Constrained:
    """Constraints typed over namespaces, beside dynamics of the same coordinates."""
    t = sp.Symbol("time", real=True)
    p, q, v = (
        [sp.Symbol(prefix + name, real=True) for name in names]
        for prefix, names in (("p_", parameters), ("q_", coordinates), ("v_", coordinates))
    )
    named = [
        SimpleNamespace(**dict(zip(names, symbols, strict=True)))
        for names, symbols in ((parameters, p), (coordinates, q), (coordinates, v))
    ]
    positions = typed(*named[:2], t) if typed else []
    closures = sp.Matrix(len(positions), 1, positions)
    slopes = closures.jacobian(q) if positions else sp.zeros(0, len(q))
    rates = slopes * sp.Matrix(v) + closures.diff(t)
    levels = sp.Matrix([*rates, *(rolling(*named, t) if rolling else [])])
    jacobian = levels.jacobian(v)
    rate = levels.subs(dict.fromkeys(v, 0))
    bias = levels.jacobian(q) * sp.Matrix(v) + levels.diff(t)
    made = [
        sp.lambdify((t, q, v, p), e, "numpy", cse=True)
        for e in (closures, slopes, jacobian, rate, bias)
    ]
    return Constrained(dynamics.mass_matrix, dynamics.forcing, *made)


def from_lagrangian(
    lagrangian: Expr,
    generalized: Sequence[Expr],
    coordinates: Sequence[tuple[Symbol, Symbol]],
    parameters: Sequence[Symbol],
    time: Symbol,
) -> Dynamics:
    """Lagrange's equations of L(q, v, t) with the generalized forces Q added.

    Coordinates come as pairs of independent symbols (q, v); LagrangesMethod
    wants functions of time, so they are put in and taken out again.
    """
    t = dynamicsymbols._t
    qs = [sp.Function(f"f{i}")(t) for i in range(len(coordinates))]
    into = {time: t}
    for function, (q, v) in zip(qs, coordinates, strict=True):
        into |= {q: function, v: function.diff(t)}
    method = LagrangesMethod(lagrangian.xreplace(into), qs)
    method.form_lagranges_equations()
    arguments = (
        t,
        [sp.Symbol(f"q{i}") for i in range(len(qs))],
        [sp.Symbol(f"v{i}") for i in range(len(qs))],
        list(parameters),
    )
    out = dict(zip((f.diff(t) for f in qs), arguments[2], strict=True))
    bare = dict(zip(qs, arguments[1], strict=True))
    forcing = method.forcing + sp.Matrix([sp.sympify(e).xreplace(into) for e in generalized])
    numeric = [
        sp.lambdify(arguments, e.xreplace(out).xreplace(bare), "numpy", cse=True)
        for e in (method.mass_matrix, forcing)
    ]
    return Dynamics(*numeric)


def from_typed(
    typed: Typed,
    forces: TypedForces | None,
    coordinates: Sequence[str],
    parameters: Sequence[str],
) -> Dynamics:
    """The same from a Lagrangian typed over namespaces of parameters, q and v."""
    p, q, v = (
        {name: sp.Symbol(prefix + name, real=True, positive=prefix == "p_") for name in names}
        for prefix, names in (("p_", parameters), ("q_", coordinates), ("v_", coordinates))
    )
    spaces = [SimpleNamespace(**s) for s in (p, q, v)]
    t = sp.Symbol("time", real=True)
    given: Mapping[str, Expr] = forces(*spaces, t) if forces else {}
    return from_lagrangian(
        typed(*spaces, t),
        [given.get(c, sp.Integer(0)) for c in coordinates],
        [(q[c], v[c]) for c in coordinates],
        [p[n] for n in parameters],
        t,
    )


def integrate(
    dynamics: Dynamics, p: Sequence[float], y0: Array, times: Array, scale: Array
) -> Array:
    """y = [q, v] at the times by DOP853 at rtol 1e-13; ``scale`` of each component sets atol."""
    n = len(y0) // 2

    def rhs(t: float, y: Array) -> Array:
        return np.concatenate([y[n:], dynamics.accelerations(t, y[:n], y[n:], p)])

    solution = solve_ivp(
        rhs,
        (times[0], times[-1]),
        y0,
        method="DOP853",
        t_eval=times,
        rtol=1e-13,
        atol=1e-15 * scale,
    )
    assert solution.success, solution.message
    return np.asarray(solution.y.T)
