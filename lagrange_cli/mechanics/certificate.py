"""Every derivation is checked before it is shown, by two routes that share nothing with it.

At random feasible states, in high precision, the residual M q̈ − f is compared

* with Newton's law: m r̈ − F, contracted with virtual displacements (so that
  constraint forces, orthogonal to them, drop out), where r̈ comes from series
  arithmetic along the motion and ∂r/∂q from a backward sweep;
* with d/dt ∂L/∂q̇ − ∂L/∂q − Q, evaluated from the Lagrangian that is shown, by
  a backward sweep over series.

No derivative taken symbolically enters either. The same evaluations tell which
coordinates are cyclic and whether the energy function is conserved.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InputError, InternalError, Mark, Problem
from lagrange_cli.mechanics.derivation import Derivation, raw_terms
from lagrange_cli.mechanics.equations import Certificate, ShownEquation
from lagrange_cli.mechanics.sampling import double, working_digits
from lagrange_cli.mechanics.tape import DomainError, Series, Tape

__all__ = ["Evidence", "certify", "certify_shown"]

_ZERO = mpf(0)
_UNIT = sp.Integer(1)
_ONE: Series = (mpf(1), _ZERO, _ZERO)

#: Draws, each closer to the initial configuration, before the scene is called singular there.
_DRAWS = 60

#: Above this number of coordinates one state is checked.
_LARGE = 64

Point = Mapping[sp.Symbol, mpf]


@dataclass(frozen=True)
class Evidence:
    """A passed certificate and what the evaluations showed on the way.

    Attributes
    ----------
    cyclic
        For each coordinate, whether ∂L/∂q vanished at every state.
    forced
        For each coordinate, whether a generalized force did not vanish.
    energy_conserved
        Whether d/dt (Σ q̇ ∂L/∂q̇ − L) = Q·q̇ − ∂L/∂t vanished at every state.
    energy_is_sum
        Whether Σ q̇ ∂L/∂q̇ − L equals T + V (V without velocities) at every state.
    mass_matrices
        M at each state, as doubles.
    states
        The states themselves (symbol → value).
    residuals
        M q̈ − f at the first state, each with the size of its terms.
    """

    certificate: Certificate
    cyclic: tuple[bool, ...]
    forced: tuple[bool, ...]
    energy_conserved: bool
    energy_is_sum: bool
    mass_matrices: tuple[list[list[float]], ...]
    states: tuple[Point, ...]
    residuals: tuple[tuple[mpf, mpf], ...]


class _Checker:
    """The tapes of one derivation."""

    def __init__(self, derivation: Derivation) -> None:
        reduced = derivation.reduced
        self.reduced = reduced
        self.t = reduced.names.t
        self.q = [c.q for c in reduced.coordinates]
        self.v = [c.v for c in reduced.coordinates]
        self.a = [c.a for c in reduced.coordinates]
        self.n = len(self.q)
        self.parameters = list(reduced.names.parameters.values())
        self.still = [self.t, *self.q, *self.parameters]
        self.moving = [self.t, *self.q, *self.v, *self.parameters]
        self.upper = [(j, k) for j in range(self.n) for k in range(j, self.n)]
        if any(derivation.mass[j][k] != derivation.mass[k][j] for j, k in self.upper):
            raise InternalError(Problem("the derived mass matrix is not symmetric"))
        masses = [sp.Add(*derivation.mass[j][k]) for j, k in self.upper]
        forcing = [sp.Add(*f) for f in derivation.forcing]
        self.derived = Tape([*masses, *forcing], self.moving)
        at_rest = derivation.potential.xreplace(dict.fromkeys(self.v, sp.Integer(0)))
        lagrangian = derivation.lagrangian
        self.l_terms = len(sp.Add.make_args(lagrangian))
        self.lagrangian = Tape(
            [lagrangian, derivation.kinetic, at_rest, *sp.Add.make_args(lagrangian)], self.moving
        )
        self._newton_tapes(derivation)

    def _newton_tapes(self, derivation: Derivation) -> None:
        reduced = self.reduced
        self.symbols = list(reduced.resolved)
        number = {s: k for k, s in enumerate(self.symbols)}
        self.components = [number[s] for body in reduced.names.particle_symbols for s in body]
        self.positions = Tape([reduced.resolved[s] for s in self.symbols], self.still)
        self.masses = Tape([m for m in reduced.masses for _ in range(3)], self.parameters)
        terms = raw_terms(reduced)
        self.raw = [*self.symbols, *(q for q in self.q if q not in number)]
        self.potential = Tape([sp.Add(*terms.positional)], [*self.raw, self.t, *self.parameters])
        self.extra = Tape([derivation.extra], self.moving)
        self.dissipation = Tape([derivation.dissipation], self.moving)
        self.forces = derivation.forces
        self.dissipates = derivation.dissipation != 0
        self.force_values = Tape([c for f in self.forces for c in f.components], self.moving)
        bodies = {
            body.name: [number[s] for s in symbols]
            for body, symbols in zip(reduced.names.bodies, reduced.names.body_symbols, strict=True)
        }
        self.targets = [
            bodies[f.on] if len(f.components) == 3 else [-1 - self._row(f.on)] for f in self.forces
        ]

    def _row(self, name: str) -> int:
        return [c.name for c in self.reduced.coordinates].index(name)

    # Evaluations at one state (q, v, a, t, parameters).

    def derived_parts(self, point: Point) -> tuple[list[list[mpf]], list[mpf]]:
        """M and f at a state."""
        values = self.derived.run([(point[s], _ZERO, _ZERO) for s in self.moving], 0).values
        mass = [[_ZERO] * self.n for _ in range(self.n)]
        for (j, k), value in zip(self.upper, values, strict=False):
            mass[j][k] = mass[k][j] = value
        return mass, values[len(self.upper) :]

    def series(self, point: Point) -> dict[sp.Symbol, Series]:
        """t, q, v and parameters along the motion with the state's accelerations."""
        series: dict[sp.Symbol, Series] = {self.t: (point[self.t], mpf(1), _ZERO)}
        for q, v, a in zip(self.q, self.v, self.a, strict=True):
            series[q] = (point[q], point[v], point[a])
            series[v] = (point[v], point[a], _ZERO)
        for p in self.parameters:
            series[p] = (point[p], _ZERO, _ZERO)
        return series

    def generalized_forces(self, point: Point, series: Mapping[sp.Symbol, Series]) -> list[mpf]:
        """Q from forces and dissipation by virtual work."""
        if not self.forces and not self.dissipates:
            return [_ZERO] * self.n
        values = self.force_values.run([series[s] for s in self.moving], 0).values
        pending = iter(values)
        seeds: dict[int, mpf] = {}
        q_force = [_ZERO] * self.n
        for targets in self.targets:
            for target in targets:
                value = next(pending)
                if target < 0:
                    q_force[-1 - target] += value
                else:
                    seeds[target] = seeds.get(target, _ZERO) + value
        run = self.positions.run([series[s] for s in self.still], 0)
        work = run.gradient({k: (x, _ZERO, _ZERO) for k, x in seeds.items()})
        drag = self.dissipation.run([series[s] for s in self.moving], 0).gradient({0: _ONE})
        for j in range(self.n):
            q_force[j] += work[1 + j][0] - drag[1 + self.n + j][0]
        return q_force

    def newton(self, series: Mapping[sp.Symbol, Series], forces: Sequence[mpf]) -> list[mpf]:
        """Σ (m r̈ − F)·∂r/∂q for each coordinate, T_extra − U by its Euler–Lagrange expression."""
        run = self.positions.run([series[s] for s in self.still], 2)
        outputs = run.outputs
        masses = self.masses.run([series[s] for s in self.parameters], 0).values
        seeds: dict[int, mpf] = {}
        for mass, k in zip(masses, self.components, strict=True):
            seeds[k] = seeds.get(k, _ZERO) + mass * outputs[k][2]
        place = dict(zip(self.symbols, outputs, strict=True))
        inputs = [place.get(s, series.get(s, _ONE)) for s in self.raw]
        slope = self.potential.run(
            [*inputs, series[self.t], *(series[p] for p in self.parameters)], 0
        ).gradient({0: _ONE})
        direct = [_ZERO] * self.n
        for k, s in enumerate(self.raw):
            if k < len(self.symbols):
                seeds[k] = seeds.get(k, _ZERO) + slope[k][0]
            else:
                direct[self.q.index(s)] += slope[k][0]
        work = run.gradient({k: (x, _ZERO, _ZERO) for k, x in seeds.items()})
        extra = self._euler_lagrange(self.extra, series)
        return [work[1 + j][0] + direct[j] + extra[j] - forces[j] for j in range(self.n)]

    def _euler_lagrange(self, tape: Tape, series: Mapping[sp.Symbol, Series]) -> list[mpf]:
        """d/dt ∂L/∂q̇ − ∂L/∂q of the tape's first output."""
        gradient = tape.run([series[s] for s in self.moving], 1).gradient({0: _ONE})
        return [gradient[1 + self.n + j][1] - gradient[1 + j][0] for j in range(self.n)]


