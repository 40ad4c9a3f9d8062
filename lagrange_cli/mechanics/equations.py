"""Equations of motion as frozen values.

Positions q, velocities v, accelerations a and time t are independent SymPy
symbols. A velocity's symbol is named ``dot(q)`` and an acceleration's
``ddot(q)``, so that any expression printed by name reads as scene language.
Everything downstream (display, emission, simulation) sees these values and
never the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Literal

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
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.scene.units import Units

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.errors import Mark, Problem
    from lagrange_cli.files import Recording
    from lagrange_cli.mechanics.depiction import Depiction
    from lagrange_cli.mechanics.derivation_sources import DerivationSources
    from lagrange_cli.mechanics.reaction_values import ConstraintForces
    from lagrange_cli.mechanics.step_values import DerivationSteps
    from lagrange_cli.scene.conditions import SimulationDefaults
    from lagrange_cli.scene.model import DeclaredFunction, FamilyIndex


def tagged(name: str, tail: str) -> str:
    """A name with something after it that can be read back: ``rod_2``, ``rod_2[1]``."""
    base, bracket, indices = name.partition("[")
    return f"{base}{tail}{bracket}{indices}"


@dataclass(frozen=True)
class Parameter:
    """A parameter.

    Attributes
    ----------
    name, symbol
        Its name in the scene, and its symbol.
    value
        Its double; None if it must be given to simulate.
    decimal
        The same with 40 digits; empty if only the double is known.
    positive
        True if the scene declares it positive.
    unit, description, latex
        Texts of the scene, None if absent.
    start_of
        Coordinate, or ``t``, whose start it is: a constant of integration. None for others.
    exact
        The value as an exact number; None if there is none.
    """

    name: str
    symbol: Symbol
    value: float | None = None
    positive: bool = False
    decimal: str = field(default="", compare=False)
    unit: str | None = None
    description: str | None = None
    latex: str | None = None
    start_of: str | None = None
    exact: Expr | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Input:
    """A given function of time.

    Attributes
    ----------
    name, symbol
        Its name in the scene, and its symbol.
    expression
        Its value over t and parameters, None if it is recorded or driven.
    recording
        The file that holds its values, read when they are needed; None if it is an expression or
        driven.
    """

    name: str
    symbol: Symbol
    expression: Expr | None
    recording: Recording | None = None

    @property
    def driven(self) -> bool:
        """Its values are given by whoever evaluates the equations, and unknown before."""
        return self.expression is None and self.recording is None


@dataclass(frozen=True)
class Coordinate:
    """A generalized coordinate.

    Attributes
    ----------
    name
        Its name in the scene.
    q, v, a
        Independent symbols of q, q̇ and q̈.
    is_angle
        True if it enters positions only through 2π-periodic functions, or has unit rad.
    unit, description, latex
        Texts of the scene, None if absent.
    mark
        Its place in the scene, None if the scene does not declare it.
    """

    name: str
    q: Symbol
    v: Symbol
    a: Symbol
    is_angle: bool = False
    unit: str | None = None
    description: str | None = None
    latex: str | None = None
    mark: Mark | None = None

    @property
    def is_positive(self) -> bool:
        """True if the scene declares that it stays above zero."""
        return bool(self.q.is_positive)


@dataclass(frozen=True)
class CartesianName:
    """A Cartesian name that the scene writes (``x1``, ``z_bob``).

    Attributes
    ----------
    name
        The name.
    position, velocity
        Its value over (q, t) and its rate over (q, v, t).
    latex
        LaTeX of the scene, None if absent.
    """

    name: str
    position: Expr
    velocity: Expr
    latex: str | None = None


@dataclass(frozen=True)
class ParticleMotion:
    """A particle and its motion.

    Attributes
    ----------
    name, mass
        Its name and its mass.
    components
        Names of its x, y and z.
    position, velocity
        r(q, t) and ṙ(q, v, t), each along x, y, z.
    latex
        LaTeX of the scene, None if absent.
    """

    name: str
    mass: Expr
    components: tuple[str, str, str]
    position: tuple[Expr, Expr, Expr]
    velocity: tuple[Expr, Expr, Expr]
    latex: str | None = None


@dataclass(frozen=True)
class BodyForce:
    """A non-conservative force of the scene.

    Attributes
    ----------
    name, on
        Its name, and that of the particle, point or coordinate it acts on.
    components
        Along x, y, z; one only on a coordinate.
    generalized
        Generalized force Q on each coordinate.
    """

    name: str
    on: str
    components: tuple[Expr, ...]
    generalized: tuple[Expr, ...]


@dataclass(frozen=True)
class Closure:
    """A closure equation: a constraint kept beside the coordinates, with its multiplier.

    Between positions, φ(q, t) = 0 with φ̇ = ``gradient``·v + ``rate`` and
    φ̈ = ``gradient``·a + ``bias``. Between velocities, ψ(q, v, t) = 0, not integrable, with
    ψ = ``gradient``·v + ``rate`` and ψ̇ = ``gradient``·a + ``bias``.

    Attributes
    ----------
    name
        Name of the constraint.
    kind
        ``position`` or ``velocity``.
    expression
        φ or ψ: left-hand side − right-hand side.
    gradient
        One entry a coordinate, over q and t; walk it by :func:`.sparse.entries`.
    rate
        Over q and t, as above.
    bias
        Over q, v and t, as above.
    multiplier
        The symbol λ: λ·gradient is the generalized force that the constraint exerts.
    text, mark
        The equation as the scene writes it, and its place.
    integral
        True if the scene states the rate of φ, whose constant the initial state gives.
    """

    name: str
    kind: Literal["position", "velocity"]
    expression: Expr
    gradient: Sequence[Expr]
    rate: Expr
    bias: Expr
    multiplier: Symbol
    text: str
    mark: Mark | None = None
    integral: bool = False

    @cached_property
    def coordinate_numbers(self) -> tuple[int, ...]:
        """Numbers of the coordinates whose entry of the gradient is not plainly zero."""
        return tuple(entries(self.gradient))


@dataclass(frozen=True)
class Contact:
    """A one-sided constraint: the gap φ(q, t) ≥ 0 of ``closure``, whose λ ≥ 0 pushes where φ = 0.

    ``restitution``: Newton's coefficient e over the parameters; a contact that closes with
    φ̇ < 0 opens with −e φ̇.
    """

    closure: Closure
    restitution: Expr

    @property
    def name(self) -> str:
        return self.closure.name


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
    momentum
        The conserved momentum whose rate prints in place of the terms, None if they print.
    """

    coordinate: str
    terms: tuple[tuple[Expr, Expr], ...]
    divided_by: Expr
    momentum: Expr | None = None

    @cached_property
    def residual(self) -> Expr:
        """The sum of the terms: zero along a motion."""
        import sympy

        return sympy.Add(*(coefficient * factor for coefficient, factor in self.terms))


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
class TextbookForm:
    """What is written for readers alone: neither simulation nor code needs it.

    Attributes
    ----------
    shown
        Textbook form of each equation of motion.
    short_lagrangian
        L as it is shown, None where nothing is left out of T − V.
    balance
        The rate of the energy where it is not conserved and the rate is short, else None.
    """

    shown: tuple[ShownEquation, ...]
    short_lagrangian: ShortLagrangian | None = None
    balance: EnergyBalance | None = None


