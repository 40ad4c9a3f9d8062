"""Labels: names, units and the title of a scene, as pictures of its motions show them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

_RATE = re.compile(r"dot\((.+)\)")

_SENSITIVITY = re.compile(r"d\((.+?)\)/d\((.+)\)")


@dataclass(frozen=True)
class Label:
    """A text with mathematics in it.

    Attributes
    ----------
    latex
        In LaTeX, mathematics between dollars.
    plain
        The same in Unicode.
    """

    latex: str
    plain: str


@dataclass(frozen=True)
class Labels:
    """Names of columns in pictures.

    Attributes
    ----------
    title
        The scene's title, or else its name.
    energy
        Symbol of the energy function: ``E``, or ``h`` where it is Jacobi's integral.
    latex
        Name → LaTeX that the scene gives it.
    dimensions, units
        As :class:`lagrange_cli.scene.units.Units` has them; units of parameters too.
    """

    title: str = ""
    energy: str = "E"
    latex: Mapping[str, str] = field(default_factory=dict)
    dimensions: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)

    def symbol(self, column: str) -> Label:
        """Return the symbol of a column, without dollars in ``latex``."""
        from lagrange_cli.notation.symbols import latex_name, text_name

        if column == "energy":
            return Label(self.energy, self.energy)
        rate = _RATE.fullmatch(column)
        name, order = (rate[1], 1) if rate else (column, 0)
        shares = _SENSITIVITY.fullmatch(name)
        if shares is None:
            return Label(latex_name(name, order, self.latex.get(name)), text_name(name, order))
        above = f"dot({shares[1]})" if rate else shares[1]
        top, bottom = self.symbol(above), self.symbol(shares[2])
        partial = rf"\partial {top.latex} / \partial {bottom.latex}"
        return Label(partial, f"∂{top.plain}/∂{bottom.plain}")

    def unit(self, column: str) -> Label | None:
        """Return the unit of a column; None if it has none, or it is not known."""
        from lagrange_cli.notation.symbols import latex_unit

        unit = self.units.get(column)
        return Label(latex_unit(unit), unit) if unit else None


def labels_of(equations: Equations) -> Labels:
    """Gather the labels of a system."""
    from lagrange_cli.notation.symbols import printable

    latex = {c.name: c.latex for c in equations.system.coordinates}
    latex |= {c.name: c.latex for c in equations.system.cartesian_names}
    latex |= {p.name: p.latex for p in equations.system.parameters}
    scene_units = equations.presentation.units
    parameter_units = {p.name: p.unit for p in equations.system.parameters if p.unit is not None}
    is_jacobi = any(c.kind == "jacobi" for c in equations.derivation.conserved)
    return Labels(
        title=printable(equations.presentation.title or equations.presentation.name),
        energy="h" if is_jacobi else "E",
        latex={name: text for name, text in latex.items() if text is not None},
        dimensions=scene_units.dimensions,
        units={n: printable(u) for n, u in {**parameter_units, **scene_units.units}.items()},
    )