@dataclass
class _State:
    """What one state showed."""

    mismatch: mpf
    mass: list[list[float]]
    cyclic: list[bool]
    forced: list[bool]
    conserved: bool
    is_sum: bool
    residuals: list[tuple[mpf, mpf]]


def certify(derivation: Derivation, digits: int, points: int) -> Evidence:
    """Check a derivation; the module says how.

    Parameters
    ----------
    digits
        Decimal digits that must agree (the arithmetic carries more).
    points
        Number of random states; one above 64 coordinates.

    Raises
    ------
    InternalError
        The derivation disagrees with Newton's law or with the Lagrangian.
    InputError
        The scene's expressions are not real near its initial configuration.
    """
    if len(derivation.reduced.coordinates) > _LARGE:
        points = 1
    with mpmath.workdps(working_digits(digits)):
        try:
            checker = _Checker(derivation)
        except DomainError as error:
            raise _nowhere(derivation) from error
        states, seen = [], []
        for point in _points(derivation, points):
            try:
                seen.append(_look(checker, point, digits))
                states.append(point)
            except (DomainError, ZeroDivisionError, OverflowError):
                continue
            if len(seen) == points:
                break
        if len(seen) < points:
            raise _nowhere(derivation)
        worst = max((s.mismatch for s in seen), default=_ZERO)
    if worst > mpf(10) ** (5 - digits):
        raise InternalError(
            Problem(
                "the derived equations disagree with Newton's law:"
                f" mismatch {mpmath.nstr(worst, 3)} at {digits} digits"
            )
        )
    n = range(len(derivation.reduced.coordinates))
    return Evidence(
        Certificate(points, digits, double(worst)),
        tuple(all(s.cyclic[j] for s in seen) for j in n),
        tuple(any(s.forced[j] for s in seen) for j in n),
        all(s.conserved for s in seen),
        all(s.is_sum for s in seen),
        tuple(s.mass for s in seen),
        tuple(states),
        tuple(seen[0].residuals) if seen else (),
    )


