"""Motion with contacts by another route: SciPy's events, and impacts as least squares.

The accelerations with contacts are those nearest to the free ones, in the metric of the kinetic
energy, that no closed gap forbids (Gauss' principle of least constraint); an impact takes the
velocities likewise. Both are problems of non-negative least squares for the pushes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import nnls

from tests.systems.lagranges_method import Constrained

Array = NDArray[np.float64]

#: A gap or its rate below this is zero (lengths and times of these scenes are about 1).
ZERO = 1e-10


@dataclass(frozen=True)
class Happened:
    t: float
    contact: int
    closes: bool


class ContactReference:
    """The motion of a system whose closures are gaps.

    ``dynamics`` holds the gaps as closures, ``e`` their coefficients of restitution.
    """

    def __init__(self, dynamics: Constrained, p: Sequence[float], e: Sequence[float]) -> None:
        self.dynamics, self.p, self.e = dynamics, p, np.array(e, dtype=float)
        self.happened: list[Happened] = []

    def _of(self, name: str, t: float, y: Array) -> Array:
        n = len(y) // 2
        return np.asarray(getattr(self.dynamics, name)(t, y[:n], y[n:], self.p), dtype=float)

    def gaps(self, t: float, y: Array) -> Array:
        return self._of("closures", t, y).ravel()

    def speeds(self, t: float, y: Array) -> Array:
        n = len(y) // 2
        return self._of("jacobian", t, y) @ y[n:] + self._of("rate", t, y).ravel()

    def _pushes(self, t: float, y: Array, rows: list[int], short: Array) -> tuple[Array, Array]:
        """Pushes x ≥ 0 with J M⁻¹ Jᵀ x + short ≥ 0 complementary, and M⁻¹ Jᵀ x."""
        jacobian = self._of("jacobian", t, y)[rows]
        root = np.linalg.cholesky(self._of("mass_matrix", t, y))
        half = np.linalg.solve(root, jacobian.T)  # L⁻¹ Jᵀ
        # min ½|half x|² + short·x, x ≥ 0, as least squares on (half; small) x.
        target = -np.linalg.lstsq(half.T, short, rcond=None)[0]
        x, _ = nnls(half, target)
        return x, np.linalg.solve(root.T, half @ x)

    def accelerations(self, t: float, y: Array, closed: list[int]) -> Array:
        n = len(y) // 2
        q, v = y[:n], y[n:]
        mass = self._of("mass_matrix", t, y)
        forcing = self.dynamics.forcing(t, q, v, self.p).ravel()
        if not closed:
            return np.linalg.solve(mass, forcing)
        return self._held(t, y, mass, forcing, closed)[:n]

    def _held(self, t: float, y: Array, mass: Array, forcing: Array, closed: list[int]) -> Array:
        """Accelerations, then multipliers, with contacts that stay closed."""
        jacobian = self._of("jacobian", t, y)[closed]
        bias = self._of("bias", t, y).ravel()[closed]
        k = len(closed)
        matrix = np.block([[mass, -jacobian.T], [jacobian, np.zeros((k, k))]])
        return np.linalg.solve(matrix, np.concatenate([forcing, -bias]))

    def _multiplier(self, t: float, y: Array, closed: list[int], contact: int) -> float:
        n = len(y) // 2
        mass = self._of("mass_matrix", t, y)
        forcing = self.dynamics.forcing(t, y[:n], y[n:], self.p).ravel()
        return float(self._held(t, y, mass, forcing, closed)[n + closed.index(contact)])

    def _settled(
        self, t: float, y: Array, touching: list[int], leaves: int | None
    ) -> tuple[Array, list[int]]:
        """State and closed contacts behind an event."""
        n, y = len(y) // 2, np.array(y)
        speeds = self.speeds(t, y)
        if touching and (speeds[touching] < -ZERO).any():
            back = self.e[touching] * np.minimum(speeds[touching], 0)
            _, change = self._pushes(t, y, touching, speeds[touching] + back)
            y[n:] += change
            speeds = self.speeds(t, y)
        rest = [k for k in touching if abs(speeds[k]) < ZERO and k != leaves]
        if not rest:
            return y, []
        free = self.accelerations(t, y, [])
        bias = self._of("bias", t, y).ravel()
        short = (self._of("jacobian", t, y) @ free + bias)[rest]
        x, _ = self._pushes(t, y, rest, short)
        return y, [k for k, push in zip(rest, x, strict=True) if push > ZERO]

    def run(self, y0: Array, times: Array, scale: Array) -> Array:
        """States at the times; ``happened`` receives the events."""
        t, until = float(times[0]), float(times[-1])
        touching = [k for k, gap in enumerate(self.gaps(t, y0)) if abs(gap) < ZERO]
        y, closed = self._settled(t, y0, touching, None)
        states = np.empty((len(times), len(y0)))
        states[0] = y0
        while t < until:
            t, y, closed = self._piece(t, y, closed, times, states, scale)
        return states

    def _piece(
        self, t: float, y: Array, closed: list[int], times: Array, states: Array, scale: Array
    ) -> tuple[float, Array, list[int]]:
        n, start, until = len(y) // 2, t, float(times[-1])
        later = (times > t) & (times <= until)

        def rhs(at: float, state: Array) -> Array:
            return np.concatenate([state[n:], self.accelerations(at, state, closed)])

        def watch(contact: int):
            def function(at: float, state: Array) -> float:
                if at - start < 1e-9:  # what opens or closes here is zero here
                    return 1.0
                if contact in closed:
                    return self._multiplier(at, state, closed, contact)
                return float(self.gaps(at, state)[contact])

            function.terminal, function.direction = True, -1
            return function

        solution = solve_ivp(
            rhs,
            (t, until),
            y,
            method="DOP853",
            t_eval=times[later],
            events=[watch(k) for k in range(len(self.e))],
            rtol=1e-13,
            atol=1e-15 * scale,
            max_step=(until - float(times[0])) / 200,
        )
        assert solution.success, solution.message
        rows = np.flatnonzero(later)[: len(solution.t)]
        if len(rows):
            states[rows] = solution.y.T
        if solution.status == 0:
            return until, y, closed
        (contact,) = [k for k, at in enumerate(solution.t_events) if len(at)][:1]
        t, y = float(solution.t_events[contact][0]), solution.y_events[contact][0]
        closes = contact not in closed
        self.happened.append(Happened(t, contact, closes))
        touching = sorted({*closed, contact})
        y, closed = self._settled(t, y, touching, None if closes else contact)
        return t, y, closed