@dataclass(frozen=True)
class InitialState:
    """Initial state at the start time.

    Attributes
    ----------
    positions, velocities
        q and v as doubles, in the order of the coordinates.
    projected
        Largest change made to a given value to satisfy the constraints, 0 if none.
    decimals
        q and v with 40 digits; empty if only the doubles are known.
    """

    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    projected: float = 0.0
    decimals: tuple[str, ...] = field(default=(), compare=False)


@dataclass(frozen=True)
class ReplacedChart:
    """Coordinates that others have replaced.

    Attributes
    ----------
    coordinates
        The former coordinates.
    places
        The present coordinates over the former ones.
    start
        Initial state in the former ones, None if it is not known.
    steady
        Names of former ones whose rates are proven to keep their signs, by
        :func:`.dynamics.singular_configurations.conserved_momenta`.
    """

    coordinates: tuple[Coordinate, ...]
    places: tuple[CartesianName, ...]
    start: InitialState | None
    steady: tuple[str, ...] = ()


@dataclass(frozen=True, repr=False)
class Equations:
    """Equations of motion ``mass_matrix · a = forcing + Σ λ·gradient`` with all that explains them.

    Attributes
    ----------
    name, title, description
        Texts of the scene.
    file, digest
        Its file, and the SHA-256 of its text.
    t
        Symbol of time.
    parameters, coordinates, inputs
        Symbols of the expressions. Those of inputs may stand wherever velocities may, but beside
        them in L.
    account
        Account of degrees of freedom.
    particles, cartesian_names
        Positions and velocities over the coordinates.
    kinetic, potential
        T and V in display form; V may hold velocities (a generalized potential U).
    lagrangian, dissipation
        L = T − V, and the dissipation function.
    forces
        Non-conservative forces.
    mass_matrix
        n rows of n entries over q and t, unscaled.
    forcing
        n entries over q, v and t, unscaled.
    textbook
        Writes the textbook form, and compares it with the derived one, when it is first called.
    energy
        Σ v ∂L/∂v − L, whether conserved or not.
    cyclic
        Names of cyclic coordinates.
    conserved, facts
        Conserved quantities and other proven facts.
    certificate
        The comparison with Newton's law.
    initial
        Initial state; None if the scene gives none or a parameter lacks its value.
    simulate
        The scene's section ``simulate``.
    functions
        The scene's own functions.
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
    warnings, remarks
        Findings to be reported.
    closures
        Independent equations between the coordinates; none in minimal form.
    contacts
        One-sided constraints, whose λ is zero while the gap is open.
    outputs
        Expressions that the scene asks for, by name, over (q, v, t).
    followed
        Conserved quantities among the outputs whose drift a simulation measures; None unless they
        were asked for.
    brackets
        Poisson brackets that were asked for, None if none were.
    suggested
        Values of coordinates that could be given if ``initial`` is None.
    constraint_forces
        Constraint forces, None unless they were asked for.
    steps
        Steps of the derivation, None unless they were asked for.
    choice
        Formulation that was taken, None if there is one only.
    singular
        Configurations that the coordinates do not cover.
    positive
        Names that the scene declares positive, with their expressions over (q, t): the equations
        hold where all of these are above zero.
    chart
        Coordinates that the present ones have replaced, None if there were none.
    open_questions
        Coordinates that may be cyclic and quantities that may be conserved: neither proven nor
        refuted.
    sensitivities
        For each number by which the motion is differentiated, the parameters that change with it,
        and their derivatives. Those of the n coordinates stand behind the coordinates, n for
        each; mass matrix and forcing are of the first n alone.
    latex
        LaTeX of the scene for names beside those of parameters and coordinates: of definitions,
        components and multipliers (``lambda_rod``).
    indices
        LaTeX of the scene for the names of closures and contacts below a letter.
    units
        Units of coordinates, Cartesian names, outputs and their rates, of ``t`` and ``energy``.
    sources
        The sources of another derivation of mass matrix and forcing.
    depiction
        The sources of a picture; None with more than :data:`.depiction.MOST_BODIES` bodies.
    """

    name: str
    title: str | None
    description: str | None
    file: str
    digest: str
    t: Symbol
    parameters: tuple[Parameter, ...]
    coordinates: tuple[Coordinate, ...]
    account: Account
    particles: tuple[ParticleMotion, ...]
    cartesian_names: tuple[CartesianName, ...]
    kinetic: Expr
    potential: Expr
    lagrangian: Expr
    dissipation: Expr
    forces: tuple[BodyForce, ...]
    mass_matrix: tuple[Sequence[Expr], ...]
    forcing: tuple[Expr, ...]
    textbook: Callable[[], TextbookForm]
    energy: Expr
    cyclic: tuple[str, ...]
    conserved: tuple[Conserved, ...]
    facts: Facts
    certificate: Certificate
    initial: InitialState | None
    simulate: SimulationDefaults
    abbreviations: tuple[tuple[str, Expr], ...] = ()
    functions: tuple[DeclaredFunction, ...] = ()
    sizes: tuple[tuple[str, int], ...] = ()
    families: tuple[tuple[str, tuple[FamilyIndex, ...]], ...] = ()
    literals: tuple[tuple[Fraction, str], ...] = ()
    sums: tuple[tuple[Expr, ...], ...] = ()
    warnings: tuple[Problem, ...] = ()
    remarks: tuple[str, ...] = ()
    closures: tuple[Closure, ...] = ()
    contacts: tuple[Contact, ...] = ()
    outputs: tuple[tuple[str, Expr], ...] = ()
    followed: tuple[FollowedQuantity, ...] | None = None
    brackets: PoissonBrackets | None = None
    suggested: tuple[tuple[str, str], ...] = ()
    inputs: tuple[Input, ...] = ()
    constraint_forces: ConstraintForces | None = None
    steps: DerivationSteps | None = None
    choice: FormulationChoice | None = None
    singular: tuple[SingularConfiguration, ...] = ()
    positive: tuple[tuple[str, Expr], ...] = ()
    chart: ReplacedChart | None = None
    open_questions: tuple[str, ...] = ()
    sensitivities: tuple[Mapping[Symbol, Fraction], ...] = ()
    latex: Mapping[str, str] = field(default_factory=dict)
    indices: Mapping[str, str] = field(default_factory=dict)
    units: Units = field(default_factory=Units)
    sources: DerivationSources | None = field(default=None, compare=False, repr=False)
    depiction: Depiction | None = field(default=None, compare=False, repr=False)

    def __repr__(self) -> str:
        """Return a line: all fields would be pages of expressions."""
        names = ", ".join(c.name for c in self.coordinates)
        return f"<Equations of {self.name} in {names or 'no coordinates'}: {self.formulation} form>"

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
    def formulation(self) -> Literal["minimal", "multiplier"]:
        return "multiplier" if self.closures or self.contacts else "minimal"

    @property
    def pushing(self) -> tuple[Closure, ...]:
        """All that has a multiplier: closures, then the gaps of contacts."""
        return (*self.closures, *(c.closure for c in self.contacts))

    @property
    def multipliers(self) -> tuple[str, ...]:
        """Names of the constraints whose multipliers the equations hold."""
        return tuple(closure.name for closure in self.pushing)
