"""Root loci: the poles along branches of equilibria as curves in the complex plane."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.simulate.model.labels import Label, labels_of
from lagrange_cli.simulate.results.picture import Line, MarkedPlace, Panel, Picture

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.values import Branch, Branches
    from lagrange_cli.mechanics.equations import Equations

#: Branches that have a panel.
_PANELS = 6

_UNNAMED = Label("", "")


def picture_of_loci(equations: Equations, found: Branches) -> Picture:
    """Draw the poles of each branch; dots stand at its ends and at its marked points.

    Raises
    ------
    InputError
        No branch has poles.
    """
    drawn = [k for k, b in enumerate(found.branches) if b.locus.poles.size][:_PANELS]
    if not drawn:
        raise InputError(Problem("no branch has poles to draw", rule="no-picture"))
    labels = labels_of(equations)
    symbol = labels.symbol(found.parameter)
    panels = tuple(
        _panel(found, k, Label(symbol.latex, symbol.plain), alone=len(found.branches) == 1)
        for k in drawn
    )
    return Picture(labels.title, panels)


def _panel(found: Branches, number: int, symbol: Label, *, alone: bool) -> Panel:
    branch = found.branches[number]
    of = "" if alone else f", branch {number + 1}"
    height = float(np.nanmax(np.abs(branch.locus.poles.imag)))
    axis = Line(_UNNAMED, np.zeros(2), np.array([-height, height]), faint=True)
    return Panel(
        (axis, *_lines(branch)),
        Label(r"$\mathrm{Re}\,s$", "Re s"),
        Label(rf"$\mathrm{{Im}}\,s${of}", f"Im s{of}"),
        over_time=False,
        equal=False,
        places=tuple(_places(found, branch, symbol)),
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


def _places(found: Branches, branch: Branch, symbol: Label) -> Iterator[MarkedPlace]:
    """Yield the upper poles at both ends, and at marked points those nearest to the axis.

    Of the poles at one end the farthest has the parameter beside it: of two alike at the begin the
    left one, at the end the right one, so that texts stand apart.
    """
    locus = branch.locus
    for row, side in ((0, -1), (len(locus.values) - 1, 1)):
        value = f"{locus.values[row]:.4g}"
        text = Label(f"${symbol.latex} = {value}$", f"{symbol.plain} = {value}")
        upper = _upper(locus.poles[row])
        farthest = [(float(f"{abs(p):.6g}"), side * p.real) for p in upper]
        for pole, far in zip(upper, farthest, strict=True):
            label = text if far == max(farthest) else _UNNAMED
            yield MarkedPlace(pole.real, pole.imag, label)
    for _, number in branch.marks:
        mark = found.marks[number]
        row = int(np.argmin(np.abs(locus.values - mark.value)))
        upper = _upper(locus.poles[row])
        if upper:
            nearest = min(upper, key=lambda pole: abs(pole.real))
            told = f"{number + 1} {mark.kind}"
            yield MarkedPlace(nearest.real, nearest.imag, Label(told, told))


def _upper(poles: np.ndarray[tuple[int], np.dtype[np.complex128]]) -> list[complex]:
    """Return the poles that are not below the real axis."""
    size = float(np.abs(poles).max(initial=0.0))
    return [complex(pole) for pole in poles.tolist() if pole.imag >= -1e-9 * size]
