"""Bode diagram: gains and phases of a frequency response over the angular frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.analysis.values import continuous_phase
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.simulate.results.plot import new_figure, picture_bytes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from lagrange_cli.analysis.values import Channel, FrequencyResponse

#: Inches, and pairs that a legend names.
_SIZE, _LONGEST_LEGEND = (6.3, 5.2), 12

#: Part of an undamped frequency within which lines are broken.
_BESIDE = 3e-3

#: Colours that differ in lightness, and dashes.
_COLOURS = ("black", "#0072b2", "#d55e00", "#009e73")
_DASHES = ("-", "--", ":", "-.")


def bode_diagram(response: FrequencyResponse, title: str, ending: str) -> bytes:
    """Draw all pairs of inputs and outputs; return the bytes of a file of this ending.

    Lines end at undamped poles, at which a dotted line stands.

    Raises
    ------
    InputError
        No output answers to an input; matplotlib is not installed, or does not know the ending.
    """
    if not response.channels:
        raise InputError(Problem("no output answers to an input", rule="response"))
    figure = new_figure(_SIZE, ending)
    above, below = figure.subplots(2, 1, sharex=True)
    for number, channel in enumerate(response.channels):
        _draw(above, below, response, channel, number)
    _label(above, below, response)
    figure.suptitle(title, fontsize="large", parse_math=False)
    return picture_bytes(figure, ending)


def _draw(
    above: Axes, below: Axes, response: FrequencyResponse, channel: Channel, number: int
) -> None:
    gains = response.gains[
        :, response.outputs.index(channel.output), response.inputs.index(channel.source)
    ]
    colour = _COLOURS[number % len(_COLOURS)]
    dashes = _DASHES[number // len(_COLOURS) % len(_DASHES)]
    label = f"{channel.source} → {channel.output}"
    undamped = [peak.frequency for peak in channel.peaks if peak.gain is None]
    for pole in undamped:
        gains = np.where(np.abs(response.frequencies - pole) < _BESIDE * pole, np.nan, gains)
    sizes = np.where(np.abs(gains) > 0, np.abs(gains), np.nan)
    above.plot(response.frequencies, sizes, label=label, color=colour, ls=dashes)
    below.plot(response.frequencies, np.degrees(continuous_phase(gains)), color=colour, ls=dashes)
    for pole in undamped:
        for axes in (above, below):
            axes.axvline(pole, color="0.6", ls=":", lw=0.9)


def _label(above: Axes, below: Axes, response: FrequencyResponse) -> None:
    from matplotlib.ticker import MaxNLocator

    above.set_xscale("log")
    above.set_yscale("log")
    above.set_xlim(response.low, response.high)
    above.set_ylabel("gain")
    below.set_ylabel("phase in degrees")
    below.set_xlabel("angular frequency ω")
    below.yaxis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 1.5, 3, 4.5, 9, 10]))
    for axes in (above, below):
        axes.grid(visible=True, which="major", color="0.9", lw=0.6)
    if len(response.channels) <= _LONGEST_LEGEND:
        above.legend(fontsize="small", frameon=False)
