"""Certificate of what is printed: equations, rates of momenta, energies and the Lagrangian.

Printed forms are derived ones rewritten further: collected, divided, with other names. Each is
evaluated at the first state of the certificate and compared with what was certified there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InternalError, Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.certify.certificate import CLOSE_DIGITS, Evidence
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.equations import EulerForm, ShortLagrangian, ShownEquation
from lagrange_cli.mechanics.numerics.autodiff import Tape, TaylorSeries, evaluate
from lagrange_cli.mechanics.numerics.rank import SymbolValues
from lagrange_cli.mechanics.numerics.sampling import working_digits
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.step_values import rate_symbol, spin_symbol

_ZERO = mpf(0)
_UNIT = sp.Integer(1)

#: Residuals of the equations of motion, each with the size of its terms.
_Residuals = Sequence[tuple[mpf, mpf]]


def certify_shown(evidence: Evidence, shown: Sequence[ShownEquation]) -> None:
    """Check that the textbook form, times its divisor, is M q̈ − f − Σ λ·gradient.

    Raises
    ------
    InternalError
        It is not, at one of the states of the certificate.
    """
    parts = [e for s in shown for pair in (*s.terms, (s.divided_by, _UNIT)) for e in pair]
    wrong: str | None = None
    for digits, residuals in attempts(evidence):
        wrong = _not_derived(evidence, residuals, shown, parts, digits)
        if wrong is None:
            return
    raise InternalError(Problem(f"the equation shown for '{wrong}' is not that derived"))


def certify_rates(evidence: Evidence, reduced: Reduced, shown: Sequence[ShownEquation]) -> None:
    """Check that rates of momenta, each with its remainder, are M q̈ − f − Σ λ·gradient.

    Momenta are differentiated along the motion by series, not symbolically.

    Raises
    ------
    InternalError
        One is not, at the first state of the certificate.
    """
    forms = {k: s.rate_form for k, s in enumerate(shown) if s.rate_form is not None}
    wrong: str | None = None
    for digits, residuals in attempts(evidence) if forms else ():
        with mpmath.workdps(digits):
            along = along_motion(evidence.states[0], reduced)
            parts = [e for form in forms.values() for e in (form.momentum, form.remainder_sum)]
            outputs = iter(Tape(parts, list(along)).run([*along.values()], 1).outputs)
            wrong = None
            for k in forms:
                rate, remainder = next(outputs)[1], next(outputs)[0]
                residual, scale = residuals[k]
                if abs(rate + remainder - residual) > _tolerance(evidence) * scale:
                    wrong = wrong or shown[k].coordinate
        if wrong is None:
            return
    if wrong is not None:
        raise InternalError(Problem(f"the momentum shown for '{wrong}' has another rate"))


def certify_energy(evidence: Evidence, energy: sp.Expr) -> None:
    """Check that an energy is Σ q̇ ∂L/∂q̇ − L at the first state of the certificate.

    Raises
    ------
    InternalError
        It is not.
    """
    first, second = _precisions(evidence)
    if not (
        _is_energy(evidence, evidence.energy, energy, first)
        or _is_energy(evidence, evidence.look_closely().energy, energy, second)
    ):
        raise InternalError(Problem("the energy shown is not that derived"))


def _is_energy(evidence: Evidence, function: tuple[mpf, mpf], energy: sp.Expr, digits: int) -> bool:
    """Tell whether an energy is ``function`` at the first state, in so many digits."""
    with mpmath.workdps(digits):
        derived, scale = function
        difference = abs(derived - evidence.value(energy))
        return bool(difference <= _tolerance(evidence) * scale)


def certify_lagrangian(evidence: Evidence, derivation: Uncertified, short: ShortLagrangian) -> None:
    """Check that the shown Lagrangian is T − V but for terms without coordinates and velocities.

    Raises
    ------
    InternalError
        It is not.
    """
    moving = {s for c in derivation.reduced.coordinates for s in (c.q, c.v)}
    state = evidence.states[0]
    parts = [short.expression, short.left_out, -derivation.lagrangian]
    is_same = False
    for digits in _precisions(evidence):
        with mpmath.workdps(digits):
            values = evaluate(parts, state)
            difference = abs(sum(values, _ZERO))
            is_same = is_same or difference <= _tolerance(evidence) * sum(map(abs, values), _ZERO)
    if not is_same or not short.left_out.free_symbols.isdisjoint(moving):
        raise InternalError(Problem("the Lagrangian shown is not that derived"))


def certify_euler(evidence: Evidence, derivation: Uncertified, form: EulerForm) -> None:
    """Check Euler's equations, q̇ and T over ω at the first state of the certificate.

    Multiplied by ∂q̇/∂ω, M q̈ − f − Σ λ·gradient of what turns must be I ω̇ + ω × I ω − M.

    Raises
    ------
    InternalError
        One of them is not that derived.
    """
    if not any(
        _is_euler(evidence, derivation, form, residuals, digits)
        for digits, residuals in attempts(evidence)
    ):
        raise InternalError(Problem("Euler's equations shown are not those derived"))


def _is_euler(
    evidence: Evidence,
    derivation: Uncertified,
    form: EulerForm,
    residuals: _Residuals,
    digits: int,
) -> bool:
    reduced, state = derivation.reduced, evidence.states[0]
    coordinates = [reduced.coordinates[k] for k in form.numbers]
    symbols = [spin_symbol(form.body, axis) for axis in "123"]
    with mpmath.workdps(digits):
        along = along_motion(state, reduced)
        spins = Tape(list(form.spins), list(along)).run([*along.values()], 1).outputs
        known = {**state, **{s: w[0] for s, w in zip(symbols, spins, strict=True)}}
        known |= {rate_symbol(s.name): w[1] for s, w in zip(symbols, spins, strict=True)}
        slopes = [derivative(rate, s) for s in symbols for rate in form.rates]
        pairs = [(form.kinetic, derivation.kinetic)]
        pairs += [(rate, c.v) for rate, c in zip(form.rates, coordinates, strict=True)]
        bound, size = _tolerance(evidence), mpf(1)
        values = evaluate([e for pair in pairs for e in pair], known)
        for shown, derived in zip(values[::2], values[1::2], strict=True):
            if abs(shown - derived) > bound * max(abs(derived), size):
                return False
        steps, count = evaluate(slopes, known), len(form.numbers)
        parts = zip(form.inertia, form.gyroscopic, form.torques, strict=True)
        for k, (inertia, gyroscopic, torque) in enumerate(parts):
            works = [
                step * residuals[j][0]
                for step, j in zip(steps[count * k : count * (k + 1)], form.numbers, strict=True)
            ]
            scale = sum((residuals[j][1] for j in form.numbers), _ZERO)
            terms = evaluate([inertia, -gyroscopic, -torque], known)
            if abs(sum(terms, _ZERO) - sum(works, _ZERO)) > bound * scale:
                return False
    return True


def along_motion(state: SymbolValues, reduced: Reduced) -> dict[sp.Symbol, TaylorSeries]:
    """Value and rate of each symbol of a state along its velocities and accelerations."""
    rates = {reduced.names.t: mpf(1)}
    for c in reduced.coordinates:
        rates |= {c.q: state[c.v], c.v: state[c.a]}
    return {s: (x, rates.get(s, _ZERO), _ZERO) for s, x in state.items()}


def _precisions(evidence: Evidence) -> Iterable[int]:
    """Yield working digits: few, in which equal numbers may differ by rounding, then many."""
    return working_digits(evidence.certificate.digits), CLOSE_DIGITS


def attempts(evidence: Evidence) -> Iterator[tuple[int, _Residuals]]:
    """Yield working digits and the residuals of the first state in them: few, then many."""
    first, second = _precisions(evidence)
    yield first, evidence.residuals
    yield second, evidence.look_closely().residuals


def _tolerance(evidence: Evidence) -> mpf:
    return mpf(10) ** (5 - evidence.certificate.digits)


def _not_derived(
    evidence: Evidence,
    residuals: _Residuals,
    shown: Sequence[ShownEquation],
    parts: Sequence[sp.Expr],
    digits: int,
) -> str | None:
    """Name the coordinate of the first equation that differs from its residual."""
    state = evidence.states[0]
    with mpmath.workdps(digits):
        run = Tape(parts, list(state)).run([(x, _ZERO, _ZERO) for x in state.values()], 0)
        pending = iter(run.values)
        for equation, (residual, scale) in zip(shown, residuals, strict=True):
            products = [next(pending) * next(pending) for _ in equation.terms]
            divisor = next(pending) * next(pending)
            difference = abs(sum(products) * divisor - residual)
            if difference > _tolerance(evidence) * scale:
                return equation.coordinate
    return None
