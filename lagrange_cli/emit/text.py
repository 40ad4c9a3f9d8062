"""The derivation as a person reads it in a terminal, in Unicode or plain ASCII."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

import sympy

from lagrange_cli.emit.base import OptionValue, completed
from lagrange_cli.emit.constraint_wording import (
    certificate_line,
    choice_line,
    conserved_reason,
    contacts_lines,
    counting,
    divisor_and_factor,
    energy_is_sum,
    energy_letter,
    explicit_line,
    implied_line,
    is_generalized_potential,
    multiplier_label,
    multipliers_line,
    only_between_impacts,
    quantity_labels,
    recorded_line,
    telling_definitions,
    undecided,
    without_line,
)
from lagrange_cli.emit.document_options import DEFAULT_SECTIONS, TEXT_OPTIONS, sections_of
from lagrange_cli.emit.family_wording import (
    account_lines,
    coordinates_by_ranges,
    sizes_line,
    text_ranges,
    with_families,
)
from lagrange_cli.emit.force_wording import force_notes, force_rows, forces_line, reaction_rows
from lagrange_cli.emit.forms.contents import FORMS, form_sections
from lagrange_cli.emit.initial_state import multiple_of_pi
from lagrange_cli.emit.language import ENGLISH, Language, language
from lagrange_cli.emit.steps.sections import Law
from lagrange_cli.emit.steps.writer import Writer
from lagrange_cli.emit.steps_text import section_rows, section_writers, text_letters
from lagrange_cli.errors import escape_controls
from lagrange_cli.mechanics.dynamics.accelerations import (
    differentiated,
    explicit_form,
    forcing_with_reactions,
)
from lagrange_cli.mechanics.families.families import Families, families_in
from lagrange_cli.mechanics.families.forms import FamilyRow, Form, Range
from lagrange_cli.notation.build import display, display_row, display_sum
from lagrange_cli.notation.families import FamilyNotation
from lagrange_cli.notation.layout import Piece, added, columns, deeper, joined, suffixed
from lagrange_cli.notation.one_line import OneLinePrinter
from lagrange_cli.notation.page import USUAL_WIDTH, Block, Page, Row, formula, page, words
from lagrange_cli.notation.scene_language import ScenePrinter
from lagrange_cli.notation.tree import DisplayNode, abbreviations_in
from lagrange_cli.notation.unicode import UnicodePrinter
from lagrange_cli.notation.vocabulary import Vocabulary, unabbreviated, vocabulary

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.dynamics.accelerations import ExplicitForm
    from lagrange_cli.mechanics.equations import CartesianName, Equations, Input, ShownEquation
    from lagrange_cli.mechanics.findings import Conserved
    from lagrange_cli.mechanics.step_values import DerivationSteps

_DEFAULT = frozenset(DEFAULT_SECTIONS.split(","))

#: Parts of the text, each with what writes one of its sections.
_Parts: TypeAlias = Iterable[tuple[str, Callable[[], Iterable["Row | Block"]]]]


def derivation_text(
    equations: Equations,
    *,
    ascii: bool = False,
    form: str = "lagrange",
    width: int = USUAL_WIDTH,
    **options: OptionValue,
) -> str:
    """Write the derivation in lines of ``width`` columns where formulas allow; see
    :func:`derivation_page`. ``options`` are those of the registry for text."""
    return derivation_page(equations, ascii=ascii, form=form, options=options).text(width)


def derivation_page(
    equations: Equations,
    *,
    ascii: bool = False,
    form: str = "lagrange",
    options: Mapping[str, OptionValue] | None = None,
) -> Page:
    """Write the derivation: degrees of freedom, energies, equations, what is conserved.

    Parameters
    ----------
    equations
        What a derivation yields.
    ascii
        Seven-bit text with formulas in the scene language; else Unicode.
    form
        ``lagrange`` for Lagrange's equations; ``explicit`` for accelerations and
        multipliers where few are coupled, and M q̈ = f where more are; or one of
        :data:`.forms.contents.FORMS`.
    options
        ``sections`` and ``language`` as the registry declares them for text.

    Raises
    ------
    InternalError
        An expression has no exact form in print.
    """
    steps = equations.steps
    letters = vocabulary(equations, abbreviating=steps is None)
    chosen = completed("text", TEXT_OPTIONS, options or {})
    is_written = steps is not None or chosen["written_out"]
    families = None if is_written else families_in(equations)
    printer = ScenePrinter() if ascii else UnicodePrinter(lowered=families is not None)
    over_letters = None if families is None else FamilyNotation(families, letters)
    forces = equations.constraint_forces is not None
    parts = frozenset(sections_of(chosen, forces=forces))
    say = language(str(chosen["language"]))
    say = say.in_ascii() if ascii else say
    writer = _Writer(equations, letters, printer, over_letters, parts=parts, say=say)
    rows = writer.whole(form) if steps is None else writer.with_steps(form, steps)
    return page(rows, ascii=ascii)


@dataclass(frozen=True)
class _Writer:
    """Writes the sections of the text.

    Attributes
    ----------
    equations
        The equations.
    words
        Display names of their symbols.
    printer
        Prints display trees on one line.
    over_letters
        Writes what families have in common; None if all is written out.
    abbreviated
        Names of the scene's abbreviations that what was written so far holds.
    parts
        Names of the parts that are wanted.
    say
        The language of the words between formulas.
    """

    equations: Equations
    words: Vocabulary
    printer: OneLinePrinter
    over_letters: FamilyNotation | None = None
    abbreviated: set[str] = field(default_factory=set)
    parts: frozenset[str] = _DEFAULT
    say: Language = ENGLISH

    def whole(self, form: str) -> Iterator[Iterable[Row | Block]]:
        """The derivation in short."""
        above: _Parts = (
            ("system", lambda: self.parameters() if self.parts != _DEFAULT else []),
            ("account constraints", self.account),
            ("system energies", self.inputs),
            ("energies", self.energies),
            ("equations", self.forces),
            *self.equations_in(form),
            ("equations constraints", self.closures),
            ("equations constraints", self.contacts),
        )
        below: _Parts = (
            ("result", lambda: self.result(form)),
            ("forces", self.constraint_forces),
            ("conserved", self.conserved),
            ("conserved", self.energy),
            ("initial", self.initial),
            ("equations", self.outputs),
            ("certificate", self.certificate),
        )
        first, last = list(self.chosen(above)), list(self.chosen(below))
        # What is abbreviated is known when all else is written.
        return iter([self.heading(), *first, self.abbreviations(), *last])

    def with_steps(self, form: str, steps: DerivationSteps) -> Iterator[Iterable[Row | Block]]:
        """The derivation line by line."""
        from lagrange_cli.emit.steps.board import conclusions, working
        from lagrange_cli.emit.steps.writer import StepsWriter

        letters = text_letters(ascii=isinstance(self.printer, ScenePrinter))
        board = StepsWriter(self.equations, letters, self.say, steps=steps)
        yield self.heading()
        yield from self.chosen(
            (
                ("system", self.parameters),
                ("account constraints", lambda: self.account(positions=False)),
                ("system energies", self.inputs),
                *section_writers(working(board), self.printer),
                *(self.equations_in(form) if form != "lagrange" else ()),
                ("equations constraints", self.contacts),
                ("result", lambda: self.result(form)),
                ("forces", self.constraint_forces),
                *section_writers(conclusions(board), self.printer),
                ("initial", self.initial),
                ("equations", self.outputs),
                ("certificate", self.certificate),
            )
        )

    def chosen(self, sections: _Parts) -> Iterator[Iterable[Row | Block]]:
        """Write the sections that belong to a part that is wanted."""
        for names, write in sections:
            if not self.parts.isdisjoint(names.split()):
                yield write()

    def certificate(self) -> list[Row]:
        from lagrange_cli.emit.steps.board import certified_line

        seal, steps = self.equations.certificate, self.equations.steps
        lines = [certificate_line(seal, self.say)]
        lines += [] if steps is None else [certified_line(steps, seal.digits, self.say)]
        return [Row("", "", words(line)) for line in lines]

    def initial(self) -> list[Row]:
        """Positions and velocities at the start, those that are not zero."""
        start = self.equations.initial
        if start is None:
            return [Row(self.say("Initial values"), "   ", words(self.say("none")), "heading")]
        rows = [_heading(self.say("Initial values"))]
        for order, values in enumerate((start.positions, start.velocities)):
            for c, value in zip(self.equations.coordinates, values, strict=True):
                name = f"  {self.printer.symbol(c.name, order)}"
                multiple = multiple_of_pi(value) if c.is_angle and order == 0 else None
                if multiple is not None:
                    rows.append(self.formula(name, multiple))
                else:
                    rows.append(Row(name, f" = {repr(value).removesuffix('.0')}", role="name"))
        return rows

    def result(self, form: str) -> list[Row]:
        """Accelerations, unless they are the equations that are written."""
        if form == "explicit" and "equations" in self.parts:
            return []
        return self.accelerations(self.say("Result"))

    def heading(self) -> list[Row]:
        name, title = self.equations.name, self.equations.title
        if not title:
            return [Row(escape_controls(name), role="heading")]
        return [Row(escape_controls(name), ": ", words(escape_controls(title)), "heading")]

    # -- degrees of freedom -------------------------------------------------------

    def parameters(self) -> list[Row]:
        """Parameters with value, unit and meaning, in columns."""
        literals = dict(self.equations.literals)
        rows = []
        for p in self.equations.parameters:
            value = "" if p.value is None else literals.get(Fraction(repr(p.value)), repr(p.value))
            told = f"{value.removesuffix('.0')} {escape_controls(p.unit or '')}".strip()
            rows.append((self.printer.symbol(p.name), f" = {told}" if told else ""))
        leads = _leads([name + told for name, told in rows])
        meanings = [words(escape_controls(p.description or "")) for p in self.equations.parameters]
        lines = [
            Row(f"  {name}", told + lead, meaning, "name")
            for (name, told), lead, meaning in zip(rows, leads, meanings, strict=True)
        ]
        return [_heading(self.say("Parameters")), *lines] if lines else []

    def account(self, *, positions: bool = True) -> list[Row | Block]:
        """Count the degrees of freedom; name constraints and coordinates, with ``positions``."""
        listed = list(self.constraints()) if "constraints" in self.parts else []
        if "account" not in self.parts:
            none = Row("", "  ", words(self.say("none")))
            return [_heading(self.say("Constraints")), *(listed or [none])]
        counts = counting(self.equations, self.say)
        items = [*(f"{count}," for count in counts[:-1]), *counts[-1:]]
        chosen = choice_line(self.equations, self.say)
        formulation = Row(self.say("Formulation"), "   ", words(chosen), "heading")
        return [
            Row(self.say("Degrees of freedom"), "   ", words(items), "heading"),
            *listed,
            self.coordinates(telling_definitions(self.equations) if positions else ()),
            *([formulation] if chosen else []),
            *self.singular(),
        ]

    def singular(self) -> Iterator[Row]:
        """List the places at which the coordinates are singular."""
        for place in self.equations.singular:
            names = ", ".join(self.printer.symbol(name) for name in place.coordinates)
            zero = suffixed(self.pieces(place.where), " = 0", 4)
            lead = f"      {self.say('{names} where', names=names)} "
            yield formula(self.say("Singular"), lead, zero, "heading")

    def constraints(self) -> Iterator[Row]:
        account = self.equations.account
        rows = []
        for name, equations, remark in account_lines(account.lines, self.families, self.say):
            ends = [*("," for _ in equations[1:]), ""]
            pieces: list[Piece] = []
            for (text, ranges), end in zip(equations, ends, strict=True):
                mark = "," if ranges else end
                pieces += _equation_pieces(escape_controls(text) + mark)
                if ranges:
                    span = self.range_piece(ranges)
                    pieces.append(replace(span, lead="  ", text=span.text + end))
            pieces[0] = replace(pieces[0], separator="")
            rows.append((name, (*pieces, *_remark_pieces(escape_controls(remark)))))
        if account.implied:
            rows.append((self.say("(implied)"), words(implied_line(account, self.say))))
        width = max((len(name) for name, _ in rows), default=0)
        for name, shown in rows:
            yield Row(f"  {name}", " " * (width - len(name) + 3), shown, "name")

    def coordinates(self, positions: Sequence[CartesianName]) -> Block:
        items = self.coordinate_items()
        if self.equations.account.chosen_automatically:
            items += ["", "", *self.say("(chosen automatically)").split(" ")]
        head = Row(self.say("Coordinates"), "   ", words(items), "heading")
        listed = [(c.name, c.position) for c in positions]
        formulas = {self.printer.symbol(name): body for name, body in self.listed(listed)}
        for row in () if self.families is None else self.families.beyond:
            assert self.over_letters is not None
            body = self.tree(self.over_letters.whole(row))
            formulas[self.printer.symbol(row.name)] = self.ranged(body, row)
        rows = (formula(f"  {name}", " = ", body, "") for name, body in formulas.items())
        return Block((head, *rows), "packed")

    def coordinate_items(self) -> list[str]:
        """Names of coordinates; those of a family as one, with the range of its indices."""
        families = self.families
        if families is None:
            symbols = ((self.printer.symbol(c.name), c) for c in self.equations.coordinates)
            names = [f"{q} > 0" if c.is_positive else q for q, c in symbols] or ["none"]
            return [f"{name}," for name in names[:-1]] + names[-1:]
        ascii_only = isinstance(self.printer, ScenePrinter)
        items: list[str] = []
        for named, ranges in coordinates_by_ranges(families, self.equations):
            for name, coordinate in named:
                sign = " > 0" if coordinate.is_positive else ""
                items.append(f"{self.printer.symbol(name)}{sign},")
            items += [f"{text_ranges(ranges, ascii=ascii_only)},"] if ranges else []
        items[-1] = items[-1].removesuffix(",")
        told = sizes_line(families)
        return [*items, "", "", f"({told})"] if told else items

    # -- energies, forces, equations ------------------------------------------------

    def energies(self) -> list[Row]:
        labels = quantity_labels(self.equations)
        potential = "U" if is_generalized_potential(self.equations) else "V"
        families = self.families
        forms: tuple[Form | None, ...] = (None, None, None)
        if families is not None:
            forms = families.kinetic, families.potential, families.dissipation
        rows = [
            self.energy_row(labels["T"], self.equations.kinetic, forms[0]),
            self.energy_row(labels[potential], self.equations.potential, forms[1]),
        ]
        short = self.equations.short_lagrangian
        if short is not None:
            pieces = self.pieces(short.expression)
            if any(forms) or sum(p.width for p in pieces) > 2 * USUAL_WIDTH:
                difference = [Piece(f"{labels['T']} - {labels[potential]}", 5)]
                pieces = [*difference, *added(self.pieces(-short.left_out))]
            told = f"({without_line(self.equations, self.printer.symbol('t'), self.say)})"
            rows.append(formula(labels["L"], " = ", pieces, aside=told))
        if self.equations.dissipation != 0:
            rows.append(self.energy_row(labels["D"], self.equations.dissipation, forms[2]))
        return rows

    def energy_row(self, label: str, energy: Expr, form: Form | None) -> Row:
        """An energy, with sums over indices where it has such a form."""
        if form is None or self.over_letters is None:
            return self.formula(label, energy)
        return formula(label, " = ", self.tree(self.over_letters.form(form)))

    def forces(self) -> list[Row | Block]:
        rows = [
            self.formula(
                f"  Q_{self.printer.symbol(c.name)}",
                q,
                self.say("{name} on {place}", name=force.name, place=force.on),
            )
            for force in self.equations.forces
            for c, q in zip(self.equations.coordinates, force.generalized, strict=True)
            if q != 0
        ]
        return _with_asides(self.say("Generalized forces"), rows)

    def equations_in(self, form: str) -> _Parts:
        """The sections of the equations of motion in a form."""
        if form not in FORMS:
            yield "equations", self.accelerations if form == "explicit" else self.motion
        elif "equations" in self.parts:
            is_lowered = isinstance(self.printer, UnicodePrinter) and self.printer.lowered
            is_ascii = isinstance(self.printer, ScenePrinter)
            letters = text_letters(ascii=is_ascii, lowered=is_lowered)
            writer = Writer(self.equations, letters, self.say)
            for whole in form_sections(form, writer, self.words, self.noted):
                # Laws are for documents and boards.
                blocks = tuple(b for b in whole.blocks if not isinstance(b, Law))
                rows = section_rows(replace(whole, blocks=blocks), self.printer, indent=2)
                yield "equations", partial(list[Row], rows)

    def motion(self) -> list[Row]:
        rows = []
        for one in self.with_families("motion", len(self.equations.shown)):
            shown = one.shown if isinstance(one, FamilyRow) else self.equations.shown[one]
            left = suffixed(self.left_side(shown, one), " = 0", 4)
            divisor, factor = divisor_and_factor(shown)
            aside = ""
            if divisor is not None:
                aside = self.say("(divided by {factor})", factor=joined(self.divisor(divisor, one)))
            elif factor is not None:
                aside = self.say(
                    "(multiplied by {factor})", factor=joined(self.divisor(factor, one))
                )
            rows.append((shown.coordinate, self.ranged(left, one), aside))
        names = [self.printer.symbol(name) for name, _, _ in rows]
        leads = _leads(names)
        lines = [
            formula(f"  {name}", lead, pieces, aside=aside)
            for name, lead, (_, pieces, aside) in zip(names, leads, rows, strict=True)
        ]
        return [_heading(self.say("Equations of motion")), *(lines or [self.still()])]

    def still(self) -> Row:
        return Row("", "  ", words(self.say("none: nothing can move")))

    def left_side(self, shown: ShownEquation, one: int | FamilyRow) -> list[Piece]:
        """The terms of an equation, or d/dt of its momentum, which no scene can say."""
        terms, momentum = self.words, shown.momentum
        if isinstance(one, FamilyRow) and self.over_letters is not None:
            terms = self.over_letters.words_of(one)
        if momentum is None or isinstance(self.printer, ScenePrinter):
            return self.tree(display_row(shown, terms))
        rate = display(momentum, terms)
        self.note(rate)
        return self.printer.rate(rate)

    def divisor(self, expression: Expr, one: int | FamilyRow) -> list[Piece]:
        """What an equation was divided by, or multiplied with."""
        if isinstance(one, FamilyRow) and self.over_letters is not None:
            return self.tree(self.over_letters.part(one, expression))
        return self.pieces(expression)

    # -- families -------------------------------------------------------------------

    @property
    def families(self) -> Families | None:
        return None if self.over_letters is None else self.over_letters.families

    def with_families(self, part: str, count: int) -> Iterator[int | FamilyRow]:
        """Numbers of the rows of a part of the page, or the rows of their families."""
        found = () if self.families is None else getattr(self.families, part)
        return with_families(found, count)

    def ranged(self, pieces: list[Piece], one: int | FamilyRow) -> list[Piece]:
        """A formula with the range of its indices behind it."""
        if not isinstance(one, FamilyRow) or not one.ranges:
            return pieces
        return [*suffixed(pieces, ",", 1), self.range_piece(one.ranges)]

    def range_piece(self, ranges: Sequence[Range]) -> Piece:
        told = text_ranges(ranges, ascii=isinstance(self.printer, ScenePrinter))
        return Piece(told, columns(told) + 1, " ", "", 0)

    def listed(self, named: Sequence[tuple[str, Expr]]) -> Iterator[tuple[str, list[Piece]]]:
        """Names with what they stand for, those of families with letters."""
        found = () if self.families is None else self.families.definitions(named)
        for one in with_families(found, len(named)):
            if isinstance(one, FamilyRow) and self.over_letters is not None:
                yield one.name, self.ranged(self.tree(self.over_letters.whole(one)), one)
            elif isinstance(one, int):
                yield named[one][0], self.pieces(named[one][1])

    def accelerations(self, heading: str = "") -> list[Row]:
        explicit = explicit_form(self.equations)
        heading = heading or self.say("Equations of motion")
        if not self.equations.coordinates:
            return [_heading(heading), self.still()]
        told = explicit_line(self.equations, explicit, self.say)
        rows = [Row(heading, ", ", words(told[0].lower() + told[1:]), "heading")]
        solved = zip(self.equations.coordinates, explicit.accelerations, strict=True)
        known = [(c.name, value) for c, value in solved if value is not None]
        rows += [
            formula(f"  {self.printer.symbol(name, 2)}", " = ", right)
            for name, right in self.listed(known)
        ]
        for closure, value in zip(self.equations.closures, explicit.multipliers, strict=True):
            if value is not None:
                rows.append(self.formula(f"  {joined(self.pieces(closure.multiplier))}", value))
        return rows + self.coupled(explicit)

    def coupled(self, explicit: ExplicitForm) -> list[Row]:
        """M and f of the accelerations that are not solved for, and what closures say of them."""
        coordinates, open_rows = self.equations.coordinates, explicit.coupled
        if not open_rows:
            return []
        names = [self.printer.symbol(c.name) for c in coordinates]
        unknowns = ", ".join(self.printer.symbol(coordinates[i].name, 2) for i in open_rows)
        labels = quantity_labels(self.equations)
        mass, forcing = labels["M"], labels["f"]
        rows = [
            Row(
                "",
                f"  {mass} (",
                words(
                    self.say(
                        "{unknowns}) = {forcing} with", unknowns=unknowns, forcing=forcing
                    ).split(" ")
                ),
            )
        ]
        for i in open_rows:
            for j in open_rows:
                entry = self.equations.mass_matrix[i][j]
                if j >= i and entry != 0:
                    rows.append(self.formula(f"  {mass}[{names[i]}, {names[j]}]", entry))
        right = forcing_with_reactions(self.equations)
        rows += [self.formula(f"  {forcing}[{names[i]}]", right[i]) for i in open_rows]
        for closure, value in zip(self.equations.closures, explicit.multipliers, strict=True):
            if value is None:
                row = display_row(differentiated(self.equations, closure), self.words)
                left = suffixed(self.printer.pieces(row), " = 0", 4)
                rows.append(formula(f"  {escape_controls(closure.name)}", "   ", left))
        return rows

    def closures(self) -> list[Row]:
        """The equations beside those of motion, and what their multipliers mean."""
        if not self.equations.closures:
            return []
        closures = self.equations.closures
        shown = []
        for one in self.with_families("closures", len(closures)):
            if isinstance(one, FamilyRow) and self.over_letters is not None:
                name, left = one.name, self.tree(self.over_letters.whole(one))
            elif isinstance(one, int):
                name, left = closures[one].name, self.pieces(closures[one].expression)
            shown.append((escape_controls(name), self.ranged(suffixed(left, " = 0", 4), one)))
        names = [name for name, _ in shown]
        rows = [
            formula(f"  {name}", lead, left)
            for (name, left), lead in zip(shown, _leads(names), strict=True)
        ]
        note = Row("", "  ", words(multipliers_line(self.equations, self.say)))
        return [_heading(self.say("Closure equations")), *rows, note]

    def contacts(self) -> list[Row]:
        """Gaps and restitutions of one-sided constraints, and what their multipliers mean."""
        names = [escape_controls(c.name) for c in self.equations.contacts]
        rows = [_heading(self.say("Contacts"))] if names else []
        for name, lead, contact in zip(names, _leads(names), self.equations.contacts, strict=True):
            open_gap = f" {self.printer.at_least} 0"
            left = suffixed(self.pieces(contact.closure.expression), open_gap, columns(open_gap))
            value = joined(self.pieces(contact.restitution))
            elasticity = self.say("restitution {value}", value=value)
            rows.append(formula(f"  {name}", lead, left, aside=elasticity))
        return rows + [
            Row("", "  ", words(line)) for line in contacts_lines(self.equations, self.say)
        ]

    def constraint_forces(self) -> list[Row]:
        """Forces on the particles, and what each constraint exerts, where asked for."""
        forces = self.equations.constraint_forces
        if forces is None:
            return []
        groups = list(force_rows(forces))
        for name, multiplier, sizes in reaction_rows(self.equations, forces):
            known = [] if multiplier is None else [(self._multiplier(name), multiplier)]
            pushed = [(self.say("force on {place}", place=on), e) for on, e in sizes]
            groups.append((name, known + pushed))
        names = [escape_controls(name) for name, _ in groups]
        lines = [Row(self.say("Constraint forces"), "   ", words(forces_line(self.say)), "heading")]
        for name, lead, (_, rows) in zip(names, _leads(names), groups, strict=True):
            for index, (label, expression) in enumerate(rows):
                begin = (" " * columns(name) if index else name) + lead
                shown = self.pieces(expression)
                opening = f"{escape_controls(label)} = "
                lines.append(
                    formula(f"  {begin.rstrip()}", begin[len(begin.rstrip()) :] + opening, shown)
                )
        lines += [] if groups else [Row("", "  ", words(self.say("none")))]
        return lines + [
            Row("", "  ", words(escape_controls(n))) for n in force_notes(forces, self.say)
        ]

    def _multiplier(self, constraint: str) -> str:
        return self.printer.symbol(multiplier_label(self.equations, constraint))

    def abbreviations(self) -> list[Row]:
        """What the abbreviations on the page stand for, those of these among them."""
        rows: list[Row] = []
        for name, expression in reversed(self.equations.abbreviations):
            if name in self.abbreviated:
                writer = replace(self, words=unabbreviated(name, self.words))
                rows.insert(0, writer.formula(f"  {self.printer.symbol(name)}", expression))
        return [_heading(self.say("Abbreviations")), *rows] if rows else []

    # -- what is conserved ------------------------------------------------------------

    def conserved(self) -> list[Row | Block]:
        if not self.equations.coordinates:
            return []
        conserved = self.equations.conserved
        rows = [
            self.conserved_family(one)
            if isinstance(one, FamilyRow)
            else self.conserved_row(conserved[one])
            for one in self.with_families("momenta", len(conserved))
        ]
        heading, searched = self.say("Conserved"), self.say("among cyclic momenta and energy")
        lines: list[Row | Block] = [Row(heading, " ", words(searched), "heading")]
        if rows:
            lines.append(Block(tuple(rows), "asides"))
        else:
            lines = [Row(heading, "   ", words(self.say("none") + f" {searched}"), "heading")]
        names = [
            "E" if n == "energy" else self.printer.symbol(n) for n in undecided(self.equations)
        ]
        note = words(self.say("not decided: {names}", names=", ".join(names)))
        return [*lines, Row("", "  ", note)] if names else lines

    def energy(self) -> list[Row]:
        """The rate of the energy where that is not conserved."""
        balance = self.equations.balance
        if balance is None:
            return []
        labels = quantity_labels(self.equations)
        label = labels["E" if balance.kind == "energy" else "h"]
        when = self.say(" between impacts") if only_between_impacts(self.equations) else ""
        rows = [Row(self.say("Energy"), when, role="heading")]
        if energy_is_sum(self.equations, balance):
            rows.append(Row(f"  {label}", f" = {labels['T']} + {labels['V']}", role="name"))
        else:
            rows.append(self.total(f"  {label}", balance.parts or (self.equations.energy,)))
        if balance.is_dissipation:
            return [*rows, Row(f"  d{label}/dt", f" = -2 {labels['D']}", role="name")]
        return [*rows, self.total(f"  d{label}/dt", (balance.rate,))]

    def conserved_row(self, quantity: Conserved) -> Row:
        name, equals, total = self.quantity(quantity).partition(" = ")
        if equals:
            reason = escape_controls(self.reason(quantity))
            return Row(f"  {name}", equals + total, role="name", aside=reason)
        parts = quantity.parts or (quantity.expression,)
        return self.total(f"  {name}", parts, self.reason(quantity))

    def conserved_family(self, row: FamilyRow) -> Row:
        """The momenta of a family."""
        assert self.over_letters is not None
        one = self.equations.conserved[row.covers[0]]
        reason = self.reason(one, self.printer.symbol(row.name))
        shown = self.ranged(self.tree(self.over_letters.whole(row)), row)
        label = f"  {self.printer.symbol(f'p_{row.name}')}"
        return formula(label, " = ", shown, aside=escape_controls(reason))

    def quantity(self, quantity: Conserved) -> str:
        labels = quantity_labels(self.equations)
        if quantity.kind == "momentum":
            return self.printer.symbol(quantity.name)
        if energy_is_sum(self.equations, quantity):
            return f"{labels['E']} = {labels['T']} + {labels['V']}"
        return labels[energy_letter(quantity)]

    def reason(self, quantity: Conserved, subject: str = "") -> str:
        """Say why a quantity is conserved; ``subject`` stands for the coordinates of a family."""
        if not subject and quantity.coordinate is not None:
            subject = self.printer.symbol(quantity.coordinate)
        subject = subject or quantity_labels(self.equations)["L"]
        return conserved_reason(self.equations, quantity, subject, "t", self.say)

    def inputs(self) -> list[Row]:
        rows = [self.input_row(source) for source in self.equations.inputs]
        return [_heading(self.say("Inputs")), *rows] if rows else []

    def input_row(self, source: Input) -> Row:
        """Write an input: its expression, or in words where its values are recorded."""
        label = f"  {self.printer.symbol(source.name)}"
        if source.recording is None:
            return self.formula(label, source.expression)
        return Row(
            label, ": ", words(escape_controls(recorded_line(source.recording, self.say))), "name"
        )

    def outputs(self) -> list[Row]:
        rows = [self.formula(f"  {self.printer.symbol(n)}", e) for n, e in self.equations.outputs]
        return [_heading(self.say("Outputs")), *rows] if rows else []

    # -- rows ---------------------------------------------------------------------------

    def pieces(self, expression: Expr) -> list[Piece]:
        return self.tree(display(expression, self.words))

    def tree(self, node: DisplayNode) -> list[Piece]:
        """The pieces of a tree, whose abbreviations are noted."""
        self.note(node)
        return self.printer.pieces(node)

    def noted(self, node: DisplayNode) -> DisplayNode:
        """The same tree, whose abbreviations are noted."""
        self.note(node)
        return node

    def note(self, node: DisplayNode) -> None:
        if self.words.named:
            self.abbreviated.update(abbreviations_in(node))

    def total(self, label: str, parts: Sequence[Expr], aside: str = "") -> Row:
        """``label = Σ parts``, the parts in their order, or with sums over indices."""
        form = None if self.families is None else self.families.quantity(sympy.Add(*parts))
        if form is None or self.over_letters is None:
            shown = self.tree(display_sum(parts, self.words))
        else:
            shown = self.tree(self.over_letters.form(form))
        return formula(label, " = ", shown, aside=escape_controls(aside))

    def formula(self, label: str, expression: Expr, aside: str = "") -> Row:
        """``label = expression``, and what is said of it."""
        shown = self.pieces(expression)
        return formula(label, " = ", shown, aside=escape_controls(aside))


def _heading(text: str) -> Row:
    return Row(text, role="heading")


def _with_asides(heading: str, rows: Sequence[Row]) -> list[Row | Block]:
    return [_heading(heading), Block(tuple(rows), "asides")] if rows else []


def _leads(names: Sequence[str]) -> list[str]:
    """Blanks after names, up to the column after the longest one."""
    width = max(map(columns, names), default=0)
    return [" " * (width - columns(name) + 3) for name in names]


def _equation_pieces(text: str) -> Iterator[Piece]:
    """Break an equation as the scene has it before signs, where it does not fit on a line."""
    depth = 0
    for index, part in enumerate(re.split(r" (?=[-+=<>]=? )", text)):
        lead, level = ("  ", 1 + depth) if index else ("", 0)
        yield Piece(part, columns(part) + 1, " ", lead, level)
        depth += part.count("(") - part.count(")")


def _remark_pieces(remark: str) -> Sequence[Piece]:
    """A remark in parentheses, broken between words where it does not fit on a line."""
    if not remark:
        return ()
    first, *others = words(f"({remark})")
    opening = replace(first, width=first.width + 2, separator="   ", lead="  ")
    return [opening, *(replace(p, lead="   ") for p in deeper(others))]
