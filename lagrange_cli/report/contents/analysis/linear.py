"""Sections on the linear system: M, C and K, the state space, modes as columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.notation.build import display
from lagrange_cli.notation.labels import free_letter
from lagrange_cli.notation.ordering import root_of
from lagrange_cli.report.contents.analysis.matrices import Matrices
from lagrange_cli.report.contents.analysis.places import Places
from lagrange_cli.report.contents.analysis.wording import damping_line
from lagrange_cli.report.document_options import MOST_LISTED
from lagrange_cli.report.tree import Block, Formula, Law, Paragraph, Section, formulas, section

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.analysis.result import Analysis
    from lagrange_cli.analysis.values import Linearization, Mode
    from lagrange_cli.notation.tree import DisplayNode
    from lagrange_cli.report.contents.derivation.writer import DocumentWriter

#: Part of a line that a root over a squared frequency fills at most.
_WIDEST_ROOT = 0.6


def linear_sections(analysis: Analysis, places: Places) -> Iterator[tuple[str, Section | None]]:
    """Write the sections on the linear system and its modes, as far as they were found.

    Each has a name before it, by which labels are told apart.
    """
    contents, linear, modes = _LinearContents(places), analysis.linearization, analysis.modes
    if linear is not None:
        yield "linearization", contents.linearization(linear)
        yield "states", contents.state_space(linear)
    if modes is not None:
        yield "modes", contents.modes(modes)


@dataclass(frozen=True)
class _LinearContents:
    places: Places

    @property
    def writer(self) -> DocumentWriter:
        return self.places.writer

    # -- the linear system ------------------------------------------------------------

    def linearization(self, linear: Linearization) -> Section | None:
        writer, say, letters = self.writer, self.writer.say, self.writer.letters
        bold = letters.bold
        zero = bold("0")
        terms = [letters.times(bold(m), bold("x", k)) for m, k in (("M", 2), ("C", 1), ("K", 0))]
        names = ", ".join(letters.inline(letters.symbol(n)) for n in linear.coordinates)
        intro = say(
            "Small displacements {vector} of {names} from",
            vector=letters.inline(bold("x")),
            names=names,
        )
        place = self.places.point(linear.at)
        if self.places.is_short(place):
            where: tuple[Block, ...] = (
                Paragraph(f"{intro} {self.places.inline(place, ())} {say('obey')}"),
            )
        else:
            where = (Paragraph(intro), formulas(place), Paragraph(say("obey")))
        exact, rows = linear.exact, Matrices(self.writer, self.places.columns)
        damping = damping_line(linear, letters.inline(bold("C")), say)
        return section(
            say("Linearization"),
            *where,
            Law(f"{' + '.join(terms)} = {zero}"),
            formulas(
                [
                    *rows.rows("M", linear.mass, None if exact is None else exact.mass),
                    *rows.rows("C", linear.damping, None if exact is None else exact.damping),
                    *rows.rows("K", linear.stiffness, None if exact is None else exact.stiffness),
                ],
                result=True,
            ),
            writer.paragraph(say("{text}.", text=damping) if damping else "", rows.remark()),
        )

    def state_space(self, linear: Linearization) -> Section | None:
        say, letters, space = self.writer.say, self.writer.letters, linear.state_space
        rows, exact = Matrices(self.writer, self.places.columns), linear.exact
        bold = letters.bold
        driven = f" + {letters.times(bold('B'), bold('u'))}" if space.inputs else ""
        law = f"{bold('x', 1)} = {letters.times(bold('A'), bold('x'))}{driven}"
        listed = [self._named("x", space.states)]
        matrices = rows.rows("A", space.a, None if exact is None else exact.a)
        if space.inputs:
            listed.append(self._named("u", space.inputs))
            matrices += rows.rows("B", space.b, None if exact is None else exact.b)
        if self.writer.equations.system.outputs:
            fed = f" + {letters.times(bold('D'), bold('u'))}" if space.inputs else ""
            law += f"{letters.comma}{bold('y')} = {letters.times(bold('C'), bold('x'))}{fed}"
            listed.append(self._named("y", space.outputs))
            matrices += rows.rows("C", space.c, None)
            matrices += rows.rows("D", space.d, None) if space.inputs else []
        return section(
            say("State space"),
            Paragraph(say("Of first order, with the differences from rest of")),
            formulas(listed),
            Paragraph(say("the same is")),
            Law(law),
            formulas(matrices, result=True),
            self.writer.paragraph(rows.remark()),
        )

    def _named(self, letter: str, names: Sequence[str]) -> Formula:
        """``x = (θ, θ̇)``."""
        components = tuple(map(self._state, names))
        return Formula(self.writer.letters.bold(letter), (), components=components)

    def _state(self, name: str) -> str:
        letters = self.writer.letters
        if name.startswith("dot("):
            return letters.symbol(name[4:-1], 1)
        return letters.symbol(name)

    # -- modes ------------------------------------------------------------------------

    def modes(self, modes: Sequence[Mode]) -> Section | None:
        say, letters = self.writer.say, self.writer.letters
        shown = modes[:MOST_LISTED]
        damped = any(mode.pole is not None for mode in modes)
        frequency = free_letter(self.writer.equations, ("omega", "Omega", "nu"))
        pole = free_letter(self.writer.equations, ("s", "lambda", "z"))
        rows: list[Formula] = []
        for k, mode in enumerate(shown, 1):
            if mode.pole is not None:
                label = letters.below(letters.symbol(pole), str(k))
                rows.append(
                    Formula(label, (Matrices(self.writer, self.places.columns).number(mode.pole),))
                )
            else:
                rows += self._frequency(letters.below(letters.symbol(frequency), str(k)), mode)
        hidden = len(modes) - len(shown)
        columns = Matrices(self.writer, self.places.columns)
        amplitudes = np.array([m.shape for m in shown]).T
        # Of one coordinate every shape is 1.
        shapes = (
            columns.rows("Phi", amplitudes, _exact_shapes(shown)) if len(amplitudes) > 1 else []
        )
        kind = say("Poles") if damped else say("Angular frequencies")
        return section(
            say("Modes"),
            Paragraph(say("{text}:", text=kind)),
            formulas(rows, result=True),
            Paragraph(
                say(
                    "Each column of {matrix} is the shape of a mode, its largest amplitude 1:",
                    matrix=letters.inline(letters.bold("Phi")),
                )
            )
            if shapes
            else None,
            formulas(shapes, result=True),
            self.writer.paragraph(
                columns.remark(),
                say("And {count} more, in JSON.", count=hidden) if hidden else "",
            ),
        )

    def _frequency(self, label: str, mode: Mode) -> list[Formula]:
        """ω = √(…) = 2.4; a long closed form is that of ω²."""
        number = Matrices(self.writer, self.places.columns).number(mode.frequency)
        square = mode.exact_square
        if square is None:
            return [Formula(label, (number,))]
        node = self.writer.tree(square)
        if square.is_Rational or square.is_Float:
            return [Formula(label, (number,))]
        if self.writer.letters.room(node) <= _WIDEST_ROOT * self.places.columns:
            return [Formula(label, (self._root(square), number))]
        return [
            Formula(self.writer.letters.square(label), (node,)),
            Formula(label, (number,)),
        ]

    def _root(self, square: Expr) -> DisplayNode:
        return root_of(display(square, self.writer.words))


def _exact_shapes(modes: Sequence[Mode]) -> list[tuple[Expr, ...]] | None:
    """Amplitudes in closed form, a row for each coordinate; None if some are known in numbers."""
    shapes = [mode.exact_shape for mode in modes]
    known = [shape for shape in shapes if shape is not None]
    return list(zip(*known, strict=True)) if len(known) == len(shapes) else None
