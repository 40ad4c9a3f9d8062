"""Lowered statements as Python is to print them: without scopes and names for what has a place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from lagrange_cli.program.graph.operands import (
    COUNTED,
    AffineIndex,
    Constant,
    Element,
    Operand,
    Variable,
    rebuilt,
    variables,
)
from lagrange_cli.program.lowered.functions import (
    RESULTS,
    For,
    Let,
    Require,
    RequireFinite,
    Scope,
    Step,
    Store,
    operands_in,
    steps_in,
)

_FIRST_RESULT = Element(RESULTS, AffineIndex(0))


def is_zero(operand: Operand) -> bool:
    """Tell whether an operand is the number zero."""
    return isinstance(operand, Constant) and not operand.value


def cleared(step: Step) -> Element | None:
    """Return the first number of an array that a loop does nothing but set to zero."""
    if isinstance(step, For) and step.independent and len(step.body) == 1:
        (store,) = step.body
        if isinstance(store, Store) and is_zero(store.operand) and store.target.table is None:
            return store.target
    return None


def groups(body: Sequence[Step]) -> Iterator[list[Step]]:
    """Yield stores, and tests, that follow each other together, all other statements alone."""
    group: list[Step] = []
    for step in body:
        if group and not (type(step) is type(group[0]) and isinstance(step, Store | Require)):
            yield group
            group = []
        group.append(step)
    if group:
        yield group


def without_aliases(body: Sequence[Step], places: dict[str, Operand]) -> Iterator[Step]:
    """Yield statements without scopes, and without names for what has a place already."""

    def placed(variable: Variable) -> Operand:
        if isinstance(variable, Element) and variable.name in ("p", "u"):
            is_fixed = not any(variable.index.steps) and variable.table is None
            return Variable(f"{variable.name}{variable.index.base}") if is_fixed else variable
        return places.get(variable.name, variable)

    for step in body:
        if isinstance(step, Scope):
            yield from without_aliases(step.body, {})
        elif isinstance(step, For):
            yield replace(step, body=tuple(without_aliases(step.body, dict(places))))
        elif isinstance(step, Let):
            operand = rebuilt(step.operand, placed)
            places.pop(step.name, None)
            is_place = isinstance(operand, Variable) and step.name[0] == "l"
            if is_place and getattr(operand, "table", None) is None:
                places[step.name] = operand
            else:
                yield Let(step.name, operand)
        elif isinstance(step, Store):
            yield Store(step.target, rebuilt(step.operand, placed))
        else:
            yield step


def is_independent(loop: For) -> bool:
    """Tell whether no repetition of a single loop reads or stores what another one stores."""
    if loop.count.steps or not all(isinstance(step, Store) for step in loop.body):
        return False
    count, stored = loop.count.base, set[tuple[str, int]]()
    stores = [step for step in loop.body if isinstance(step, Store)]
    for store in stores:
        cells = _cells(store.target, count)
        if len(cells) < count or stored & cells:
            return False
        stored |= cells
    read = [v for store in stores for v in variables(store.operand) if isinstance(v, Element)]
    return not any(v.name == COUNTED or v.table or stored & _cells(v, count) for v in read)


def _cells(element: Element, count: int) -> set[tuple[str, int]]:
    """Return array and indices of an element in all repetitions of a loop."""
    return {(element.name, element.index.at((k,))) for k in range(count)}


def with_last_inlined(body: Sequence[Step]) -> Sequence[Step]:
    """Return statements in which the only result is not named before it is stored."""
    steps = [step for step in body if not isinstance(step, RequireFinite)]
    if len(steps) > 1:
        *before, let, store = steps
        if isinstance(let, Let) and store == Store(_FIRST_RESULT, Variable(let.name)):
            return [*before, Store(_FIRST_RESULT, let.operand)]
    return steps


def elements_in(body: Sequence[Step]) -> Iterator[Element]:
    """Yield the numbers of arrays that statements read or store."""
    for step in steps_in(body):
        if isinstance(step, Store):
            yield step.target
    for operand in operands_in(body):
        yield from (v for v in variables(operand) if isinstance(v, Element))
