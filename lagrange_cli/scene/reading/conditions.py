"""Reading the sections that say how a scene starts, runs and is checked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, get_args

from lagrange_cli.errors import InputError
from lagrange_cli.scene.conditions import (
    EquilibriumExpectation,
    ErrorExpectation,
    EventExpectation,
    Expect,
    Formulation,
    InitialValue,
    StateExpectation,
    WrittenDefaults,
)
from lagrange_cli.scene.language.expression import Equation, Expression
from lagrange_cli.scene.language.families import Budget
from lagrange_cli.scene.language.problems import Problems, shown, suggestion
from lagrange_cli.scene.reading.entries import Reading, is_indexed
from lagrange_cli.scene.reading.overrides import initial_name
from lagrange_cli.scene.reading.source import Mapping, Scalar, Sequence, SourceNode

_NUMBERS = ("until", "from", "accuracy", "samples", "step", "rtol", "atol")

_EXPECT = (
    *("dof", "cyclic", "conserved", "equations", "lagrangian", "hamiltonian"),
    *("state", "drift", "events", "equilibrium", "equilibria", "frequencies", "error"),
)

#: Terms that expected equations are written out to where sizes are other than the file's: some
#: tenths of a second.
_MOST_RESIZED = 100_000


def read_initial(node: SourceNode, reading: Reading) -> tuple[InitialValue, ...]:
    return _initial_values(node, "initial", reading)


def read_near(node: SourceNode, reading: Reading) -> tuple[InitialValue, ...]:
    return _initial_values(node, "near", reading)


def _initial_values(node: SourceNode, section: str, reading: Reading) -> tuple[InitialValue, ...]:
    mapping = reading.mapping(node, f"'{section}'", "a mapping of values")
    what = f"'{section}'"
    entries = mapping.entries if mapping else ()
    return tuple(v for key, value in entries for v in initial_values(key, value, what, reading))


def initial_values(
    key: Scalar, node: SourceNode, what: str, reading: Reading
) -> Iterator[InitialValue]:
    """Read ``x: value`` or ``dot(x): value``, for every element where ``x`` is a family."""
    text, order = initial_name(key.text)
    name = replace(key, text=text)
    if is_indexed(text) and order and key.exact:
        column = key.mark.column + key.text.index(text)
        name = replace(name, mark=replace(key.mark, column=column, length=len(text)))
    for element in reading.elements(name):
        shown = f"dot({element.text})" if order else element.text
        expression = reading.expression(node, f"'{shown}' in {what}")
        if expression:
            yield InitialValue(element.text, order, key.mark, expression)


def read_simulate(node: SourceNode, reading: Reading) -> WrittenDefaults:
    mapping = reading.mapping(node, "'simulate'")
    if mapping is None:
        return WrittenDefaults()
    fields = reading.fields(mapping, "'simulate'", (*_NUMBERS, "method", "formulation"))
    numbers: dict[str, Any] = {
        "start" if key == "from" else key: reading.expression(fields[key], f"'{key}' in 'simulate'")
        for key in _NUMBERS
        if key in fields
    }
    method = reading.text(fields["method"], "'method'") if "method" in fields else None
    if "samples" in fields and "step" in fields:
        reading.problems.add(
            "'samples' and 'step' exclude each other", fields["step"].mark, rule="conflict"
        )
    formulation = _formulation(fields["formulation"], reading) if "formulation" in fields else None
    return WrittenDefaults(mark=mapping.mark, method=method, formulation=formulation, **numbers)


def _formulation(node: SourceNode, reading: Reading) -> Formulation | None:
    known: tuple[Formulation, ...] = get_args(Formulation)
    text = node.text if isinstance(node, Scalar) else ""
    for name in known:
        if text == name:
            return name
    hint = suggestion(text, known, f"known are {', '.join(known)}")
    if text:
        message = f"unknown formulation {shown(text)} in 'simulate'"
        reading.problems.add(message, node.mark, hint=hint, rule="unknown-name")
    else:
        reading.expected("a formulation", "'simulate'", node, hint)
    return None


def read_expect(node: SourceNode, reading: Reading) -> Expect:
    mapping = reading.mapping(node, "'expect'")
    if mapping is None:
        return Expect()
    fields = reading.fields(mapping, "'expect'", _EXPECT)
    read: dict[str, Any] = {key: _EXPECTATIONS[key](node, reading) for key, node in fields.items()}
    for key in ("dof", "cyclic", "conserved", "equilibria", "frequencies"):
        if key in fields:
            read[f"{key}_mark"] = fields[key].mark
    if "state" in read:
        read["states"] = read.pop("state")
    return Expect(mark=mapping.mark, **read)


def _dof(node: SourceNode, reading: Reading) -> int | None:
    return reading.integer(node, "'dof' in 'expect'")


def _names(key: str) -> Any:
    def read(node: SourceNode, reading: Reading) -> tuple[str, ...] | None:
        what = f"'{key}' in 'expect'"
        sequence = reading.items(node, what, "a list of names")
        if sequence is None:
            return None
        names: list[str] = []
        for item in sequence.items:
            if isinstance(item, Scalar) and is_indexed(item.text):
                names.extend(element.text for element in reading.elements(item))
            elif (text := reading.text(item, what)) is not None:
                names.append(text)
        return tuple(names)

    return read


def _equations(node: SourceNode, reading: Reading) -> tuple[Equation, ...] | None:
    """Read expected equations; with other sizes than the file's, unless they are too long then."""
    if reading.sizes.keys().isdisjoint(reading.overrides):
        return _written_out(node, reading)
    trial = replace(reading, problems=Problems(), budget=Budget(_MOST_RESIZED))
    try:
        read = _written_out(node, trial)
    except InputError:
        if not trial.budget.exceeded:
            raise
        reading.problems.warn(
            "the equations expected are left out: with these sizes they are written out to more"
            f" than {_MOST_RESIZED} terms",
            node.mark,
            rule="limit",
        )
        return None
    return _written_out(node, reading) if trial.problems.errors else read


