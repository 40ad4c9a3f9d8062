"""A system's C: its names, number type and printing in one value, and templates filled in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.emit.c.names import CNames, Real
from lagrange_cli.emit.template_files import filled
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.printing import Dialect

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Functions that ``<math.h>`` lacks; the source file has its own.
_OWN = ("max", "min", "sign")


@dataclass(frozen=True)
class CTarget:
    """Names and number type that the functions of one source file of C share.

    Attributes
    ----------
    names
        Identifiers of the system.
    real
        The floating-point type of all numbers.
    """

    names: CNames
    real: Real

    @classmethod
    def of(cls, equations: Equations, real: Real) -> CTarget:
        """Return the target with the names of a scene."""
        return cls(CNames.of(equations), real)

    @property
    def prefix(self) -> str:
        """Return the beginning of all identifiers of the source file."""
        return self.names.prefix

    @property
    def functions(self) -> dict[str, str]:
        """Return function of a program → its name in C."""
        table = {name: name + self.real.suffix for name in PROGRAM_FUNCTIONS if name not in _OWN}
        table["abs"] = "fabs" + self.real.suffix
        return table | {name: f"{self.prefix}_{name}" for name in _OWN}

    @property
    def dialect(self) -> Dialect:
        """Return the dialect in which expressions are printed."""
        return Dialect(self.real.literal, self.functions, self.names.inputs)

    def arguments(self, result: str) -> str:
        """Return the parameter list that all functions of the interface share."""
        real, names = self.real.name, self.names
        return (
            f"{real} t, const {real} *y, const {real} *u, "
            f"const {names.prefix}_params *p, {names.further}"
            f"{real} *work, {real} *{result}"
        )

    def state_arguments(self) -> str:
        """Return the parameter list of functions that change a state."""
        real, names = self.real.name, self.names
        return (
            f"{real} t, {real} *y, const {real} *u, "
            f"const {names.prefix}_params *p, {names.further}{real} *work"
        )

    def fill(self, template: str, others: Mapping[str, str] | None = None) -> str:
        """Put type, names and constants into a template; ``others``: further tokens, first."""
        real = self.real
        replacements = {
            **(others or {}),
            "@NAME@": self.prefix,
            "@REAL@": real.name,
            "@FABS@": "fabs" + real.suffix,
            "@SQRT@": "sqrt" + real.suffix,
            "@FREXP@": "frexp" + real.suffix,
            "@LDEXP@": "ldexp" + real.suffix,
            "@CEIL@": "ceil" + real.suffix,
            "@ZERO@": real.value(0.0),
            "@ONE@": real.value(1.0),
        }
        return filled(template, replacements)
