"""The configuration that ``--at`` gives, and the equilibrium that it selects."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import mpmath
import sympy as sp

from lagrange_cli.analysis.equilibria.repeats import distance
from lagrange_cli.analysis.equilibria.rest_system import parameter_values
from lagrange_cli.analysis.equilibria.search import polished
from lagrange_cli.analysis.values import DIGITS, Equilibria, Equilibrium, Mpf
from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.errors import nearest as nearest_name
from lagrange_cli.mechanics.interpretation import interpret
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.phrases import Phrase
from lagrange_cli.scene.language.families import read_expression

if TYPE_CHECKING:
    from lagrange_cli.analysis.equilibria.rest_system import RestSystem
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import State

#: Distance from an equilibrium, relative to 1 and to its coordinates, below which a typed
#: configuration is a rounded one of it.
_TYPED = 1e-2


@dataclass(frozen=True)
class Configuration:
    """Values of coordinates, and of held inputs over the parameters, with their places.

    ``turning``: values of momenta and rates of ignored coordinates, by name.
    """

    coordinates: Mapping[str, Mpf]
    held_inputs: Mapping[str, sp.Expr]
    marks: Mapping[str, Mark]
    turning: Mapping[str, Mpf]


def configuration_at(
    equations: Equations, texts: Mapping[str, str], turning: Collection[str] = ()
) -> Configuration:
    """Read the values of ``--at NAME=VALUE``.

    ``turning``: names of momenta and rates that may be given.

    Raises
    ------
    InputError
        Located: a name is none of these, or a value is no number.
    """
    coordinates = {c.name for c in equations.system.coordinates}
    inputs = {u.name for u in equations.system.inputs}
    values: dict[str, Mpf] = {}
    held_inputs: dict[str, sp.Expr] = {}
    marks: dict[str, Mark] = {}
    rates: dict[str, Mpf] = {}
    known = coordinates | inputs | set(turning)
    for name, text in texts.items():
        shown = f"{name}={text}"
        marks[name] = Mark(f"--at {name}", 1, 1, shown, max(1, len(name)))
        if name not in known:
            hint = nearest_name(name, known) or f"known are {', '.join(sorted(known))}"
            others = ", no momentum and no rate that is conserved" if turning else ""
            message = f"'{name}' is no coordinate and no input{others}"
            raise InputError(Problem(message, marks[name], hint, "unknown-name"))
        place = Mark(f"--at {name}", 1, len(name) + 2, shown, max(1, len(text)))
        expression = interpret(equations, read_expression(text, place))
        value = number_of(equations, expression, place)
        if name in coordinates:
            values[name] = value
        elif name in turning:
            rates[name] = value
        else:
            held_inputs[name] = expression
    return Configuration(values, held_inputs, marks, rates)


def number_of(equations: Equations, expression: sp.Expr, place: Mark) -> Mpf:
    """Evaluate an expression in parameters.

    Raises
    ------
    InputError
        At ``place``: it has no finite value for the values of the parameters.
    """
    with mpmath.workdps(DIGITS):
        known = parameter_values(equations)
        if expression.free_symbols <= known.keys():
            with suppress(DomainError):
                (value,) = evaluate([expression], known)
                if mpmath.isfinite(value):
                    return value
    message = "this is no number for the values of the parameters"
    raise InputError(Problem(message, place, rule="no-value"))


def nearest(
    system: RestSystem, equilibria: Equilibria, configuration: Configuration
) -> Equilibrium:
    """Choose the equilibrium at which the equations are linearized.

    With coordinates in ``configuration`` the one that agrees with them; else the stable one
    nearest to the initial configuration, or if none is known to be stable the nearest.

    Raises
    ------
    InputError
        There is none.
    """
    if configuration.coordinates:
        return _at(system, equilibria, configuration)
    points = [p for p in equilibria.points if p.position is not None]
    if equilibria.points and not points:
        system.require_values()
    if not points:
        raise InputError(Problem(_none(system, equilibria), rule="analysis-none"))
    stable = [p for p in points if p.stability and p.stability.verdict.split()[0] in _GOOD]
    return min(stable or points, key=lambda p: distance(system, p.position or (), system.start))


#: First words of verdicts that call an equilibrium stable in some sense.
_GOOD = ("stable", "asymptotically")


def _none(system: RestSystem, equilibria: Equilibria) -> str:
    if equilibria.complete:
        if system.free_to_give:
            return Phrase("there is no steady motion")
        return Phrase("there is no equilibrium")
    count = str(equilibria.starts)
    if system.free_to_give:
        return Phrase("no steady motion was found from {count} starts", count=count)
    return Phrase("no equilibrium was found from {count} starts", count=count)


def _at(system: RestSystem, equilibria: Equilibria, configuration: Configuration) -> Equilibrium:
    """Choose a known equilibrium at this configuration, or one that Newton's method reaches."""
    system.require_values()
    coordinates = system.equations.system.coordinates
    chosen = {
        k: configuration.coordinates[c.name]
        for k, c in enumerate(coordinates)
        if c.name in configuration.coordinates
    }

    def gap(point: Equilibrium) -> Mpf:
        position = point.position or ()
        full = [chosen.get(k, x) for k, x in enumerate(position)]
        return distance(system, position, full)

    points = [p for p in equilibria.points if p.position is not None]
    near = [p for p in points if gap(p) <= _TYPED]
    if near:
        start = system.start
        return min(near, key=lambda p: distance(system, p.position or (), start))
    place = [float(chosen.get(k, x)) for k, x in enumerate(system.start)]
    reached = polished(system, [*place, *[0.0] * len(system.equations.system.closures)])
    if reached is not None and gap(reached) <= _TYPED:
        return reached
    name = next(iter(configuration.coordinates))
    known = min(points, key=gap, default=None)
    hint = f"no {system.sought} is known"
    if known is not None and known.position is not None:
        values = zip(coordinates, known.position, strict=True)
        hint = "near: " + ", ".join(f"{c.name} = {float(x):.6g}" for c, x in values)
    message = f"this is no {system.sought}"
    raise InputError(Problem(message, configuration.marks[name], hint, "analysis-at"))


