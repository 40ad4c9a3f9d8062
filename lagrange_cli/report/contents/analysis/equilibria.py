"""The section on equilibria or steady motions: how many there are, and each with its stability."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.phrases import Phrase
from lagrange_cli.report.contents.analysis.wording import (
    hidden,
    inlined,
    sentence,
    values_of,
    verdict_word,
)
from lagrange_cli.report.contents.numbers import phrased
from lagrange_cli.report.document_options import MOST_LISTED
from lagrange_cli.report.inlines import (
    AT_MOST,
    Expression,
    Label,
    Listed,
    Sentence,
    Text,
    Written,
    enumerated,
    joined,
    label_node,
    numeral,
    say,
    symbol,
    upright,
)
from lagrange_cli.report.tree import (
    Block,
    Bullets,
    Case,
    Cases,
    Formula,
    Formulas,
    Paragraph,
    Section,
    section,
)

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.analysis.equilibria.steady import SteadyForm
    from lagrange_cli.analysis.result import Analysis
    from lagrange_cli.analysis.values import (
        Equilibria,
        Equilibrium,
        Existence,
        NearBalance,
        Turning,
    )
    from lagrange_cli.report.contents.derivation.writer import DocumentWriter


#: Most conditions of steady motion that are shown, and operations of one: what books print.
_MOST_CONDITIONS, _LONGEST_CONDITION = 3, 40


def equilibria_section(analysis: Analysis, writer: DocumentWriter) -> Section | None:
    """Return equilibria, or steady motions with the values that they are for."""
    result, steady = analysis.equilibria, analysis.steady
    if result is None:
        return None
    places = Places(analysis, writer)
    counted: Written = _count(result)
    if result.complete and result.released:
        counted = Listed((counted, _released(result.released)), between="; ")
    if steady is not None:
        values = inlined(
            places.letter(s) + ("" if x is None else " = " + numeral(x))
            for s, x in steady.given_values
        )
        condition = say("with {values}", values=values)
        counted = say("{name}: {value}", name=condition, value=counted)
    points = result.points[:MOST_LISTED]
    return section(
        say("Equilibria") if steady is None else say("Steady motions"),
        *_conditions(places),
        sentence(counted),
        Cases(tuple(map(places.case, points))) if points else None,
        hidden(len(result.points) - len(points)),
        *_absent(places, result),
        Bullets(tuple(map(places.near, result.unproven))) if result.unproven else None,
        *held_values(result.held_inputs, [s.name for s in analysis.equations.system.switches]),
    )


def _conditions(places: Places) -> Iterator[Block]:
    """Yield what rates and places of a steady motion have to do with each other, if it is short."""
    steady = places.analysis.steady
    conditions = () if steady is None else steady.conditions
    is_short = all(e.count_ops() <= _LONGEST_CONDITION for e in conditions)
    if is_short and 0 < len(conditions) <= _MOST_CONDITIONS:
        yield Paragraph(say("Motions are steady where:"))
        zero = label_node(numeral(0))
        yield Formulas(tuple(Formula(places.letter(e), (zero,)) for e in conditions))


def held_values(
    values: Sequence[tuple[str, float]], switches: Collection[str] = ()
) -> Iterator[Paragraph]:
    """Say at which values inputs, and states with two values, are held, if there are some."""
    inputs = [(name, x) for name, x in values if name not in switches]
    states = [(name, x) for name, x in values if name in switches]
    if inputs:
        yield Paragraph(say("Inputs are held at {values}.", values=values_of(inputs)))
    if states:
        text = "States with two values are held at {values}."
        yield Paragraph(say(text, values=values_of(states)))


def _released(count: int) -> Sentence:
    """Say that equilibria of singular coordinates were left out by a measurement, not a proof."""
    one = (
        "one more at singular coordinates is left out, since motions from rest were measured to"
        " begin beside it"
    )
    many = (
        "{count} more at singular coordinates are left out, since motions from rest were measured"
        " to begin beside them"
    )
    return say.counted(count, one, many)


def _count(equilibria: Equilibria) -> Sentence:
    """Say how many there are, or how many were found."""
    number = len(equilibria.points)
    if equilibria.complete and equilibria.nonzero:
        names = inlined(map(symbol, equilibria.nonzero))
        count = len(equilibria.nonzero)
        if number:
            one = "these are all where {names} is not 0"
            many = "these are all where {names} are not 0"
            return say.counted(count, one, many, names=names)
        one = "none where {names} is not 0: the forces cannot balance"
        many = "none where {names} are not 0: the forces cannot balance"
        return say.counted(count, one, many, names=names)
    if equilibria.complete:
        return say("these are all") if number else say("none: the forces cannot balance")
    if equilibria.starts:
        return say(
            "{count} found, by a search from {starts} starts; there may be others",
            count=number,
            starts=equilibria.starts,
        )
    return say("{count} found; there may be others", count=number)


def _absent(places: Places, result: Equilibria) -> Iterator[Block]:
    """Yield equilibria that exist for other values of the parameters."""
    coordinates = places.analysis.rest_equations.system.coordinates
    cases = []
    for absent in result.absent:
        if absent.conditions:
            pairs = zip(coordinates, absent.exact, strict=True)
            place = places.place(absent.exact, None, [c.name for c, e in pairs if e == c.q])
            cases.append(Case(place, places.conditions(absent.conditions)))
    if cases:
        yield Paragraph(say("For other values of the parameters there are as well:"))
        yield Cases(tuple(cases))


@dataclass(frozen=True)
class Places:
    """Writes configurations.

    Attributes
    ----------
    analysis
        The analysis that they are of.
    writer
        Writes expressions.
    """

    analysis: Analysis
    writer: DocumentWriter

    def place(
        self, exact: Sequence[Expr] | None, position: Sequence[object] | None, free: Sequence[str]
    ) -> tuple[Formula, ...]:
        """``θ = acos(g / (R ω²)) = 1.03``, a row for each coordinate."""
        rows, steady = [], self.analysis.steady
        coordinates = self.analysis.rest_equations.system.coordinates
        for k in range(len(coordinates)) if steady is None else steady.resting:
            c = coordinates[k]
            label = self.writer.coordinate(c)
            if c.name in free:
                rows.append(Formula(label + upright(Listed((" ", say("any")), "")), ()))
                continue
            closed = None if exact is None else exact[k]
            has_number = position is not None and _has_one_number(closed, free)
            number = float(str(position[k])) if position is not None and has_number else None
            rows.append(self._equation(label, closed, number))
        return tuple(rows)

    def _equation(self, label: Label, exact: Expr | None, number: float | None) -> Formula:
        chain = () if exact is None else (self.writer.tree(exact),)
        return Formula(label, chain if number is None else (*chain, label_node(numeral(number))))

    def point(self, point: Equilibrium) -> tuple[Formula, ...]:
        """Return a row for each coordinate that rests, and for each that turns."""
        rows, steady = self.place(point.exact, point.position, point.free), self.analysis.steady
        if steady is None or point.turning is None:
            return rows
        return (*rows, *self._turning(steady, point.turning))

    def _turning(self, steady: SteadyForm, turning: Turning) -> Iterator[Formula]:
        """Yield of each ignored coordinate the rate where the momentum is given, or otherwise.

        A rate without a momentum has been said before.
        """
        given_values = steady.given_values if steady.momenta else ()
        for k, (momentum, (fixed, _)) in enumerate(zip(steady.momenta, given_values, strict=True)):
            is_rate = fixed == momentum.symbol
            closed = turning.exact_rates if is_rate else turning.exact_momenta
            numbers = turning.rates if is_rate else turning.momenta
            exact = None if closed is None else closed[k]
            number = None if numbers is None else float(numbers[k])
            if exact is not None and exact.is_Rational:
                number = None
            shown = momentum.coordinate.v if is_rate else momentum.symbol
            yield self._equation(self.letter(shown), exact, number)

    def letter(self, symbol: Symbol) -> Label:
        """Return the symbol of a momentum or rate."""
        return self.writer.formula(symbol)

    def near(self, at: NearBalance) -> Text:
        """Say near which position numbers balance without a proof."""
        rows = self.place(None, at.position, at.free)
        sides = ((row.label, row.middle, *map(Expression, row.chain)) for row in rows)
        return say(
            "numbers nearly balance near {place}; it is not proven that there is an equilibrium",
            place=inlined(joined(" = ", side) for side in sides),
        )

    def case(self, point: Equilibrium) -> Case:
        """Return an equilibrium with its stability."""
        stability, reason = point.stability, _reason(point)
        about: Text = phrased(reason) if reason else ""
        if stability is not None and stability.stable_where:
            where = self.conditions(stability.stable_where)
            about = say("stable where {conditions}", conditions=where)
        verdict = "" if stability is None else verdict_word(stability.verdict)
        return Case(self.point(point), self.conditions(point.conditions), verdict, about)

    def conditions(self, conditions: Sequence[Existence]) -> Text:
        """Return conditions on parameters, empty if there are none."""
        signs: dict[str, Label | str] = {"<=": " " + AT_MOST + " ", "=": " = ", "<": " < "}
        if not conditions:
            return ""
        sides = (map(self.writer.formula, (c.smaller, c.larger)) for c in conditions)
        listed = zip(conditions, sides, strict=True)
        return enumerated([joined(signs[c.relation], pair) for c, pair in listed])


def _has_one_number(exact: Expr | None, free: Sequence[str]) -> bool:
    """Say whether a closed form is no number already, and holds no coordinate that is any."""
    if exact is None:
        return True
    return not (exact.is_Rational or {s.name for s in exact.free_symbols} & set(free))


def _reason(point: Equilibrium) -> str:
    """Give the reason of a verdict, a phrase; empty if stability was not asked for."""
    if not point.isolated:
        return Phrase("one of a continuum")
    return "" if point.stability is None else point.stability.reason
