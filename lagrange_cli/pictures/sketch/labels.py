"""Labels of a sketch: names as captions in LaTeX and Unicode, and places where least is drawn."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from lagrange_cli.notation.symbols import latex_name, text_name
from lagrange_cli.pictures.sketch.sketch import Caption

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import BodyForce
    from lagrange_cli.pictures.sketch.configurations import Configurations

    Array: TypeAlias = NDArray[np.float64]


def named(name: str, latex: str | None = None) -> Caption:
    """Return the caption of a name; ``latex`` is the scene's own way to write it."""
    return Caption(latex_name(name, override=latex), text_name(name))


def symbol_caption(equations: Equations, symbol: Expr) -> Caption:
    """Return the caption of a parameter."""
    latex = {p.symbol: p.latex for p in equations.system.parameters}
    return named(str(symbol), latex.get(symbol))


def gravity_caption(configurations: Configurations, acceleration: Array) -> Caption | None:
    """Return g, or the parameter that is the size of the acceleration; None if it is another one.

    On a slope in whose plane a scene moves only a part of g acts.
    """
    size = float(np.linalg.norm(acceleration))
    equations = configurations.equations
    for parameter in equations.system.parameters:
        if abs(configurations.values.get(parameter.symbol, 0.0) - size) <= 1e-12 * size:
            caption = named(parameter.name, parameter.latex)
            return Caption(rf"\vec{{{caption.latex}}}", caption.plain)
    masses = {s for p in equations.system.particles for s in p.mass.free_symbols}
    parameters = {s for _, v in configurations.depiction.potentials for s in v.free_symbols}
    is_number = not (parameters & configurations.values.keys()) - masses
    return Caption(r"\vec{g}", "g") if is_number else None


def force_caption(equations: Equations, force: BodyForce) -> Caption:
    """Return the parameter or input that is the size of a force, or else the force's name."""
    symbols = set().union(*(e.free_symbols for e in force.components))
    sizes = [p.symbol for p in equations.system.parameters if p.symbol in symbols]
    sizes += [x.symbol for x in equations.system.external if x.symbol in symbols]
    return symbol_caption(equations, sizes[0]) if len(sizes) == 1 else named(force.name)


def point_caption(configurations: Configurations, name: str) -> Caption:
    """Return the caption of a point, or of the origin."""
    latex = {point.name: point.latex for point in configurations.depiction.points}
    return named(name, latex.get(name))


def particle_captions(equations: Equations) -> list[Caption]:
    """Return for each particle the symbol of its mass, or its name where masses are alike."""
    counts = Counter(p.mass for p in equations.system.particles)
    return [
        symbol_caption(equations, p.mass)
        if p.mass.is_Symbol and counts[p.mass] == 1
        else named(p.name, p.latex)
        for p in equations.system.particles
    ]


#: Size of a letter of a label, and the distance of points that stand for a stroke.
_LETTER_WIDTH, _HALF_HEIGHT, _SPACING = 0.17, 0.19, 0.06
#: Directions that are tried, the preferred ones first.
_DIRECTIONS = [np.array([np.cos(a), np.sin(a)]) for a in np.pi / 8 * np.array(
    [1, 7, 15, 9, 0, 4, 12, 8, 2, 6, 14, 10, 3, 5, 13, 11]
)]  # fmt: skip
_GAPS = (0.14, 0.3, 0.5)


class Placer:
    """Places labels one after the other; each is an obstacle to those after it."""

    def __init__(self) -> None:
        self._obstacles: list[Array] = []
        self._boxes: list[tuple[Array, Array]] = []

    def avoid(self, line: Array) -> None:
        """Keep labels off a polyline, shape (P, 2)."""
        for a, b in pairwise(line):
            count = max(2, int(np.linalg.norm(b - a) / _SPACING) + 1)
            self._obstacles += list(np.linspace(a, b, count))

    def around(self, at: Array, text: str, clearance: float, towards: Array | None = None) -> Array:
        """Return the centre of a label beside a place.

        Parameters
        ----------
        clearance
            Radius around the place that stays free, in centimetres.
        towards
            Direction in which it should stand; None for the preferred ones.
        """
        half = half_size(text)
        candidates = [
            (at + (clearance + gap + _reach(half, d)) * d, gap - 0.25 * _favour(d, towards))
            for gap in _GAPS
            for d in _DIRECTIONS
        ]
        costs = [cost + self._cost(centre, half) for centre, cost in candidates]
        best = candidates[int(np.argmin(np.round(costs, 6)))][0]
        self._boxes.append((best, half))
        return best

    def _cost(self, centre: Array, half: Array) -> float:
        """Strokes and labels that a label would hide, and a little for those close by."""
        cost = 0.0
        if self._obstacles:
            off = np.abs(np.array(self._obstacles) - centre) - half
            cost += 1.0 * int((off.max(axis=1) < 0.02).sum())
            cost += 0.02 * int((off.max(axis=1) < 0.1).sum())
        for taken, size in self._boxes:
            cost += 20.0 * bool((np.abs(taken - centre) < half + size).all())
        return cost


def half_size(text: str) -> Array:
    """Return half the width and height of a label, in centimetres."""
    return np.array([0.5 * _LETTER_WIDTH * max(1, len(text)) + 0.02, _HALF_HEIGHT])


def _reach(half: Array, direction: Array) -> float:
    """Return the distance from the centre of a box to its edge along a direction."""
    parts: Sequence[float] = [
        float(h / abs(d)) for h, d in zip(half, direction, strict=True) if abs(d) > 1e-9
    ]
    return min(parts)


def _favour(direction: Array, towards: Array | None) -> float:
    return 0.0 if towards is None else float(direction @ towards)
