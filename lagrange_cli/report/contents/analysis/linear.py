"""Sections on the linear system: M, C and K, the state space, modes as columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.notation.build import display
from lagrange_cli.notation.labels import free_letter
from lagrange_cli.notation.ordering import root_of
from lagrange_cli.report.contents.analysis.equilibria import Places
from lagrange_cli.report.contents.analysis.wording import hidden, inlined, sentence, state
from lagrange_cli.report.document_options import MOST_LISTED
from lagrange_cli.report.inlines import (
    COMMA,
    Inline,
    Label,
    Sentence,
    below,
    bold,
    joined,
    label_node,
    numeral,
    say,
    square,
    symbol,
    times,
)
from lagrange_cli.report.tree import (
    Formula,
    Law,
    Matrices,
    Matrix,
    Paragraph,
    Passage,
    Section,
    formulas,
    section,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from sympy import Expr

    from lagrange_cli.analysis.result import Analysis
    from lagrange_cli.analysis.values import Linearization, Mode, SampledLoop
    from lagrange_cli.report.contents.derivation.writer import DocumentWriter

#: Digits of an angular frequency.
_FREQUENCY_DIGITS = 9


#: Letters of a step from sample to sample.
_SUM = {
    "u": Inline(bold("u")),
    "x": Inline(bold("x")),
    "sum": Inline(times(bold("A"), bold("x")) + " + " + times(bold("B"), bold("u"))),
}


def linear_sections(
    analysis: Analysis, writer: DocumentWriter
) -> Iterator[tuple[str, Section | None]]:
    """Write the sections on the linear system and its modes, as far as they were found.

    Each has a name before it, by which labels are told apart.
    """
    contents = _LinearContents(analysis, writer)
    if analysis.linearization is not None:
        yield "linearization", contents.linearization(analysis.linearization)
        yield "states", contents.state_space(analysis.linearization)
    if analysis.sampled is not None:
        yield "sampled", contents.sampled(analysis.sampled)
    if analysis.modes is not None:
        yield "modes", contents.modes(analysis.modes)


@dataclass(frozen=True)
class _LinearContents:
    analysis: Analysis
    writer: DocumentWriter

    def matrix(
        self,
        letter: str,
        numbers: NDArray[np.float64] | NDArray[np.complex128],
        exact: Sequence[Sequence[Expr]] | None,
    ) -> Matrix:
        """Return a matrix in closed form, where it is known, and in numbers.

        Parameters
        ----------
        letter
            Its letter, which is written in bold.
        numbers
            The matrix in doubles.
        exact
            The same in closed form, or None.
        """
        if not numbers.size or not numbers.any():
            return Matrix(letter, ())
        values = tuple(tuple(label_node(numeral(x)) for x in row) for row in numbers.tolist())
        if exact is None or all(e.is_Rational for row in exact for e in row):
            return Matrix(letter, values)
        return Matrix(letter, values, tuple(tuple(map(self.writer.tree, row)) for row in exact))

    # -- the linear system ------------------------------------------------------------

    def linearization(self, linear: Linearization) -> Section | None:
        exact = linear.exact
        terms = [times(bold(m), bold("q", k)) for m, k in (("M", 2), ("C", 1), ("K", 0))]
        names = inlined(map(symbol, linear.coordinates))
        vector = Inline(bold("q"))
        place = Places(self.analysis, self.writer).point(linear.at)
        damping = _damping(linear)
        return section(
            say("Linearization"),
            Passage(
                say("Small displacements {vector} of {names} from", vector=vector, names=names),
                place,
                say("obey"),
            ),
            Law(joined(" + ", terms) + " = " + bold("0")),
            Matrices(
                (
                    self.matrix("M", linear.mass, None if exact is None else exact.mass),
                    self.matrix("C", linear.damping, None if exact is None else exact.damping),
                    self.matrix("K", linear.stiffness, None if exact is None else exact.stiffness),
                )
            ),
            None if damping is None else sentence(damping),
            Paragraph(_held(linear)) if linear.states else None,
        )

    def state_space(self, linear: Linearization) -> Section | None:
        space, exact = linear.state_space, linear.exact
        has_inputs, has_outputs = bool(space.inputs), bool(self.writer.equations.system.outputs)
        law = bold("x", 1) + " = " + _driven("A", "B", has_inputs)
        listed = [_named("x", space.states)]
        matrices = [self.matrix("A", space.a, None if exact is None else exact.a)]
        if has_inputs:
            listed.append(_named("u", space.inputs))
            matrices.append(self.matrix("B", space.b, None if exact is None else exact.b))
        if has_outputs:
            law = law + COMMA + bold("y") + " = " + _driven("C", "D", has_inputs)
            listed.append(_named("y", space.outputs))
            matrices.append(self.matrix("C", space.c, None))
        if has_outputs and has_inputs:
            matrices.append(self.matrix("D", space.d, None))
        return section(
            say("State space"),
            Passage(
                say("With the differences from rest"),
                tuple(listed),
                say("the same is of first order:"),
            ),
            Law(law),
            Matrices(tuple(matrices)),
        )

    def sampled(self, loop: SampledLoop) -> Section | None:
        """Return the matrices from sample to sample, and the poles of the loop."""
        time = Inline(numeral(loop.period))
        matrices = None
        if loop.a is not None and loop.b is not None:
            matrices = Matrices((self.matrix("A", loop.a, None), self.matrix("B", loop.b, None)))
        letter = symbol(free_letter(self.writer.equations, ("z", "zeta", "lambda")))
        shown = loop.poles[:MOST_LISTED]
        rows = [
            Formula(below(letter, str(k)), (label_node(numeral(pole)),))
            for k, pole in enumerate(shown, 1)
        ]
        law = say("With {u} held, {x} becomes {sum} within {time}, where", time=time, **_SUM)
        return section(
            say("Sampled loop"),
            None if matrices is None else Paragraph(law),
            matrices,
            Paragraph(say("Poles of the loop from period to period, {time} each:", time=time)),
            formulas(rows, result=True),
            hidden(len(loop.poles) - len(shown)),
        )

    # -- modes ------------------------------------------------------------------------

    def modes(self, modes: Sequence[Mode]) -> Section | None:
        shown = modes[:MOST_LISTED]
        is_damped = any(mode.pole is not None for mode in modes)
        letters = [
            symbol(free_letter(self.writer.equations, names))
            for names in (("omega", "Omega", "nu"), ("s", "lambda", "z"))
        ]
        rows = []
        for k, mode in enumerate(shown, 1):
            frequency, pole = (below(letter, str(k)) for letter in letters)
            if mode.pole is None:
                rows.append(self._frequency(frequency, mode))
            else:
                rows.append(Formula(pole, (label_node(numeral(mode.pole)),)))
        # Of one coordinate every shape is 1.
        amplitudes = np.array([m.shape for m in shown]).T
        has_shapes = len(amplitudes) > 1
        shapes = self.matrix("Phi", amplitudes, _exact_shapes(shown)) if has_shapes else None
        columns = "Each column of {matrix} is the shape of a mode, its largest amplitude 1:"
        kind = say("Poles") if is_damped else say("Angular frequencies")
        return section(
            say("Modes"),
            Paragraph(say("{text}:", text=kind)),
            formulas(rows, result=True),
            None if shapes is None else Paragraph(say(columns, matrix=Inline(bold("Phi")))),
            None if shapes is None else Matrices((shapes,)),
            hidden(len(modes) - len(shown)),
        )

    def _frequency(self, label: Label, mode: Mode) -> Formula:
        """ω = √(…) = 2.4; a long closed form is that of ω²."""
        number = label_node(numeral(mode.frequency, _FREQUENCY_DIGITS))
        exact = mode.exact_square
        if exact is None or exact.is_Rational or exact.is_Float:
            return Formula(label, (number,))
        root = root_of(display(exact, self.writer.words))
        apart = Formula(square(label), (self.writer.tree(exact),)), Formula(label, (number,))
        return Formula(label, (root, number), otherwise=apart)


def _driven(matrix: str, by: str, has_inputs: bool) -> Label:
    """``A x + B u``, or ``A x`` without inputs."""
    free = times(bold(matrix), bold("x"))
    return free + " + " + times(bold(by), bold("u")) if has_inputs else free


def _named(letter: str, names: Sequence[str]) -> Formula:
    """``x = (θ, θ̇)``."""
    return Formula(bold(letter), (), components=tuple(map(state, names)))


def _damping(linear: Linearization) -> Sentence | None:
    """Say whether C is damping, gyroscopic or both; None if it is zero."""
    damps, turns = bool(linear.dissipative.any()), bool(linear.gyroscopic.any())
    matrix = Inline(bold("C"))
    if damps and turns:
        return say(
            "{matrix} has a symmetric part, damping, and an antisymmetric one, gyroscopic",
            matrix=matrix,
        )
    if damps:
        return say("{matrix} is symmetric: damping", matrix=matrix)
    return say("{matrix} is antisymmetric: gyroscopic", matrix=matrix) if turns else None


def _held(linear: Linearization) -> Sentence:
    """Say of what the matrices of second order are where there are states of first order."""
    names = inlined(map(symbol, linear.states))
    one = "Here the state {names} is held at rest; in the state space it moves."
    many = "Here the states {names} are held at rest; in the state space they move."
    return say.counted(len(linear.states), one, many, names=names)


def _exact_shapes(modes: Sequence[Mode]) -> list[tuple[Expr, ...]] | None:
    """Amplitudes in closed form, a row for each coordinate; None if some are known in numbers."""
    shapes = [mode.exact_shape for mode in modes]
    known = [shape for shape in shapes if shape is not None]
    return list(zip(*known, strict=True)) if len(known) == len(shapes) else None