def certify_shown(evidence: Evidence, shown: Sequence[ShownEquation]) -> None:
    """Check that the textbook form, times what was divided out, is M q̈ − f.

    Raises
    ------
    InternalError
        It is not, at one of the states of the certificate.
    """
    digits = evidence.certificate.digits
    parts = [e for s in shown for pair in (*s.terms, (s.divided_by, _UNIT)) for e in pair]
    state = evidence.states[0]
    with mpmath.workdps(working_digits(digits)):
        run = Tape(parts, list(state)).run([(x, _ZERO, _ZERO) for x in state.values()], 0)
        pending = iter(run.values)
        for equation, (residual, scale) in zip(shown, evidence.residuals, strict=True):
            products = [next(pending) * next(pending) for _ in equation.terms]
            divisor = next(pending) * next(pending)
            difference = abs(sum(products) * divisor - residual)
            if difference > mpf(10) ** (5 - digits) * scale:
                raise InternalError(
                    Problem(f"the equation shown for '{equation.coordinate}' is not that derived")
                )


def _nowhere(derivation: Derivation) -> InputError:
    scene = derivation.reduced.scene
    mark = scene.initial[0].mark if scene.initial else Mark(scene.file, 1, 1)
    return InputError(
        Problem(
            "the scene's expressions are not finite real numbers at any configuration tried"
            + (" near the initial one" if scene.initial else ""),
            mark,
            hint="" if scene.initial else "give a configuration in 'initial' or 'near'",
            rule="not-real",
        )
    )


def _points(derivation: Derivation, points: int) -> Iterable[dict[sp.Symbol, mpf]]:
    reduced = derivation.reduced
    sampler = reduced.sampler([])
    for k in range(_DRAWS + points):
        width = mpf(2) ** -(max(0, k - points) // 4)
        point = sampler.draw(vary_parameters=k < _DRAWS // 2, width=width)
        if point is None:
            return
        for c in reduced.coordinates:
            scale = sampler.spread(c.q)
            point[c.v] = sampler.noise(scale)
            point[c.a] = sampler.noise(scale)
        yield point


def _look(checker: _Checker, point: Point, digits: int) -> _State:
    series = checker.series(point)
    mass, forcing = checker.derived_parts(point)
    forces = checker.generalized_forces(point, series)
    newton = checker.newton(series, forces)
    run = checker.lagrangian.run([series[s] for s in checker.moving], 1)
    gradient = run.gradient({0: _ONE})
    n = checker.n
    momenta, slopes = gradient[1 + n : 1 + 2 * n], gradient[1 : 1 + n]
    mismatch = _ZERO
    residuals = []
    for j in range(n):
        inertia = [mass[j][k] * point[checker.a[k]] for k in range(n)]
        ours = sum(inertia, -forcing[j])
        lagrange = momenta[j][1] - slopes[j][0] - forces[j]
        scale = sum((abs(x) for x in inertia), abs(forcing[j])) + abs(momenta[j][1])
        residuals.append((ours, scale))
        difference = max(abs(ours - newton[j]), abs(ours - lagrange))
        mismatch = max(mismatch, difference / scale if scale else difference)
    tiny = mpf(10) ** (5 - digits)
    values = run.values
    size = sum((abs(x) for x in values[3:]), _ZERO)
    spread = [max(abs(point[q]), abs(point[v])) for q, v in zip(checker.q, checker.v, strict=True)]
    power = [f * point[v] for f, v in zip(forces, checker.v, strict=True)]
    loss = sum(power, -gradient[0][0])
    flow = sum((abs(p) for p in power), abs(gradient[0][0]))
    energy = sum((m[0] * point[v] for m, v in zip(momenta, checker.v, strict=True)), -values[0])
    return _State(
        mismatch,
        [[double(x) for x in row] for row in mass],
        [abs(s[0]) * d <= tiny * size for s, d in zip(slopes, spread, strict=True)],
        [f != 0 for f in forces],
        bool(abs(loss) <= tiny * flow) or bool(flow <= tiny * size and not any(forces)),
        bool(abs(energy - values[1] - values[2]) <= tiny * size),
        residuals,
    )
