"""Sentences and facts on equations of motion that reports of all formats share."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.mechanics.algebra.shorten import divided_termwise
from lagrange_cli.notation.labels import names_shown
from lagrange_cli.notation.vocabulary import MOST_OPERATIONS
from lagrange_cli.report.contents.joints import joint_remarks
from lagrange_cli.report.inlines import (
    Chain,
    Count,
    Inline,
    Label,
    Listed,
    Plain,
    Typed,
    Written,
    rounded,
    say,
    symbol,
    upright,
)

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.analysis.symmetries.conserved_quantities import EnergyLoss, EnergySum
    from lagrange_cli.files import Recording, Table
    from lagrange_cli.mechanics.dynamics.accelerations import ExplicitForm
    from lagrange_cli.mechanics.equations import Equations, ShownEquation
    from lagrange_cli.mechanics.findings import (
        Certificate,
        Conserved,
        ConstraintLine,
        EnergyBalance,
    )
    from lagrange_cli.mechanics.system import CartesianName, Closure

#: Letters of the account of degrees of freedom.
_COUNTED = {"N", "K", "DOF"}

#: Time within a sentence.
TIME = Inline(symbol("t"))


def counting(equations: Equations) -> list[Written]:
    """Say what is counted: ``3N = 6``, ``1 further coordinate``, ``K = 4``, ``DOF = 3``.

    Bodies count ``6B``, or ``3B`` in a plane. In words alone where the scene gives one of the
    letters another meaning; coordinates alone where there are neither particles nor constraints.
    Formulas are labels.
    """
    account = equations.derivation.account
    counted: list[Written] = [Chain((text,)) for text in account.counted]
    constraints: Written = Chain((f"K = {account.constraints}",))
    dof: Written = upright(say("DOF")) + f" = {account.dof}"
    if (_COUNTED | ({"B"} if account.bodies else set())) & names_shown(equations):
        one, many = "{count} Cartesian coordinate", "{count} Cartesian coordinates"
        counted = [say.counted(account.cartesian, one, many)]
        if account.bodies:
            one, many = "{count} coordinate of bodies", "{count} coordinates of bodies"
            of_bodies = say.counted(account.of_bodies, one, many)
            counted = [*(counted if account.cartesian else ()), of_bodies]
        one, many = "{count} independent constraint", "{count} independent constraints"
        constraints = say.counted(account.constraints, one, many)
        one, many = "{count} degree of freedom", "{count} degrees of freedom"
        dof = say.counted(account.dof, one, many)
    elif account.extra and not any(
        (
            account.cartesian,
            account.bodies,
            account.constraints,
            account.nonholonomic,
            account.unilateral,
        )
    ):
        free = say.counted(account.dof, "{count} coordinate", "{count} coordinates")
        return [upright(say("DOF")) + " = " + upright(free), say("no particles")]
    one, many = "{count} further coordinate", "{count} further coordinates"
    further = say.counted(account.extra, one, many)
    one, many = "{count} nonholonomic constraint", "{count} nonholonomic constraints"
    nonholonomic = say.counted(account.nonholonomic, one, many)
    one, many = "{count} one-sided constraint", "{count} one-sided constraints"
    unilateral = say.counted(account.unilateral, one, many)
    return [
        *counted,
        *([further] if account.extra else ()),
        constraints,
        dof,
        *([nonholonomic] if account.nonholonomic else ()),
        *([unilateral] if account.unilateral else ()),
    ]


def multipliers_line(
    equations: Equations, pushing: Sequence[Closure] | None = None
) -> Written | None:
    """Explain the multipliers, of ``pushing`` alone if that is given; None if there are none."""
    closures = [c for c in equations.system.closures if pushing is None or c in pushing]
    kinds = {closure.kind for closure in closures}
    if not kinds:
        return None
    lengths = names_of_lengths(equations) & {closure.name for closure in closures}
    if lengths >= {closure.name for closure in closures}:
        return say("The multiplier keeps a quaternion at length 1, and is no force")
    explained = _explained_by_gradients(kinds)
    if not lengths:
        return explained
    excepted = say("that of {listed} is no force", listed=names(lengths))
    return Listed((explained, excepted), between="; ")


def names_of_lengths(equations: Equations) -> set[str]:
    """Return the names of the closures that keep quaternions at length 1."""
    lines = equations.derivation.account.lines
    return {line.name for line in lines if line.joint[:1] == ("unit",)}


def _explained_by_gradients(kinds: Collection[str]) -> Written:
    """Say what a multiplier is of closures between positions, between velocities, or of both."""
    if kinds == {"position"}:
        return say(
            "The multiplier times the gradient of the left side is the force that the constraint"
            " exerts"
        )
    if kinds == {"velocity"}:
        return say(
            "The multiplier times the gradient of the left side by the velocities is the force"
            " that the constraint exerts"
        )
    return say(
        "The multiplier times the gradient of the left side (by the velocities where it holds"
        " them) is the force that the constraint exerts"
    )


def explicit_line(equations: Equations, explicit: ExplicitForm) -> Written:
    """Say what the explicit form is solved for, and what it does not determine."""
    solved = [value is not None for value in explicit.accelerations]
    parts: list[Written] = []
    if not any(solved):
        parts.append(say("Not solved for the accelerations, as a linear system"))
    elif any(explicit.multipliers):
        parts.append(say("Solved for the accelerations and multipliers"))
    else:
        parts.append(say("Solved for the accelerations"))
    if any(solved) and not all(solved):
        parts.append(say(" where few are coupled, the others as a linear system"))
    if None in explicit.multipliers:
        parts.append(say(" with the closure equations, differentiated"))
    if equations.system.contacts:
        parts.append(say("; contacts determine their multipliers"))
    return Listed(tuple(parts), between="")


def contacts_lines(equations: Equations) -> tuple[Written, ...]:
    """Explain contacts, their multipliers and impacts; empty if there are no contacts."""
    if not equations.system.contacts:
        return ()
    return (
        say(
            "Where a gap is 0 its multiplier is at least 0, and times the gradient of the gap it is"
            " the force of the contact; where a gap is open its multiplier is 0"
        ),
        say("A gap that closes opens again with the speed of its closing times its restitution"),
    )


def choice_line(equations: Equations) -> Written | None:
    """Say which formulation was taken and why; None if there was no choice to explain."""
    choice = equations.derivation.choice
    if choice is None or not choice.why:
        return None
    why = {
        "as asked": say("as asked"),
        "fewer operations": say("fewer operations"),
        "the coordinates are declared": say("the coordinates are declared"),
    }[choice.why]
    taken = f"{choice.minimal:,}", f"{choice.multiplier:,}"
    if choice.formulation == "minimal":
        return say(
            "minimal ({why}): {minimal} operations predicted for a right-hand side beside"
            " {multiplier} of multiplier",
            why=why,
            minimal=taken[0],
            multiplier=taken[1],
        )
    return say(
        "multiplier ({why}): {multiplier} operations predicted for a right-hand side beside"
        " {minimal} of minimal",
        why=why,
        minimal=taken[0],
        multiplier=taken[1],
    )


def remark_on(line: ConstraintLine, *, classified: bool = False) -> Written | None:
    """Describe the status of a constraint, with its kind if ``classified``; None if usual."""
    remarks: list[Written] = []
    part = [say(" on a part of the configurations")] if line.on_a_part else []
    if line.status == "satisfied":
        remarks.append(Listed((say("satisfied by the definitions"), *part), between=""))
    elif line.status == "redundant" and line.implied_by:
        implied = say("redundant, implied by {listed}", listed=names(line.implied_by))
        remarks.append(Listed((implied, *part), between=""))
    elif line.status == "redundant":
        remarks.append(say("redundant"))
    elif line.joint:
        remarks += joint_remarks(line)
    if classified:
        remarks.append(_kind(line))
    if line.status == "unilateral" and line.restitution:
        remarks.append(say("restitution {value}", value=Plain(line.restitution)))
    return Listed(tuple(remarks), between="; ") if remarks else None


def names(listed: Iterable[str]) -> Listed:
    """Return names of the scene with commas between them."""
    return Listed(tuple(map(Plain, listed)))


def _kind(line: ConstraintLine) -> Written:
    """Class of a constraint by what it restricts, and by t."""
    restricts = {"nonholonomic": say("nonholonomic"), "unilateral": say("one-sided")}
    time = say("rheonomic") if line.rheonomic else say("scleronomic")
    return Listed((restricts.get(line.status) or say("holonomic"), time))


def implied_kind(equations: Equations) -> Written:
    """Class of the constraints that the positions imply, as far as it is known."""
    if not equations.derivation.facts.rheonomic:
        return Listed((say("holonomic"), say("scleronomic")))
    is_stated = any(line.rheonomic for line in equations.derivation.account.lines)
    return Listed((say("holonomic"), *(() if is_stated else (say("rheonomic"),))))


def common_kind(equations: Equations) -> Written | None:
    """``holonomic, scleronomic`` where all of several constraints are so; else None."""
    account = equations.derivation.account
    kinds = [_kind(line) for line in account.lines]
    kinds += [implied_kind(equations)] if account.implied else []
    return kinds[0] if len(kinds) > 1 and len(set(kinds)) == 1 else None


def implied_line(equations: Equations) -> Written | None:
    """Count the constraints that the positions imply and the scene does not state, if any."""
    account = equations.derivation.account
    if not account.implied:
        return None
    counted = say.counted(
        account.implied,
        "{count} constraint built into the positions",
        "{count} constraints built into the positions",
    )
    if common_kind(equations):
        return counted
    return Listed((counted, implied_kind(equations)), between="; ")


def telling_definitions(equations: Equations) -> list[CartesianName]:
    """Return Cartesian names, as they print, that are neither 0 nor a coordinate of that name."""
    q = {c.name: c.q for c in equations.system.coordinates}
    constants = [p.symbol for p in equations.system.parameters]
    return [
        replace(c, position=divided_termwise(c.position, constants))
        for c in equations.system.cartesian_names
        if c.position != 0 and q.get(c.name) != c.position
    ]


def is_generalized_potential(equations: Equations) -> bool:
    """Say whether the potential depends on velocities."""
    return not equations.system.potential.free_symbols.isdisjoint(
        c.v for c in equations.system.coordinates
    )


def none_conserved_line(equations: Equations) -> Written:
    """Say that neither a cyclic momentum nor the energy is conserved; undecided ones are apart."""
    if undecided(equations):
        return Listed((say("none"), say("among cyclic momenta and energy")), between=" ")
    return say("No cyclic momentum is conserved, and neither is the energy.")


def undecided(equations: Equations) -> list[str]:
    """List the momenta and energies of which it is not known whether they are conserved."""
    symbols = {f"p_{c.name}" for c in equations.system.coordinates} | {"energy"}
    return [name for name in equations.derivation.open_questions if name in symbols]


def only_between_impacts(equations: Equations) -> bool:
    """Say whether an energy is kept between impacts only, which take a part of it."""
    return any(contact.restitution != 1 for contact in equations.system.contacts)


def conserved_reason(equations: Equations, quantity: Conserved, subject: Label) -> Written:
    """Say why a quantity is conserved; ``subject``: the cyclic coordinate or L."""
    name = Inline(subject)
    if quantity.kind == "momentum":
        return say("{name} is cyclic", name=name)
    if only_between_impacts(equations):
        phrase = "{lagrangian} does not depend on {time} (between impacts)"
        return say(phrase, lagrangian=name, time=TIME)
    return say("{lagrangian} does not depend on {time}", lagrangian=name, time=TIME)


def recorded_line(recording: Recording) -> Written:
    """Tell column, file and interpolation of a recorded input."""
    named = {"column": Plain(recording.column), "file": Plain(recording.file)}
    if recording.interpolation == "linear":
        return say("column {column} of {file}, linear between rows", **named)
    if recording.interpolation == "cubic":
        return say("column {column} of {file}, a cubic spline through the rows", **named)
    return say("column {column} of {file}, each row until the next", **named)


def table_line(table: Table) -> Written:
    """Tell column, file and interpolation of a table, and what holds beyond it."""
    named = {"column": Plain(table.source.column), "file": Plain(table.source.file)}
    if table.interpolation == "linear":
        text = say("column {column} of {file}, linear between rows", **named)
    elif table.interpolation == "cubic":
        text = say("column {column} of {file}, a cubic spline through the rows", **named)
    else:
        text = say("column {column} of {file}, monotone cubics between rows", **named)
    if table.outside == "hold":
        return say("{text}; beyond it, the outermost values", text=text)
    if table.outside == "extend":
        return say("{text}; beyond it, straight lines", text=text)
    return say("{text}; the equations hold within it", text=text)


def energy_is_sum(equations: Equations, quantity: Conserved | EnergyBalance) -> bool:
    """Say whether an energy is T + V with the V that is shown."""
    return quantity.kind == "energy" and not is_generalized_potential(equations)


def energy_letter(quantity: Conserved) -> str:
    """Give the letter of an energy or Jacobi integral."""
    return "E" if quantity.kind == "energy" or quantity.is_energy else "h"


def without_line(equations: Equations) -> Written | None:
    """Say what is left out of L, None if nothing is."""
    short = equations.derivation.short_lagrangian
    if short is None:
        return None
    parameters = {p.symbol for p in equations.system.parameters}
    is_constant = [term.free_symbols <= parameters for term in short.left_out.as_ordered_terms()]
    if all(is_constant):
        return say("without constants")
    if any(is_constant):
        return say("without constants and functions of {time} alone", time=TIME)
    return say("without functions of {time} alone", time=TIME)


def divisor_and_factor(shown: ShownEquation) -> tuple[Expr | None, Expr | None]:
    """Give what an equation was divided by, or what it was multiplied by; neither for a sign.

    To be rid of fractions is to multiply.
    """
    if shown.divided_by in (1, -1):
        return None, None
    number, product = shown.divided_by.as_coeff_Mul(rational=True)
    above, _ = product.as_numer_denom()
    is_multiplied = number.q > 1 or (above == 1 and product != 1)
    return (None, 1 / shown.divided_by) if is_multiplied else (shown.divided_by, None)


def certificate_line(certificate: Certificate) -> Written:
    """``Certified at 8 random states to 30 digits, largest mismatch 3e-31``."""
    return say.counted(
        certificate.points,
        "Certified at {count} random state to {digits} digits, largest mismatch {mismatch}",
        "Certified at {count} random states to {digits} digits, largest mismatch {mismatch}",
        digits=certificate.digits,
        mismatch=Inline(rounded(certificate.mismatch)),
    )


def loss_line(loss: EnergyLoss, lagrangian: Label) -> Written:
    """Say why an energy is not conserved: ``L depends on t; friction takes energy``.

    ``lagrangian`` is the label of L.
    """
    return Listed(tuple(_reasons(loss, Inline(lagrangian))), between="; ")


def _reasons(loss: EnergyLoss, lagrangian: Inline) -> Iterator[Written]:
    if loss.depends_on_time:
        yield say("{lagrangian} depends on {time}", lagrangian=lagrangian, time=TIME)
    for name in loss.inputs:
        yield say("{lagrangian} holds the input {name}", lagrangian=lagrangian, name=Plain(name))
    for name in loss.states:
        yield say("{lagrangian} holds the state {name}", lagrangian=lagrangian, name=Plain(name))
    if loss.friction:
        yield say("friction takes energy")
    if len(loss.forces) == 1:
        yield say("the force {name} does work", name=Plain(loss.forces[0]))
    elif loss.forces:
        yield say("the forces {names} do work", names=names(loss.forces))
    for name in loss.moving:
        yield say("the constraint {name} moves", name=Plain(name))


def sum_line(equations: Equations, energy: EnergySum) -> Written:
    """Say whether T + V is conserved beside, or in place of, Jacobi's integral.

    If it is not, the constraints of the scene that depend on time do work, or a motion that the
    positions prescribe: of a constraint built into them, or of their axes.
    """
    if energy.conserved is None:
        return say("not decided whether this is conserved")
    if energy.conserved:
        return say("conserved too") if energy.with_jacobi else say("conserved")
    moving = sum(line.rheonomic for line in equations.derivation.account.lines)
    if moving:
        return say.counted(
            moving,
            "not conserved: the moving constraint does work",
            "not conserved: the moving constraints do work",
        )
    return say("not conserved: the prescribed motion does work")


def operations_told(count: int) -> Written:
    """``(27,909 operations)``, in place of an expression."""
    return say("({count} operations)", count=Count(count))


def omission_told(option: str = "--written-out") -> Written:
    """A sentence for a page that leaves out expressions; ``option`` of a command prints them."""
    return say(
        "Expressions of more than {most} operations are left out; {option} prints them.",
        most=Count(MOST_OPERATIONS),
        option=Typed(option),
    )
