"""Functions of charts for a model: where they are singular, and what has replaced them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.program.emitted_functions import program_of
from lagrange_cli.program.lowered.lowering import lowered
from lagrange_cli.program.lowered.stored import StoredFunctions
from lagrange_cli.simulate.model.expressions import outputs_program
from lagrange_cli.simulate.model.model import ChartSingularity, FormerChart
from lagrange_cli.simulate.model.table_ends import table_ends, vanishing_slips

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Coordinate, ReplacedChart
    from lagrange_cli.program.program import Program


def coordinate_kinds(coordinates: Iterable[Coordinate]) -> tuple[str, ...]:
    """Name the kinds of coordinates: ``angle``, or a word that those of one dimension share.

    Parts of quaternions count as angles: they are of size 1, and turns are about twice as large.
    """
    return tuple(
        "angle" if c.is_angle or c.is_of_quaternion else c.unit or "length" for c in coordinates
    )


def chart_singularities(equations: Equations) -> tuple[ChartSingularity, ...]:
    """Describe the singular configurations of the coordinates in words of the scene."""
    if not equations.derivation.singular:
        return ()
    from lagrange_cli.notation.scene_language import to_scene_language  # imports all of notation

    of_turns = _angles_of_three_turns(equations)
    return tuple(
        ChartSingularity(
            f"{to_scene_language(place.where, equations)} = 0",
            place.coordinates,
            place.infinite,
            any(angles.issuperset(place.coordinates) for angles in of_turns),
        )
        for place in equations.derivation.singular
    )


def _angles_of_three_turns(equations: Equations) -> list[set[str]]:
    """List the names of the angles of each body that has three turns, each by a coordinate."""
    names = {c.q: c.name for c in equations.system.coordinates}
    turnings = (p.turning for p in equations.system.particles if p.turning is not None)
    angles = (
        [names.get(turn[1]) for turn in turning.turns if isinstance(turn, tuple)]
        for turning in turnings
    )
    known = ({name for name in each if name is not None} for each in angles)
    return [each for each in known if len(each) == 3]


def singular_program(equations: Equations) -> Program | None:
    """Make a program whose numbers vanish at singular configurations; None if there are none."""
    if not equations.derivation.singular:
        return None
    # Inertia holds no inputs.
    equations = replace(equations, system=replace(equations.system, inputs=()))
    return outputs_program(equations, (place.where for place in equations.derivation.singular))


def _above(equations: Equations) -> list[Expr]:
    """List what is positive where the equations hold."""
    ends = (*table_ends(equations), *vanishing_slips(equations))
    return [e for _, e in (*equations.system.positive, *ends)]


def positive_program(equations: Equations) -> Program | None:
    """Make a program whose numbers are positive where the equations hold; None if the scene
    declares nothing positive, no table ends and no slip vanishes."""
    above = _above(equations)
    if not above:
        return None
    # Inputs move no coordinate.
    return outputs_program(replace(equations, system=replace(equations.system, inputs=())), above)


def guard_program(equations: Equations) -> tuple[Program, list[list[int]]] | None:
    """Make the program whose numbers vanish at singular configurations where no coordinate ends.

    Numbers that vanish at the border of what is positive, at ends of tables and of slips, follow.
    With it come, for each number, the places in the state of the rates that move nothing there.
    None if there is no such number.
    """
    places = [place for place in equations.derivation.singular if not place.infinite]
    above = _above(equations)
    if not (places or above):
        return None
    names = [c.name for c in equations.system.coordinates]
    rates = [[len(names) + names.index(name) for name in place.coordinates] for place in places]
    vanishing = [*(place.where for place in places), *above]
    return outputs_program(equations, vanishing), [*rates, *([] for _ in above)]


def former_chart(equations: Equations) -> FormerChart | None:
    """Gather the coordinates that were replaced, and functions from them to the present ones.

    ``equations``: with functions of time in place of inputs. Recorded ones in positions leave none.
    """
    chart, inputs = equations.system.chart, {u.symbol for u in equations.system.inputs}
    if chart is not None and chart.turns:
        return _former_turns(chart)
    if chart is None or any(
        not inputs.isdisjoint(place.velocity.free_symbols) for place in chart.places
    ):
        return None
    former = replace(
        equations,
        system=replace(
            equations.system,
            coordinates=chart.coordinates,
            cartesian_names=chart.places,
            closures=(),
            inputs=(),
            outputs=(),
        ),
    )
    functions = {
        name: lowered(program_of(former, name), name) for name in ("positions", "velocities")
    }
    start = chart.start
    return FormerChart(
        tuple(c.name for c in chart.coordinates),
        coordinate_kinds(chart.coordinates),
        None if start is None else (*start.positions, *start.velocities),
        StoredFunctions.from_functions(functions),
        chart.steady,
        tuple(c.name for c in chart.coordinates if c.is_positive),
    )


def _former_turns(chart: ReplacedChart) -> FormerChart:
    """Gather the angles that quaternions have replaced."""
    names = [c.name for c in chart.coordinates]
    angles = tuple(name for turn in chart.turns for name in turn.angles)
    numbers = [names.index(name) for name in angles]
    start = None
    if chart.start is not None:
        rows = chart.start.positions, chart.start.velocities
        start = tuple(row[k] for row in rows for k in numbers)
    kinds = ("angle",) * len(angles)
    return FormerChart(angles, kinds, start, StoredFunctions(), turns=chart.turns)
