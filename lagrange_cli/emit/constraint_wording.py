"""Wording that the terminal, LaTeX and other reports share."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.mechanics.equations import tagged
from lagrange_cli.notation.symbols import multiplier_name

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.dynamics.accelerations import ExplicitForm
    from lagrange_cli.mechanics.equations import CartesianName, Equations, ShownEquation
    from lagrange_cli.mechanics.findings import (
        Account,
        Certificate,
        Conserved,
        ConstraintLine,
        EnergyBalance,
    )

#: Letters of quantities → their labels if the scene uses the letter.
_LABELS = {"T": "T_kin", "V": "V_pot", "U": "U_pot", "L": "Lagrangian", "D": "D_diss", "E": "E_tot"}
_LABELS |= {"h": "h_Jac", "M": "M_mass", "f": "f_gen"}
#: Letters of the account of degrees of freedom.
_COUNTED = {"N", "K", "DOF"}


def quantity_labels(equations: Equations) -> dict[str, str]:
    """Return ``T, V, U, L, D, E, h, M, f`` → labels that differ from all names of the scene."""
    taken = _names(equations)
    return {short: long if short in taken else short for short, long in _LABELS.items()}


def multiplier_label(equations: Equations, constraint: str) -> str:
    """Name the multiplier of a constraint; underscores tell it from a scene's ``lambda_NAME``."""
    taken = _names(equations)
    while f"lambda_{constraint}" in taken:
        constraint = tagged(constraint, "_")
    return multiplier_name(constraint)


def free_letter(equations: Equations, letters: tuple[str, ...]) -> str:
    """Return the first of some letters that no name of the scene is, alone or with a word below.

    If all of them are, the last one.
    """
    taken = {name.split("_")[0] for name in _names(equations)}
    return next((letter for letter in letters if letter not in taken), letters[-1])


def _names(equations: Equations) -> set[str]:
    names = {p.name for p in equations.parameters}
    names |= {c.name for c in equations.coordinates}
    names |= {c.name for c in equations.cartesian_names}
    names |= {name for name, _ in (*equations.abbreviations, *equations.outputs)}
    # Those that are given stand in their place, and are not printed.
    names |= {function.name for function in equations.functions if function.expression is None}
    return names | {source.name for source in equations.inputs}


def counting(equations: Equations) -> list[str]:
    """Say what is counted: ``3N = 6``, ``1 further coordinate``, ``K = 4``, ``DOF = 3``.

    In words alone where the scene gives one of the letters another meaning.
    """
    account = equations.account
    numbers = account.cartesian, account.constraints, account.dof
    letters = [f"{x} = {n}" for x, n in zip(("3N", "K", "DOF"), numbers, strict=True)]
    if _COUNTED & _names(equations):
        nouns = ("Cartesian coordinate", "independent constraint", "degree")
        letters = [_counted(n, noun) for n, noun in zip(numbers, nouns, strict=True)]
        letters[2] += " of freedom"
    cartesian, constraints, dof = letters
    further = _counted(account.extra, "further coordinate")
    nonholonomic = _counted(account.nonholonomic, "nonholonomic constraint")
    unilateral = _counted(account.unilateral, "one-sided constraint")
    return [
        cartesian,
        *([further] if account.extra else ()),
        constraints,
        dof,
        *([nonholonomic] if account.nonholonomic else ()),
        *([unilateral] if account.unilateral else ()),
    ]


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" + "s" * (number != 1)


def multipliers_line(equations: Equations) -> str:
    """Explain the multipliers; empty if there are none."""
    if not equations.closures:
        return ""
    by = {
        frozenset({"position"}): "",
        frozenset({"velocity"}): " by the velocities",
        frozenset({"position", "velocity"}): " (by the velocities where it holds them)",
    }[frozenset(closure.kind for closure in equations.closures)]
    return (
        f"The multiplier times the gradient of the left side{by} is the force that the "
        "constraint exerts"
    )


def explicit_line(equations: Equations, explicit: ExplicitForm) -> str:
    """Say what the explicit form is solved for, and what it does not determine."""
    solved = [value is not None for value in explicit.accelerations]
    what = "accelerations and multipliers" if any(explicit.multipliers) else "accelerations"
    told = f"Solved for the {what}"
    if not any(solved):
        told = "Not solved for the accelerations, as a linear system"
    elif not all(solved):
        told += " where few are coupled, the others as a linear system"
    if None in explicit.multipliers:
        told += " with the closure equations, differentiated"
    return f"{told}; contacts determine their multipliers" if equations.contacts else told


