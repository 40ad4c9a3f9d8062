"""Sections on numerical results: Lyapunov exponents, a system along a motion, responses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from lagrange_cli.report.contents.analysis.wording import hidden, inlined, sentence, state
from lagrange_cli.report.contents.numbers import phrased
from lagrange_cli.report.inlines import (
    COMMA,
    Inline,
    Label,
    Listed,
    Plain,
    Sentence,
    Text,
    bold,
    differential,
    numeral,
    opened,
    say,
    symbol,
    times,
    virtual,
)
from lagrange_cli.report.tree import Bullets, Labelled, Law, Paragraph, Section, Table, section

if TYPE_CHECKING:
    from lagrange_cli.analysis.result import AlongMotion, Exponents
    from lagrange_cli.analysis.values import Channel, FrequencyResponse


def exponents_section(result: Exponents | None) -> Section | None:
    """Return a table of Lyapunov exponents and their spreads, if there are some."""
    if result is None:
        return None
    rows = tuple(
        (Inline(numeral(x, 5)), Inline(numeral(y, 2)))
        for x, y in zip(result.values, result.spreads, strict=True)
    )
    heads = say("exponent"), say("spread")
    averaged = say(
        "averaged from {start} to {until}, together {total}",
        start=_at(result.start),
        until=Inline(numeral(result.until)),
        total=Inline(numeral(sum(result.values), 3)),
    )
    return section(
        say("Lyapunov exponents"),
        sentence(averaged),
        Table(heads, rows, numeric=frozenset(heads)),
    )


def along_section(result: AlongMotion | None) -> Section | None:
    """Return the section on a linear system along a motion, if any; JSON holds its matrices."""
    if result is None:
        return None
    span = say(
        "{count} times from {start} to {until}",
        count=result.count,
        start=_at(result.start),
        until=Inline(numeral(result.until)),
    )
    named = (
        (say("states"), result.states),
        (say("inputs"), result.inputs),
        (say("outputs"), result.outputs),
    )
    law = differential(virtual(bold("y"))) + " = " + _changed("A", "B")
    law = law + COMMA + virtual(bold("z")) + " = " + _changed("C", "D")
    return section(
        say("Along the motion"),
        sentence(span),
        Law(law),
        Labelled(tuple((name, inlined(map(state, names))) for name, names in named if names)),
        Bullets(tuple(_along_lines(result))),
    )


def _at(time: float) -> Inline:
    return Inline(symbol("t") + " = " + numeral(time))


def _changed(of_states: str, of_inputs: str) -> Label:
    """``A(t) δy + B(t) δu``."""
    matrices = [(of_states, "y"), (of_inputs, "u")]
    first, second = (times(bold(m) + "(t)", virtual(bold(by))) for m, by in matrices)
    return first + " + " + second


def _along_lines(result: AlongMotion) -> Iterator[Text]:
    """Say how accurate a linear system along a motion is, and where its matrices are."""
    if result.is_constrained:
        allowed = times(bold("E") + "(t)", virtual(bold("y"))) + " = " + bold("0")
        yield say("{formula} are the changes that constraints allow", formula=Inline(allowed))
    yield say(
        "estimated error {estimated}, requested {requested}",
        estimated=Inline(numeral(result.estimated, 2)),
        requested=Inline(numeral(result.requested, 1)),
    )
    if result.reason:
        yield phrased(result.reason)
    yield say("The matrices are in the JSON, and in FILE.npz with -o FILE.npz.")


#: Pairs of inputs and outputs, and peaks of each, that are listed.
_MOST_CHANNELS, _MOST_PEAKS = 24, 12


def response_section(result: FrequencyResponse | None) -> Section | None:
    """Return a table of the largest gains of responses, if there are some."""
    if result is None:
        return None
    span = say(
        "angular frequencies from {start} to {until}",
        start=Inline(numeral(result.low)),
        until=Inline(numeral(result.high)),
    )
    of_pair = say("input"), say("output"), say("static gain")
    of_peak = say("at"), say("gain"), say("phase")
    rows = tuple(
        row for channel in result.channels[:_MOST_CHANNELS] for row in _channel_rows(channel)
    )
    lines = tuple(say("{text}.", text=opened(line)) for line in _response_lines(result))
    return section(
        say("Frequency response"),
        sentence(span),
        Table((*of_pair, *of_peak), rows) if rows else None,
        Paragraph(Listed(lines, " ")),
        hidden(len(result.channels) - _MOST_CHANNELS),
    )


def _channel_rows(channel: Channel) -> Iterator[tuple[Text, ...]]:
    """Yield a row for each peak; the first names the pair."""
    static = say("infinite") if channel.static is None else Inline(numeral(channel.static))
    head: tuple[Text, ...] = Plain(channel.source), Plain(channel.output), static
    for peak in channel.peaks[:_MOST_PEAKS]:
        place = Inline(numeral(peak.frequency, 9))
        if peak.gain is None or peak.phase is None:
            yield (*head, place, say("infinite"), "")
        else:
            phase = Plain(f"{math.degrees(peak.phase):.1f}°")
            yield (*head, place, Inline(numeral(peak.gain)), phase)
        head = "", "", ""
    if not channel.peaks:
        yield (*head, "", "", "")


def _response_lines(result: FrequencyResponse) -> Iterator[Sentence]:
    """Say which gains the table lists, and how far they are to be trusted."""
    if not result.channels:
        yield say("no output answers to an input")
        return
    yield say("largest gains, each at its frequency; infinite where a pole is undamped")
    if result.settles == "undamped":
        yield say("poles on the imaginary axis: free motions go on beside these")
    if result.settles == "unstable":
        yield say("a pole has a positive real part: motions grow and do not settle to these")
    error = Inline(numeral(result.error, 1))
    yield say("rounding is at most {error} of a value", error=error)
