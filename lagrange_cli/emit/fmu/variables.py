"""The variables of a unit: what a scene has, in the order of the value references in C."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, TypeAlias

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Input, System

Kind: TypeAlias = Literal[
    "time", "parameter", "input", "computed input", "state", "rate", "output", "indicator"
]


@dataclass(frozen=True)
class Variable:
    """A variable of a unit.

    Attributes
    ----------
    name
        Its name, unlike all others.
    reference
        Its value reference.
    kind
        What it is of the scene.
    start
        Its value before the start, None if it is computed.
    unit, description
        Texts of the scene, None if absent.
    derivative_of
        Reference of the state whose rate it is, None for others.
    dependencies
        References of states and inputs that it depends on, None if they are all of them.
    """

    name: str
    reference: int
    kind: Kind
    start: float | None = None
    unit: str | None = None
    description: str | None = None
    derivative_of: int | None = None
    dependencies: tuple[int, ...] | None = None


#: Energies, which every unit has among its outputs: name, and what it is.
_ENERGIES = {
    "energy(kinetic)": "kinetic energy T",
    "energy(potential)": "potential energy V",
    "energy": "energy function, the sum of v dL/dv, less L",
}


def _symbols(expression: Expr) -> frozenset[Symbol]:
    """Return the symbols of an expression."""
    # Here and not above: a unit whose texts are remembered is packed without mathematics.
    from lagrange_cli.mechanics.free_symbols import symbols_in

    return symbols_in(expression)


def is_computed(entry: Input, t: Symbol) -> bool:
    """Tell whether the scene gives an input as a function of time, so that nobody else can."""
    return entry.expression is not None and t in _symbols(entry.expression)


def written_outputs(equations: Equations) -> tuple[tuple[str, Expr], ...]:
    """Return the scene's outputs, then its Cartesian names and energies, by name."""
    system = equations.system
    energies = (system.kinetic, system.potential, system.energy)
    return (
        *system.outputs,
        *((name.name, name.position) for name in system.cartesian_names),
        *zip(_ENERGIES, energies, strict=True),
    )


def variables_of(equations: Equations) -> tuple[Variable, ...]:
    """List all variables; the reference of each is its place."""
    listed = list(_unnumbered(equations))
    names = _unique([variable.name for variable in listed])
    numbered = [
        replace(variable, name=name, reference=number)
        for number, (name, variable) in enumerate(zip(names, listed, strict=True))
    ]
    return tuple(_linked(equations.system, numbered))


def _unnumbered(equations: Equations) -> Iterator[Variable]:
    """List the variables by kind, with texts and starts, as the enumeration in C has them."""
    system, units = equations.system, equations.presentation.units.units
    yield Variable("time", 0, "time", unit=units.get("t"))
    for parameter in system.parameters:
        yield Variable(
            parameter.name, 0, "parameter", parameter.value, parameter.unit, parameter.description
        )
    for entry in system.inputs:
        kind: Kind = "computed input" if is_computed(entry, system.t) else "input"
        recorded = None if entry.recording is None else entry.recording.described
        start = None if kind == "computed input" else input_start(equations, entry)
        yield Variable(entry.name, 0, kind, start, units.get(entry.name), recorded)
    assert system.initial is not None
    names = [coordinate.name for coordinate in system.coordinates]
    texts = [coordinate.description for coordinate in system.coordinates]
    states, starts = system.state_names, system.initial.numbers
    texts += [*(None for _ in names), *(state.description for state in system.states)]
    for name, start, text in zip(states, starts, texts, strict=True):
        yield Variable(name, 0, "state", start, units.get(name), text)
    for name in states:
        yield Variable(f"der({name})", 0, "rate")
    for name, _ in written_outputs(equations):
        unit = units.get("energy" if name in _ENERGIES else name)
        yield Variable(name, 0, "output", unit=unit, description=_ENERGIES.get(name))
    for contact in system.contacts:
        text = "the gap while the contact is open, its multiplier while it is closed"
        yield Variable(f"indicator({contact.name})", 0, "indicator", description=text)


def input_start(equations: Equations, entry: Input) -> float:
    """Return the constant that the scene gives for an input, 0 for one that is recorded."""
    if entry.expression is None:
        return 0.0
    system = equations.system
    values = {p.symbol: p.exact if p.exact is not None else p.value for p in system.parameters}
    return float(entry.expression.subs(values))


def _unique(names: Sequence[str]) -> list[str]:
    """Give a name that is repeated a tail."""
    taken: set[str] = set()
    result = []
    for name in names:
        choice, tail = name, 2
        while choice in taken:
            choice, tail = f"{name}_{tail}", tail + 1
        taken.add(choice)
        result.append(choice)
    return result


def _linked(system: System, variables: Sequence[Variable]) -> Iterator[Variable]:
    """Say of rates what they are the rates of, and of outputs what they depend on."""
    states = [v.reference for v in variables if v.kind == "state"]
    places = [v.reference for v in variables if v.kind in ("input", "computed input")]
    n = len(system.coordinates)
    known = dict(zip(system.state_symbols, states, strict=True))
    known |= {
        entry.symbol: place
        for entry, place in zip(system.inputs, places, strict=True)
        if not is_computed(entry, system.t)
    }
    outputs = iter(_expressions(system))
    rates = iter(range(system.layout.size))
    for variable in variables:
        if variable.kind == "rate":
            number = next(rates)
            only = (states[n + number],) if number < n else None
            yield replace(variable, derivative_of=states[number], dependencies=only)
        elif variable.kind == "output":
            symbols_here = _symbols(next(outputs)) & known.keys()
            yield replace(variable, dependencies=tuple(sorted(known[s] for s in symbols_here)))
        else:
            yield variable


def _expressions(system: System) -> Iterable[Expr]:
    """List the expressions of :func:`written_outputs`."""
    yield from (expression for _, expression in system.outputs)
    yield from (name.position for name in system.cartesian_names)
    yield from (system.kinetic, system.potential, system.energy)