def _written_out(node: SourceNode, reading: Reading) -> tuple[Equation, ...] | None:
    """Read a list of equations, or a mapping of names to equations, which may be families."""
    what = "'equations' in 'expect'"
    if isinstance(node, Mapping):
        named = reading.named(node, "equations", symbols=False)
        read = [reading.equation(value, f"'{key.text}' of {what}") for key, value in named]
    else:
        sequence = reading.items(node, what, "a list of equations")
        if sequence is None:
            return None
        read = [reading.equation(item, what) for item in sequence.items]
    return tuple(equation for equation in read if equation)


def _lagrangian(node: SourceNode, reading: Reading) -> Expression | None:
    return reading.expression(node, "'lagrangian' in 'expect'")


def _hamiltonian(node: SourceNode, reading: Reading) -> Expression | None:
    return reading.expression(node, "'hamiltonian' in 'expect'")


def _states(node: SourceNode, reading: Reading) -> tuple[StateExpectation, ...]:
    items = node.items if isinstance(node, Sequence) else (node,)
    read = [_state(item, reading) for item in items]
    return tuple(state for state in read if state)


def _state(node: SourceNode, reading: Reading) -> StateExpectation | None:
    what = "'state' in 'expect'"
    mapping = reading.mapping(node, what, "a mapping {t, NAME, within}")
    if mapping is None:
        return None
    entries = {key.text: (key, value) for key, value in mapping.entries}
    special = {}
    for name in ("t", "within"):
        if name in entries:
            special[name] = reading.expression(entries.pop(name)[1], f"'{name}' in {what}")
        else:
            reading.problems.add(f"{what} has no '{name}'", mapping.mark, rule="missing")
    values = [
        v for key, value in entries.values() for v in initial_values(key, value, what, reading)
    ]
    if not entries:
        reading.problems.add(f"{what} names no coordinate", mapping.mark, rule="missing")
    time, within = special.get("t"), special.get("within")
    if time is None or within is None:
        return None
    return StateExpectation(mapping.mark, time, tuple(values), within)


def _drift(node: SourceNode, reading: Reading) -> tuple[tuple[str, Expression], ...]:
    what = "'drift' in 'expect'"
    mapping = reading.mapping(node, what, "a mapping of bounds")
    bounds = []
    for key, value in mapping.entries if mapping else ():
        bound = reading.expression(value, f"'{key.text}' in {what}")
        if bound:
            bounds.append((key.text, bound))
    return tuple(bounds)


