"""Numerical results as text: Lyapunov exponents, a linear system along a motion, responses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from lagrange_cli.notation.page import Block, Row, words
from lagrange_cli.report.contents.analysis.wording import along_lines, averaged_line, span_line

if TYPE_CHECKING:
    from lagrange_cli.analysis.result import AlongMotion, Exponents
    from lagrange_cli.analysis.values import Channel, FrequencyResponse, Matrix
    from lagrange_cli.report.phrases.language import Language


def exponent_rows(result: Exponents | None, say: Language) -> list[Row | Block]:
    """Write Lyapunov exponents and their spreads, if there are some."""
    if result is None:
        return []
    columns = [
        [say("exponent"), *(f"{x:.5g}" for x in result.values)],
        [say("spread"), *(f"{x:.2g}" for x in result.spreads)],
    ]
    widths = [max(map(len, column)) for column in columns]
    rows = [
        Row("", "  ".join(["", *(f"{x:>{w}}" for x, w in zip(row, widths, strict=True))]))
        for row in zip(*columns, strict=True)
    ]
    average = words(averaged_line(result, say, str))
    return [Row(say("Lyapunov exponents"), "   ", average, "heading"), *rows]


def along_rows(result: AlongMotion | None, say: Language) -> list[Row | Block]:
    """Write states, inputs, outputs and accuracy of the linear system along a motion, if any."""
    if result is None:
        return []
    law = "d/dt dy = A(t) dy + B(t) du,  dz = C(t) dy + D(t) du"
    named = (
        (say("states"), result.states),
        (say("inputs"), result.inputs),
        (say("outputs"), result.outputs),
    )
    rows = [Row("", "  ", words(law))]
    rows += [Row("", f"  {n:8} ", words(", ".join(names))) for n, names in named if names]
    rows += [Row("", "  ", words(line)) for line in along_lines(result, say, str)]
    heading = say("Along the motion")
    return [Row(heading, "   ", words(span_line(result, say, str)), "heading"), *rows]


#: Pairs of inputs and outputs, and peaks of each, that are listed.
_MOST_CHANNELS, _MOST_PEAKS = 24, 12


def response_rows(result: FrequencyResponse | None, say: Language) -> list[Row | Block]:
    """Write responses and their largest gains, if there are some."""
    if result is None:
        return []
    table = response_table(result, say)
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    rows = [
        Row("", "  ".join(["", *(f"{x:<{w}}" for x, w in zip(row, widths, strict=True))]).rstrip())
        for row in table
    ]
    rows += [Row("", "  ", words(line)) for line in response_lines(result, say)]
    span = say("angular frequencies from {start} to {until}", **_span(result))
    return [Row(say("Frequency response"), "   ", words(span), "heading"), *rows]


def _span(result: FrequencyResponse) -> dict[str, str]:
    return {"start": f"{result.low:g}", "until": f"{result.high:g}"}


def response_table(result: FrequencyResponse, say: Language) -> list[tuple[str, ...]]:
    """Write the head and a row for each peak; the first of a pair names it."""
    of_pair = say("input"), say("output"), say("static gain")
    of_peak = say("at"), say("gain"), say("phase")
    table: list[tuple[str, ...]] = [(*of_pair, *of_peak)]
    for channel in result.channels[:_MOST_CHANNELS]:
        static = say("infinite") if channel.static is None else f"{channel.static:.6g}"
        head = channel.source, channel.output, static
        for cells in _peaks(channel, say):
            table.append((*head, *cells))
            head = "", "", ""
    return table


def _peaks(channel: Channel, say: Language) -> Iterator[tuple[str, str, str]]:
    for peak in channel.peaks[:_MOST_PEAKS]:
        place = f"{peak.frequency:.9g}"
        if peak.gain is None or peak.phase is None:
            yield place, say("infinite"), ""
        else:
            yield place, f"{peak.gain:.6g}", f"{math.degrees(peak.phase):.1f}°"
    if not channel.peaks:
        yield "", "", ""


def response_lines(result: FrequencyResponse, say: Language) -> Iterator[str]:
    """Say which gains the table lists, and how far they are to be trusted."""
    if not result.channels:
        yield say("no output answers to an input")
        return
    yield say("largest gains, each at its frequency; infinite where a pole is undamped")
    if result.settles == "undamped":
        yield say("poles on the imaginary axis: free motions go on beside these")
    if result.settles == "unstable":
        yield say("a pole has a positive real part: motions grow and do not settle to these")
    yield say("rounding is at most {error} of a value", error=f"{result.error:.0e}")
    hidden = len(result.channels) - _MOST_CHANNELS
    if hidden > 0:
        yield say("and {count} more, in --json", count=hidden)


def number_rows(name: str, numbers: Matrix) -> Iterator[Row]:
    """Write a matrix in numbers, its columns below each other."""
    cells = [[f"{x:.6g}" for x in row] for row in (numbers + 0.0).tolist()]
    widths = [max(len(row[k]) for row in cells) for k in range(len(cells[0]))]
    for i, row in enumerate(cells):
        shown = "  ".join(f"{cell:>{width}}" for cell, width in zip(row, widths, strict=True))
        label = f"  {name} = " if i == 0 else " " * (len(name) + 5)
        yield Row(label.rstrip(), " " * (len(label) - len(label.rstrip())) + shown, (), "name")


def complex_text(value: complex) -> str:
    """Write a complex number in six digits."""
    if not value.imag:
        return f"{value.real:.6g}"
    sign = "+" if value.imag > 0 else "-"
    real = f"{value.real:.6g} " if value.real else ""
    return f"{real}{sign} {abs(value.imag):.6g}i" if real else f"{value.imag:.6g}i"
