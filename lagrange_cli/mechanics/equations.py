"""Equations of motion as a frozen value in three parts.

``system`` is what code and integration are made from, ``derivation`` is what is known about it and
why it holds, ``presentation`` is how the scene names and draws it. Everything downstream (display,
emission, simulation) sees these values and never the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING

from lagrange_cli.mechanics.findings import (
    Account,
    Certificate,
    Conserved,
    EnergyBalance,
    Facts,
    FollowedQuantity,
    FormulationChoice,
    PoissonBrackets,
    SingularConfiguration,
)
from lagrange_cli.mechanics.system import System
from lagrange_cli.scene.units import Units

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.errors import Problem
    from lagrange_cli.mechanics.depiction import Depiction
    from lagrange_cli.mechanics.findings import ConstraintForces, DerivationSources
    from lagrange_cli.mechanics.step_values import DerivationSteps
    from lagrange_cli.scene.model import FamilyIndex


@dataclass(frozen=True)
class RateForm:
    """An equation as the rate of a momentum, ``d/dt (momentum) + Σ coefficient·factor = 0``.

    Attributes
    ----------
    momentum
        The momentum, in whose rate the accelerations stand.
    remainder
        Pairs of coefficient and factor in display order, none of a conserved momentum.
    """

    momentum: Expr
    remainder: tuple[tuple[Expr, Expr], ...] = ()

    @cached_property
    def remainder_sum(self) -> Expr:
        """The sum of the remainder, 0 of a conserved momentum."""
        return _sum_of(self.remainder)


@dataclass(frozen=True)
class ShownEquation:
    """The textbook form of one equation of motion, ``Σ coefficient·factor = 0``.

    Attributes
    ----------
    coordinate
        Name of its coordinate.
    terms
        Pairs of coefficient and factor in display order: those in ddot (factor an acceleration),
        in dot (a monomial in velocities), without either (1), and with a multiplier.
    divided_by
        Common factor that was divided out, 1 if none.
    rate_form
        The form with a rate that prints in place of the terms, None if they print; nothing is
        divided out then.
    """

    coordinate: str
    terms: tuple[tuple[Expr, Expr], ...]
    divided_by: Expr
    rate_form: RateForm | None = None

    @cached_property
    def residual(self) -> Expr:
        """The sum of the terms: zero along a motion."""
        return _sum_of(self.terms)

    @property
    def whole_parts(self) -> tuple[Expr, ...]:
        """Expressions that together are the equation: residual, divisor, momentum, remainder."""
        form = self.rate_form
        rate = () if form is None else (form.momentum, form.remainder_sum)
        return (self.residual, self.divided_by, *rate)

    def map(self, coordinate: str, rule: Callable[[Expr], Expr]) -> ShownEquation:
        """Return the equation of another coordinate, a rule applied to each expression."""
        form = self.rate_form
        if form is not None:
            form = RateForm(rule(form.momentum), _mapped(form.remainder, rule))
        return ShownEquation(coordinate, _mapped(self.terms, rule), rule(self.divided_by), form)


def _sum_of(terms: Iterable[tuple[Expr, Expr]]) -> Expr:
    import sympy

    return sympy.Add(*(coefficient * factor for coefficient, factor in terms))


def _mapped(
    terms: Iterable[tuple[Expr, Expr]], rule: Callable[[Expr], Expr]
) -> tuple[tuple[Expr, Expr], ...]:
    return tuple((rule(coefficient), rule(factor)) for coefficient, factor in terms)


@dataclass(frozen=True)
class ShortLagrangian:
    """L without terms that change no equation of motion.

    Attributes
    ----------
    expression
        What is left of T − V.
    left_out
        Constants and functions of t alone.
    """

    expression: Expr
    left_out: Expr


@dataclass(frozen=True)
class EulerForm:
    """Euler's equations of a body along its axes: I ω̇ + ω × I ω = M.

    They stand for the equations of the quaternion or the three angles q that turn it, with q̇
    over ω.

    Attributes
    ----------
    body, numbers
        Its name, and the numbers of the four or three coordinates.
    spins
        ω over q and q̇.
    inertia, gyroscopic, torques
        Of each axis I ω̇ and −ω × I ω over components of ω and their rates, and M over q, ω, other
        velocities and t.
    rates
        q̇ over q and components of ω.
    kinetic
        T over components of ω and other velocities.
    """

    body: str
    numbers: tuple[int, ...]
    spins: tuple[Expr, ...]
    inertia: tuple[Expr, ...]
    gyroscopic: tuple[Expr, ...]
    torques: tuple[Expr, ...]
    rates: tuple[Expr, ...]
    kinetic: Expr

    @property
    def residuals(self) -> tuple[Expr, ...]:
        """I ω̇ + ω × I ω − M of each axis."""
        parts = zip(self.inertia, self.gyroscopic, self.torques, strict=True)
        return tuple(inertia - gyroscopic - torque for inertia, gyroscopic, torque in parts)


@dataclass(frozen=True)
class TextbookForm:
    """Texts for readers alone: neither simulation nor code needs them.

    Attributes
    ----------
    shown
        Textbook form of each equation of motion.
    short_lagrangian
        L as it is shown, None where nothing is left out of T − V.
    balance
        The rate of the energy where it is not conserved and the rate is short, else None.
    euler
        Euler's equations of a body that turns freely, None of other systems. They print in place of
        those of a quaternion.
    """

    shown: tuple[ShownEquation, ...]
    short_lagrangian: ShortLagrangian | None = None
    balance: EnergyBalance | None = None
    euler: EulerForm | None = None


@dataclass(frozen=True)
class Derivation:
    """All that is known about a system, and the proof of its equations.

    Attributes
    ----------
    account
        Account of degrees of freedom.
    textbook
        Writes the textbook form, and compares it with the derived one, when it is first called.
    cyclic
        Names of cyclic coordinates.
    conserved, facts
        Conserved quantities and other proven facts.
    certificate
        The comparison with Newton's law.
    warnings, remarks
        Findings to be reported.
    followed
        Conserved quantities among the outputs whose drift a simulation measures; None unless they
        were asked for.
    brackets
        Poisson brackets that were asked for, None if none were.
    suggested
        Values of coordinates that could be given if ``initial`` is None.
    start
        Symbols of q and q̇ with their starts over the parameters; empty unless the scene writes
        some in parameters.
    constraint_forces
        Constraint forces, None unless they were asked for.
    steps
        Steps of the derivation, None unless they were asked for.
    choice
        Formulation that was taken, None if there is one only.
    singular
        Configurations that the coordinates do not cover.
    open_questions
        Coordinates that may be cyclic and quantities that may be conserved: neither proven nor
        refuted.
    sources
        The sources of another derivation of mass matrix and forcing.
    """

    account: Account
    certificate: Certificate
    facts: Facts
    cyclic: tuple[str, ...]
    conserved: tuple[Conserved, ...]
    textbook: Callable[[], TextbookForm]
    open_questions: tuple[str, ...] = ()
    singular: tuple[SingularConfiguration, ...] = ()
    suggested: tuple[tuple[str, str], ...] = ()
    start: tuple[tuple[Symbol, Expr], ...] = ()
    choice: FormulationChoice | None = None
    steps: DerivationSteps | None = None
    constraint_forces: ConstraintForces | None = None
    brackets: PoissonBrackets | None = None
    followed: tuple[FollowedQuantity, ...] | None = None
    warnings: tuple[Problem, ...] = ()
    remarks: tuple[str, ...] = ()
    sources: DerivationSources | None = field(default=None, compare=False, repr=False)

    @property
    def shown(self) -> tuple[ShownEquation, ...]:
        """Textbook form of each equation."""
        return self.textbook().shown

    @property
    def short_lagrangian(self) -> ShortLagrangian | None:
        """L as it is shown, None where nothing is left out of T − V."""
        return self.textbook().short_lagrangian

    @property
    def balance(self) -> EnergyBalance | None:
        """The rate of the energy where it is not conserved and the rate is short, else None."""
        return self.textbook().balance

    @property
    def euler(self) -> EulerForm | None:
        """Euler's equations of a body that turns freely, None of other systems."""
        return self.textbook().euler


