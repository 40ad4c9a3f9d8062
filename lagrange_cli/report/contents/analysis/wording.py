"""Phrases that text and documents of an analysis share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.analysis.phrases import Part, Phrase

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sympy import Expr, Symbol

    from lagrange_cli.analysis.equilibria.steady import SteadyForm
    from lagrange_cli.analysis.result import AlongMotion, Exponents
    from lagrange_cli.analysis.symmetries.linear_symmetries import Symmetries
    from lagrange_cli.analysis.values import (
        Equilibria,
        Equilibrium,
        Linearization,
        NearBalance,
        Turning,
        Verdict,
    )
    from lagrange_cli.report.phrases.language import Language


@dataclass(frozen=True)
class Teller:
    """Says phrases of an analysis in the letters of a format and a language.

    Attributes
    ----------
    say
        The language.
    symbol, matrix, words
        Write a name of the scene, the letter of a matrix, and a text within a sentence.
    """

    say: Language
    symbol: Callable[[str], str]
    matrix: Callable[[str], str]
    words: Callable[[str], str]

    def __call__(self, text: str) -> str:
        """Say a phrase; other texts stay as they are."""
        if not isinstance(text, Phrase):
            return self.words(text)
        return self.say(text.english, **{k: self._part(k, p) for k, p in text.parts.items()})

    def _part(self, name: str, part: Part) -> str:
        if isinstance(part, str):
            return self(part)
        return ", ".join(map(self.matrix if name == "matrix" else self.symbol, part))


def count_line(equilibria: Equilibria, say: Language, symbol: Callable[[str], str]) -> str:
    """Say how many there are, or how many were found.

    ``symbol`` writes a name of the scene within a sentence.
    """
    number = len(equilibria.points)
    if equilibria.complete and equilibria.nonzero:
        names = ", ".join(map(symbol, equilibria.nonzero))
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


def unproven_lines(
    equilibria: Equilibria, say: Language, place: Callable[[NearBalance], str]
) -> list[str]:
    """Say near which positions numbers balance without a proof.

    ``place`` writes a configuration.
    """
    return [
        say(
            "numbers nearly balance near {place}; it is not proven that there is an equilibrium",
            place=place(near),
        )
        for near in equilibria.unproven
    ]


def held_line(equilibria: Equilibria, say: Language, symbol: Callable[[str], str]) -> list[str]:
    """Say at which values inputs are held; nothing if there are none."""
    inputs = ", ".join(f"{symbol(n)} = {x:g}" for n, x in equilibria.held_inputs)
    return [say("with inputs held at {values}", values=inputs)] if inputs else []


def has_one_number(exact: Expr | None, free: Sequence[str]) -> bool:
    """Say whether a closed form is no number already, and holds no coordinate that is any."""
    if exact is None:
        return True
    return not (exact.is_Rational or {s.name for s in exact.free_symbols} & set(free))


def turning_values(
    steady: SteadyForm, turning: Turning
) -> Iterator[tuple[Symbol, Expr | None, float | None]]:
    """Give of each ignored coordinate the rate where the momentum is given, or otherwise.

    Each is a symbol, and its value in closed form and in numbers as far as they are known.
    """
    for k, (momentum, (value, _)) in enumerate(
        zip(steady.momenta, steady.given_values, strict=True)
    ):
        is_rate = value == momentum.symbol
        exact = turning.exact_rates if is_rate else turning.exact_momenta
        numbers = turning.rates if is_rate else turning.momenta
        yield (
            momentum.coordinate.v if is_rate else momentum.symbol,
            None if exact is None else exact[k],
            None if numbers is None else float(numbers[k]),
        )


def verdict_word(verdict: Verdict, say: Language) -> str:
    """Name the proven stability of an equilibrium, or say that it is undecided."""
    return {
        "stable": say("stable"),
        "asymptotically stable": say("asymptotically stable"),
        "stable but for drift": say("stable but for drift"),
        "stable in the linear approximation": say("stable in the linear approximation"),
        "unstable": say("unstable"),
        "undecided": say("undecided"),
    }[verdict]


def reason_of(point: Equilibrium) -> str:
    """Give the reason of a verdict, a phrase; empty if stability was not asked for."""
    if not point.isolated:
        return Phrase("one of a continuum")
    return "" if point.stability is None else point.stability.reason


def damping_line(linear: Linearization, label: str, say: Language) -> str:
    """Say whether C is damping, gyroscopic or both; empty if it is zero."""
    damps, turns = bool(linear.dissipative.any()), bool(linear.gyroscopic.any())
    if damps and turns:
        return say(
            "{matrix} has a symmetric part, damping, and an antisymmetric one, gyroscopic",
            matrix=label,
        )
    if damps:
        return say("{matrix} is symmetric: damping", matrix=label)
    return say("{matrix} is antisymmetric: gyroscopic", matrix=label) if turns else ""


def searched(symmetries: Symmetries | None, say: Language) -> str:
    """Say among which quantities conserved ones were searched for."""
    if symmetries is None:
        return say("among cyclic momenta and energy")
    if symmetries.complete:
        return say("among energy and what symmetries linear in the coordinates give")
    return say("among energy and what symmetries constant in the coordinates give")


def averaged_line(result: Exponents, say: Language, inline: Callable[[str], str]) -> str:
    """Say over which time exponents are averages, and what they add up to.

    ``inline`` writes a formula within a sentence.
    """
    return say(
        "averaged from {start} to {until}, together {total}",
        start=inline(f"t = {result.start:.6g}"),
        until=f"{result.until:.6g}",
        total=f"{sum(result.values):.3g}",
    )


def span_line(result: AlongMotion, say: Language, inline: Callable[[str], str]) -> str:
    """Say at which times a linear system along a motion is known."""
    return say(
        "{count} times from {start} to {until}",
        count=result.count,
        start=inline(f"t = {result.start:.6g}"),
        until=f"{result.until:.6g}",
    )


def along_lines(result: AlongMotion, say: Language, words: Callable[[str], str]) -> list[str]:
    """Say how accurate a linear system along a motion is, and where its matrices are."""
    allowed = say("E(t) dy = 0 are the changes that constraints allow")
    return [
        *([allowed] if result.is_constrained else []),
        say(
            "estimated error {estimated}, requested {requested}",
            estimated=f"{result.estimated:.1e}",
            requested=f"{result.requested:.0e}",
        ),
        *([words(result.reason)] if result.reason else []),
        say("The matrices are in the JSON, and in FILE.npz with -o FILE.npz."),
    ]


def part_word(part: str, say: Language) -> str:
    """Name a part of an analysis."""
    return {
        "symmetries": say("symmetries"),
        "equilibria": say("equilibria"),
        "linearization": say("linearization"),
        "modes": say("modes"),
        "contacts": say("loss of contact"),
    }[part]
