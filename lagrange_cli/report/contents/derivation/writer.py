"""The writer of a document's sections, which notes the abbreviations that they use."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.elements.motion import QuaternionParts
from lagrange_cli.mechanics.families.families import Families, families_in
from lagrange_cli.mechanics.families.forms import FamilyRow, Form
from lagrange_cli.mechanics.step_values import rate_symbol, spin_symbol
from lagrange_cli.notation.build import display, display_row, display_sum, display_terms
from lagrange_cli.notation.families import FamilyNotation
from lagrange_cli.notation.ordering import symbol_of
from lagrange_cli.notation.tree import Dependence, DisplayNode, abbreviations_in
from lagrange_cli.notation.vocabulary import Omission, Vocabulary, unabbreviated, vocabulary
from lagrange_cli.report.contents.families import with_families
from lagrange_cli.report.contents.sentences import omission_told, operations_told
from lagrange_cli.report.contents.steps.writer import Writer
from lagrange_cli.report.inlines import Text, ranges, symbol, upright
from lagrange_cli.report.tree import Formula, Paragraph

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations, EulerForm, ShownEquation


def has_quaternion(equations: Equations) -> bool:
    """Say whether a quaternion turns a body: only then Euler's equations are asked for."""
    turnings = (p.turning for p in equations.system.particles if p.turning is not None)
    return any(isinstance(turn, QuaternionParts) for t in turnings for turn in t.turns)


@dataclass(frozen=True)
class DocumentWriter(Writer):
    """Writes labels and rows of a document.

    Attributes
    ----------
    abbreviating
        True if the scene's abbreviations stand for their expressions.
    written_out
        True if every element of indexed families is shown, and expressions of any length.
    read_back
        True if equations are to be read as a scene is, over accelerations.
    by_euler
        True if Euler's equations stand for those of a quaternion, as in other forms they do not.
    abbreviated
        Names of the abbreviations that what was written so far holds.
    """

    abbreviating: bool = True
    written_out: bool = False
    read_back: bool = False
    by_euler: bool = True
    abbreviated: set[str] = field(default_factory=set)

    @cached_property
    def words(self) -> Vocabulary:
        """Display names of all symbols; steps are written without abbreviations."""
        abbreviating = self.abbreviating and self.equations.derivation.steps is None
        usual = vocabulary(self.equations, abbreviating=abbreviating, omission=self.omission)
        if self.euler is None:
            return usual
        atoms = dict(usual.atoms)
        for rank, axis in enumerate("123", len(self.equations.system.coordinates)):
            spin, name = spin_symbol(self.euler.body, axis), self.spin_name(self.euler, axis)
            atoms[spin] = symbol_of(name, Dependence.VELOCITY, rank)
            atoms[rate_symbol(spin.name)] = symbol_of(name, Dependence.ACCELERATION, rank, order=1)
        return replace(usual, atoms=atoms)

    def spin_name(self, form: EulerForm, axis: str) -> str:
        """Return the name of a component of ω, that of a scene where it is to be read as one."""
        if self.read_back:
            return str(spin_symbol(form.body, axis))
        return f"{self.spin_letter}_{axis}"

    @cached_property
    def euler(self) -> EulerForm | None:
        """Euler's equations of a body by a quaternion, None of other systems and in steps."""
        derivation = self.equations.derivation
        if derivation.steps is not None or not self.by_euler:
            return None
        return derivation.euler if has_quaternion(self.equations) else None

    # -- what is left out -----------------------------------------------------------

    @cached_property
    def omission(self) -> Omission | None:
        """Leaves out expressions that are too long to be read; None if all are wanted."""
        return None if self.written_out else Omission(lambda n: upright(operations_told(n)))

    def left_out(self) -> Paragraph | None:
        """Return the note on expressions that were left out; None if there are none."""
        if self.omission is None or not self.omission.counts:
            return None
        return Paragraph(omission_told())

    # -- families -------------------------------------------------------------------

    @cached_property
    def over_letters(self) -> FamilyNotation | None:
        """Writes what families have in common; None if all is written out, as steps are."""
        is_written = self.written_out or self.equations.derivation.steps is not None
        families = None if is_written else families_in(self.equations)
        return None if families is None else FamilyNotation(families, self.words)

    @property
    def families(self) -> Families | None:
        return None if self.over_letters is None else self.over_letters.families

    def with_families(self, part: str, count: int) -> Iterator[int | FamilyRow]:
        """Return numbers of the rows of a part of the document, or the rows of their families."""
        return with_families(() if self.families is None else getattr(self.families, part), count)

    def family_row(self, label: Text, row: FamilyRow) -> Formula:
        """Return a definition or quantity of the elements of a family."""
        assert self.over_letters is not None
        node = self.noted(self.over_letters.whole(row))
        return Formula(label, (node,), ranges=ranges(row.ranges))

    @property
    def energy_forms(self) -> tuple[Form | None, Form | None, Form | None]:
        """T, V and the dissipation function with sums over indices; None of those written out."""
        families = self.families
        if families is None:
            return None, None, None
        return families.kinetic, families.potential, families.dissipation

    def energy(self, label: Text, energy: Expr, form: Form | None) -> Formula:
        """Return an energy, with sums over indices where it has such a form."""
        if form is None or self.over_letters is None:
            return self.row(label, energy)
        return Formula(label, (self.noted(self.over_letters.form(form)),))

    def definitions(
        self, named: Sequence[tuple[str, Text, Expr]], order: int = 0
    ) -> Iterator[Formula]:
        """Names, their labels and what they stand for; those of families as one, with letters.

        ``order``: dots that the labels have.
        """
        family_rows: Sequence[FamilyRow] = ()
        if self.families is not None:
            family_rows = self.families.definitions([(name, e) for name, _, e in named])
        for one in with_families(family_rows, len(named)):
            if isinstance(one, FamilyRow):
                yield self.family_row(symbol(one.name, order), one)
            else:
                yield self.row(*named[one][1:])

    # -- rows -----------------------------------------------------------------------

    def tree(self, expression: Expr) -> DisplayNode:
        """Return an expression as it is displayed."""
        return self.noted(display(expression, self.words))

    def shown_row(self, shown: ShownEquation, words: Vocabulary) -> DisplayNode:
        """Return the left side of an equation of motion."""
        return (display_terms if self.read_back else display_row)(shown, words)

    def noted(self, node: DisplayNode) -> DisplayNode:
        """Return the same tree, whose abbreviations are noted."""
        if self.words.named:
            self.abbreviated.update(abbreviations_in(node))
        return node

    def total(self, label: Text, parts: Sequence[Expr]) -> Formula:
        """``label = Σ parts``, the parts in their order, or with sums over indices."""
        form = None if self.families is None else self.families.quantity(sympy.Add(*parts))
        if form is not None:
            return self.energy(label, sympy.Add(*parts), form)
        return Formula(label, (self.noted(display_sum(parts, self.words)),))

    def abbreviations(self) -> list[Formula]:
        """Return the definitions of the abbreviations in use, and of those that these use."""
        rows: list[Formula] = []
        for name, expression in reversed(self.equations.presentation.abbreviations):
            if name in self.abbreviated:
                node = self.noted(display(expression, unabbreviated(name, self.words)))
                rows.insert(0, Formula(symbol(name), (node,)))
        return rows
