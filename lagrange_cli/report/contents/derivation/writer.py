"""The writer of a document's sections, which notes the abbreviations that they use."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.errors import InputError, Mark, Problem
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


def printed_euler(equations: Equations) -> EulerForm | None:
    """Return Euler's equations where they print in place of those of a quaternion."""
    derivation = equations.derivation
    has_lagranges = derivation.steps is not None or not has_quaternion(equations)
    return None if has_lagranges else derivation.euler


def required_euler(equations: Equations) -> EulerForm:
    """Return Euler's equations.

    Raises
    ------
    InputError
        The system is not one body that turns freely.
    """
    form = equations.derivation.euler
    if form is not None:
        return form
    raise InputError(
        Problem(
            f"'{equations.presentation.name}' is not one rigid body that a quaternion or three"
            " angles turn, about its centre of mass or about its origin at rest",
            Mark(equations.presentation.file, 1, 1),
            hint="--form lagrange writes the equations of every system",
            rule="no-euler",
        )
    )


def with_spins(
    words: Vocabulary, form: EulerForm, names: Sequence[tuple[str, str | None]]
) -> Vocabulary:
    """Return the vocabulary with components of ω, each with its name and LaTeX."""
    atoms, sums = dict(words.atoms), dict(words.sums)
    sums |= _cyclic_differences(form.gyroscopic)
    for rank, (axis, (name, latex)) in enumerate(zip("123", names, strict=True), len(atoms)):
        spin = spin_symbol(form.body, axis)
        rate = rate_symbol(spin.name)
        atoms[spin] = symbol_of(name, Dependence.VELOCITY, rank, latex=latex)
        atoms[rate] = symbol_of(name, Dependence.ACCELERATION, rank, order=1, latex=latex)
    return replace(words, atoms=atoms, sums=sums)


def _cyclic_differences(
    torques: Sequence[Expr],
) -> Iterator[tuple[Expr, tuple[tuple[Expr, ...], bool]]]:
    """Yield differences of moments in −ω × I ω with their terms in cyclic order, as I3 - I1."""
    for term in (term for torque in torques for term in sympy.Add.make_args(torque)):
        for factor in sympy.Mul.make_args(term):
            if factor.is_Add and len(factor.args) == 2:
                falling = sorted(factor.args, key=lambda e: bool(e.could_extract_minus_sign()))
                yield factor, (tuple(falling), False)


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
    form
        The form of the equations: ``lagrange``, in which Euler's stand for those of a quaternion,
        ``euler``, or another one.
    abbreviated
        Names of the abbreviations that what was written so far holds.
    """

    abbreviating: bool = True
    written_out: bool = False
    read_back: bool = False
    form: str = "lagrange"
    abbreviated: set[str] = field(default_factory=set)

    @cached_property
    def words(self) -> Vocabulary:
        """Display names of all symbols; steps are written without abbreviations."""
        abbreviating = self.abbreviating and self.equations.derivation.steps is None
        usual = vocabulary(self.equations, abbreviating=abbreviating, omission=self.omission)
        if self.euler is None:
            return usual
        names = [(self.spin_name(self.euler, axis), None) for axis in "123"]
        return with_spins(usual, self.euler, names)

    def spin_name(self, form: EulerForm, axis: str) -> str:
        """Return the name of a component of ω, that of a scene where it is to be read as one."""
        if self.read_back:
            return str(spin_symbol(form.body, axis))
        return f"{self.spin_letter}_{axis}"

    @cached_property
    def euler(self) -> EulerForm | None:
        """Euler's equations where they print; in steps they are asked for.

        Raises
        ------
        InputError
            They are asked for, and there are none.
        """
        if self.form == "euler":
            return required_euler(self.equations)
        return printed_euler(self.equations) if self.form == "lagrange" else None

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
