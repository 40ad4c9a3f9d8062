"""``events`` and ``reset`` of C with one-sided constraints: contacts open, close and bounce.

At an event the closed contacts take an impact if one of them approaches, by Newton's law with
impulses that only push (Moreau, *Unilateral contact and dry friction in finite freedom dynamics*,
1988; Glocker and Pfeiffer, *Nonlinear Dynamics* 7 (1995) 471): w = u⁺ + e·min(u⁻, 0) ≥ 0, Λ ≥ 0,
w·Λ = 0 for the rates u. Contacts that do not leave stay closed if they have to push: λ ≥ 0, φ̈ ≥ 0,
λ·φ̈ = 0. Both are the optimality conditions of a projection in the metric of the kinetic energy,
which the dual method of Goldfarb and Idnani finds (*Math. Programming* 27 (1983) 1): it copes with
contacts that depend on others.
"""

from __future__ import annotations

from collections.abc import Mapping

from lagrange_cli.emit.c.body import program_workspace_size
from lagrange_cli.emit.c.names import CNames
from lagrange_cli.emit.c.target import CTarget
from lagrange_cli.emit.constants import COMPLEMENTARITY_STEPS, IMPACT_TOLERANCES, RATE_TOLERANCE
from lagrange_cli.emit.template_files import c_template
from lagrange_cli.program.program import Program, result_count

#: Number of contacts from which on those that push are guessed first; set by hand.
_FEWEST_GUESSED = 8

#: Rounds of guesses of the contacts that push; set by hand.
_ROUNDS = 12

#: Pivot of a matrix with ones on the diagonal that ends the guesses; set by hand.
_SMALLEST = 1e-6


def impact_text(programs: Mapping[str, Program], target: CTarget) -> str:
    """Return ``events`` and ``reset`` with their helpers; empty if there are no contacts."""
    if "gaps" not in programs:
        return ""
    names, real, contacts = target.names, target.real, _contacts(programs)
    guessed = contacts >= _FEWEST_GUESSED
    replacements = _arguments(names, programs["gaps"].parameters - 2 * contacts) | {
        "@PASSED@": names.passed,
        "@ARGUMENTS@": target.arguments("out"),
        "@U@": str(contacts),
        "@M@": str(_multipliers(programs) - contacts),
        "@N@": str(programs["gaps"].coordinates),
        "@START@": str(_inner(programs)),
        "@RESULTS@": str(_results(programs)),
        "@STEPS@": str(COMPLEMENTARITY_STEPS),
        "@ROUNDS@": str(_ROUNDS),
        "@SMALLEST@": real.value(max(_SMALLEST, 64 * float(real.epsilon))),
        "@GUESSED@": "    @NAME@_guess(n, w, size, c);\n" if guessed else "",
        "@MIN@": f"fmin{real.suffix}",
        "@MAX@": f"fmax{real.suffix}",
        "@TOLERANCE@": real.value(max(RATE_TOLERANCE, 64 * float(real.epsilon))),
        "@LOOSER@": real.value(IMPACT_TOLERANCES),
        "@ULPS@": real.value(128 * float(real.epsilon)),
    }
    guess = ["guess"] if guessed else []
    templates = ("events", "closing", "among_active", *guess, "push", "impact", "reset")
    return "\n".join(target.fill(target.fill(c_template(name), replacements)) for name in templates)


def _arguments(names: CNames, flags_from: int) -> dict[str, str]:
    """Return the tokens of argument lists; flags are behind the parameters, or in an array."""
    inside = names.contact_from is None
    constant = "" if inside else ", const @REAL@ *contact"
    changing = "" if inside else ", @REAL@ *contact"
    state = f"@REAL@ t, {{}}@REAL@ *y, const @REAL@ *u, {{}}{names.prefix}_params *p"
    changed = "" if inside else "const "
    return {
        "@OF@": "" if inside else "contact_",
        "@STATIC@": "" if inside else "static ",
        "@INT@": "long" if inside else "int",
        "@FLIGHT@": "" if inside else "flight_",
        "@FREE@": "t, y, u, p",
        "@STATE@": state.format("const ", "const ") + constant,
        "@MUTABLE@": state.format("const ", changed) + changing,
        "@MUTABLE_STATE@": state.format("", changed) + changing,
        "@CONTACT@": f"    const @REAL@ *const contact = p->p + {flags_from};\n" if inside else "",
        "@CHANGING@": f"    @REAL@ *const contact = p->p + {flags_from};\n" if inside else "",
    }


def impact_workspace_size(programs: Mapping[str, Program]) -> int:
    """Return the numbers of workspace for ``events`` and ``reset``; 0 if there are no contacts."""
    if "gaps" not in programs:
        return 0
    n, u = programs["gaps"].coordinates, _contacts(programs)
    events = max(2 * u, _multipliers(programs))
    known = 2 * u + u * (n + 3) + 7 * u + u * u + _results(programs)
    return _inner(programs) + max(events, known + u * u + 3 * u)


def _inner(programs: Mapping[str, Program]) -> int:
    """Return the numbers of workspace that the called functions need."""
    called = ("gaps", "gap_terms", "impulse", "contact_multipliers", "rhs", "flight_rhs")
    return max(program_workspace_size(programs[name]) for name in called if name in programs)


def _contacts(programs: Mapping[str, Program]) -> int:
    """Return the number of contacts: each has a gap, and its magnitude."""
    return result_count(programs["gaps"]) // 2


def _multipliers(programs: Mapping[str, Program]) -> int:
    return sum(len(block.closures) for block in programs["contact_multipliers"].blocks)


def _results(programs: Mapping[str, Program]) -> int:
    """Return the most numbers that a called function returns, besides terms."""
    return max(2 * programs["gaps"].coordinates, _multipliers(programs))
