"""Phrases and labels of equations of motion that the terminal, documents and JSON share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.mechanics.algebra.shorten import divided_termwise
from lagrange_cli.notation.labels import names_shown
from lagrange_cli.notation.vocabulary import MOST_OPERATIONS
from lagrange_cli.report.phrases.language import ENGLISH, Language

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.analysis.symmetries.conserved_quantities import EnergyLoss, EnergySum
    from lagrange_cli.files import Recording
    from lagrange_cli.mechanics.dynamics.accelerations import ExplicitForm
    from lagrange_cli.mechanics.equations import Equations, ShownEquation
    from lagrange_cli.mechanics.findings import (
        Certificate,
        Conserved,
        ConstraintLine,
        EnergyBalance,
    )
    from lagrange_cli.mechanics.system import CartesianName

#: Letters of the account of degrees of freedom.
_COUNTED = {"N", "K", "DOF"}


def counting(equations: Equations, say: Language = ENGLISH) -> list[str]:
    """Say what is counted: ``3N = 6``, ``1 further coordinate``, ``K = 4``, ``DOF = 3``.

    In words alone where the scene gives one of the letters another meaning; coordinates alone
    where there are neither particles nor constraints.
    """
    account = equations.derivation.account
    cartesian = f"3N = {account.cartesian}"
    constraints = f"K = {account.constraints}"
    dof = f"{say('DOF')} = {account.dof}"
    if _COUNTED & names_shown(equations):
        one, many = "{count} Cartesian coordinate", "{count} Cartesian coordinates"
        cartesian = say.counted(account.cartesian, one, many)
        one, many = "{count} independent constraint", "{count} independent constraints"
        constraints = say.counted(account.constraints, one, many)
        one, many = "{count} degree of freedom", "{count} degrees of freedom"
        dof = say.counted(account.dof, one, many)
    elif account.extra and not any(
        (account.cartesian, account.constraints, account.nonholonomic, account.unilateral)
    ):
        free = say.counted(account.dof, "{count} coordinate", "{count} coordinates")
        return [f"{say('DOF')} = {free}", say("no particles")]
    one, many = "{count} further coordinate", "{count} further coordinates"
    further = say.counted(account.extra, one, many)
    one, many = "{count} nonholonomic constraint", "{count} nonholonomic constraints"
    nonholonomic = say.counted(account.nonholonomic, one, many)
    one, many = "{count} one-sided constraint", "{count} one-sided constraints"
    unilateral = say.counted(account.unilateral, one, many)
    return [
        cartesian,
        *([further] if account.extra else ()),
        constraints,
        dof,
        *([nonholonomic] if account.nonholonomic else ()),
        *([unilateral] if account.unilateral else ()),
    ]


def multipliers_line(equations: Equations, say: Language = ENGLISH) -> str:
    """Explain the multipliers; empty if there are none."""
    kinds = {closure.kind for closure in equations.system.closures}
    if not kinds:
        return ""
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


def explicit_line(equations: Equations, explicit: ExplicitForm, say: Language = ENGLISH) -> str:
    """Say what the explicit form is solved for, and what it does not determine."""
    solved = [value is not None for value in explicit.accelerations]
    if not any(solved):
        sentence = say("Not solved for the accelerations, as a linear system")
    elif any(explicit.multipliers):
        sentence = say("Solved for the accelerations and multipliers")
    else:
        sentence = say("Solved for the accelerations")
    if any(solved) and not all(solved):
        sentence += say(" where few are coupled, the others as a linear system")
    if None in explicit.multipliers:
        sentence += say(" with the closure equations, differentiated")
    return (
        sentence + say("; contacts determine their multipliers")
        if equations.system.contacts
        else sentence
    )


def contacts_lines(equations: Equations, say: Language = ENGLISH) -> tuple[str, ...]:
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


def choice_line(equations: Equations, say: Language = ENGLISH) -> str:
    """Say which formulation was taken and why; empty if there was no choice to explain."""
    choice = equations.derivation.choice
    if choice is None or not choice.why:
        return ""
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


def remark_on(line: ConstraintLine, say: Language = ENGLISH, *, classified: bool = False) -> str:
    """Describe the status of a constraint, with its kind if ``classified``."""
    remarks = []
    part = say(" on a part of the configurations") if line.on_a_part else ""
    if line.status == "satisfied":
        remarks.append(say("satisfied by the definitions") + part)
    elif line.status == "redundant":
        others = ", ".join(line.implied_by)
        implied = say("redundant, implied by {listed}", listed=others) + part
        remarks.append(implied if others else say("redundant"))
    if classified:
        remarks.append(_kind(line, say))
    if line.status == "unilateral" and line.restitution:
        remarks.append(say("restitution {value}", value=line.restitution))
    return "; ".join(remarks)


def _kind(line: ConstraintLine, say: Language) -> str:
    """Class of a constraint by what it restricts, and by t."""
    restricts = {"nonholonomic": say("nonholonomic"), "unilateral": say("one-sided")}
    time = say("rheonomic") if line.rheonomic else say("scleronomic")
    return f"{restricts.get(line.status) or say('holonomic')}, {time}"


def implied_kind(equations: Equations, say: Language) -> str:
    """Class of the constraints that the positions imply, as far as it is known."""
    if not equations.derivation.facts.rheonomic:
        return f"{say('holonomic')}, {say('scleronomic')}"
    is_stated = any(line.rheonomic for line in equations.derivation.account.lines)
    return say("holonomic") if is_stated else f"{say('holonomic')}, {say('rheonomic')}"


def common_kind(equations: Equations, say: Language = ENGLISH) -> str:
    """``holonomic, scleronomic`` where all of several constraints are so; else empty."""
    account = equations.derivation.account
    kinds = [_kind(line, say) for line in account.lines]
    kinds += [implied_kind(equations, say)] if account.implied else []
    return kinds[0] if len(kinds) > 1 and len(set(kinds)) == 1 else ""


def implied_line(equations: Equations, say: Language = ENGLISH) -> str:
    """Count the constraints that the positions imply and the scene does not state, or return ""."""
    account = equations.derivation.account
    if not account.implied:
        return ""
    counted = say.counted(
        account.implied,
        "{count} constraint built into the positions",
        "{count} constraints built into the positions",
    )
    if common_kind(equations):
        return counted
    return f"{counted}; {implied_kind(equations, say)}"


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


def none_conserved_line(equations: Equations, say: Language) -> str:
    """Say that neither a cyclic momentum nor the energy is conserved; undecided ones are apart."""
    if undecided(equations):
        return f"{say('none')} {say('among cyclic momenta and energy')}"
    return say("No cyclic momentum is conserved, and neither is the energy.")


def undecided(equations: Equations) -> list[str]:
    """List the momenta and energies of which it is not known whether they are conserved."""
    symbols = {f"p_{c.name}" for c in equations.system.coordinates} | {"energy"}
    return [name for name in equations.derivation.open_questions if name in symbols]


def only_between_impacts(equations: Equations) -> bool:
    """Say whether an energy is kept between impacts only, which take a part of it."""
    return any(contact.restitution != 1 for contact in equations.system.contacts)


def conserved_reason(
    equations: Equations, quantity: Conserved, subject: str, time: str, say: Language = ENGLISH
) -> str:
    """Say why a quantity is conserved; ``subject``: the cyclic coordinate or L, as printed."""
    if quantity.kind == "momentum":
        return say("{name} is cyclic", name=subject)
    if only_between_impacts(equations):
        return say(
            "{lagrangian} does not depend on {time} (between impacts)",
            lagrangian=subject,
            time=time,
        )
    return say("{lagrangian} does not depend on {time}", lagrangian=subject, time=time)


def recorded_line(recording: Recording, say: Language = ENGLISH) -> str:
    """Tell column, file and interpolation of a recorded input."""
    named = {"column": recording.column, "file": recording.file}
    if recording.interpolation == "linear":
        return say("column {column} of {file}, linear between rows", **named)
    if recording.interpolation == "cubic":
        return say("column {column} of {file}, a cubic spline through the rows", **named)
    return say("column {column} of {file}, each row until the next", **named)


def energy_is_sum(equations: Equations, quantity: Conserved | EnergyBalance) -> bool:
    """Say whether an energy is T + V with the V that is shown."""
    return quantity.kind == "energy" and not is_generalized_potential(equations)


def energy_letter(quantity: Conserved) -> str:
    """Give the letter of an energy or Jacobi integral."""
    return "E" if quantity.kind == "energy" or quantity.is_energy else "h"


def without_line(equations: Equations, letter: str = "t", say: Language = ENGLISH) -> str:
    """Say what is left out of L, empty if nothing is; ``letter`` stands for time."""
    short = equations.derivation.short_lagrangian
    if short is None:
        return ""
    parameters = {p.symbol for p in equations.system.parameters}
    is_constant = [term.free_symbols <= parameters for term in short.left_out.as_ordered_terms()]
    if all(is_constant):
        return say("without constants")
    if any(is_constant):
        return say("without constants and functions of {time} alone", time=letter)
    return say("without functions of {time} alone", time=letter)


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


def certificate_line(certificate: Certificate, say: Language = ENGLISH) -> str:
    """``Certified at 8 random states to 30 digits, largest mismatch 3e-31``."""
    return say.counted(
        certificate.points,
        "Certified at {count} random state to {digits} digits, largest mismatch {mismatch}",
        "Certified at {count} random states to {digits} digits, largest mismatch {mismatch}",
        digits=certificate.digits,
        mismatch=f"{certificate.mismatch:.0e}" if certificate.mismatch else "0",
    )


def loss_line(
    loss: EnergyLoss, lagrangian: str, time: str, say: Language, words: Callable[[str], str]
) -> str:
    """Say why an energy is not conserved: ``L depends on t; friction takes energy``.

    Parameters
    ----------
    loss
        What was found.
    lagrangian, time
        L and t within a sentence.
    say
        The language.
    words
        Writes names of the scene within a sentence.
    """
    return "; ".join(_reasons(loss, lagrangian, time, say, words))


def _reasons(
    loss: EnergyLoss, lagrangian: str, time: str, say: Language, words: Callable[[str], str]
) -> Iterator[str]:
    if loss.depends_on_time:
        yield say("{lagrangian} depends on {time}", lagrangian=lagrangian, time=time)
    for name in loss.inputs:
        yield say("{lagrangian} holds the input {name}", lagrangian=lagrangian, name=words(name))
    if loss.friction:
        yield say("friction takes energy")
    for name in loss.forces:
        yield say("the force {name} does work", name=words(name))
    for name in loss.moving:
        yield say("the constraint {name} moves", name=words(name))


def sum_line(equations: Equations, energy: EnergySum, say: Language) -> str:
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


def operations_told(count: int, say: Language) -> str:
    """``(27,909 operations)``, in place of an expression."""
    return say("({count} operations)", count=say.number(count))


def omission_told(option: str, say: Language) -> str:
    """A sentence for a page that leaves out expressions; ``option`` of a command prints them."""
    return say(
        "Expressions of more than {most} operations are left out; {option} prints them.",
        most=say.number(MOST_OPERATIONS),
        option=option,
    )
