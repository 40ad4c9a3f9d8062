"""Pictures of normal modes: the system at rest in grey, displaced in black; still or moving.

A mode moves as q* + a Re(Y e^{iφ}), with its shape Y over all coordinates. The amplitude a is for
the eye: the fastest particle goes a part of the extent of the system, and no angle far.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.analysis.analyze import analyze
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.notation.symbols import printable
from lagrange_cli.pictures.drawing import picture_of
from lagrange_cli.pictures.moving import (
    DARK,
    IN_A_ROW,
    OTHER_WIDTH,
    WIDTHS,
    MovingPanel,
    MovingPictures,
)
from lagrange_cli.pictures.picture import (
    NO_LABEL,
    Axis,
    Line,
    Look,
    Panel,
    Picture,
    equation,
    frequency_unit,
)
from lagrange_cli.pictures.sketch.displaced import BODY, RestingSketch
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label, Labels, labels_of

if TYPE_CHECKING:
    from lagrange_cli.analysis.values import Mode
    from lagrange_cli.mechanics.equations import Equations

#: Modes that are drawn.
_MOST_MODES = 12

#: Part of the extent that the fastest particle goes, and of the shortest link, and radians that an
#: angle turns, at most.
_REACH, _APART, _TURN = 0.2, 0.3, 0.5

#: Pictures of a period, and its seconds.
_FRAMES, _SECONDS = 24, 2.0

#: Points across a panel.
_POINTS = 150


def mode_pictures(
    equations: Equations, at: Mapping[str, str] | None = None, *, moving: bool
) -> MovingPictures:
    """Draw the modes at an equilibrium.

    Parameters
    ----------
    at
        As for :func:`.analyze.analyze`.
    moving
        True for the pictures of a period, else the largest displacement.

    Raises
    ------
    InputError
        There are no modes, or no picture of the system.
    """
    analysis = analyze(equations, ("linearization", "modes"), at)
    assert analysis.linearization is not None
    linear, modes = analysis.linearization, analysis.modes or ()
    if not modes:
        raise InputError(Problem("there are no modes to draw", rule="plot"))
    phases = 2 * np.pi * np.arange(_FRAMES if moving else 1) / _FRAMES
    assert linear.at.position is not None
    # States of first order stand behind the coordinates, and are not drawn.
    moving_ones = linear.at.position[: len(equations.system.coordinates)]
    q0 = np.array([float(x) for x in moving_ones])
    sketch, labels = RestingSketch(equations, q0), labels_of(equations)
    panels = tuple(
        _panel(
            equations,
            sketch,
            q0,
            linear.directions @ np.array(mode.shape),
            _titled(mode, labels),
            phases,
        )
        for mode in modes[:_MOST_MODES]
    )
    hidden = len(modes) - len(panels)
    remark = f"{hidden} further modes are not drawn" if hidden else ""
    title = printable(equations.presentation.title or equations.presentation.name)
    return MovingPictures(title, panels, _SECONDS, remark)


def _panel(
    equations: Equations,
    sketch: RestingSketch,
    q0: Array,
    shape: Array,
    title: Label,
    phases: Array,
) -> MovingPanel:
    shape = shape * _amplitude(equations, sketch, shape)
    moved = [q0 + np.real(shape * np.exp(1j * phase)) for phase in phases]
    return MovingPanel(title, sketch.displaced(moved))


def _amplitude(equations: Equations, sketch: RestingSketch, shape: Array) -> float:
    """Choose the factor of a shape that is seen well."""
    speeds = [sketch.speed(part) for part in (shape.real, shape.imag)]
    turning = [
        abs(x) for c, x in zip(equations.system.coordinates, shape, strict=True) if c.is_angle
    ]
    reach = min(_REACH, _APART * sketch.shortest_link)
    limits = [reach / max(speeds)] if max(speeds) > 1e-9 else []
    limits += [_TURN / max(turning)] if max(turning, default=0.0) > 0 else []
    return min(limits, default=0.0)


def _titled(mode: Mode, labels: Labels) -> Label:
    """Write ``ω = 3.132 rad/s``, or the pole ``s = −0.1 ± 3.1 i``."""
    pole = mode.pole
    if pole is None:
        unit = frequency_unit(labels)
        return equation(Label(r"\omega", "ω"), mode.frequency, unit, 4)
    parts = [f"{pole.real:.4g}".replace("-", "−")] if pole.real else []
    parts += [f"± {pole.imag:.4g} i"] if pole.imag else []
    plain = f"s = {' '.join(parts) or '0'}"
    latex = plain.replace("−", "-").replace("±", r"\pm").replace(" i", r"\,\mathrm{i}")
    return Label(f"${latex}$", plain)


# -- as pictures --------------------------------------------------------------------------


@picture_of.register
def picture_of_modes(pictures: MovingPictures, asked: str | None = None) -> Picture:
    """Draw a panel for each mode."""
    (left, low), (right, high) = (corner.tolist() for corner in pictures.box())
    empty = Panel((), Axis(NO_LABEL), Axis(NO_LABEL), box=(left, right, low, high))
    dot = 2 * BODY * _POINTS * min(1 / (right - left), empty.ratio / (high - low))
    panels = tuple(
        replace(empty, lines=tuple(_lines(panel, dot)), title=panel.title)
        for panel in pictures.panels
    )
    return Picture(pictures.title, panels, most_columns=IN_A_ROW)


def _lines(panel: MovingPanel, dot: float) -> Iterator[Line]:
    """Yield supports, the system at rest and displaced; ``dot``: points across a body."""
    for configuration, colour in (*panel.backdrop(), (panel.shown(0), DARK)):
        for kind, line in configuration.strokes:
            look = Look(
                colour, WIDTHS.get(kind, OTHER_WIDTH), int(kind == "radius"), is_named=False
            )
            yield Line(NO_LABEL, line[:, 0], line[:, 1], look=look)
        x, y = configuration.bodies.T
        yield Line(NO_LABEL, x, y, look=Look(colour, 0.0, 0, 0, dot, is_named=False))
