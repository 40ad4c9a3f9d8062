"""The derivation as a person reads it in a terminal, in Unicode or plain ASCII."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from lagrange_cli.emit.constraint_wording import (
    SEARCHED,
    between_impacts,
    certificate_line,
    choice_line,
    contacts_lines,
    counting,
    energy_is_sum,
    explicit_line,
    implied_line,
    is_generalized_potential,
    multiplier_label,
    multipliers_line,
    quantity_labels,
    remark_on,
    telling_definitions,
    undecided,
    was_divided,
)
from lagrange_cli.emit.force_wording import FORCES_LINE, force_notes, force_rows, reaction_rows
from lagrange_cli.emit.text_lines import TEXT_WIDTH, hung, listed, padded
from lagrange_cli.errors import escape_controls
from lagrange_cli.mechanics.dynamics.accelerations import (
    differentiated,
    explicit_form,
    forcing_with_reactions,
)
from lagrange_cli.notation.build import Vocabulary, display, display_row, vocabulary
from lagrange_cli.notation.layout import Piece, joined, suffixed
from lagrange_cli.notation.one_line import OneLinePrinter, columns
from lagrange_cli.notation.scene_language import ScenePrinter
from lagrange_cli.notation.unicode import UnicodePrinter

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.dynamics.accelerations import ExplicitForm
    from lagrange_cli.mechanics.equations import CartesianName, Equations, Input
    from lagrange_cli.mechanics.findings import Conserved
    from lagrange_cli.mechanics.step_values import DerivationSteps

_STILL = "  none: nothing can move"


def derivation_text(equations: Equations, *, ascii: bool = False, form: str = "lagrange") -> str:
    """Write the derivation: degrees of freedom, energies, equations, what is conserved.

    Parameters
    ----------
    equations
        What a derivation yields.
    ascii
        Seven-bit text with formulas in the scene language; else Unicode.
    form
        ``lagrange`` for Lagrange's equations; ``explicit`` for accelerations and
        multipliers where few are coupled, and M q̈ = f where more are.

    Returns
    -------
    str
        Lines of at most 100 columns where formulas allow, with a final newline.

    Raises
    ------
    InternalError
        An expression has no exact form in print.
    """
    page = _Page(equations, vocabulary(equations), ScenePrinter() if ascii else UnicodePrinter())
    blocks = page.whole(form) if equations.steps is None else page.with_steps(form, equations.steps)
    text = "\n\n".join("\n".join(block) for block in blocks if block) + "\n"
    return text.encode("ascii", "backslashreplace").decode("ascii") if ascii else text


@dataclass(frozen=True)
class _Page:
    """Writes the parts of the text, each a list of lines.

    Attributes
    ----------
    equations
        The equations.
    words
        Display names of their symbols.
    printer
        Prints display trees on one line.
    """

    equations: Equations
    words: Vocabulary
    printer: OneLinePrinter

    def whole(self, form: str) -> list[list[str]]:
        """The derivation in short."""
        return [
            self.heading(),
            self.account(),
            self.inputs(),
            self.energies(),
            self.forces(),
            self.accelerations() if form == "explicit" else self.motion(),
            self.closures(),
            self.contacts(),
            self.constraint_forces(),
            self.conserved(),
            self.energy(),
            self.outputs(),
            [certificate_line(self.equations.certificate)],
        ]

    def with_steps(self, form: str, steps: DerivationSteps) -> list[list[str]]:
        """The derivation line by line."""
        from lagrange_cli.emit.steps.board import certified_line, conclusions, working
        from lagrange_cli.emit.steps_text import section_blocks, text_letters

        letters = text_letters(ascii=isinstance(self.printer, ScenePrinter))
        digits = self.equations.certificate.digits
        return [
            self.heading(),
            self.parameters(),
            self.account(positions=False),
            self.inputs(),
            *section_blocks(working(self.equations, steps, letters), self.printer),
            self.accelerations() if form == "explicit" else [],
            self.contacts(),
            self.constraint_forces(),
            *section_blocks(conclusions(self.equations, steps, letters), self.printer),
            self.outputs(),
            [certificate_line(self.equations.certificate), certified_line(steps, digits)],
        ]

    def heading(self) -> list[str]:
        title = self.equations.title
        return [escape_controls(self.equations.name + (f": {title}" if title else ""))]

    # -- degrees of freedom -------------------------------------------------------

    def parameters(self) -> list[str]:
        """Parameters with value, unit and meaning, in columns."""
        literals = dict(self.equations.literals)
        rows = []
        for p in self.equations.parameters:
            value = "" if p.value is None else literals.get(Fraction(repr(p.value)), repr(p.value))
            told = f"{value.removesuffix('.0')} {escape_controls(p.unit or '')}".strip()
            shown = f"  {self.printer.symbol(p.name)}{' = ' if told else ''}{told}"
            rows.append((shown, escape_controls(p.description or "")))
        width = max((columns(shown) for shown, _ in rows), default=0)
        lines = [f"{padded(shown, width)}   {meaning}".rstrip() for shown, meaning in rows]
        return ["Parameters", *lines] if lines else []

    def account(self, *, positions: bool = True) -> list[str]:
        """Count the degrees of freedom; name constraints and coordinates, with ``positions``."""
        counts = ", ".join(counting(self.equations))
        lines = [*listed("Degrees of freedom   ", counts.split()), *self.constraints()]
        lines += self.coordinates(telling_definitions(self.equations) if positions else ())
        chosen = choice_line(self.equations)
        lines += listed("Formulation   ", chosen.split()) if chosen else []
        return [*lines, *self.singular()]

    def singular(self) -> list[str]:
        """List the places at which the coordinates are singular."""
        lines = []
        for place in self.equations.singular:
            names = ", ".join(self.printer.symbol(name) for name in place.coordinates)
            opening = f"Singular      {names} where "
            lines += hung(opening, suffixed(self.pieces(place.where), " = 0", 4))
        return lines

    def constraints(self) -> list[str]:
        account = self.equations.account
        rows = []
        for line in account.lines:
            remark = remark_on(line)
            items = [f"{e}," for e in line.equations[:-1]] + list(line.equations[-1:])
            rows.append((line.name, items + _remark_items(remark)))
        if account.implied:
            rows.append(("(implied)", [implied_line(account)]))
        names = max((len(name) for name, _ in rows), default=0)
        return [
            line
            for name, items in rows
            for line in listed(f"  {name:<{names}}   ", [escape_controls(i) for i in items])
        ]

    def coordinates(self, positions: Sequence[CartesianName]) -> list[str]:
        names = ", ".join(self.printer.symbol(c.name) for c in self.equations.coordinates)
        head = f"Coordinates   {names or 'none'}"
        if self.equations.account.chosen_automatically:
            head += "   (chosen automatically)"
        formulas = {self.printer.symbol(c.name): self.pieces(c.position) for c in positions}
        beside = "   ".join(f"{name} = {joined(body)}" for name, body in formulas.items())
        if beside and columns(head) + 8 + columns(beside) <= TEXT_WIDTH:
            return [f"{head}        {beside}"]
        opening, *items = head.split("   ", 1)
        return [*listed(f"{opening}   ", items[0].split(" ")), *self.packed(formulas)]

    def packed(self, formulas: Mapping[str, Sequence[Piece]]) -> list[str]:
        """Short formulas side by side, long ones on lines of their own."""
        lines: list[str] = []
        room = 0
        for name, body in formulas.items():
            shown = f"{name} = {joined(body)}"
            if columns(shown) + 3 <= room:
                lines[-1] += f"   {shown}"
                room -= columns(shown) + 3
            else:
                lines += hung(f"  {name} = ", body)
                room = TEXT_WIDTH - columns(lines[-1])
        return lines

    # -- energies, forces, equations ------------------------------------------------

    def energies(self) -> list[str]:
        labels = quantity_labels(self.equations)
        potential = "U" if is_generalized_potential(self.equations) else "V"
        lines = self.formula(labels["T"], self.equations.kinetic)
        lines += self.formula(labels[potential], self.equations.potential)
        if self.equations.dissipation != 0:
            lines += self.formula(labels["D"], self.equations.dissipation)
        return lines

    def forces(self) -> list[str]:
        rows = [
            (f"Q_{self.printer.symbol(c.name)}", q, f"{force.name} on {force.on}")
            for force in self.equations.forces
            for c, q in zip(self.equations.coordinates, force.generalized, strict=True)
            if q != 0
        ]
        return self.with_reasons("Generalized forces", rows)

    def motion(self) -> list[str]:
        rows = []
        for shown in self.equations.shown:
            ending = " = 0"
            if was_divided(shown):
                ending += f"   (divided by {joined(self.pieces(shown.divided_by))})"
            left = self.printer.pieces(display_row(shown, self.words))
            rows.append((shown.coordinate, suffixed(left, ending, columns(ending))))
        names = [self.printer.symbol(name) for name, _ in rows]
        width = max(map(columns, names), default=0)
        lines = [
            line
            for name, (_, pieces) in zip(names, rows, strict=True)
            for line in hung(f"  {padded(name, width)}   ", pieces)
        ]
        return ["Equations of motion", *(lines or [_STILL])]

    def accelerations(self) -> list[str]:
        explicit = explicit_form(self.equations)
        if not self.equations.coordinates:
            return ["Equations of motion", _STILL]
        told = explicit_line(self.equations, explicit)
        lines = listed("Equations of motion, ", (told[0].lower() + told[1:]).split())
        solved = zip(self.equations.coordinates, explicit.accelerations, strict=True)
        for c, value in solved:
            if value is not None:
                lines += self.formula(f"  {self.printer.symbol(c.name, 2)}", value)
        for closure, value in zip(self.equations.closures, explicit.multipliers, strict=True):
            if value is not None:
                lines += self.formula(f"  {joined(self.pieces(closure.multiplier))}", value)
        return lines + self.coupled(explicit)

    def coupled(self, explicit: ExplicitForm) -> list[str]:
        """M and f of the accelerations that are not solved for, and what closures say of them."""
        coordinates, open_rows = self.equations.coordinates, explicit.coupled
        if not open_rows:
            return []
        names = [self.printer.symbol(c.name) for c in coordinates]
        unknowns = ", ".join(self.printer.symbol(coordinates[i].name, 2) for i in open_rows)
        labels = quantity_labels(self.equations)
        mass, forcing = labels["M"], labels["f"]
        lines = listed(f"  {mass} (", f"{unknowns}) = {forcing} with".split(" "))
        for i in open_rows:
            for j in open_rows:
                entry = self.equations.mass_matrix[i][j]
                if j >= i and entry != 0:
                    lines += self.formula(f"  {mass}[{names[i]}, {names[j]}]", entry)
        right = forcing_with_reactions(self.equations)
        for i in open_rows:
            lines += self.formula(f"  {forcing}[{names[i]}]", right[i])
        for closure, value in zip(self.equations.closures, explicit.multipliers, strict=True):
            if value is None:
                row = display_row(differentiated(self.equations, closure), self.words)
                left = suffixed(self.printer.pieces(row), " = 0", 4)
                lines += hung(f"  {escape_controls(closure.name)}   ", left)
        return lines

    def closures(self) -> list[str]:
        """The equations beside those of motion, and what their multipliers mean."""
        if not self.equations.closures:
            return []
        rows = [(escape_controls(c.name), c.expression) for c in self.equations.closures]
        width = max(columns(name) for name, _ in rows)
        lines = ["Closure equations"]
        for name, expression in rows:
            left = suffixed(self.pieces(expression), " = 0", 4)
            lines += hung(f"  {padded(name, width)}   ", left)
        return [*lines, *listed("  ", multipliers_line(self.equations).split(" "))]

    def contacts(self) -> list[str]:
        """Gaps and restitutions of one-sided constraints, and what their multipliers mean."""
        rows = [
            (escape_controls(c.name), c.closure.expression, c.restitution)
            for c in self.equations.contacts
        ]
        width = max((columns(name) for name, _, _ in rows), default=0)
        lines = ["Contacts"] if rows else []
        for name, gap, restitution in rows:
            open_gap = f" {self.printer.at_least} 0"
            left = suffixed(self.pieces(gap), open_gap, columns(open_gap))
            lines += hung(f"  {padded(name, width)}   ", left)
            elasticity = f"   restitution {joined(self.pieces(restitution))}"
            if columns(lines[-1] + elasticity) <= TEXT_WIDTH:
                lines[-1] += elasticity
            else:
                lines += self.formula(" " * (width + 5) + "restitution", restitution)
        for line in contacts_lines(self.equations):
            lines += listed("  ", line.split(" "))
        return lines

    def constraint_forces(self) -> list[str]:
        """Forces on the particles, and what each constraint exerts, where asked for."""
        forces = self.equations.constraint_forces
        if forces is None:
            return []
        groups = list(force_rows(forces))
        for name, multiplier, sizes in reaction_rows(self.equations, forces):
            known = [] if multiplier is None else [(self._multiplier(name), multiplier)]
            groups.append((name, known + [(f"force on {on}", e) for on, e in sizes]))
        names = [escape_controls(name) for name, _ in groups]
        width = max(map(columns, names), default=0)
        lines = [f"Constraint forces   {FORCES_LINE}"]
        for name, (_, rows) in zip(names, groups, strict=True):
            for index, (label, expression) in enumerate(rows):
                opening = padded("" if index else name, width)
                lines += self.formula(f"  {opening}   {escape_controls(label)}", expression)
        lines += [] if groups else ["  none"]
        notes = [listed("  ", escape_controls(n).split(" ")) for n in force_notes(forces)]
        return [*lines, *(line for note in notes for line in note)]

    def _multiplier(self, constraint: str) -> str:
        return self.printer.symbol(multiplier_label(self.equations, constraint))

    # -- what is conserved ------------------------------------------------------------

    def conserved(self) -> list[str]:
        rows = [
            (
                self.quantity(c),
                None if energy_is_sum(self.equations, c) else c.expression,
                self.reason(c),
            )
            for c in self.equations.conserved
        ]
        if not self.equations.coordinates:
            return []
        lines = self.with_reasons(f"Conserved {SEARCHED}", rows)
        lines = lines or [f"Conserved   none {SEARCHED}"]
        names = [
            "E" if n == "energy" else self.printer.symbol(n) for n in undecided(self.equations)
        ]
        return lines + ([f"  not decided: {', '.join(names)}"] if names else [])

    def energy(self) -> list[str]:
        """The rate of the energy where that is not conserved."""
        balance = self.equations.balance
        if balance is None:
            return []
        labels = quantity_labels(self.equations)
        label = labels["E" if balance.kind == "energy" else "h"]
        lines = [f"Energy{between_impacts(self.equations)}"]
        if energy_is_sum(self.equations, balance):
            lines.append(f"  {label} = {labels['T']} + {labels['V']}")
        else:
            lines += self.formula(f"  {label}", self.equations.energy)
        if balance.is_dissipation:
            return [*lines, f"  d{label}/dt = -2 {labels['D']}"]
        return lines + self.formula(f"  d{label}/dt", balance.rate)

    def quantity(self, quantity: Conserved) -> str:
        labels = quantity_labels(self.equations)
        if quantity.kind == "momentum":
            return self.printer.symbol(quantity.name)
        if energy_is_sum(self.equations, quantity):
            return f"{labels['E']} = {labels['T']} + {labels['V']}"
        return labels["E" if quantity.kind == "energy" else "h"]

    def reason(self, quantity: Conserved) -> str:
        if quantity.coordinate is None:
            return quantity.reason.replace("L", quantity_labels(self.equations)["L"], 1)
        symbol = self.printer.symbol(quantity.coordinate)
        return quantity.reason.replace(quantity.coordinate, symbol, 1)

    def inputs(self) -> list[str]:
        lines = [line for source in self.equations.inputs for line in self.input_lines(source)]
        return ["Inputs", *lines] if lines else []

    def input_lines(self, source: Input) -> list[str]:
        """Write an input: its expression, or in words where its values are recorded."""
        label = f"  {self.printer.symbol(source.name)}"
        if source.recording is None:
            return self.formula(label, source.expression)
        return listed(f"{label}: ", escape_controls(source.recording.described).split())

    def outputs(self) -> list[str]:
        return self.named("Outputs", self.equations.outputs)

    def named(self, heading: str, rows: Sequence[tuple[str, Expr]]) -> list[str]:
        names = [(self.printer.symbol(name), e) for name, e in rows]
        lines = [line for name, e in names for line in self.formula(f"  {name}", e)]
        return [heading, *lines] if lines else []

    # -- lines --------------------------------------------------------------------------

    def pieces(self, expression: Expr) -> list[Piece]:
        return self.printer.pieces(display(expression, self.words))

    def formula(self, label: str, expression: Expr) -> list[str]:
        """``label = expression``, broken where it is too long."""
        return hung(f"{label} = ", self.pieces(expression))

    def with_reasons(self, heading: str, rows: Iterable[tuple[str, Expr | None, str]]) -> list[str]:
        """``label = expression     reason`` under a heading; reasons form a column."""
        blocks = [
            (
                [f"  {label}"]
                if expression is None
                else hung(f"  {label} = ", self.pieces(expression)),
                escape_controls(reason),
            )
            for label, expression, reason in rows
        ]
        if not blocks:
            return []
        short = [
            columns(b[0]) for b, _ in blocks if len(b) == 1 and columns(b[0]) <= TEXT_WIDTH // 2
        ]
        column = max(short, default=0)
        lines = [heading]
        for block, reason in blocks:
            *before, last = block
            lines += [*before, f"{padded(last, column)}     {reason}"]
        return lines


def _remark_items(remark: str) -> list[str]:
    """A remark in parentheses, whole where it fits on a line, else word by word."""
    if not remark:
        return []
    return [f"  ({remark})"] if len(remark) <= TEXT_WIDTH // 2 else ["", "", *f"({remark})".split()]