def _events(node: SourceNode, reading: Reading) -> tuple[EventExpectation, ...]:
    sequence = reading.items(node, "'events' in 'expect'", "a list of events {name, t, within}")
    read = [_event(item, reading) for item in sequence.items] if sequence else ()
    return tuple(event for event in read if event)


def _event(node: SourceNode, reading: Reading) -> EventExpectation | None:
    what = "'events' in 'expect'"
    mapping = reading.mapping(node, what, "a mapping {name, t, within}")
    if mapping is None:
        return None
    fields = reading.fields(mapping, what, ("name", "t", "within"), required=("name",))
    numbers = {
        key: reading.expression(fields[key], f"'{key}' in {what}")
        for key in ("t", "within")
        if key in fields
    }
    name = reading.text(fields["name"], f"'name' in {what}") if "name" in fields else None
    if name is None or None in numbers.values():
        return None
    if "within" in numbers and "t" not in numbers:
        reading.problems.add(
            f"'within' in {what} without 't'", fields["within"].mark, rule="missing"
        )
    time, within = numbers.get("t"), numbers.get("within")
    return EventExpectation(name, fields["name"].mark, time, within)


def _equilibrium_law(node: SourceNode, reading: Reading) -> tuple[Equation, ...] | None:
    """Read one equation, or a list of equations that hold together."""
    what = "'equilibrium' in 'expect'"
    items = node.items if isinstance(node, Sequence) else (node,)
    if not items:
        reading.expected("an equation, or a list of them", what, node)
        return None
    read = [reading.equation(item, what) for item in items]
    return tuple(equation for equation in read if equation)


def _equilibria(node: SourceNode, reading: Reading) -> tuple[EquilibriumExpectation, ...] | None:
    sequence = reading.items(node, "'equilibria' in 'expect'", "a list of equilibria {NAME: value}")
    if sequence is None:
        return None
    read = [_equilibrium(item, reading) for item in sequence.items]
    return tuple(equilibrium for equilibrium in read if equilibrium)


def _equilibrium(node: SourceNode, reading: Reading) -> EquilibriumExpectation | None:
    what = "'equilibria' in 'expect'"
    mapping = reading.mapping(node, what, "a mapping {NAME: value, stability}")
    if mapping is None:
        return None
    entries = {key.text: (key, value) for key, value in mapping.entries}
    verdict = mark = None
    if "stability" in entries:
        _, stability = entries.pop("stability")
        verdict, mark = reading.text(stability, f"'stability' in {what}"), stability.mark
    values = [
        v for key, value in entries.values() for v in initial_values(key, value, what, reading)
    ]
    for value in values:
        if value.order:
            reading.problems.add(f"velocities are 0 in {what}", value.mark, rule="shape")
    return EquilibriumExpectation(mapping.mark, tuple(values), verdict, mark)


def _frequencies(node: SourceNode, reading: Reading) -> tuple[Expression, ...] | None:
    what = "'frequencies' in 'expect'"
    sequence = reading.items(node, what, "a list of numbers")
    if sequence is None:
        return None
    read = [reading.expression(item, what) for item in sequence.items]
    return tuple(expression for expression in read if expression)


def read_error_expectation(node: SourceNode, reading: Reading) -> ErrorExpectation | None:
    """Read ``error: {kind, contains}``."""
    what = "'error' in 'expect'"
    mapping = reading.mapping(node, what, "a mapping {kind, contains}")
    if mapping is None:
        return None
    fields = reading.fields(mapping, what, ("kind", "contains"))
    texts = {key: reading.text(value, f"'{key}' of {what}") for key, value in fields.items()}
    return ErrorExpectation(mapping.mark, texts.get("kind"), texts.get("contains"))


_EXPECTATIONS: dict[str, Any] = {
    "dof": _dof,
    "cyclic": _names("cyclic"),
    "conserved": _names("conserved"),
    "equations": _equations,
    "lagrangian": _lagrangian,
    "hamiltonian": _hamiltonian,
    "state": _states,
    "drift": _drift,
    "events": _events,
    "equilibrium": _equilibrium_law,
    "equilibria": _equilibria,
    "frequencies": _frequencies,
    "error": read_error_expectation,
}
