"""The writer of sections: equations, and steps if any, to labels and rows of trees."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from lagrange_cli.analysis.symmetries.angular_momentum import angular_momentum_axis
from lagrange_cli.analysis.symmetries.starting_values import conserved_at_start
from lagrange_cli.mechanics.step_values import moment_symbol, rate_symbol, spin_symbol
from lagrange_cli.notation.build import display
from lagrange_cli.notation.labels import free_base, free_letter, quantity_labels
from lagrange_cli.notation.ordering import labelled_symbol, symbol_of
from lagrange_cli.notation.symbols import latex_name
from lagrange_cli.notation.tree import Dependence, DisplayNode, DisplaySum, as_terms
from lagrange_cli.notation.vocabulary import Omission, Vocabulary, vocabulary
from lagrange_cli.report.contents.sentences import is_generalized_potential, names_of_lengths
from lagrange_cli.report.inlines import (
    CROSS,
    DOT,
    Chain,
    Expression,
    Inline,
    Label,
    Listed,
    Plain,
    Text,
    below,
    bold,
    group,
    joined,
    partial,
    routhian,
    say,
    symbol,
    times,
    total,
    vector,
    virtual,
)
from lagrange_cli.report.tree import Formula, Formulas, Medium, Paragraph, Title

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.findings import Conserved
    from lagrange_cli.mechanics.step_values import (
        BodySteps,
        ComponentSteps,
        DerivationSteps,
        Displacement,
        TurningSteps,
    )
    from lagrange_cli.mechanics.system import Closure, Coordinate

#: Terms of a sum that is written out although its parts stand above it.
_MOST_TERMS = 12

#: Symbols of general formulas: a coordinate, its rate and its displacement, and a position.
PLACE, SPEED, POSITION = symbol("q_j"), symbol("q_j", 1), vector("r")
DISPLACED = virtual(PLACE)

#: Mass times acceleration of particle i.
INERTIA = times(symbol("m_i"), vector("r", 2))


@dataclass(frozen=True)
class Writer:
    """Makes labels and rows of some equations.

    Attributes
    ----------
    equations
        The equations.
    """

    equations: Equations

    @cached_property
    def words(self) -> Vocabulary:
        """Display names of all symbols."""
        return vocabulary(self.equations)

    def tree(self, expression: Expr) -> DisplayNode:
        """Return an expression as it is displayed."""
        return display(expression, self.words)

    # -- labels ---------------------------------------------------------------------

    @cached_property
    def labels(self) -> dict[str, Label]:
        """Labels of T, V, L and so on that differ from all names of the scene."""
        names = quantity_labels(self.equations)
        labels = {short: symbol(name) for short, name in names.items()}
        # Routh's function keeps its letter, in another face.
        return labels if names["R"] == "R" else {**labels, "R": routhian()}

    @property
    def potential(self) -> Label:
        """The label of the potential: V, or U where it depends on velocities."""
        return self.labels["U" if is_generalized_potential(self.equations) else "V"]

    def coordinate(self, coordinate: Coordinate, order: int = 0) -> Label:
        return symbol(coordinate.name, order, coordinate.latex)

    def formula(self, expression: Expr) -> Label:
        """Return an expression as a label, or a part of one."""
        return Expression(self.tree(expression))

    def inline(self, expression: Expr) -> Inline:
        """Return an expression within a sentence."""
        return Inline(self.formula(expression))

    @cached_property
    def spin_letter(self) -> str:
        """The letter of angular velocities, ω where the scene has no other use for it.

        Outputs that are components of an angular velocity are no other use.
        """
        turnings = [p.turning for p in self.equations.system.particles if p.turning is not None]
        spins = {e for t in turnings for e in (*t.spin, *t.spin_in_space)}
        outputs = self.equations.system.outputs
        same = {name for name, expression in outputs if expression in spins}
        return free_base(self.equations, ("omega", "Omega", "w", "u"), same)

    # -- rows -----------------------------------------------------------------------

    def row(self, label: Text, *chain: Expr) -> Formula:
        """``label = first = second``; an expression that reads as the one before is left out."""
        shown: list[DisplayNode] = []
        for expression in chain:
            node = self.tree(expression)
            if not shown or shown[-1] != node:
                shown.append(node)
        return Formula(label, tuple(shown))

    def sum_row(self, label: Text, whole: Expr) -> Formula:
        """``label = whole``, or the label alone where the sum is long."""
        node = self.tree(whole)
        short = not isinstance(node, DisplaySum) or len(as_terms(node)) <= _MOST_TERMS
        return Formula(label, (node,) if short else ())

    # -- paragraphs -----------------------------------------------------------------

    def paragraph(self, *sentences: Text, only: Medium | None = None) -> Paragraph | None:
        """Return a paragraph of the sentences that are not empty."""
        nonempty = tuple(s for s in sentences if s)
        return Paragraph(Listed(nonempty, " "), only=only) if nonempty else None

    def title(self, name: str) -> Title:
        """Return the title of the formulas below it, a name of the scene."""
        return Title(say("{text}:", text=Plain(name)))


@dataclass(frozen=True)
class StepsWriter(Writer):
    """Makes labels and rows of the steps of some equations.

    Attributes
    ----------
    steps
        The steps that lead to the equations.
    omission
        Leaves out expressions that are too long to be read; None if all are wanted.
    read_back
        True if angular velocities have the names that a scene gives them.
    """

    _: KW_ONLY
    steps: DerivationSteps
    omission: Omission | None = None
    read_back: bool = False

    @cached_property
    def words(self) -> Vocabulary:
        """Display names of all symbols: those of the equations, Cartesian names, displacements."""
        usual = vocabulary(self.equations, omission=self.omission)
        atoms = dict(usual.atoms)
        written = [term.written for term in (*self.steps.kinetic, *self.steps.potentials)]
        for name in {s for e in written for s in e.free_symbols} - atoms.keys():
            order = [c.name for c in self.equations.system.cartesian_names]
            rank = order.index(name.name) if name.name in order else len(order)
            atoms[name] = symbol_of(name.name, Dependence.COORDINATE, rank)
        for rank, name in enumerate(c.name for c in self.equations.system.cartesian_names):
            atoms[rate_symbol(name)] = symbol_of(name, Dependence.VELOCITY, rank, order=1)
        for rank, parts in enumerate(self.steps.balances):
            label = virtual(self.displaced_place(parts.displacement))
            atoms[parts.displacement.symbol] = labelled_symbol(label, Dependence.ACCELERATION, rank)
        spins = [(body, c.axis) for body in self.turning for c in turning_of(body).components]
        for rank, (body, axis) in enumerate(spins, len(self.equations.system.coordinates)):
            spin, name = spin_symbol(body.name, axis), self._spin_name(body.name, axis)
            atoms[spin] = symbol_of(name, Dependence.VELOCITY, rank)
            rate = rate_symbol(spin.name)
            atoms[rate] = symbol_of(name, Dependence.ACCELERATION, rank, order=1)
        moments = [(body, m) for body in self.turning for m, _ in turning_of(body).moments]
        for rank, (body, moment) in enumerate(moments, -len(moments)):
            name = self._spin_name(body.name, moment, self.inertia_tensor_letter)
            atoms[moment_symbol(body.name, moment)] = symbol_of(name, Dependence.PARAMETER, rank)
        return replace(usual, atoms=atoms)

    # -- labels ---------------------------------------------------------------------

    def variable(self, variable: Symbol) -> Label:
        """Return a coordinate or t, as what is differentiated by."""
        named = {c.q: self.coordinate(c) for c in self.equations.system.coordinates}
        return named.get(variable, symbol("t"))

    def cartesian(self, name: str, order: int = 0) -> Label:
        """Return a Cartesian name, which may be that of a coordinate."""
        named = {c.name: self.coordinate(c, order) for c in self.equations.system.coordinates}
        return named.get(name, symbol(name, order))

    @cached_property
    def constraint_letter(self) -> str:
        """The letter of left sides of constraints, φ where the scene has no other use for it."""
        return free_letter(self.equations, ("phi", "psi", "f", "g", "h", "w"))

    def constraint(self, closure: Closure) -> Label:
        """Return the left side of a closure or gap: ``φ_rolling``."""
        letter, index = (
            self.constraint_letter,
            self.equations.presentation.indices.get(closure.name),
        )
        latex = None if index is None else f"{latex_name(letter)}_{{{index}}}"
        return symbol(f"{letter}_{closure.name}", 0, latex)

    @cached_property
    def force_letter(self) -> str:
        """The letter of applied forces, F where the scene has no other use for it."""
        return free_letter(self.equations, ("F", "K", "P"))

    @cached_property
    def inertia_letter(self) -> str:
        """The letter of inertia less force of terms that act on no particle."""
        return free_letter(self.equations, ("N", "S", "W"))

    @property
    def applied(self) -> Label:
        """The applied force on particle i."""
        return vector(self.force_letter)

    @property
    def torque(self) -> Label:
        """The applied torque on body i."""
        return _of_body(self.torque_letter)

    @property
    def small_turn(self) -> Label:
        """The small angle of a virtual turn of body i."""
        return _of_body(self.angle_letter)

    @property
    def spin_slope(self) -> Label:
        """``∂ω_i/∂q̇_j``, by which the rate of a coordinate turns body i."""
        return self.spin_by(SPEED)

    def spin_by(self, speed: Label) -> Label:
        """Return the derivative of the angular velocity of body i by the rate of a coordinate."""
        return partial(_of_body(self.spin_letter), speed)

    @cached_property
    def restricting(self) -> tuple[Closure, ...]:
        """Constraints that restrict displacements; small turns keep the lengths of quaternions."""
        pushing, balances = self.equations.system.pushing, self.steps.balances
        if not any(parts.displacement.axis for parts in balances):
            return pushing
        lengths = names_of_lengths(self.equations)
        return tuple(closure for closure in pushing if closure.name not in lengths)

    @property
    def displaced(self) -> tuple[Label, Label]:
        """``δr_i`` and ``δφ_i``."""
        return virtual(POSITION), virtual(self.small_turn)

    @property
    def momentum_rate(self) -> Label:
        """The rate of the angular momentum of body i about its centre of mass."""
        return _of_body(self.momentum_letter, 1)

    @property
    def inertia_torque(self) -> Label:
        """``I_i ω̇_i + ω_i × I_i ω_i``."""
        inertia, spin = _of_body(self.inertia_tensor_letter), _of_body(self.spin_letter)
        turned = times(inertia, _of_body(self.spin_letter, 1))
        return turned + " + " + spin + CROSS + times(inertia, spin)

    def speed(self, variable: Symbol) -> Label:
        """Return the rate of a coordinate, as what is differentiated by."""
        named = {c.q: self.coordinate(c, 1) for c in self.equations.system.coordinates}
        return named[variable]

    def force(self, name: str) -> Label:
        """Return the force along a Cartesian name: ``F_x``."""
        return below(self.force_letter, self.cartesian(name))

    @cached_property
    def turning(self) -> tuple[BodySteps, ...]:
        """The rigid bodies that turn."""
        return tuple(body for body in self.steps.bodies if body.turning is not None)

    @cached_property
    def angle_letter(self) -> str:
        """The letter of the small angles of virtual turns."""
        return free_base(self.equations, ("phi", "chi", "epsilon", "vartheta"))

    @cached_property
    def torque_letter(self) -> str:
        """The letter of applied torques, M where the scene has no other use for it."""
        return free_base(self.equations, ("M", "tau", "K", "G"))

    @cached_property
    def momentum_letter(self) -> str:
        """The letter of angular momenta about centres of mass; L is the Lagrangian."""
        return free_base(self.equations, ("J", "H", "S", "Gamma"))

    @cached_property
    def inertia_tensor_letter(self) -> str:
        """The letter of moments of inertia, I where the scene has no other use for it."""
        return free_base(self.equations, ("I", "Theta", "Lambda"))

    def spin(self, body: BodySteps, axis: str, order: int = 0) -> Label:
        """Return a component of the angular velocity of a body: ``ω_1``."""
        return symbol(self._spin_name(body.name, axis), order)

    def along_spin(self, letter: str, body: str, axis: str) -> Label:
        """Return the component of a vector with this letter that is along one of ω of a body."""
        return symbol(self._spin_name(body, axis, letter))

    def _spin_name(self, body: str, axis: str, letter: str = "") -> str:
        if self.read_back and not letter:
            return str(spin_symbol(body, axis))
        name = body if len(self.turning) > 1 else ""
        return "_".join(filter(None, (letter or self.spin_letter, axis, name)))

    def displaced_place(self, displacement: Displacement) -> Label:
        """Return what is displaced: a coordinate, or the angle of a small turn, ``φ_1``."""
        if displacement.axis:
            return self.along_spin(self.angle_letter, displacement.name, displacement.axis)
        return self.coordinate(self._named_coordinate(displacement))

    def spin_along(self, displacement: Displacement) -> Label:
        """Return ∂ω_i/∂q̇ of a coordinate, or ∂ω_i/∂ω_1 of a small turn."""
        if displacement.axis:
            name = self._spin_name(displacement.name, displacement.axis)
            return self.spin_by(symbol(name))
        return self.spin_by(self.coordinate(self._named_coordinate(displacement), 1))

    def _named_coordinate(self, displacement: Displacement) -> Coordinate:
        coordinates = self.equations.system.coordinates
        return next(c for c in coordinates if c.name == displacement.name)

    def factor(self, expression: Expr) -> Label:
        """Return an expression as a factor of a label."""
        is_sum = isinstance(self.tree(expression), DisplaySum)
        return group(self.formula(expression)) if is_sum else self.formula(expression)


def start_sentence(writer: Writer, letter: Callable[[Conserved], Label]) -> Paragraph | None:
    """Give conserved quantities at a start that the scene writes in its parameters."""
    values = tuple(
        letter(quantity) + " = " + writer.formula(value)
        for quantity, value in conserved_at_start(writer.equations)
    )
    return Paragraph(say("At the start {values}.", values=Listed(values))) if values else None


def angular_momentum_sentence(
    writer: Writer, quantity: Conserved, letter: Label
) -> Paragraph | None:
    """Say about which axis a momentum is the angular momentum, if it is proven to be so."""
    axis = angular_momentum_axis(writer.equations, quantity)
    if axis is None:
        return None
    sentence = "{momentum} is the angular momentum about the {axis} axis."
    return Paragraph(say(sentence, momentum=letter, axis=Inline(axis)))


def is_own_coordinate(part: ComponentSteps) -> bool:
    """Say whether a Cartesian name is a coordinate itself."""
    return bool(part.position.is_Symbol and part.position.name == part.name)


def _of_body(letter: str, order: int = 0) -> Label:
    """Return a vector of body i."""
    return below(bold(letter, order), "i")


def turning_of(body: BodySteps) -> TurningSteps:
    """Return the turning of a body that turns."""
    assert body.turning is not None
    return body.turning


def sum_of(terms: Iterable[Label | str]) -> Label:
    """Return terms of a general formula with plus signs; 0 if there are none."""
    return joined(" + ", terms) or Chain(("0",))


def work(force: Label, along: Label) -> Label:
    """``Σ_i F_i · δr_i``, or along ∂r_i/∂q_j."""
    return total("i", force + DOT + along)


def work_in_coordinates(force: Label) -> Label:
    """``Σ_j Q_j δq_j``."""
    return total("j", times(force, DISPLACED))


def by_body(
    writer: StepsWriter, rows: Callable[[BodySteps], Iterable[Formula]]
) -> Iterator[Title | Formulas]:
    """Return the rows of each body that has any, below its name where there are several."""
    for body in writer.steps.bodies:
        written = tuple(rows(body))
        if written:
            if len(writer.steps.bodies) > 1:
                yield writer.title(body.name)
            yield Formulas(written)
