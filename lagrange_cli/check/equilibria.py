"""Expected equilibria and frequencies, compared with an analysis."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain
from typing import TYPE_CHECKING, Any, get_args

from lagrange_cli.check.model import edits_at
from lagrange_cli.errors import Edit, InputError, Mark, Problem, nearest
from lagrange_cli.mechanics import interpret
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.symbols.inputs import closed_loop
from lagrange_cli.notation.scene_language import to_scene_language
from lagrange_cli.scene.conditions import EquilibriumExpectation, Expect
from lagrange_cli.scene.language.expression import Expression

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sympy import Expr, Symbol

    from lagrange_cli.analysis.equilibria.rest_system import RestSystem
    from lagrange_cli.analysis.values import Equilibria, Equilibrium


#: Difference, relative to 1 and to the number, that is allowed.
_WITHIN = 1e-9

#: Equilibria that a hint lists.
_MOST_LISTED = 8


def expected_equilibria(expect: Expect, equations: Equations) -> Iterator[Problem]:
    """Require each listed equilibrium to be found; an empty list says that there is none."""
    if expect.equilibria is None:
        return
    from lagrange_cli.analysis.analyze import analyze

    try:
        equilibria = analyze(equations, ["equilibria"]).equilibria
    except InputError as error:
        yield _not_found(error, expect.equilibria_mark, "equilibria")
        return
    assert equilibria is not None
    if not expect.equilibria and (equilibria.points or not equilibria.complete):
        yield Problem(
            f"expected no equilibrium; found: {_listed(equilibria, equations)}"
            if equilibria.points
            else "it cannot be decided that there is no equilibrium",
            expect.equilibria_mark,
            rule="equilibria",
        )
    for expected in expect.equilibria:
        yield from _one_equilibrium(expected, equilibria, equations, expect.equilibria)


def expected_law(expect: Expect, equations: Equations) -> Iterator[Problem]:
    """Require the listed equations together to be a law of equilibrium, in all parameters."""
    if expect.equilibrium is None:
        return
    from lagrange_cli.analysis.equilibria.laws import law_verdict
    from lagrange_cli.analysis.equilibria.rest_system import rest_system

    mark = expect.equilibrium[0].mark()
    sides = [
        (interpret(equations, e.left), interpret(equations, e.right)) for e in expect.equilibrium
    ]
    try:
        system = rest_system(equations, {})
    except InputError as error:
        yield _not_found(error, mark, "equilibrium")
        return
    verdict = law_verdict(system, [left - right for left, right in sides])
    messages = {
        "unbalanced": "the forces do not balance wherever this holds",
        "narrow": "this does not hold all along a branch of the equilibria",
        "undecided": "it cannot be decided whether this is a law of equilibrium",
    }
    if verdict != "proven":
        yield Problem(
            messages[verdict],
            mark,
            hint=f"found: {_listed_laws(system, equations)}",
            rule="equilibrium",
        )


def _listed_laws(system: RestSystem, equations: Equations) -> str:
    """List the equilibria for all values of the parameters."""
    from lagrange_cli.analysis.equilibria.laws import laws_of_equilibrium

    forms = laws_of_equilibrium(system)
    listed = [_law(point, equations) for point in (forms.points if forms else ())]
    return "\n  ".join(["", *listed[:_MOST_LISTED]]) if listed else "none in closed form"


def _law(point: Equilibrium, equations: Equations) -> str:
    """``theta any where m*g*a = b*F``."""
    pairs = zip(_placed(equations), point.exact or (), strict=True)
    place = ", ".join(
        f"{name} any" if name in point.free else f"{name} = {to_scene_language(value, equations)}"
        for name, value in pairs
    )
    conditions = " and ".join(
        f"{to_scene_language(c.smaller, equations)} {c.relation} "
        f"{to_scene_language(c.larger, equations)}"
        for c in point.conditions
    )
    return f"{place} where {conditions}" if conditions else place


def _one_equilibrium(
    expected: EquilibriumExpectation,
    equilibria: Equilibria,
    equations: Equations,
    listed: Sequence[EquilibriumExpectation],
) -> Iterator[Problem]:
    from lagrange_cli.analysis.values import Verdict

    verdicts = get_args(Verdict)
    if expected.stability is not None and expected.stability not in verdicts:
        yield Problem(
            f"there is no stability '{expected.stability}'",
            expected.stability_mark,
            hint=nearest(expected.stability, verdicts) or f"known are {', '.join(verdicts)}",
            rule="equilibria",
        )
        return
    known = [p for p in equilibria.points if p.position is not None]
    places = [(p, _places(p, equations)) for p in known]
    names = {name for _, values in places for name in values}
    for entry in expected.values:
        if places and entry.name not in names:
            message = f"'{entry.name}' is no coordinate and no Cartesian name"
            hint = nearest(entry.name, names)
            yield Problem(message, entry.mark, hint=hint, rule="equilibria")
            return
    values = _numbers_of(expected, equations)
    here = [p for p, place in places if _agrees(values, place, p, equations)]
    if not here:
        message = "this equilibrium is not found"
        hint = f"found: {_listed(equilibria, equations)}"
        others = [_numbers_of(one, equations) for one in listed]
        unnamed = [
            (p, place)
            for p, place in places
            if values.keys() <= place.keys()
            and not any(_agrees(numbers, place, p, equations) for numbers in others)
        ]
        edits = _edits_to_nearest(expected, values, unnamed)
        yield Problem(message, expected.mark, hint=hint, rule="equilibria", edits=edits)
    elif expected.stability is not None:
        verdicts_here = [p.stability.verdict for p in here if p.stability is not None]
        if expected.stability not in verdicts_here:
            message = f"expected '{expected.stability}', found: {', '.join(verdicts_here)}"
            edits = tuple(
                e for one in verdicts_here[:1] for e in edits_at(expected.stability_mark, one)
            )
            yield Problem(message, expected.stability_mark, rule="equilibria", edits=edits)


def _numbers_of(expected: EquilibriumExpectation, equations: Equations) -> dict[str, float]:
    """Evaluate the values of an expected equilibrium."""
    return {entry.name: number_of(equations, entry.value) for entry in expected.values}


def _edits_to_nearest(
    expected: EquilibriumExpectation,
    values: Mapping[str, float],
    places: Sequence[tuple[Equilibrium, Mapping[str, float]]],
) -> tuple[Edit, ...]:
    """Replace expected values by those of the nearest of some equilibria."""
    if not places:
        return ()
    point, place = min(
        places, key=lambda one: math.hypot(*(one[1][name] - x for name, x in values.items()))
    )
    edits = [
        edits_at(entry.value, repr(place[entry.name]))
        for entry in expected.values
        if entry.name not in point.free
    ]
    return tuple(chain.from_iterable(edits))


def _places(point: Equilibrium, equations: Equations) -> dict[str, float]:
    """Evaluate coordinates, states and Cartesian names that have values, at an equilibrium."""
    placed = _placed(equations)
    known: dict[Expr, Any] = dict(zip(placed.values(), point.position or (), strict=True))
    known |= {p.symbol: p.value for p in equations.system.parameters if p.value is not None}
    values = {c.name: c.position.subs(known) for c in equations.system.cartesian_names}
    numbers = {name: float(value) for name, value in values.items() if value.is_number}
    return numbers | {name: float(known[symbol]) for name, symbol in placed.items()}


def _placed(equations: Equations) -> dict[str, Symbol]:
    """Return the symbols of the numbers of an equilibrium by name: coordinates, then states.

    What controllers hold are states of their loop; states with two values are held.
    """
    system = closed_loop(equations).system
    symbols = {c.name: c.q for c in system.coordinates}
    return symbols | {state.name: state.symbol for state in system.states if not state.switch}


def _agrees(
    expected: Mapping[str, float],
    place: Mapping[str, float],
    point: Equilibrium,
    equations: Equations,
) -> bool:
    """Say whether an equilibrium has these values; angles a turn apart are one."""
    angles = {c.name for c in equations.system.coordinates if c.is_angle}
    for name, value in expected.items():
        if name in point.free:
            continue
        gap = abs(place[name] - value)
        if name in angles:
            gap = abs(math.remainder(gap, 2 * math.pi))
        if not gap <= _WITHIN * max(1.0, abs(value)):
            return False
    return True


def _listed(equilibria: Equilibria, equations: Equations) -> str:
    """List equilibria, each with its coordinates."""
    names = [c.name for c in equations.system.coordinates]
    points = [
        ", ".join(f"{n} = {float(x):.9g}" for n, x in zip(names, p.position or (), strict=False))
        for p in equilibria.points
    ]
    return "; ".join(points) or "none"


def expected_frequencies(expect: Expect, equations: Equations) -> Iterator[Problem]:
    """Require the modes at the stable equilibrium to have exactly these angular frequencies."""
    if expect.frequencies is None:
        return
    from lagrange_cli.analysis.analyze import analyze

    try:
        modes = analyze(equations, ["modes"]).modes or ()
    except InputError as error:
        yield _not_found(error, expect.frequencies_mark, "frequencies")
        return
    frequencies = sorted(mode.frequency for mode in modes)
    expected = sorted(number_of(equations, e) for e in expect.frequencies)
    size = max(map(abs, expected), default=0.0)
    agree = len(frequencies) == len(expected) and all(
        _is_near(a, b, size) for a, b in zip(frequencies, expected, strict=True)
    )
    if not agree:
        written = sorted(expect.frequencies, key=lambda e: number_of(equations, e))
        pairs = list(zip(written, frequencies, strict=False))
        yield Problem(
            f"expected the frequencies {_numbers(expected)}; found: {_numbers(frequencies)}",
            expect.frequencies_mark,
            rule="frequencies",
            edits=tuple(
                edit
                for expression, measured in pairs
                if not _is_near(measured, number_of(equations, expression), size)
                for edit in edits_at(expression, repr(measured))
            )
            if len(frequencies) == len(expected)
            else (),
        )


def _is_near(measured: float, expected: float, size: float) -> bool:
    """Compare a frequency; those far below the largest, ``size``, are 0."""
    return abs(measured - expected) <= _WITHIN * max(abs(expected), _WITHIN * size)


def _numbers(values: list[float]) -> str:
    return ", ".join(f"{x:.12g}" for x in values) or "none"


def _not_found(error: InputError, mark: Mark | None, rule: str) -> Problem:
    """Report an analysis that could not be made, at the expectation."""
    problem = error.problems[0]
    return Problem(problem.message, mark, hint=problem.hint, rule=rule)


def number_of(equations: Equations, expression: Expression) -> float:
    """Evaluate an expression in parameters.

    Raises
    ------
    InputError
        Located: a parameter lacks its value, or it is no real number.
    """
    known = {p.symbol: p.value for p in equations.system.parameters if p.value is not None}
    value = interpret(equations, expression).subs(known)
    if value.free_symbols:
        names = ", ".join(sorted(symbol.name for symbol in value.free_symbols))
        raise InputError(
            Problem(f"no value is known for {names}", expression.mark(), rule="no-value")
        )
    if not value.is_real:
        raise InputError(Problem("this is no real number", expression.mark(), rule="no-value"))
    return float(value)
