"""The header of emitted C: declarations, and the documentation of the interface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

from lagrange_cli.emit.c.constraints import _reset_arguments, change_arguments, mode_target
from lagrange_cli.emit.c.further import (
    canonical_declarations,
    derivative_declarations,
    linearization_declaration,
)
from lagrange_cli.emit.c.target import CTarget, wrapped
from lagrange_cli.emit.initial_state import rates_note
from lagrange_cli.emit.naming import comment_text, described, domain_note
from lagrange_cli.emit.shared_code import input_lines
from lagrange_cli.emit.template_files import c_template
from lagrange_cli.program.emitted_functions import optional_outputs
from lagrange_cli.version import __version__

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.program.solvers.jacobians import Jacobian

_INPUTS = """
/* out[0..@NAME@_INPUTS-1]: the inputs as the scene has them at time t. */
int @NAME@_inputs(@OUT@);
"""

_OUTPUTS = """
/* out[0..@NAME@_OUTPUTS-1]: the outputs in the order above. */
int @NAME@_outputs(@OUT@);
"""


_SWITCHES = """
/*
 * out[0..@NAME@_SWITCHES-1]: of each state with two values, in their order, what is
 * positive as long as its value stays. Where a number falls through zero, say number k,
 * find when; call @NAME@_change there with event = k; go on. Begin with event = -1.
 */
int @NAME@_switches(@OUT@);

/*
 * Changes states with two values: that of the event, and those whose number is below
 * zero; at a start (event = -1) zero counts as that. Returns 1 where a number is not
 * known, 4 where both conditions of a state hold; y is then meaningless.
 */
