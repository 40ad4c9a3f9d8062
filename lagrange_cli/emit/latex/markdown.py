"""Markdown with LaTeX formulas between dollars, as notebooks and forges of code show it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from lagrange_cli.emit.constraint_wording import (
    certificate_line,
    counting,
    energy_is_sum,
    multipliers_line,
    quantity_labels,
)
from lagrange_cli.emit.latex.steps import LatexLetters, formula_rows
from lagrange_cli.emit.latex.typesetter import FormulaRow, Typesetter
from lagrange_cli.emit.steps.board import certified_line, conclusions, working
from lagrange_cli.emit.steps.sections import Block, Formulas, Law, Section
from lagrange_cli.notation.symbols import latex_name

if TYPE_CHECKING:
    from lagrange_cli.emit.base import OptionValue
    from lagrange_cli.mechanics.equations import Equations


#: Punctuation that is markup anywhere in a line, and at its beginning.
_MARKUP = re.compile(r"([\\`*_{}\[\]<>#$|~&!])")
_OPENING = re.compile(r"^(\d*)([-+=.):])")


class MarkdownLetters(LatexLetters):
    """Letters of LaTeX; text of a scene with all its punctuation escaped."""

    def words(self, text: str) -> str:
        plain = " ".join("".join(c if c.isprintable() else " " for c in text).split())
        return _OPENING.sub(r"\1\\\2", _MARKUP.sub(r"\\\1", plain))


def emit_markdown(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    """Return ``NAME.md``.

    Parameters
    ----------
    equations
        What a derivation yields; its steps are written if it has any.
    options
        ``form``: ``lagrange`` or ``explicit``.

    Raises
    ------
    InternalError
        An expression has no exact form in print.
    """
    page = _Page(equations)
    form = str(options["form"])
    body = page.whole(form) if equations.steps is None else page.with_steps(form)
    blocks = [page.opening(), *body, page.certificate()]
    return {f"{equations.name}.md": "\n\n".join(part for block in blocks for part in block) + "\n"}


class _Page:
    """The parts of the page, each a list of paragraphs."""

    def __init__(self, equations: Equations) -> None:
        self.equations = equations
        self.setter = Typesetter.of(equations, abbreviating=False)
        self.letters = MarkdownLetters()

    def opening(self) -> list[str]:
        equations = self.equations
        paragraphs = [f"# {self.letters.words(equations.title or equations.name)}"]
        if equations.description:
            paragraphs.append(self.letters.words(equations.description))
        counts = ", ".join(counting(equations))
        names = [f"${self.setter.coordinate(c)}$" for c in equations.coordinates]
        paragraphs.append(f"Degrees of freedom: {counts}. Coordinates: {', '.join(names)}.")
        return paragraphs

    def whole(self, form: str) -> list[list[str]]:
        """The derivation in short."""
        setter, closures = self.setter, self.setter.closures()
        line = multipliers_line(self.equations)
        return [
            [*self._rows("Lagrangian", setter.energies()), *filter(None, [setter.without()])],
            self._rows("Equations of motion", setter.motion(form)),
            [*self._rows("Closure equations", closures), *([f"{line}."] if line else [])],
            self._rows("Contacts", setter.contacts()),
            self._rows("Conserved quantities", list(self._conserved())),
        ]

    def _rows(self, heading: str, rows: Sequence[FormulaRow]) -> list[str]:
        return [f"## {heading}", _display(self.setter.aligned(rows))] if rows else []

    def _conserved(self) -> Iterator[FormulaRow]:
        labels = {k: latex_name(v) for k, v in quantity_labels(self.equations).items()}
        for quantity in self.equations.conserved:
            label = labels["h" if quantity.kind == "jacobi" else "E"]
            if quantity.kind == "momentum":
                label = latex_name(quantity.name)
            elif energy_is_sum(self.equations, quantity):
                label += f" = {labels['T']} + {labels['V']}"
            yield self.setter.definition(label, quantity.expression)

    def with_steps(self, form: str) -> list[list[str]]:
        """The derivation line by line."""
        equations, steps = self.equations, self.equations.steps
        assert steps is not None
        explicit = self.setter.motion(form) if form == "explicit" else []
        return [
            *(self._section(s) for s in working(equations, steps, self.letters)),
            self._rows("Accelerations", explicit),
            *(self._section(s) for s in conclusions(equations, steps, self.letters)),
        ]

    def _section(self, section: Section) -> list[str]:
        return [f"## {section.heading}", *self._blocks(section.blocks)]

    def _blocks(self, blocks: Iterable[Block]) -> Iterator[str]:
        for block in blocks:
            if isinstance(block, Formulas):
                yield _display(self.setter.aligned(formula_rows(self.setter, block)))
            else:
                yield _display([block.text]) if isinstance(block, Law) else block.text

    def certificate(self) -> list[str]:
        lines = [f"{certificate_line(self.equations.certificate)}."]
        if self.equations.steps is not None:
            digits = self.equations.certificate.digits
            lines.append(f"{certified_line(self.equations.steps, digits)}.")
        return lines


def _display(lines: Sequence[str]) -> str:
    return "\n".join(["$$", *lines, "$$"])