def require_switch_values(equations: Equations, configuration: Configuration) -> None:
    """Refuse values of states with two values that are neither.

    Raises
    ------
    InputError
        Located at the value.
    """
    for state in _switching(equations):
        value = configuration.held_inputs.get(state.name)
        if value is not None and value not in (0, 1):
            message = f"the state '{state.name}' has the values 0 and 1"
            raise InputError(
                Problem(message, configuration.marks[state.name], rule="misplaced-state")
            )


def without_switching(
    equations: Equations, system: RestSystem, equilibria: Equilibria
) -> tuple[Equilibria, list[str]]:
    """Leave out the points at which a held state would change; and say which.

    ``equations`` are those with the switches, ``system`` the one whose equilibria were sought.
    """
    points, reasons = list(equilibria.points), dict[str, None]()
    for state in _switching(equations):
        value = system.inputs[state.symbol]
        for point in equilibria.points:
            if point in points and _changes(state, value, system, point):
                points.remove(point)
                said = Phrase(
                    "where all rests with {name} = {value}, {name} changes: that is no equilibrium",
                    name=(state.name,),
                    value=str(value),
                )
                reasons[said] = None
    return replace(equilibria, points=tuple(points)), list(reasons)


def _switching(equations: Equations) -> list[State]:
    return [state for state in equations.system.states if state.switch is not None]


def _changes(state: State, value: sp.Expr, system: RestSystem, point: Equilibrium) -> bool:
    """Tell whether the condition holds by which a state changes; False where that is not known."""
    assert state.switch is not None
    if point.position is None or point.free:
        return False
    condition = state.switch.off if value == 1 else state.switch.on
    coordinates = system.equations.system.coordinates
    values: Mapping[sp.Symbol, object] = {
        **system.known,
        **{c.q: x for c, x in zip(coordinates, point.position, strict=True)},
        **{c.v: sp.S.Zero for c in coordinates},
    }
    if not condition.free_symbols <= values.keys():
        return False
    try:
        (excess,) = evaluate([condition], values)
    except DomainError:
        return False
    return bool(excess >= 0)