def contacts_lines(equations: Equations) -> tuple[str, ...]:
    """Explain contacts, their multipliers and impacts; empty if there are no contacts."""
    if not equations.contacts:
        return ()
    return (
        "Where a gap is 0 its multiplier is at least 0, and times the gradient of the gap it is"
        " the force of the contact; where a gap is open its multiplier is 0",
        "A gap that closes opens again with the speed of its closing times its restitution",
    )


def choice_line(equations: Equations) -> str:
    """Say which formulation was taken and why; empty if there was no choice to explain."""
    choice = equations.choice
    if choice is None or not choice.why:
        return ""
    alternative = "multiplier" if choice.formulation == "minimal" else "minimal"
    counts = {"minimal": choice.minimal, "multiplier": choice.multiplier}
    return (
        f"{choice.formulation} ({choice.why}): {counts[choice.formulation]:,} operations predicted"
        f" for a right-hand side beside {counts[alternative]:,} of {alternative}"
    )


def remark_on(line: ConstraintLine) -> str:
    """Describe the status of a constraint; empty for an ordinary one."""
    remarks = []
    part = " on a part of the configurations" if line.on_a_part else ""
    if line.status == "satisfied":
        remarks.append(f"satisfied by the definitions{part}")
    elif line.status == "redundant":
        others = ", ".join(line.implied_by)
        remarks.append(f"redundant, implied by {others}{part}" if others else "redundant")
    elif line.status == "unilateral":
        remarks.append("one-sided" + (f", restitution {line.restitution}" * bool(line.restitution)))
    if line.rheonomic:
        remarks.append("depends on t")
    return "; ".join(remarks)


def implied_line(account: Account) -> str:
    """Count the restrictions that no constraint states; empty if there are none."""
    if not account.implied:
        return ""
    noun = "restriction" if account.implied == 1 else "restrictions"
    return f"{account.implied} {noun} by definitions and position expressions"


def telling_definitions(equations: Equations) -> list[CartesianName]:
    """Return the Cartesian names that are neither 0 nor a coordinate of that name."""
    q = {c.name: c.q for c in equations.coordinates}
    return [c for c in equations.cartesian_names if c.position != 0 and q.get(c.name) != c.position]


def is_generalized_potential(equations: Equations) -> bool:
    """Say whether the potential depends on velocities."""
    return not equations.potential.free_symbols.isdisjoint(c.v for c in equations.coordinates)


#: What conserved quantities are searched for among.
SEARCHED = "among cyclic momenta and energy"


def undecided(equations: Equations) -> list[str]:
    """List the momenta and energies of which it is not known whether they are conserved."""
    symbols = {f"p_{c.name}" for c in equations.coordinates} | {"energy"}
    return [name for name in equations.open_questions if name in symbols]


def between_impacts(equations: Equations) -> str:
    """Say that an energy balance holds between impacts only; empty if it holds always."""
    elastic = all(contact.restitution == 1 for contact in equations.contacts)
    return "" if elastic else " between impacts"


def energy_is_sum(equations: Equations, quantity: Conserved | EnergyBalance) -> bool:
    """Say whether an energy is T + V with the V that is shown."""
    return quantity.kind == "energy" and not is_generalized_potential(equations)


def energy_letter(quantity: Conserved) -> str:
    """Give the letter of an energy or Jacobi integral."""
    return "E" if quantity.kind == "energy" or quantity.is_energy else "h"


def without_line(equations: Equations, letter: str = "t") -> str:
    """Say what is left out of L, empty if nothing is; ``letter`` stands for time."""
    short = equations.short_lagrangian
    if short is None:
        return ""
    parameters = {p.symbol for p in equations.parameters}
    is_constant = [term.free_symbols <= parameters for term in short.left_out.as_ordered_terms()]
    told = ["constants"] if any(is_constant) else []
    told += [] if all(is_constant) else [f"functions of {letter} alone"]
    return f"without {' and '.join(told)}"


def divisor_and_factor(shown: ShownEquation) -> tuple[Expr | None, Expr | None]:
    """Give what an equation was divided by, or what it was multiplied by; neither for a sign.

    To be rid of fractions is to multiply.
    """
    if shown.divided_by in (1, -1):
        return None, None
    number, _ = shown.divided_by.as_coeff_Mul(rational=True)
    return (None, 1 / shown.divided_by) if number.q > 1 else (shown.divided_by, None)


def certificate_line(certificate: Certificate) -> str:
    """``Certified at 8 random states to 30 digits, largest mismatch 3e-31``."""
    noun = "state" if certificate.points == 1 else "states"
    mismatch = f"{certificate.mismatch:.0e}" if certificate.mismatch else "0"
    return (
        f"Certified at {certificate.points} random {noun} to {certificate.digits} digits, "
        f"largest mismatch {mismatch}"
    )
