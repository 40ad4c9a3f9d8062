"""Frequency responses: Bode diagrams of all pairs of inputs and outputs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lagrange_cli.analysis.values import Channel, FrequencyResponse, continuous_phase
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.pictures.drawing import picture_of
from lagrange_cli.pictures.picture import (
    DEGREES,
    NO_LABEL,
    Axis,
    Line,
    Panel,
    Picture,
    frequency_unit,
)
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label, Labels

#: Part of an undamped frequency within which lines are broken.
_BESIDE = 3e-3


@dataclass(frozen=True)
class BodeDiagram:
    """A response with the names and units of its system."""

    response: FrequencyResponse
    labels: Labels


@picture_of.register
def picture_of_response(diagram: BodeDiagram, asked: str | None = None) -> Picture:
    """Draw gains over phases. Lines end at undamped poles, at which a dotted line stands."""
    response, labels = diagram.response, diagram.labels
    if not response.channels:
        raise InputError(Problem("no output answers to an input", rule="response"))
    name = Label(r"angular frequency $\omega$", "angular frequency ω")
    frequency = Axis(name, frequency_unit(labels), is_log=True)
    gains = [(channel, _gains(response, channel)) for channel in response.channels]
    sizes = [(c, np.where(np.abs(g) > 0, np.abs(g), np.nan)) for c, g in gains]
    phases = [(c, np.degrees(continuous_phase(g))) for c, g in gains]
    panels = (
        Panel(
            tuple(_lines(diagram, sizes)),
            frequency,
            Axis(Label("gain", "gain"), is_log=True),
            is_tight=True,
            height=1.3,
        ),
        Panel(
            tuple(_lines(diagram, phases)),
            frequency,
            Axis(Label("phase", "phase"), DEGREES),
            is_tight=True,
            has_legend=False,
            height=1.3,
        ),
    )
    return Picture(labels.title, panels, is_stacked=True)


def _gains(
    response: FrequencyResponse, channel: Channel
) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
    """Return the gains of a channel, NaN beside undamped poles."""
    place = response.outputs.index(channel.output), response.inputs.index(channel.source)
    gains = response.gains[:, *place].copy()
    for pole in _undamped(channel):
        gains[np.abs(response.frequencies - pole) < _BESIDE * pole] = np.nan
    return gains


def _undamped(channel: Channel) -> list[float]:
    return [peak.frequency for peak in channel.peaks if peak.gain is None]


def _lines(diagram: BodeDiagram, values: list[tuple[Channel, Array]]) -> Iterator[Line]:
    """Yield the lines of all channels, each in the parts between undamped poles."""
    frequencies = diagram.response.frequencies
    everything = np.concatenate([v[np.isfinite(v)] for _, v in values])
    ends = np.array([everything.min(), everything.max()])
    for pole in sorted({pole for channel, _ in values for pole in _undamped(channel)}):
        yield Line(NO_LABEL, np.repeat(pole, 2), ends, "rule", is_again=True)
    for number, (channel, column) in enumerate(values):
        known = np.isfinite(column)
        cuts = np.flatnonzero(np.diff(known.astype(int))) + 1
        parts = [part for part in np.split(np.arange(len(column)), cuts) if known[part[0]]]
        for k, part in enumerate(parts):
            label = _label(diagram.labels, channel)
            yield Line(label, frequencies[part], column[part], colour=number, is_again=k > 0)


def _label(labels: Labels, channel: Channel) -> Label:
    source, output = labels.symbol(channel.source), labels.symbol(channel.output)
    return Label(
        rf"${source.latex} \rightarrow {output.latex}$", f"{source.plain} → {output.plain}"
    )
