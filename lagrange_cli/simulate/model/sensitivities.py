"""Models that find derivatives of a motion by its start and by parameters beside the motion.

Each number α that is asked for adds the derivatives of all coordinates to the coordinates, with the
variational equations (:mod:`lagrange_cli.program.solvers.sensitivities`): they are integrated and
promised like coordinates. How the start and other parameters depend on a parameter is found by
differences in 40 digits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Context, Decimal
from fractions import Fraction
from operator import mul
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.errors import InputError, Problem, nearest
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.kinks import KINKED
from lagrange_cli.mechanics.proofs.finite_field import NoValueError, solved_linear_system
from lagrange_cli.mechanics.proofs.zero_test import relation_holds
from lagrange_cli.mechanics.system import Coordinate, InitialState, State
from lagrange_cli.mechanics.tabulated import Tabulated
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.expressions import forces_and_inertias
from lagrange_cli.simulate.model.inputs import substitute_inputs

if TYPE_CHECKING:
    from sympy import Symbol

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.simulate.model.model import Model

#: Part of a parameter by which it is moved, up and down: of 40 digits, 20 are left.
_PART = Fraction(1, 10**15)

#: Digits of a difference that are kept.
_KEPT = Context(prec=20)

#: Digits that a parameter's text is written with.
_WRITTEN = Context(prec=60)

#: Parameters and initial values that replace the scene's, as texts → its model.
WithValues = Callable[[Mapping[str, str], Mapping[str, str]], "Model"]

#: Scene with one parameter replaced by a text → its model.
_WithParameter = Callable[[str, str], "Model"]


@dataclass(frozen=True)
class _Direction:
    """Derivatives by one number.

    Attributes
    ----------
    name
        The number: a coordinate or its ``dot`` for its start, or a parameter.
    start
        Derivatives of the start, shape (2n,).
    parameters
        Parameter → its derivative, of those that change.
    """

    name: str
    start: tuple[Fraction, ...]
    parameters: Mapping[str, Fraction]


class SensitiveModels:
    """Models of one derivation that find derivatives of a motion beside it.

    Code is made once for each choice of numbers and for how other parameters change with them; it
    serves other values of parameters and start.

    Parameters
    ----------
    equations
        The equations.
    model
        Makes their model with other values, given parameters and initial values as texts.
    """

    def __init__(self, equations: Equations, model: WithValues) -> None:
        self._equations, self._model = equations, model
        self._made: dict[object, Model] = {}

    def with_derivatives(
        self, names: Sequence[str], parameters: Mapping[str, str], initial: Mapping[str, str]
    ) -> Model:
        """Make the model that finds derivatives by some numbers.

        Parameters
        ----------
        names
            Coordinates, their ``dot`` (for their starts) and parameters.
        parameters, initial
            Values that replace the scene's.

        Raises
        ------
        InputError
            There is no such name; the equations have multipliers, contacts or kinks, or do not
            solve for accelerations in closed form; the start is not known.
        """
        model = self._model(parameters, initial)
        _require_same(self._model({}, {}), model)
        _require_smooth(self._equations, model)

        def with_parameter(name: str, text: str) -> Model:
            return self._model({**parameters, name: text}, initial)

        starts = {p.start_of: p.name for p in self._equations.system.parameters if p.start_of}
        directions = [
            _direction(name, model, starts, with_parameter) for name in dict.fromkeys(names)
        ]
        key = tuple((d.name, tuple(d.parameters.items())) for d in directions)
        if key not in self._made:
            self._made[key] = model_of(_varied(self._equations, directions))
        kinds = [f"{kind} by {d.name}" for d in directions for kind in model.kinds]
        start = _initial(model, directions)
        return replace(
            self._made[key],
            parameters=model.parameters,
            defaults=model.defaults,
            massless=model.massless,
            kinds=(*model.kinds, *kinds),
            initial=None if start is None else start.numbers,
            initial_decimals=() if start is None else start.decimals,
        )


def _varied(equations: Equations, directions: Sequence[_Direction]) -> Equations:
    """Add the derivatives of the coordinates to the coordinates, those of states to the states."""
    further = [_change(c, d.name) for d in directions for c in equations.system.coordinates]
    states = equations.system.states
    further_states = [_state_change(s, d.name) for d in directions for s in states]
    symbols = {p.name: p.symbol for p in equations.system.parameters}
    with_inputs = substitute_inputs(equations)  # whose expressions may hold parameters
    # What is left of a derivative that vanishes is rounding, which has no scale.
    moving = {
        p for d in directions for p in d.parameters if not _drops_out(with_inputs, symbols[p])
    }
    return replace(
        equations,
        system=replace(
            equations.system,
            coordinates=(*equations.system.coordinates, *further),
            states=(*states, *further_states),
            initial=None,
            sensitivities=tuple(
                {symbols[name]: slope for name, slope in d.parameters.items() if name in moving}
                for d in directions
            ),
        ),
    )


def _drops_out(equations: Equations, parameter: Symbol) -> bool:
    """Tell if accelerations are proven not to depend on a parameter, as a mass in free fall."""
    n = len(equations.system.mass_matrix)
    rows = [
        [*row, f]
        for row, f in zip(equations.system.mass_matrix, equations.system.forcing, strict=True)
    ]
    if any(parameter in state.rate.free_symbols for state in equations.system.states):
        return False
    rows += [[derivative(entry, parameter) for entry in row] for row in rows]

    def vanishes(values: Sequence[int], p: int) -> bool:
        """Solve M a = f modulo p, and put a into the residual's derivative."""
        table = [values[start : start + n + 1] for start in range(0, len(values), n + 1)]
        try:
            motion = (*solved_linear_system(table[:n], p), -1)
        except NoValueError:
            return False
        return all(sum(map(mul, row, motion)) % p == 0 for row in table[n:])

    return relation_holds([entry for row in rows for entry in row], vanishes)


