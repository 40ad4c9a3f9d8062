"""The complete LaTeX document of a derivation."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from lagrange_cli.emit.constraint_wording import (
    SEARCHED,
    between_impacts,
    counting,
    divisor_and_factor,
    energy_is_sum,
    energy_letter,
    explicit_line,
    implied_line,
    is_generalized_potential,
    multipliers_line,
    quantity_labels,
    remark_on,
    telling_definitions,
    undecided,
)
from lagrange_cli.emit.latex import words as latex_words
from lagrange_cli.emit.latex.forces import forces_section
from lagrange_cli.emit.latex.steps import LatexLetters, section_lines
from lagrange_cli.emit.latex.typesetter import FormulaRow, Typesetter
from lagrange_cli.emit.steps.board import conclusions, working
from lagrange_cli.mechanics.dynamics.accelerations import explicit_form
from lagrange_cli.notation.latex import latex_number
from lagrange_cli.notation.latex_escape import latex_text
from lagrange_cli.notation.symbols import latex_name

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import (
        CartesianName,
        Coordinate,
        Equations,
        ParticleMotion,
    )
    from lagrange_cli.mechanics.findings import Conserved
    from lagrange_cli.mechanics.step_values import DerivationSteps

_PREAMBLE = r"""\documentclass[11pt,a4paper]{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\IfFileExists{lmodern.sty}{\usepackage{lmodern}}{}
\usepackage[margin=25mm]{geometry}
\usepackage{amsmath}
\usepackage{booktabs}
\usepackage{longtable}
\allowdisplaybreaks
\setlength{\emergencystretch}{3em}
\setlength{\parindent}{0pt}
\setlength{\parskip}{0.5\baselineskip}
"""


def latex_document(equations: Equations, form: str = "lagrange") -> str:
    """A document that pdfLaTeX compiles by itself: system, freedom, L, motion, conservation."""
    page = _Document(equations)
    body = page.whole(form) if equations.steps is None else page.with_steps(form, equations.steps)
    blocks = [page.opening(), *body, page.outputs(), page.certificate(), [r"\end{document}"]]
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


class _Document:
    """The parts of the document, each a list of lines."""

    def __init__(self, equations: Equations) -> None:
        self.equations = equations
        self.setter = Typesetter.of(equations)
        self.labels = {k: latex_name(v) for k, v in quantity_labels(equations).items()}

    def whole(self, form: str) -> list[list[str]]:
        """The derivation in short."""
        above = [
            self.system(),
            self.freedom(),
            self.inputs(),
            self.energies(),
            self.forces(),
            self.motion(form),
            self.closures(),
            self.contacts(),
        ]
        below = [forces_section(self.setter), self.conserved(), self.energy()]
        # What is abbreviated is known when all else is written.
        return [*above, self.abbreviations(), *below]

    def with_steps(self, form: str, steps: DerivationSteps) -> list[list[str]]:
        """The derivation line by line."""
        letters = LatexLetters()
        return [
            [r"\setlength{\jot}{1ex}"],
            self.system(),
            self.freedom(positions=False),
            self.inputs(),
            *(section_lines(self.setter, s) for s in working(self.equations, steps, letters)),
            self.motion(form) if form == "explicit" else [],
            self.contacts(),
            forces_section(self.setter),
            *(section_lines(self.setter, s) for s in conclusions(self.equations, steps, letters)),
        ]

    def opening(self) -> list[str]:
        title = latex_text(self.equations.title or self.equations.name)
        lines = [
            f"% {latex_text(self.equations.name)}: equations of motion, written by lagrange",
            _PREAMBLE + r"\begin{document}",
            rf"\begin{{center}}\LARGE {title}\end{{center}}",
        ]
        if self.equations.description:
            lines += ["", latex_text(self.equations.description)]
        return lines

    # -- the system -----------------------------------------------------------------

    def system(self) -> list[str]:
        lines = [r"\section*{System}"]
        if self.equations.particles:
            listed = [self._particle(p) for p in self.equations.particles]
            lines.append(f"{_noun(len(listed), 'Particle')}: {'; '.join(listed)}.")
        return [*lines, *self._parameters()]

    def _particle(self, particle: ParticleMotion) -> str:
        place = ", ".join(latex_name(c) for c in particle.components)
        mass = self.setter.inline(particle.mass)
        return f"{latex_text(particle.name)} of mass ${mass}$ at $({place})$"

    def _parameters(self) -> list[str]:
        parameters = self.equations.parameters
        if not parameters:
            return []
        literals = dict(self.equations.literals)
        rows = []
        for p in parameters:
            number = ""
            if p.value is not None:
                number = latex_words.value_latex(p.value, literals.get(Fraction(repr(p.value))))
            rows.append(
                (
                    f"${latex_name(p.name, 0, p.latex)}$",
                    latex_text(p.description or ""),
                    number,
                    latex_words.unit_latex(p.unit or ""),
                )
            )
        return _table(("Parameter", "Meaning", "Value", "Unit"), rows)

    # -- degrees of freedom -------------------------------------------------------------

    def freedom(self, *, positions: bool = True) -> list[str]:
        """Count the degrees of freedom; name constraints and coordinates, with ``positions``."""
        account = self.equations.account
        counts = counting(self.equations)
        told = ",\\quad ".join(map(_counted, counts))
        if not any(" = " in count for count in counts):
            # In words alone they are too long for a line.
            told = f"There are {', '.join(counts)}."
        else:
            told = rf"\[ {told} \]"
        lines = [r"\section*{Degrees of freedom}", told]
        if account.lines:
            lines += [_BULLETS, *self._constraints(), r"\end{itemize}"]
        elif account.implied:
            lines.append(f"There are {implied_line(account)}.")
        definitions = telling_definitions(self.equations) if positions else ()
        return [*lines, *self._coordinates(definitions)]

    def _constraints(self) -> list[str]:
        items = []
        for line in self.equations.account.lines:
            written = ", ".join(latex_words.scene_text_latex(e) for e in line.equations)
            remark = remark_on(line)
            items.append(
                rf"  \item {latex_text(line.name)}: {written}"
                + (f" ({latex_text(remark)})" if remark else "")
            )
        if self.equations.account.implied:
            items.append(rf"  \item {implied_line(self.equations.account)}")
        return items

    def _coordinates(self, positions: Sequence[CartesianName]) -> list[str]:
        coordinates = self.equations.coordinates
        if not coordinates:
            return ["No coordinate is left: nothing can move."]
        names = ", ".join(self._described(c) for c in coordinates)
        chosen = " (chosen automatically)" if self.equations.account.chosen_automatically else ""
        lines = [f"{_noun(len(coordinates), 'Generalized coordinate')}{chosen}: {names}."]
        rows = [
            self.setter.definition(latex_name(c.name, 0, c.latex), c.position) for c in positions
        ]
        if rows:
            lines += ["The positions are", *self.setter.align(rows, numbered=False)]
        return [*lines, *self._singular()]

    def _singular(self) -> list[str]:
        """Say where the coordinates have no meaning, a sentence each."""
        named = {c.name: f"${self.setter.coordinate(c)}$" for c in self.equations.coordinates}
        return [
            f"The motion of {' and '.join(named[name] for name in place.coordinates)}"
            f" is singular where ${self.setter.inline(place.where)} = 0$."
            for place in self.equations.singular
        ]

    def _described(self, coordinate: Coordinate) -> str:
        text = f"${self.setter.coordinate(coordinate)}$"
        told = [latex_text(coordinate.description)] if coordinate.description else []
        if coordinate.unit:
            told.append(latex_words.unit_latex(coordinate.unit))
        return f"{text} ({', '.join(told)})" if told else text

    # -- Lagrangian, forces, motion -------------------------------------------------------

    def energies(self) -> list[str]:
        velocity_dependent = is_generalized_potential(self.equations)
        potential = "generalized potential" if velocity_dependent else "potential"
        others = (
            ", the Lagrangian and the dissipation function"
            if self._dissipates()
            else (" and the Lagrangian")
        )
        return [
            r"\section*{Lagrangian}",
            f"The kinetic energy, the {potential}{others} are",
            *self.setter.align(self.setter.energies()),
            *filter(None, [self.setter.without()]),
        ]

    def _dissipates(self) -> bool:
        return bool(self.equations.dissipation != 0)

    def forces(self) -> list[str]:
        rows = [
            self.setter.definition(f"Q_{{{self.setter.coordinate(c)}}}", q)
            for force in self.equations.forces
            for c, q in zip(self.equations.coordinates, force.generalized, strict=True)
            if q != 0
        ]
        if not rows:
            return []
        listed = ", ".join(
            f"{latex_text(f.name)} on {latex_text(f.on)}" for f in self.equations.forces
        )
        return [
            r"\section*{Generalized forces}",
            f"Of the non-conservative forces ({listed}), in this order:",
            *self.setter.align(rows),
        ]

    def motion(self, form: str) -> list[str]:
        lines = [r"\section*{Equations of motion}"]
        rows = self.setter.motion(form)
        if not rows:
            return [*lines, "There are none."]
        if form == "explicit":
            told = explicit_line(self.equations, explicit_form(self.equations))
            lines.append(f"{told}:")
        else:
            lines.append(f"Lagrange's equations {self._lagrange()} give")
        lines += self.setter.align(rows)
        divided = self._divided() if form != "explicit" else ""
        return [*lines, divided] if divided else lines

    def _lagrange(self) -> str:
        label = self.labels["L"]
        dissipation = (
            rf" + \frac{{\partial {self.labels['D']}}}{{\partial \dot{{q}}_j}}"
            if self._dissipates()
            else ""
        )
        right = " + ".join([*(["Q_j"] if self.equations.forces else []), *self._multiplied()])
        return (
            rf"\[ \frac{{\mathrm{{d}}}}{{\mathrm{{d}} t}} \frac{{\partial {label}}}"
            rf"{{\partial \dot{{q}}_j}} - \frac{{\partial {label}}}{{\partial q_j}}"
            rf"{dissipation} = {right or '0'} \]"
        )

    def _multiplied(self) -> list[str]:
        """The generalized forces of the constraints, by kinds of closures and contacts."""
        kinds = {closure.kind for closure in self.equations.pushing}
        return [
            rf"\sum_k \lambda_k \frac{{\partial {phi}_k}}{{\partial {by}_j}}"
            for kind, phi, by in (
                ("position", r"\varphi", "q"),
                ("velocity", r"\psi", r"\dot{q}"),
            )
            if kind in kinds
        ]

    def closures(self) -> list[str]:
        """The equations beside those of motion, and what their multipliers mean."""
        rows = self.setter.closures()
        if not rows:
            return []
        kinds = {closure.kind for closure in self.equations.closures}
        letters = {"position": r"$\varphi_k$", "velocity": r"$\psi_k$"}
        sides = f"the {letters[min(kinds)]}"
        if len(kinds) > 1:
            sides = rf"{letters['position']}, or {letters['velocity']} where they hold velocities"
        return [
            r"\section*{Closure equations}",
            f"These hold beside the equations of motion; their left sides are {sides}.",
            *self.setter.align(rows),
            f"{multipliers_line(self.equations)}.",
        ]

    def contacts(self) -> list[str]:
        """Gaps with their multipliers and restitutions, and what these mean."""
        rows = self.setter.contacts()
        if not rows:
            return []
        told = [
            f"${self.setter.inline(c.restitution)}$ for {latex_text(c.name)}"
            for c in self.equations.contacts
        ]
        return [
            r"\section*{Contacts}",
            r"The gaps $\varphi_k$ of one-sided constraints and their multipliers obey",
            r"\[ \varphi_k \ge 0,\quad \lambda_k \ge 0,\quad \lambda_k \varphi_k = 0, \]",
            "here",
            *self.setter.align(rows),
            r"Times the gradient of the gap, $\lambda_k$ is the force of the contact. A gap that"
            r" closes with $\dot\varphi_k < 0$ opens with $-e_k \dot\varphi_k$;"
            f" the restitution $e_k$ is {', '.join(told)}.",
        ]

    def abbreviations(self) -> list[str]:
        rows = self.setter.abbreviations()
        return ["Here", *self.setter.align(rows, numbered=False)] if rows else []

    def _divided(self) -> str:
        """Say which common factors were divided out of which equations, or multiplied to them."""
        divided, multiplied = [], []
        for c, shown in zip(self.equations.coordinates, self.equations.shown, strict=True):
            divisor, factor = divisor_and_factor(shown)
            coordinate = self.setter.coordinate(c)
            if divisor is not None:
                divided.append(f"${self.setter.inline(divisor)}$ in that for ${coordinate}$")
            if factor is not None:
                multiplied.append(f"that for ${coordinate}$ by ${self.setter.inline(factor)}$")
        told = []
        if divided:
            listed = ", ".join(divided).replace("in that for", "in the equation for", 1)
            told.append(f"{_noun(len(divided), 'Common factor')} divided out: {listed}.")
        if multiplied:
            listed = ", ".join(multiplied).replace("that for", "the equation for", 1)
            told.append(f"Multiplied to be rid of fractions: {listed}.")
        return " ".join(told)

    # -- conservation, certificate ----------------------------------------------------------

    def conserved(self) -> list[str]:
        if not self.equations.coordinates:
            return []
        heading = r"\section*{Conserved quantities}"
        names = [self._name(name) for name in undecided(self.equations)]
        doubts = [f"Of {', '.join(names)} this is not decided."] if names else []
        if not self.equations.conserved:
            return [heading, f"None {SEARCHED}.", *doubts]
        told = [
            f"{self._reason(c.reason)}, so ${self._symbol(c)}$ is conserved"
            for c in self.equations.conserved
        ]
        return [
            heading,
            f"{SEARCHED.capitalize()}: {'; '.join(told)}:",
            *self.setter.align([self._conserved(c) for c in self.equations.conserved]),
            *doubts,
        ]

    def energy(self) -> list[str]:
        """The rate of the energy where that is not conserved."""
        balance = self.equations.balance
        if balance is None:
            return []
        label = self.labels["E" if balance.kind == "energy" else "h"]
        whole = label
        if energy_is_sum(self.equations, balance):
            whole += f" = {self.labels['T']} + {self.labels['V']}"
        change = rf"\frac{{\mathrm{{d}} {label}}}{{\mathrm{{d}} t}}"
        if balance.is_dissipation:
            change += f" = -2 {self.labels['D']}"
        return [
            r"\section*{Energy}",
            f"Along a motion ${label}$ changes{between_impacts(self.equations)} at the given rate:",
            *self.setter.align(
                [
                    self.setter.total(whole, balance.parts or (self.equations.energy,)),
                    self.setter.definition(change, balance.rate),
                ]
            ),
        ]

    def _name(self, name: str) -> str:
        """The symbol of ``energy`` or of a momentum ``p_NAME``."""
        if name == "energy":
            return f"${self.labels['E']}$"
        return f"${latex_name(name)}$"

    def _reason(self, reason: str) -> str:
        """A reason with the quantities it names in math mode."""
        symbols = {c.name: self.setter.coordinate(c) for c in self.equations.coordinates}
        symbols |= {"L": self.labels["L"], "t": "t"}
        words = (f"${symbols[w]}$" if w in symbols else latex_text(w) for w in reason.split())
        return " ".join(words)

    def _symbol(self, quantity: Conserved) -> str:
        if quantity.kind != "momentum":
            return self.labels[energy_letter(quantity)]
        for coordinate in self.equations.coordinates:
            if coordinate.name == quantity.coordinate:
                return f"p_{{{self.setter.coordinate(coordinate)}}}"
        return latex_name(quantity.name)

    def _conserved(self, quantity: Conserved) -> FormulaRow:
        label = self._symbol(quantity)
        if energy_is_sum(self.equations, quantity):
            label += f" = {self.labels['T']} + {self.labels['V']}"
        return self.setter.total(label, quantity.parts or (quantity.expression,))

    def inputs(self) -> list[str]:
        inputs = self.equations.inputs
        formulas = [(u.name, u.expression) for u in inputs if u.recording is None]
        recorded = [
            f"${latex_name(u.name)}$: {latex_text(u.recording.described)}."
            for u in inputs
            if u.recording is not None
        ]
        if not recorded:
            return self._named("Inputs", formulas)
        return [*(self._named("Inputs", formulas) or [r"\section*{Inputs}"]), *recorded]

    def outputs(self) -> list[str]:
        return self._named("Outputs", self.equations.outputs)

    def _named(self, heading: str, entries: Sequence[tuple[str, Expr]]) -> list[str]:
        rows = [self.setter.definition(latex_name(name), e) for name, e in entries]
        if not rows:
            return []
        return [rf"\section*{{{heading}}}", *self.setter.align(rows, numbered=False)]

    def certificate(self) -> list[str]:
        seal = self.equations.certificate
        noun = "state" if seal.points == 1 else "states"
        mismatch = latex_number(f"{seal.mismatch:.0e}") if seal.mismatch else "0"
        return [
            r"\section*{Certificate}",
            f"At {seal.points} random {noun} these equations were compared, in arithmetic of "
            f"{seal.digits} digits, with Lagrange's equations evaluated from ${self.labels['L']}$ "
            f"itself; the largest relative mismatch was ${mismatch}$.",
            *self._steps_certificate(),
        ]

    def _steps_certificate(self) -> list[str]:
        steps = self.equations.steps
        if steps is None:
            return []
        return [
            f"Every line of the steps was compared at {steps.states} of these states with automatic"
            f" differentiation: the largest mismatch was ${LatexLetters().number(steps.mismatch)}$."
        ]


#: Rows of a table that is kept on one page.
_LONGEST_TABLE = 24

_BULLETS = r"Constraints: \begin{itemize}\setlength{\itemsep}{0pt}\setlength{\parskip}{0pt}"


def _counted(phrase: str) -> str:
    """A count in math mode; its words in upright letters."""
    label, equals, number = phrase.partition(" = ")
    if not equals:
        return rf"\text{{{phrase}}}"
    return rf"\text{{{label}}} = {number}" if label == "DOF" else phrase


def _noun(count: int, singular: str) -> str:
    return singular if count == 1 else singular + "s"


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """A table; columns in which nothing stands are left out.

    A long one may run over pages, for which LaTeX needs a second run to align
    its columns.
    """
    kept = [i for i in range(len(heads)) if any(row[i] for row in rows)]
    columns = "".join(r"p{0.45\textwidth}" if heads[i] == "Meaning" else "l" for i in kept)

    def line(row: Sequence[str]) -> str:
        return "  " + " & ".join(row[i] for i in kept) + r" \\"

    long = len(rows) > _LONGEST_TABLE
    opening = r"\begin{longtable}[l]" if long else r"\begin{tabular}"
    return [
        "" if long else r"\par\medskip",
        f"{opening}{{@{{}}{columns}@{{}}}}",
        r"  \toprule",
        line(heads),
        r"  \midrule" + (r" \endhead" if long else ""),
        *map(line, rows),
        r"  \bottomrule",
        r"\end{longtable}" if long else r"\end{tabular}",
    ]
