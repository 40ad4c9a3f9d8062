"""Names of a scene as captions: LaTeX in math mode, and Unicode."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from lagrange_cli.emit.sketch.sketch import Caption
from lagrange_cli.notation.symbols import latex_name, text_name

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from sympy import Expr

    from lagrange_cli.emit.sketch.configurations import Configurations
    from lagrange_cli.mechanics.equations import Equations

    Array: TypeAlias = NDArray[np.float64]


def named(name: str, latex: str | None = None) -> Caption:
    """Return the caption of a name; ``latex`` is the scene's own way to write it."""
    return Caption(latex_name(name, override=latex), text_name(name))


def symbol_caption(equations: Equations, symbol: Expr) -> Caption:
    """Return the caption of a parameter."""
    latex = {p.symbol: p.latex for p in equations.parameters}
    return named(str(symbol), latex.get(symbol))


def gravity_caption(configurations: Configurations, acceleration: Array) -> Caption | None:
    """Return g, or the parameter that is the size of the acceleration; None if it is another one.

    On a slope in whose plane a scene moves only a part of g acts.
    """
    size = float(np.linalg.norm(acceleration))
    equations = configurations.equations
    for parameter in equations.parameters:
        if abs(configurations.values.get(parameter.symbol, 0.0) - size) <= 1e-12 * size:
            caption = named(parameter.name, parameter.latex)
            return Caption(rf"\vec{{{caption.latex}}}", caption.plain)
    masses = {s for p in equations.particles for s in p.mass.free_symbols}
    parameters = {s for _, v in configurations.depiction.potentials for s in v.free_symbols}
    is_number = not (parameters & configurations.values.keys()) - masses
    return Caption(r"\vec{g}", "g") if is_number else None


def point_caption(configurations: Configurations, name: str) -> Caption:
    """Return the caption of a point, or of the origin."""
    latex = {point.name: point.latex for point in configurations.depiction.points}
    return named(name, latex.get(name))


def particle_captions(equations: Equations) -> list[Caption]:
    """Return for each particle the symbol of its mass, or its name where masses are alike."""
    counts = Counter(p.mass for p in equations.particles)
    return [
        symbol_caption(equations, p.mass)
        if p.mass.is_Symbol and counts[p.mass] == 1
        else named(p.name, p.latex)
        for p in equations.particles
    ]