def _require_same(unchanged: Model, model: Model) -> None:
    """Refuse values with which the scene has other equations than with its own."""
    # Sizes change the equations, and values choose among the solutions of a constraint.
    if model.code != unchanged.code or model.coordinates != unchanged.coordinates:
        raise InputError(
            Problem(
                "with these values the scene has other equations, whose derivatives are not made",
                hint="give the values where the scene is read: load(path, parameters=...)",
                rule="sensitivity",
            )
        )


def _require_smooth(equations: Equations, model: Model) -> None:
    if model.initial is None or any(p.value is None and p.used for p in model.parameters):
        return  # told where the motion is asked for
    reason, hint = "", ""
    if equations.system.closures:
        reason = "constraints are kept beside the coordinates"
        hint = "--formulation minimal, where there is one"
    elif equations.system.contacts or (model.surfaces and not _is_smooth(equations)):
        reason = "contacts, or kinks and jumps of the forces, make it change by jumps"
    elif model.controllers:
        reason = "a controller samples it"
    if reason:
        message = f"the motion's derivatives are not found where {reason}"
        raise InputError(Problem(message, hint=hint, rule="sensitivity"))


def _is_smooth(equations: Equations) -> bool:
    """Tell whether the surfaces are those between pieces of tables that join without a kink."""
    moved = substitute_inputs(equations)
    kinks = {k for e in forces_and_inertias(moved) for k in e.atoms(*KINKED, Tabulated)}
    smooth = all(isinstance(kink, Tabulated) and kink.is_smooth for kink in kinks)
    return smooth and not moved.system.switches


def _direction(
    name: str, model: Model, starts: Mapping[str, str], with_parameter: _WithParameter
) -> _Direction:
    """Differentiate by a number; ``starts``: of coordinates whose start is a parameter, by name."""
    states = model.state_names
    if name in states or name in starts:
        unit = tuple(Fraction(int(state == name)) for state in states)
        return _Direction(name, unit, {starts[name]: Fraction(1)} if name in starts else {})
    values = {p.name: x for p, x in zip(model.parameters, model.exact_numbers, strict=True)}
    if name not in values or name in starts.values():
        names = [*states, *starts, *(set(values) - set(starts.values()))]
        message = f"'{name}' is neither a coordinate, whose start it would be, nor a parameter"
        hint = nearest(name, names) or f"there are {', '.join(names)}"
        raise InputError(Problem(message, hint=hint, rule="sensitivity"))
    value = values[name]
    if value is None:
        value = Fraction(next(p.value or 0.0 for p in model.parameters if p.name == name))
    step = _PART * (abs(value) or 1)
    up, down = (with_parameter(name, _text(value + sign * step)) for sign in (1, -1))
    changes = _slopes(up.exact_numbers, down.exact_numbers, step)
    changed = {
        p.name: slope for p, slope in zip(model.parameters, changes, strict=True) if slope != 0
    }
    if None in changed.values():
        raise _unknown(name, "other parameters")
    start = _slopes(up.exact_initial, down.exact_initial, step)
    if None in start:
        raise _unknown(name, "the start")
    known_start = tuple(x for x in start if x is not None)
    known = {p: x for p, x in changed.items() if x is not None}
    return _Direction(name, known_start, {**known, name: Fraction(1)})


def _unknown(name: str, what: str) -> InputError:
    message = f"the dependence of {what} on '{name}' is not known with enough digits"
    hint = "give the start by the coordinates, in decimals or fractions"
    return InputError(Problem(message, hint=hint, rule="sensitivity"))


def _slopes(
    up: Sequence[Fraction | None], down: Sequence[Fraction | None], step: Fraction
) -> list[Fraction | None]:
    return [
        None if a is None or b is None else _rounded((a - b) / (2 * step))
        for a, b in zip(up, down, strict=True)
    ]


def _rounded(slope: Fraction) -> Fraction:
    """Drop the digits that a difference has lost."""
    return Fraction(_KEPT.divide(Decimal(slope.numerator), Decimal(slope.denominator)))


def _text(value: Fraction) -> str:
    return str(_WRITTEN.divide(Decimal(value.numerator), Decimal(value.denominator)))


def _change(coordinate: Coordinate, by: str) -> Coordinate:
    """Return the derivative of a coordinate, as a coordinate."""
    name = f"d({coordinate.name})/d({by})"
    q, v, a = (sympy.Dummy(f"{kind}_{name}", real=True) for kind in "qva")
    return Coordinate(name, q, v, a)


def _state_change(state: State, by: str) -> State:
    """Return the derivative of a state, as a state; variational equations give its rate."""
    name = f"d({state.name})/d({by})"
    return State(name, sympy.Dummy(f"x_{name}", real=True), sympy.S.Zero)


def _initial(model: Model, directions: Sequence[_Direction]) -> InitialState | None:
    if model.initial is None:
        return None
    layout = model.layout
    exact = [
        Fraction(value) if x is None else x
        for value, x in zip(model.initial, model.exact_initial, strict=True)
    ]
    positions, velocities, states = (
        [*exact[part], *(x for d in directions for x in d.start[part])]
        for part in (layout.positions, layout.velocities, layout.first_order)
    )
    return InitialState(
        tuple(map(float, positions)),
        tuple(map(float, velocities)),
        0.0,
        tuple(map(_text, (*positions, *velocities, *states))),
        tuple(map(float, states)),
    )
