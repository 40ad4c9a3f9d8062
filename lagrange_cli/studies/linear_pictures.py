"""Pictures of linear systems: Bode diagrams, and root loci over a parameter."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.analysis.values import continuous_phase
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.notation.symbols import printable
from lagrange_cli.simulate.model.labels import Label, labels_of
from lagrange_cli.simulate.results.picture import Line, MarkedPlace, Panel, Picture
from lagrange_cli.simulate.results.plot import new_figure, picture_bytes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from lagrange_cli.analysis.branches.values import Branch, Branches
    from lagrange_cli.analysis.values import Channel, FrequencyResponse
    from lagrange_cli.mechanics.equations import Equations


# Bode diagrams.


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
    figure.suptitle(printable(title), fontsize="large", parse_math=False)
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


# Root loci.


#: Branches that have a panel.
_PANELS = 6

_UNNAMED = Label("", "")


def picture_of_loci(equations: Equations, branches: Branches) -> Picture:
    """Draw the poles of each branch; dots stand at its ends and at its marked points.

    Raises
    ------
    InputError
        No branch has poles.
    """
    drawn = [k for k, b in enumerate(branches.branches) if b.locus.poles.size][:_PANELS]
    if not drawn:
        raise InputError(Problem("no branch has poles to draw", rule="no-picture"))
    labels = labels_of(equations)
    symbol = labels.symbol(branches.parameter)
    panels = tuple(
        _panel(branches, k, Label(symbol.latex, symbol.plain), alone=len(branches.branches) == 1)
        for k in drawn
    )
    return Picture(labels.title, panels)


def _panel(branches: Branches, number: int, symbol: Label, *, alone: bool) -> Panel:
    branch = branches.branches[number]
    suffix = "" if alone else f", branch {number + 1}"
    height = float(np.nanmax(np.abs(branch.locus.poles.imag)))
    axis = Line(_UNNAMED, np.zeros(2), np.array([-height, height]), faint=True)
    return Panel(
        (axis, *_lines(branch)),
        Label(r"$\mathrm{Re}\,s$", "Re s"),
        Label(rf"$\mathrm{{Im}}\,s${suffix}", f"Im s{suffix}"),
        over_time=False,
        equal=False,
        places=tuple(_places(branches, branch, symbol)),
    )


def _lines(branch: Branch) -> Iterator[Line]:
    """Yield the curve of each pole, in the parts between points with another number of poles."""
    for column in branch.locus.poles.T:
        known = np.isfinite(column)
        cuts = np.flatnonzero(np.diff(known.astype(int))) + 1
        for part in np.split(np.arange(len(column)), cuts):
            if known[part[0]] and len(part) > 1:
                poles = column[part]
                yield Line(_UNNAMED, poles.real, poles.imag, dash=0, again=True)


def _places(branches: Branches, branch: Branch, symbol: Label) -> Iterator[MarkedPlace]:
    """Yield the upper poles at both ends, and at marked points those nearest to the axis.

    The farthest pole at each end is labelled with the parameter; of two equally far ones it is the
    left one at the start and the right one at the end, so that texts stand apart.
    """
    locus = branch.locus
    for row, side in ((0, -1), (len(locus.values) - 1, 1)):
        value = f"{locus.values[row]:.4g}"
        value_label = Label(f"${symbol.latex} = {value}$", f"{symbol.plain} = {value}")
        upper = _upper(locus.poles[row])
        farthest = [(float(f"{abs(p):.6g}"), side * p.real) for p in upper]
        for pole, far in zip(upper, farthest, strict=True):
            label = value_label if far == max(farthest) else _UNNAMED
            yield MarkedPlace(pole.real, pole.imag, label)
    for _, number in branch.marks:
        mark = branches.marks[number]
        row = int(np.argmin(np.abs(locus.values - mark.value)))
        upper = _upper(locus.poles[row])
        if upper:
            nearest = min(upper, key=lambda pole: abs(pole.real))
            text = f"{number + 1} {mark.kind}"
            yield MarkedPlace(nearest.real, nearest.imag, Label(text, text))


def _upper(poles: np.ndarray[tuple[int], np.dtype[np.complex128]]) -> list[complex]:
    """Return the poles that are not below the real axis."""
    size = float(np.abs(poles).max(initial=0.0))
    return [complex(pole) for pole in poles.tolist() if pole.imag >= -1e-9 * size]
