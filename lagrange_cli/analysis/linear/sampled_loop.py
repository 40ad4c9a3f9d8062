"""Loops that sampled controllers close: from sample to sample, by the matrix exponential.

Where a controller rests, what it sets is what it has set before. So what is held and kept counts as
states with the rates h(x) − u, of which rest is rest of the loop; their linear system then has
the gains beside A and B. Between samples u stays: [x, u] goes on by exp([[A, B], [0, 0]] τ) (C. F.
Van Loan, *IEEE Transactions on Automatic Control* 23 (1978) 395), and a sample adds the rates.
Poles within the unit circle prove that the loop is stable (K. J. Åström and B. Wittenmark,
*Computer-Controlled Systems*, 1997, chapters 2 and 3).
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import gcd, lcm
from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg

from lagrange_cli.analysis.values import (
    Linearization,
    SampledLoop,
    Stability,
    StateSpace,
)
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.symbols.inputs import closed_loop
from lagrange_cli.mechanics.symbols.values import decimal
from lagrange_cli.phrases import Phrase

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.analysis.equilibria.rest_system import RestSystem
    from lagrange_cli.mechanics.equations import Equations

#: Distance from the unit circle that counts as none: rounding of the exponential and of multiple
#: poles, which part by its root.
_ON_CIRCLE = 1e-7

#: Modulus below which a pole is zero.
_ZERO = 1e-9

#: Samples of all controllers until their times meet again.
_MOST_SAMPLES = 10_000


def resting_loop(equations: Equations) -> Equations:
    """Return the equations with what controllers set as states that rest where the loop does."""
    system = closed_loop(equations).system
    setting = {name: e for c in system.controllers for name, e in (*c.held_inputs, *c.memory)}
    states = tuple(
        replace(s, rate=setting[s.name] - s.symbol) if s.name in setting else s
        for s in system.states
    )
    return replace(equations, system=replace(system, states=states))


@np.errstate(over="ignore", invalid="ignore")
def sampled_loop(system: RestSystem, space: StateSpace) -> SampledLoop:
    """Step the linear system of a :func:`resting_loop` from sample to sample.

    Raises
    ------
    InputError
        A time between samples is not known, the samples of several controllers do not meet again
        within many, or motions grow beyond doubles from one to the next.
    """
    controllers = system.equations.system.controllers
    place = {name: k for k, name in enumerate(space.states)}
    periods = [_period(system, c.every) for c in controllers]
    sets = [
        [place[name] for name, _ in (*c.held_inputs, *c.memory) if name in place]
        for c in controllers
    ]
    fixed = [k for rows in sets for k in rows]
    rates = space.a.copy()
    rates[fixed] = 0.0
    whole = Fraction(lcm(*(p.numerator for p in periods)), gcd(*(p.denominator for p in periods)))
    if sum(whole / p for p in periods) > _MOST_SAMPLES:
        message = Phrase("the samples of the controllers do not meet again within many")
        raise InputError(Problem(message, rule="analysis-sampled"))
    step, before = np.eye(len(rates)), Fraction(0)
    for time in sorted({k * p for p in periods for k in range(1, int(whole / p) + 1)}):
        step = scipy.linalg.expm(rates * float(time - before)) @ step
        due = [k for p, rows in zip(periods, sets, strict=True) if time % p == 0 for k in rows]
        jump = np.eye(len(rates))
        jump[due] += space.a[due]
        step, before = jump @ step, time
    if not np.isfinite(step).all():
        message = Phrase("numbers of the sampled loop are beyond double precision")
        hint = "shorter times between samples let motions grow less from one to the next"
        raise InputError(Problem(message, hint=hint, rule="analysis-doubles"))
    poles = scipy.linalg.eigvals(step)
    plant = _plant(system, space)
    flow = scipy.linalg.expm(rates * float(whole))
    moving, constant = ([place[n] for n in names] for names in (plant.states, _held_names(system)))
    alone = len(controllers) == 1
    return SampledLoop(
        float(whole),
        plant.states,
        tuple(_held_names(system)),
        flow[np.ix_(moving, moving)] if alone else None,
        flow[np.ix_(moving, constant)] if alone else None,
        tuple(sorted((p for p in poles.tolist() if abs(p) > _ZERO), key=_order)),
    )


def _order(pole: complex) -> tuple[float, float, float]:
    return -round(abs(pole), 9), round(pole.real, 9), -pole.imag


def _period(system: RestSystem, every: Expr) -> Fraction:
    """Return a time between samples, as exact as it is known."""
    if every.is_Rational:
        return Fraction(int(every.p), int(every.q))
    if not every.is_Symbol:
        return Fraction(decimal(every))
    for parameter in system.equations.system.parameters:
        if parameter.symbol == every and parameter.value is not None:
            exact = parameter.decimal
            return Fraction(exact) if exact else Fraction(parameter.value)
    raise InputError(Problem(Phrase("no value for {names}", names=every.name), rule="analysis"))


def _held_names(system: RestSystem) -> list[str]:
    return [name for c in system.equations.system.controllers for name, _ in c.held_inputs]


def _plant(system: RestSystem, space: StateSpace) -> StateSpace:
    """Take the system alone out of the state space: what is held is an input of it."""
    controllers = system.equations.system.controllers
    memory = {name for c in controllers for name, _ in c.memory}
    names = [name for name in _held_names(system) if name in space.states]
    driving = [space.states.index(name) for name in names]
    moving = [k for k, n in enumerate(space.states) if k not in driving and n not in memory]
    return StateSpace(
        tuple(space.states[k] for k in moving),
        (*names, *space.inputs),
        space.outputs,
        space.a[np.ix_(moving, moving)],
        np.hstack([space.a[np.ix_(moving, driving)], space.b[moving]]),
        space.c[:, moving],
        np.hstack([space.c[:, driving], space.d]),
    )


def without_controllers(system: RestSystem, linear: Linearization) -> Linearization:
    """Return the linear system with what controllers hold as inputs."""
    space, exact = linear.state_space, linear.exact
    plant = _plant(system, space)
    if exact is not None and exact.a is not None and exact.b is not None:
        places = [space.states.index(name) for name in plant.states]
        driving = [space.states.index(name) for name in plant.inputs if name in space.states]
        exact = replace(
            exact,
            a=tuple(tuple(exact.a[i][j] for j in places) for i in places),
            b=tuple((*(exact.a[i][j] for j in driving), *exact.b[i]) for i in places),
        )
    states = tuple(name for name in linear.states if name in plant.states)
    return replace(linear, state_space=plant, exact=exact, states=states)


def stability_of_loop(loop: SampledLoop) -> Stability:
    """Decide the stability of rest by the poles of the loop from sample to sample."""
    largest = max(map(abs, loop.poles), default=0.0)
    if largest > 1 + _ON_CIRCLE:
        reason = Phrase(
            "a pole of the sampled loop has the modulus {value}", value=f"{largest:.4g}"
        )
        return Stability("unstable", reason)
    if largest < 1 - _ON_CIRCLE:
        reason = Phrase("all poles of the sampled loop lie inside the unit circle")
        return Stability("asymptotically stable", reason)
    return Stability("undecided", Phrase("a pole of the sampled loop lies on the unit circle"))
