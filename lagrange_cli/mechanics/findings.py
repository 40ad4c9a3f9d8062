"""Findings about a system as frozen values: degrees of freedom, facts, forces, certificate.

Beside these that pages report are the sources from which code may derive the equations anew.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from mpmath import mpf
    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.elements.tree import BodyTree


@dataclass(frozen=True)
class ConstraintLine:
    """One constraint in the account of degrees of freedom.

    Attributes
    ----------
    name, equations
        Its name, and its equations as written.
    status
        ``independent``; ``satisfied`` (the definitions satisfy it identically); ``redundant``
        (others imply it); ``nonholonomic`` (it holds velocities and is not integrable);
        ``unilateral`` (an inequality).
    implied_by
        Names of the constraints that imply it, if it is redundant.
    rheonomic
        True if it contains t.
    restitution
        Coefficient of restitution of an inequality as written, or empty.
    on_a_part
        True if the definitions satisfy it around the start, and not everywhere.
    joint
        Kind of a joint and its parts, as in :class:`~lagrange_cli.scene.joints.Joint`; empty if
        the scene has the equations themselves.
    idle, satisfied
        Numbers of equations of a joint that others imply, and that definitions satisfy.
    """

    name: str
    equations: tuple[str, ...]
    status: Literal["independent", "satisfied", "redundant", "nonholonomic", "unilateral"] = (
        "independent"
    )
    implied_by: tuple[str, ...] = ()
    rheonomic: bool = False
    restitution: str = ""
    on_a_part: bool = False
    joint: tuple[str, ...] = ()
    idle: int = 0
    satisfied: int = 0


@dataclass(frozen=True)
class Account:
    """Account of degrees of freedom, dof = cartesian + of_bodies + extra − constraints.

    Attributes
    ----------
    cartesian
        3N, of particles.
    extra
        Number of coordinates besides positions.
    constraints
        K, the number of independent equations between positions.
    dof
        Degrees of freedom.
    implied
        Number of those among K that no constraint states: definitions or positions imply them.
    lines
        The constraints one by one.
    chosen_automatically
        True if the program chose the coordinates.
    nonholonomic
        Number of constraints that lower the freedom of velocities, but not ``dof``.
    bodies
        B, the number of rigid bodies.
    of_bodies
        6B; 3B of bodies in a plane.
    """

    cartesian: int
    extra: int
    constraints: int
    dof: int
    implied: int
    lines: tuple[ConstraintLine, ...]
    chosen_automatically: bool = False
    nonholonomic: int = 0
    bodies: int = 0
    of_bodies: int = 0

    @property
    def counted(self) -> tuple[str, ...]:
        """The numbers that particles and bodies have: ``3N = 3``, ``6B = 6``."""
        of_particles = f"3N = {self.cartesian}"
        if not self.bodies:
            return (of_particles,)
        each = self.of_bodies // self.bodies
        of_bodies = f"{each}B = {self.of_bodies}"
        return (of_particles, of_bodies) if self.cartesian else (of_bodies,)

    @property
    def unilateral(self) -> int:
        """Number of one-sided constraints."""
        return sum(line.status == "unilateral" for line in self.lines)


@dataclass(frozen=True)
class Conserved:
    """A conserved quantity.

    Attributes
    ----------
    name
        ``energy``, ``jacobi``, or the name of a momentum such as ``p_theta``.
    kind
        ``energy``: T + V; ``jacobi``: Σ v ∂L/∂v − L if that is not T + V; ``momentum`` of a cyclic
        coordinate.
    expression
        The quantity over q, v and t.
    reason
        Why it is conserved, a short phrase.
    coordinate
        Name of the cyclic coordinate, None for energies.
    parts
        The terms of the expression in the order of print: T2, −T0 and V of Jacobi's integral. Empty
        if it is one expression.
    is_energy
        True of Jacobi's integral where it is the energy all the same.
    """

    name: str
    kind: Literal["momentum", "energy", "jacobi"]
    expression: Expr
    reason: str
    coordinate: str | None = None
    parts: tuple[Expr, ...] = ()
    is_energy: bool = False


@dataclass(frozen=True)
class FollowedQuantity:
    """A conserved quantity that simulations evaluate along motions.

    Attributes
    ----------
    name
        Name of its column.
    expression
        The quantity over q, v and t.
    terms
        Its changes are compared with the sum of the sizes of these.
    """

    name: str
    expression: Expr
    terms: tuple[Expr, ...]


@dataclass(frozen=True)
class NamedQuantity:
    """A function over coordinates and momenta that has a name.

    Attributes
    ----------
    name, symbol
        Its name, and what stands for it in expressions.
    expression, over_velocities
        The function over (q, p, t), and over (q, v, t).
    """

    name: str
    symbol: Symbol
    expression: Expr
    over_velocities: Expr


@dataclass(frozen=True)
class PoissonBracket:
    """{first, second} = value.

    Attributes
    ----------
    first, second
        The functions as they were written, names of quantities as symbols.
    value
        The bracket over (q, p, t), or the name of the quantity that it is.
    rate
        The rate of the first, {first, H} + ∂first/∂t, if the second is H and no forces or
        constraints act; else None.
    conserved
        True if the rate is zero; None if that is neither proven nor refuted.
    """

    first: Expr
    second: Expr
    value: Expr
    rate: Expr | None
    conserved: bool | None


@dataclass(frozen=True)
class PoissonBrackets:
    """Poisson brackets of a request, with their certificate.

    Attributes
    ----------
    brackets
        The brackets in the order of the request.
    quantities
        Named quantities in these, H apart.
    certificate
        The comparison with numerical derivatives.
    """

    brackets: tuple[PoissonBracket, ...]
    quantities: tuple[NamedQuantity, ...]
    certificate: Certificate


@dataclass(frozen=True)
class EnergyBalance:
    """The rate of an energy that is not conserved.

    Attributes
    ----------
    kind
        ``energy``: of T + V; ``jacobi``: of Σ v ∂L/∂v − L if that is not T + V.
    rate
        Its rate over q, v, t, inputs and multipliers.
    is_dissipation
        True if the rate is −2D, with the dissipation function D.
    parts
        The terms of the energy in the order of print.
    """

    kind: Literal["energy", "jacobi"]
    rate: Expr
    is_dissipation: bool
    parts: tuple[Expr, ...] = ()


@dataclass(frozen=True)
class Facts:
    """Structure facts. All booleans are proven; False means "not shown".

    Attributes
    ----------
    constant_mass_matrix, diagonal_mass_matrix
        Properties of M.
    separable
        The Hamiltonian is T(p) + V(q), without closures.
    autonomous
        Nothing depends on t.
    rheonomic
        A position or constraint depends on t explicitly.
    planar
        All particles move in one coordinate plane, or in planes parallel to it.
    positive_definite_mass_matrix
        M is positive definite.
    unused_parameters
        Names of parameters that nothing depends on.
    separable_on_closures
        As ``separable``, but with closures, if any, of positions alone.
    """

    constant_mass_matrix: bool
    diagonal_mass_matrix: bool
    separable: bool
    autonomous: bool
    rheonomic: bool
    planar: bool
    positive_definite_mass_matrix: bool
    unused_parameters: tuple[str, ...] = ()
    separable_on_closures: bool = False


@dataclass(frozen=True)
class Certificate:
    """The comparison of the derivation with Newton's law.

    Attributes
    ----------
    points
        Number of random states.
    digits
        Decimal digits that had to agree.
    mismatch
        Largest relative mismatch.
    """

    points: int
    digits: int
    mismatch: float


@dataclass(frozen=True)
class FormulationChoice:
    """The choice between two formulations.

    Attributes
    ----------
    minimal, multiplier
        Operations predicted for one right-hand side in each.
    why
        A short phrase, or empty.
    """

    formulation: Literal["minimal", "multiplier"]
    minimal: int
    multiplier: int
    why: str = ""


@dataclass(frozen=True)
class SingularConfiguration:
    """Zero set of a factor of det M, at which coordinates lose their meaning.

    Attributes
    ----------
    coordinates
        Names of the coordinates whose rates M does not determine there.
    where
        Expression over q and parameters that is zero there.
    infinite
        True at a pole of det M, where the coordinates end.
    """

    coordinates: tuple[str, ...]
    where: Expr
    infinite: bool = False


@dataclass(frozen=True)
class BodyReaction:
    """The constraint force f = m r̈ − F on a particle, or on a point that a force pulls at.

    Attributes
    ----------
    name
        Name of the particle or point.
    components
        f along x, y, z, over q, v, t or as :attr:`ConstraintForces.form` says.
    size
        f along its direction, of either sign; None if there is no short form.
    """

    name: str
    components: tuple[Expr, Expr, Expr]
    size: Expr | None = None


@dataclass(frozen=True)
class Reaction:
    """The multiplier λ of one equation φ = 0 of the scene, which exerts λ ∇φ.

    Attributes
    ----------
    name
        Name of the constraint.
    text
        φ = 0 as the scene writes it.
    multiplier
        λ.
    sizes
        λ |∇φ| for each body whose Cartesian names φ holds.
    role
        Part of a joint's reaction that λ is, as in :meth:`~lagrange_cli.scene.joints.Joint.role`;
        empty if the scene has the equations themselves.
    """

    name: str
    text: str
    multiplier: Expr
    sizes: tuple[tuple[str, Expr], ...]
    role: tuple[str, ...] = ()


@dataclass(frozen=True)
class ConstraintForces:
    """Constraint forces on bodies, and the multipliers of the scene's equations.

    Attributes
    ----------
    bodies
        Forces on particles and points.
    reactions
        Multipliers of equations.
    form
        Symbols of the expressions: ``motion`` q, v and t alone; ``accelerations`` ``ddot(q)``
        too; ``multipliers`` those of the closures (and accelerations if no multiplier alone
        gives a force).
    open
        Constraints whose multipliers are not determined or have no short form.
    included
        Terms of the scene that are written in coordinates, so that they act on no particle: the
        constraints pass them on.
    shared
        Particles and points of which several pass these on, or of which not all forces are known:
        their forces are not unique.
    weightless
        Particles without weight in a scene that gives it to others.
    """

    bodies: tuple[BodyReaction, ...]
    reactions: tuple[Reaction, ...]
    form: Literal["motion", "accelerations", "multipliers"]
    open: tuple[str, ...] = ()
    included: tuple[str, ...] = ()
    shared: tuple[str, ...] = ()
    weightless: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class DerivationSources:
    """The sources of the equations of motion beside positions and forces, for another derivation.

    Attributes
    ----------
    other_lagrangian
        The Lagrangian without ½ m ṙ² of the particles.
    forcing
        The forcing that was derived from this; equations with another one are not of these sources.
    collected_terms
        Number of terms of mass matrix and forcing; None if sums were left factored.
    state, residuals
        A state of the certificate, symbol → value with its digits, multipliers included, and
        M q̈ − f − Σ λ·gradient there, each with the size of its terms.
    energy, energy_value
        The energy function that is shown, which the certificate compared with Σ q̇ ∂L/∂q̇ − L, and
        the value of that there.
    tree
        Frames over which M and f follow by recursion, which shares more than another derivation.
    """

    other_lagrangian: Expr
    forcing: tuple[Expr, ...]
    collected_terms: int | None
    state: Mapping[Symbol, mpf]
    residuals: tuple[tuple[mpf, mpf], ...]
    energy: Expr
    energy_value: mpf
    tree: BodyTree | None = None
