"""The parts of a Python module before its functions: docstring, constants, parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

from lagrange_cli.emit.initial_state import rates_note, residual_labels
from lagrange_cli.emit.naming import comment_text, described, domain_note
from lagrange_cli.emit.python.layout import WIDTH, assignment, listing
from lagrange_cli.emit.shared_code import (
    described_input,
    momentum_names,
    polynomial_rows,
    recorded_inputs,
    switch_places,
)
from lagrange_cli.program.emitted_functions import ENTRIES
from lagrange_cli.program.program import Program
from lagrange_cli.version import __version__

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

_MANY = (
    "y is one state, or many as the columns of an array of shape (@SIZE@, m); t and parameters are"
    " then numbers or of shape (m,), and results have m as their last axis. NaN stands for no"
    " result."
)

#: Style → what the docstring of a module says of its functions.
_NOTES = {
    "numpy": [
        f"{_MANY} SciPy: solve_ivp(rhs, (0, 10), INITIAL, args=(DEFAULTS,), vectorized=True)."
    ],
    "numba": [
        f"{_MANY} Numba compiles the functions when they are first called, and loops that call"
        " them as well."
    ],
    "jax": [
        "Numbers may be arrays of JAX, for jax.jit, jax.vmap and jax.grad. NaN, or what is not"
        " finite, stands where there is no result. JAX computes with 32 bits unless it is told"
        " otherwise:",
        "",
        '    jax.config.update("jax_enable_x64", True)',
        "    step = jax.jit(jax.vmap(rhs, (None, 1, None), 1))",
    ],
    "casadi": [
        "They take expressions of CasADi (SX). NaN, or what is not finite, stands where there is no"
        " result. function(rhs) is the casadi.Function:",
        "",
        "    function(rhs)(0, INITIAL, DEFAULTS)",
        "    function(rhs).jacobian()",
    ],
}

#: Inputs as functions take them, and as functions over symbols do.
_DRIVEN = (
    "a function of (t, y, p) that returns the values of INPUTS",
    "the values of INPUTS, or a function of (t, y, p) that returns them",
)

_CONTACTS = (
    "A contact, one of CONTACTS, pushes while it is closed. mode says which are: as many 0 (open)"
    " and 1 (closed), FLIGHT if absent. Integrate with one mode until one of the numbers of events"
    " falls through zero, say number k; find when; call reset with event=k there; go on with the"
    " state and the mode that it returns. Begin with reset alone. The script does so."
)


_SWITCHES = (
    "A state of SWITCHES is 1 or 0 and has no rate. Integrate until one of the numbers of switches"
    " falls through zero, say number k; find when; call change with event=k there; go on with the"
    " state that it returns. Begin with change alone. The script does so."
)


def docstring(equations: Equations, style: str) -> str:
    """Return what the module says of itself."""
    presentation, system = equations.presentation, equations.system
    title = f": {presentation.title}" if presentation.title else ""
    paragraphs = [comment_text(f"{presentation.name}{title}")]
    if presentation.description:
        paragraphs.append(comment_text(presentation.description))
    driven = ""
    if system.inputs:
        driven = f" u is {_DRIVEN[style in ('jax', 'casadi')]}, by default those of the scene."
    held_names = [name for c in system.controllers for name, _ in c.held_inputs]
    if held_names:
        driven += f" A controller of the scene holds {', '.join(held_names)}: 0 by default here."
    note, *example = _NOTES[style]
    note = note.replace("@SIZE@", "2n + k" if system.states else "2n")
    paragraphs.append(f"{_statement(equations, style)}{driven} {note}")
    lines = [line for paragraph in paragraphs for line in [*wrap(paragraph, WIDTH), ""]]
    lines = [*lines[:-1], *example, ""]
    if system.contacts:
        lines += [*wrap(_CONTACTS, WIDTH), ""]
    if system.switches and style in ("numpy", "numba"):
        lines += [*wrap(_SWITCHES, WIDTH), ""]
    lines += [*domain_note(equations)]
    lines += [
        f"lagrange {__version__}, scene with SHA-256 {comment_text(presentation.digest)}",
        "This output is yours: use it as you like, under any terms.",
    ]
    return '"""' + "\n".join(lines) + '\n"""\n'


def _statement(equations: Equations, style: str) -> str:
    state = "for y = [q, v], in the order of COORDINATES."
    if equations.system.states:
        state = (
            "for y = [q, v, x], in the order of COORDINATES and, of the k states x of first order,"
            " dx/dt = r(q, v, x, t), of STATES."
        )
    if not equations.system.multipliers:
        return f"Equations of motion M(q, t) a = f(q, v, t) {state}"
    kinds = "closures and contacts" if equations.system.contacts else "closures"
    led = (
        " project leads a state back to what is closed, to be called after each step."
        if style in ("numpy", "numba") and equations.system.closures
        else ""
    )
    return (
        f"Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k] {state} l[k] is a"
        f" multiplier, in the order of MULTIPLIERS, and g[k] the gradient of one of the {kinds}, so"
        f" that l[k]*g[k] is the generalized force that it exerts.{led}"
    )


def constants(
    equations: Equations, derivatives: Mapping[str, Program], *, momenta: bool, arrays: bool
) -> str:
    """Define the names of what arrays hold, and the initial state.

    Parameters
    ----------
    momenta
        Names of the momenta are among them.
    arrays
        The initial state is an array of NumPy, else a list.
    """
    system = equations.system
    lines = [f"# {described(c)}" for c in system.coordinates if c.unit or c.description]
    lines += _names("COORDINATES", (c.name for c in system.coordinates))
    if system.states:
        lines += [f"# {described(s)}" for s in system.states if s.unit or s.description]
        lines += _names("STATES", (s.name for s in system.states))
    if system.switches:
        lines += _names("SWITCHES", (s.name for s in system.switches))
        lines += [
            "# Places of SWITCHES in y.",
            *listing("PLACES", map(str, switch_places(equations))),
        ]
    lines += _names("CARTESIAN", (c.name for c in system.cartesian_names))
    lines += _names("PARAMETERS", (p.name for p in system.parameters))
    if momenta:
        lines += _names("MOMENTA", momentum_names(equations))
    if system.inputs:
        lines += _names("INPUTS", (source.name for source in system.inputs))
    if system.outputs:
        lines += _names("OUTPUTS", (name for name, _ in system.outputs))
    lines += [*_closures(equations), *_patterns(derivatives)]
    initial = system.initial
    state = None if initial is None else repr([*initial.numbers])
    text = f"np.array({state})" if state and arrays else str(state)
    return "\n".join([*lines, *assignment("INITIAL", text, ""), ""])


def _names(target: str, names: Iterable[str]) -> list[str]:
    """Define a tuple of string literals in plain ASCII."""
    return listing(target, map(ascii, names))


def _closures(equations: Equations) -> list[str]:
    system = equations.system
    if not system.multipliers:
        return []
    contacts = [contact.closure for contact in system.contacts]
    texts = [f"# {comment_text(f'{c.name}: {c.text}')}" for c in (*system.closures, *contacts)]
    lines = [*texts, *(f"# {line}" for line in rates_note(equations))]
    lines += _names("MULTIPLIERS", system.multipliers)
    lines += _names("RESIDUALS", residual_labels(equations))
    if contacts:
        lines += _names("CONTACTS", (contact.name for contact in system.contacts))
        lines.append(f"FLIGHT = {(0,) * len(contacts)!r}")
    return lines


def _patterns(programs: Mapping[str, Program]) -> list[str]:
    """Define where the numbers of sparse results stand in the matrix."""
    lines: list[str] = []
    for name, program in programs.items():
        if program.jacobian is not None and program.jacobian.pattern is not None:
            rows, columns = zip(*program.jacobian.pattern, strict=True)
            constant = name.removeprefix("contact_").removesuffix(ENTRIES).upper()
            lines += listing(f"{constant}_ROWS", map(str, rows))
            lines += listing(f"{constant}_COLUMNS", map(str, columns))
    return lines


def parameters_source(equations: Equations, fields: Sequence[str]) -> str:
    """Define the type of the parameters, with their values in the scene."""
    lines = ["class Parameters(NamedTuple):"]
    for parameter, name in zip(equations.system.parameters, fields, strict=True):
        line = f"    {name}: float = {_value(parameter.value)}"
        if parameter.unit or parameter.description or parameter.name != name:
            line += f"  # {described(parameter)}"
        lines.append(line)
    return "\n".join(
        [*lines, *([] if fields else ["    pass"]), "", "", "DEFAULTS = Parameters()", ""]
    )


def _value(value: float | None) -> str:
    return 'float("nan")' if value is None else repr(float(value))


def recordings(equations: Equations) -> str:
    """Define the recorded inputs; empty where there are none."""
    tables = recorded_inputs(equations)
    if not tables:
        return ""
    lines = ["# Number of the input, end, numbers of a row: a start, coefficients from the lowest."]
    lines.append("RECORDED = [")
    for number, pieces in tables:
        end = repr(pieces.end).replace("inf", 'float("inf")')
        lines.append(f"    # {comment_text(described_input(equations, number))}")
        lines.append(f"    ({number}, {end}, {pieces.coefficients.shape[1] + 1}, [")
        lines += [f"        {', '.join(map(repr, row))}," for row in polynomial_rows(pieces)]
        lines.append("    ]),")
    return "\n".join([*lines, "]", ""])
