"""A slice of the shipped scenes is analyzed within its budget, and each equilibrium is one."""

from __future__ import annotations

import mpmath
import pytest
from mpmath import mpf

from lagrange_cli.analysis.analyze import PARTS
from lagrange_cli.api import load
from lagrange_cli.cache import open_cache
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.report.contents.analysis.documents import analysis_page
from lagrange_cli.report.values.analysis import analysis_report
from tests.systems.shipped import SCENES, SLICE, sliced

pytestmark = pytest.mark.slow


def at_rest(equations, point, held):
    """The symbols at an equilibrium, evaluated by tapes and not by the value graph."""
    place = {c.q: x for c, x in zip(equations.system.coordinates, point.position, strict=True)}
    place |= {c.v: mpf(0) for c in equations.system.coordinates}
    closures = zip(equations.system.closures, point.multipliers, strict=True)
    place |= {c.multiplier: x for c, x in closures}
    place |= {p.symbol: mpf(p.decimal) for p in equations.system.parameters if p.decimal}
    place |= {u.symbol: mpf(held.get(u.name, 0)) for u in equations.system.inputs}
    return place | {equations.system.t: mpf(1)}


def residuals(equations, place):
    """Each sum of forces, or constraint, relative to its terms."""
    rows = [list(f.as_ordered_terms()) if f != 0 else [] for f in equations.system.forcing]
    for closure in equations.system.closures:
        for j, entry in entries(closure.gradient).items():
            rows[j].append(closure.multiplier * entry)
        rows.append(list(closure.expression.as_ordered_terms()))
    for terms in filter(None, rows):
        values = evaluate(terms, place)
        yield abs(mpmath.fsum(values)), mpmath.fsum(map(abs, values))


#: The dearest analysis, of twelve coordinates with multipliers, is a campaign.
ANALYZED = {*SLICE} - {"chain_of_rods"}


@sliced(SCENES, ANALYZED)
def test_analysis_ends_and_says_what_it_left_out(name):
    derivation = load(SCENES[name]).derive(cache=open_cache())
    analysis = derivation.analyze()
    found = {part: getattr(analysis, part) for part in PARTS}
    left_out = {left.part for left in analysis.left_out}
    # Scenes without contacts lose none, and nothing is said of it.
    missing = {part for part in PARTS if found[part] is None}
    assert missing - {"contacts"} == left_out - {"contacts"}
    assert not ("contacts" in left_out and found["contacts"])
    assert all(left.reason for left in analysis.left_out)
    equations = derivation.equations
    for point in analysis.equilibria.points if analysis.equilibria else ():
        with mpmath.workdps(40):
            place = at_rest(equations, point, dict(analysis.equilibria.held_inputs))
            try:
                for miss, size in residuals(equations, place):
                    assert miss <= max(size, 1) * max(1e-9 * point.uncertainty, 1e-18)
            except DomainError:
                assert point.stability.verdict == "undecided"
    assert analysis_report(analysis)["name"] == name
    assert analysis_page(analysis, ascii=True).text().isascii()