int @NAME@_change(@CHANGE@);
"""


def header_text(
    equations: Equations,
    target: CTarget,
    work: int,
    derivatives: Mapping[str, Jacobian],
    *,
    linearized: bool,
    canonical: bool,
    steps: str = "",
) -> str:
    """Return the text of ``NAME.h``.

    Parameters
    ----------
    work
        Numbers of workspace.
    derivatives
        Function of the interface → where its results are.
    linearized, canonical
        Whether there is a function ``linearization``, whether there are canonical equations.
    steps
        Declarations of fixed steps.
    """
    prefix = target.prefix
    guard = f"LAGRANGE_{prefix}_H"
    return "\n".join(
        [
            *_comment(equations, target),
            f"#ifndef {guard}",
            f"#define {guard}",
            "",
            "#ifdef __cplusplus",
            'extern "C" {',
            "#endif",
            "",
            *_sizes(equations, prefix),
            f"#define {prefix}_POSITIONS {len(equations.system.cartesian_names)}",
            *(
                f"#define {prefix}_{name.upper()} {len(getattr(equations.system, name))}"
                for name in optional_outputs(equations)
            ),
            *(
                [f"#define {prefix}_PARAMETERS {len(equations.system.parameters)}"]
                if "jacobian_p" in derivatives
                else []
            ),
            f"#define {prefix}_WORK {work}",
            "",
            *_structure(equations, target),
            "",
            _declarations(equations, target, derivatives, linearized, canonical) + steps,
            "#ifdef __cplusplus",
            "}",
            "#endif",
            "",
            "#endif",
            "",
        ]
    )


def _sizes(equations: Equations, prefix: str) -> list[str]:
    n, closures = len(equations.system.coordinates), equations.system.closures
    size = f"#define {prefix}_{'COORDINATES' if closures else 'DOF'} {n}"
    if equations.system.states:
        size += f"\n#define {prefix}_STATES {len(equations.system.states)}"
    contacts, multipliers = len(equations.system.contacts), len(equations.system.multipliers)
    if not multipliers:
        return [size]
    positions = sum(closure.kind == "position" for closure in closures) + contacts
    return [
        size,
        *([f"#define {prefix}_CONTACTS {contacts}"] if contacts else []),
        f"#define {prefix}_MULTIPLIERS {multipliers}",
        f"#define {prefix}_CONSTRAINTS {positions + multipliers}",
    ]


def _declarations(
    equations: Equations,
    target: CTarget,
    derivatives: Mapping[str, Jacobian],
    linearized: bool,
    canonical: bool,
) -> str:
    text = c_template("interface") + (_INPUTS if equations.system.inputs else "")
    text += _OUTPUTS if equations.system.outputs else ""
    text += _SWITCHES if equations.system.switches else ""
    if equations.system.contacts or equations.system.closures:
        kind = "contacts" if equations.system.contacts else "closures"
        text += "\n" + c_template(f"interface_{kind}")
    text += derivative_declarations(derivatives, target, contacts=bool(equations.system.contacts))
    text += linearization_declaration(equations, target) if linearized else ""
    text += canonical_declarations(equations, target) if canonical else ""
    outer = mode_target(target) if equations.system.contacts else target
    return (
        text.replace("@RHS@", outer.arguments("dydt"))
        .replace("@OUT@", target.arguments("out"))
        .replace("@MODE@", outer.arguments("out"))
        .replace("@CONSTRAINTS@", _ZEROS_CLOSED if equations.system.closures else _ZEROS)
        .replace("@PROJECT@", outer.state_arguments())
        .replace("@RESET@", _reset_arguments(target))
        .replace("@CHANGE@", change_arguments(target))
        .replace("@LAST@", "2n+@NAME@_STATES-1" if equations.system.states else "2n-1")
        .replace("@NAME@", target.prefix)
    )


def _comment(equations: Equations, target: CTarget) -> list[str]:
    """Return the opening comment: what this is, the order of everything, return values."""
    lines = [_titled(target.prefix, equations.presentation.title)]
    if equations.presentation.description:
        lines += ["", comment_text(equations.presentation.description)]
    lines += [
        "",
        *_statement(equations),
        f"Made by lagrange {__version__} from the scene with SHA-256",
        comment_text(equations.presentation.digest),
        "This output is yours: use it as you like, under any terms.",
        "",
        "State y: the coordinates q, then their velocities v = dq/dt",
    ]
    layout = equations.system.layout
    for k, coordinate in enumerate(equations.system.coordinates):
        lines.append(f"  y[{k}], y[{layout.place('v', k)}]  {described(coordinate)}")
    if equations.system.states:
        lines.append("and behind them the states x of first order, dx/dt = r(q, v, x, t)")
    for k, state in enumerate(equations.system.states):
        lines.append(f"  y[{layout.place('z', k)}]  {described(state)}")
    lines += domain_note(equations)
    positions = _listed("Positions", "out", [c.name for c in equations.system.cartesian_names])
    lines += positions or ["", "Positions: none, the scene names no Cartesian component."]
    lines += _listed("Inputs", "u", input_lines(equations))
    lines += _listed("Outputs", "out", [name for name, _ in equations.system.outputs])
    lines += _closures(equations)
    lines += _contacts(equations, target.prefix)
    lines += ["", *_conventions(equations, target.prefix).splitlines()]
    return ["/*", *(f" * {piece}".rstrip() for line in lines for piece in _pieces(line)), " */"]


def _pieces(line: str) -> list[str]:
    """Return a line of the comment, over several ones where it is longer than 100 columns."""
    indented = " " * 4 if line.startswith(" ") else ""
    return wrap(line, 97, subsequent_indent=indented, break_long_words=False) or [""]


def _statement(equations: Equations) -> list[str]:
    n, m, dof = (
        len(equations.system.coordinates),
        len(equations.system.closures),
        equations.derivation.account.dof,
    )
    if equations.system.contacts:
        law = _PUSHED_CLOSED if m else _PUSHED
        return [*law, *_PUSHING, f"n = {n} coordinates, degrees of freedom: {dof}."]
    if not m:
        return ["Equations of motion M(q, t) a = f(q, v, t) with n degrees of freedom."]
    return [
        "Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with closure",
        "equations beside them and a multiplier l[k] of each. g[k] is the gradient of",
        "closure k, so that l[k]*g[k] is the generalized force that it exerts.",
        f"n = {n} coordinates, {m} multiplier{'s' * (m > 1)}, degrees of freedom: {dof}.",
    ]


def _listed(heading: str, array: str, names: Sequence[str]) -> list[str]:
    """Return names in the order of an array."""
    lines = [f"  {array}[{k}]  {comment_text(name)}" for k, name in enumerate(names)]
    return ["", f"{heading}:", *lines] if lines else []


def _closures(equations: Equations) -> list[str]:
    """Return the closures in the order of the multipliers."""
    if not equations.system.closures:
        return []
    lines = ["", "Closures, each with its multiplier:"]
    for k, closure in enumerate(equations.system.closures):
        kind = "" if closure.kind == "position" else " (of velocities)"
        text = comment_text(f"{closure.name}: {closure.text}")
        lines.append(f"  l[{k}]  {text}{kind}")
    return [*lines, *rates_note(equations)]


def _contacts(equations: Equations, prefix: str) -> list[str]:
    """Return the contacts in the order of mode, and how to integrate with them."""
    if not equations.system.contacts:
        return []
    m = len(equations.system.closures)
    lines = ["", "Contacts, each with its number in mode and its multiplier:"]
    for k, contact in enumerate(equations.system.contacts):
        text = comment_text(f"{contact.name}: {contact.closure.text}")
        lines.append(f"  mode[{k}], l[{m + k}]  {text}")
    return [*lines, "", *_MODES.replace("@NAME@", prefix).splitlines()]


def _conventions(equations: Equations, prefix: str) -> str:
    status = _STATUS_CLOSED if equations.system.multipliers else _STATUS
    driven = _DRIVEN if equations.system.inputs else _NOT_DRIVEN
    if any(source.recording is not None for source in equations.system.inputs):
        driven = _RECORDED
    return (status + driven + _CONVENTIONS).replace("@NAME@", prefix)


_PUSHED = [
    "Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with one-sided",
    "constraints beside them and a multiplier l[k] of each. g[k] is the gradient of",
    "the gap of contact k, so that l[k]*g[k] is the generalized force that it exerts.",
]

_PUSHED_CLOSED = [
    "Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with closure",
    "equations and one-sided constraints beside them and a multiplier l[k] of each.",
    "g[k] is the gradient of closure k, or of the gap of contact k, so that l[k]*g[k]",
    "is the generalized force that it exerts.",
]

_PUSHING = ["A contact pushes, l[k] >= 0, while it is closed; l[k] = 0 while it is open."]

_MODES = """\
mode[k] is 1 where contact k is closed and 0 where it is open (a null pointer: all
are). Integrate with a fixed mode until one of the numbers that @NAME@_events gives
falls through zero, say number k; find when; call @NAME@_reset at the state there,
with event = k; go on with the state and the mode that it leaves. Begin with mode
all 0 and event = -1. Behind an event the gap of what has opened is zero but for
rounding, of either sign."""

_ZEROS = """\
the gaps of the contacts, then their rates,"""

_ZEROS_CLOSED = """\
what should be zero: lhs - rhs of closures of positions and
 * the gaps of the contacts, then the rates of all closures (lhs - rhs of those that
 * hold velocities) and of the contacts;"""

_STATUS = """\
Every function returns 0, or 1 if the mass matrix is singular (or not
positive definite where it must be), or 2 if a result is not finite; what it
has written is then meaningless.
"""

_STATUS_CLOSED = """\
Every function returns 0, or 1 if no accelerations and multipliers are
determined (a singular configuration), or 2 if a result is not finite; what it
has written is then meaningless.
"""

_NOT_DRIVEN = """\
t is the time; u are inputs, of which this system has none (may be null);
"""

_DRIVEN = """\
t is the time; u holds the inputs at that time, yours or those of the function
@NAME@_inputs, which alone takes a null pointer for it;
"""

_RECORDED = """\
t is the time; u holds the inputs at that time, yours or those of the function
@NAME@_inputs, which takes the recorded ones, and these alone, from u itself;
"""

_CONVENTIONS = """\
work holds @NAME@_WORK numbers of scratch space, unrelated to any other call.
y and the array of results must not overlap. Nothing is allocated and no
state is kept, so that calls from several threads need only separate arrays."""


def _titled(name: str, title: str | None) -> str:
    return f"{name}: {comment_text(title)}" if title else name


def _structure(equations: Equations, target: CTarget) -> list[str]:
    """Return the structure of the parameters."""
    names, real = target.names, target.real
    lines = [f"typedef struct {target.prefix}_params {{"]
    for parameter, field in zip(equations.system.parameters, names.fields, strict=True):
        default = "must be given"
        if parameter.value is not None:
            default = f"default {parameter.value!r}"
        lines += wrapped(f"{real.name} {field}; /* {described(parameter)}; {default} */", 1, 1)
    if not equations.system.parameters:
        lines.append(f"    {real.name} {names.empty_field}; /* there are no parameters */")
    return [*lines, f"}} {target.prefix}_params;"]