@dataclass(frozen=True)
class Presentation:
    """Names, letters and units with which the scene presents the system, and a picture's sources.

    Attributes
    ----------
    name, title, description
        Texts of the scene.
    file, digest
        Its file, and the SHA-256 of its text.
    abbreviations
        Definitions of the scene that name no Cartesian name.
    sizes
        Sizes of the scene by name.
    families
        Families of the scene: of each index its letter, and the size that it ends with or None.
    literals
        Exact values with decimals as the scene wrote them.
    sums
        Sums in brackets, each as its terms in the order of the scene.
    stated_values
        Values of parameters that the scene states in other parameters, by name.
    latex
        LaTeX of the scene for names beside those of parameters and coordinates: of definitions,
        components and multipliers (``lambda_rod``).
    indices
        LaTeX of the scene for the names of closures and contacts below a letter.
    units
        Units of coordinates, Cartesian names, outputs and their rates, of ``t`` and ``energy``.
    depiction
        The sources of a picture; None with more than :data:`.depiction.MOST_BODIES` bodies.
    """

    name: str
    title: str | None
    description: str | None
    file: str
    digest: str
    abbreviations: tuple[tuple[str, Expr], ...] = ()
    sizes: tuple[tuple[str, int], ...] = ()
    families: tuple[tuple[str, tuple[FamilyIndex, ...]], ...] = ()
    literals: tuple[tuple[Fraction, str], ...] = ()
    sums: tuple[tuple[Expr, ...], ...] = ()
    stated_values: tuple[tuple[str, Expr], ...] = ()
    latex: Mapping[str, str] = field(default_factory=dict)
    indices: Mapping[str, str] = field(default_factory=dict)
    units: Units = field(default_factory=Units)
    depiction: Depiction | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, repr=False, eq=False)
class Equations:
    """Certified equations of motion, each its own: none equals another.

    Attributes
    ----------
    system
        Coordinates, parameters, mass matrix, forcing, closures, contacts, start and run.
    derivation
        Account, facts, conserved quantities, textbook form and certificate.
    presentation
        Names, letters, units and the sources of a picture.
    """

    system: System
    derivation: Derivation
    presentation: Presentation

    def __repr__(self) -> str:
        """Return a line: all fields would be pages of expressions."""
        names = ", ".join(c.name for c in self.system.coordinates) or "no coordinates"
        return f"<Equations of {self.presentation.name} in {names}: {self.system.formulation} form>"
