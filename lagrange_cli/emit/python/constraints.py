"""Functions of emitted Python on constraints: solvers, ``project``, ``events``, ``reset``, modes.

The methods are those of C (:mod:`lagrange_cli.emit.c.constraints`), which explains them.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.python.styles import ARRAYS, NUMBERS, Style, many_lines
from lagrange_cli.emit.shared_code import (
    COMPLEMENTARITY_STEPS,
    IMPACT_TOLERANCES,
    LARGEST_EXPONENT,
    LEAST_INERTIA,
    MOST_EVENTS_A_STEP,
    MOST_REBOUNDS,
    RATE_TOLERANCE,
    UNEVEN_PIVOT,
)
from lagrange_cli.emit.template_files import filled, python_template
from lagrange_cli.program.lowered.routines.projection import (
    NEWTON_STEPS,
    RESIDUAL_AT_REST,
    RESIDUAL_ROUNDING,
    START_TOLERANCE,
)
from lagrange_cli.program.program import Program, result_count

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Functions that evaluators and ``project`` call, by the names of their templates: those that call
#: others first.
HELPERS = (
    "solve_saddle",
    "solve_banded",
    "solve_definite",
    "solve_symmetric",
    "solve_sparse",
    "solve_columns",
    "coupled_residual",
    "residual",
)

#: Token → text in all templates.
_CONSTANTS = {
    "@UNEVEN@": repr(UNEVEN_PIVOT),
    "@SMALL@": repr(LEAST_INERTIA),
    "@WIDEST@": str(LARGEST_EXPONENT),
}


def helper_source(name: str) -> str:
    """Return the definition of a helper, with functions that it alone calls."""
    return filled(python_template(name), _CONSTANTS)


def project_source(
    functions: Collection[str], parameter: str, kind: str = "", style: Style = NUMBERS
) -> str:
    """Return the definition of ``project``; empty if there are no closures.

    Parameters
    ----------
    functions
        The other functions of the module.
    parameter
        The text of the last argument (``p``, or ``p=DEFAULTS``).
    kind
        ``contact_`` for the projection onto closures and closed contacts; else empty.
    style
        What the function runs over; of many states each is projected by itself.
    """
    if f"{kind}velocity_change" not in functions:
        return ""
    has_positions = f"{kind}position_change" in functions
    positions = python_template("project_positions") if has_positions else ""
    apart = parameter.endswith("contact")
    name = f"_{kind}project" if apart else f"{kind}project"
    many = many_lines(name, parameter, ", few=inf") if style.takes_arrays else []
    replacements = {
        "@MANY@": "".join(f"{line}\n" for line in many),
        "@LED@": positions,
        "@NAME@": name,
        "@OF@": kind,
        "@CALL@": "p, contact" if apart else "p",
        "@P@": parameter,
        "@ROUNDS@": str(NEWTON_STEPS),
        "@NEAR@": repr(RESIDUAL_AT_REST),
        "@FAR@": repr(RESIDUAL_ROUNDING),
    }
    return filled(python_template("project"), replacements)


def impact_source(programs: Mapping[str, Program], parameter: str) -> list[str]:
    """Return definitions of ``events`` and ``reset``, none where there are no contacts.

    Parameters
    ----------
    parameter
        The text of the arguments of all functions behind ``t`` and ``y``. Flags and targets
        stand in ``p`` behind the parameters, or in ``contact`` where that is among them.
    """
    if "gaps" not in programs:
        return []
    u = result_count(programs["gaps"]) // 2
    flags_from = programs["gaps"].parameters - 2 * u
    apart = parameter.endswith("contact")
    replacements = {
        "@SET@": "contact = [*map(float, flags), *map(float, targets)]"
        if apart
        else f"p = [*p[:{flags_from}], *map(float, flags), *map(float, targets)]",
        "@FLAGS@": f"contact[:{u}]" if apart else f"p[{flags_from}:{flags_from + u}]",
        "@OWN@": "_" if apart else "",
        "@FLIGHT@": "_flight_rhs" if apart else "rhs",
        "@FREE@": parameter.removesuffix(", contact"),
        "@EVENTS@": "_contact_events" if apart else "events",
        "@RESET@": "_contact_reset" if apart else "reset",
        "@P@": parameter,
        "@U@": str(u),
        "@TOLERANCE@": repr(RATE_TOLERANCE),
        "@LOOSER@": repr(IMPACT_TOLERANCES),
        "@ULPS@": repr(2.0**-46),
        "@STEPS@": str(COMPLEMENTARITY_STEPS),
    }
    names = ("events", "pushes", "gap_terms", "hit", "reset")
    return [filled(python_template(name), replacements) for name in names]


#: What the module says of them.
CONTACT_NOTES = [
    "",
    "A contact, one of CONTACTS, pushes while it is closed. mode says which are: a sequence of",
    "as many 0 (open) and 1 (closed), FLIGHT if absent. Integrate with a fixed mode until one of",
    "the numbers that events gives falls through zero, say number k; find when; call reset with",
    "event=k there; go on with the state and the mode that it returns. Begin with reset alone.",
    "As a script the module does so.",
]


_DOCS = {
    "multipliers": "Multipliers, in the order of MULTIPLIERS, zero for what is open; NaN if none.",
    "constraints": "What is zero, in the order of RESIDUALS; so is all of what is open.",
    "jacobian": "Derivatives of the accelerations by q, then by v, n by 2n, while mode stays.",
    "jacobian_u": "Derivatives of the accelerations by the inputs, while mode stays.",
    "jacobian_p": "Derivatives of the accelerations by the parameters, while mode stays.",
    "events": "What falls through zero at events: multipliers of what is closed, else gaps.",
}


#: Lines of the script, and what they are with contacts.
_CHANGES = (
    (
        "    times = np.linspace(",
        """\
    y, mode, wrong = begin(y, run["until"], p)
    if wrong:
        return wrong
    largest = np.zeros((2, len(mode)))
    times = np.linspace(""",
    ),
    (
        'y = integrate(y, t, following, run["steps"], p)',
        'y, mode = integrate(y, t, following, run["steps"], p, mode, largest)',
    ),
)


def contact_constants(equations: Equations) -> list[str]:
    """Return names of the contacts, and the mode with all of them open."""
    contacts = equations.system.contacts
    if not contacts:
        return []
    texts = [f"# {comment_text(f'{c.name}: {c.closure.text}')}" for c in contacts]
    names = tuple(contact.name for contact in contacts)
    return [*texts, f"CONTACTS = {names!a}", f"FLIGHT = {(0,) * len(contacts)!r}"]


def interface_source(programs: Mapping[str, Program], parameter: str) -> list[str]:
    """Projection, events and impacts, and the functions of the interface around them.

    Parameters
    ----------
    parameter
        Parameters of the functions of the interface, with their defaults.
    """
    if "gaps" not in programs:
        return []
    passed = ", ".join(argument.split("=")[0] for argument in parameter.split(", "))
    functions = [
        python_template("mode_function").replace("@FUNCTION@", name).replace("@DOC@", doc)
        for name, doc in _DOCS.items()
        if f"contact_{name}" in programs or name == "events"
    ]
    flags, rhs, project, reset = (
        python_template(f"mode_{name}") for name in ("flags", "rhs", "project", "reset")
    )
    texts = [flags, rhs, *functions, project, reset]
    return [
        project_source(programs, "p, contact", "contact_", ARRAYS),
        *impact_source(programs, f"{passed}, contact"),
        *(text.replace("@P@", parameter).replace("@GIVEN@", passed) for text in texts),
    ]


def contact_script(script: str, held_inputs: str, rounding: float) -> str:
    """Return the script with steps that follow contacts.

    Parameters
    ----------
    script
        The script without contacts.
    held_inputs
        Lines that hold recorded inputs to a step from ``t`` on, empty without any.
    rounding
        Half the distance from 1 to the next number.
    """
    main = script.partition("    return y\n\n\n")[2]
    for line, changed in _CHANGES:
        main = main.replace(line, changed)
    text = f"{python_template('script_contacts')}\n\n{main}"
    replacements = {
        "@HELD@": held_inputs,
        "@U@": ", held" if held_inputs else "",
        "@TOLERANCE@": repr(START_TOLERANCE),
        "@NOISE@": repr(1024 * rounding),
        "@ULP@": repr(2 * rounding),
        "@EVENTS@": str(MOST_EVENTS_A_STEP),
        "@BOUNCES@": str(MOST_REBOUNDS),
    }
    return filled(text, replacements)
