"""Functions of a Python module around its programs: projection, contacts, derivatives, momenta.

The methods are those of C (:mod:`lagrange_cli.emit.c.constraints`), which explains them.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from textwrap import wrap
from typing import TYPE_CHECKING

from lagrange_cli.emit.fixed_steps import FIXED_STEPS, require_steps, step_lines
from lagrange_cli.emit.initial_state import ROWS, steps_per_row
from lagrange_cli.emit.python.layout import TAB, WIDTH, passed_on
from lagrange_cli.emit.routines.signatures import Signature, routines_called
from lagrange_cli.emit.shared_code import RECORDED_ROUNDING
from lagrange_cli.emit.template_files import event_lines, filled, python_template
from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.program.emitted_functions import ENTRIES
from lagrange_cli.program.lowered.routines.impacts import INSTANT, reset_arrays
from lagrange_cli.program.lowered.routines.projection import (
    NEWTON_STEPS,
    RESIDUAL_AT_REST,
    RESIDUAL_ROUNDING,
    START_TOLERANCE,
)
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.tolerances import (
    MOST_EVENTS_A_STEP,
    MOST_REBOUNDS,
)
from lagrange_cli.state_layout import StateLayout

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Half the distance from 1 to the next number.
_ROUNDING = 2.0**-53


def projection_source(equations: Equations, programs: Mapping[str, Program]) -> str:
    """Define ``project``; empty where nothing has to be led back."""
    contact = "contact_" if equations.system.contacts else ""
    if f"{contact}velocity_change" not in programs:
        return ""
    has_positions = f"{contact}position_change" in programs
    replacements = {
        "@POSITIONS@": python_template("projection_positions") if has_positions else "",
        "@MODE@": ", mode=FLIGHT" if contact else "",
        "@PASSED@": ", mode" if contact else "",
        "@CLOSED@": "what is closed" if contact else "the closures",
        "@ROUNDS@": str(NEWTON_STEPS),
        "@NEAR@": repr(RESIDUAL_AT_REST),
        "@FAR@": repr(RESIDUAL_ROUNDING),
        **layout_tokens(equations.system.layout),
    }
    coupled = [python_template("projection_coupled")] if has_positions else []
    return "\n\n".join([filled(python_template("projection"), replacements), *coupled])


def routines_source(names: Iterable[str]) -> str:
    """Return the source of routines with those that they call, and with their constants."""
    routines = routines_called(names)
    constants = dict(pair for routine in routines for pair in _constants(routine))
    stated = "\n".join(f"{name} = {value!r}" for name, value in constants.items())
    return "\n\n".join([*([f"{stated}\n"] if stated else []), *map(_source, routines)])


def _constants(routine: Signature) -> Iterator[tuple[str, float]]:
    """Yield the constants that a routine reads."""
    nodes = (node for step in routine.statements for node in ast.walk(step))
    for name in dict.fromkeys(node.id for node in nodes if isinstance(node, ast.Name)):
        value = routine.constants.get(name)
        if name not in routine.names and isinstance(value, int | float):
            yield name, value


def _source(routine: Signature) -> str:
    arguments = ", ".join(argument.name for argument in routine.arguments)
    head = wrap(f"def {routine.name}({arguments}):", WIDTH, subsequent_indent=2 * TAB)
    body = next(k for k, line in enumerate(routine.lines) if line.lstrip().startswith('"""'))
    return "\n".join([*head, *routine.lines[body:], ""])


def contacts_source(equations: Equations, arguments: str) -> str:
    """Define ``events`` and ``reset``; empty where there are no contacts.

    Parameters
    ----------
    arguments
        Those of the functions of the interface behind ``t`` and ``y``, with their defaults.
    """
    if not equations.system.contacts:
        return ""
    system = equations.system
    n, c, m = len(system.coordinates), len(system.contacts), len(system.multipliers)
    replacements = {
        "@A@": arguments,
        "@P@": passed_on(arguments),
        "@U@": str(c),
        "@M@": str(m - c),
        "@N@": str(n),
        "@TWICE@": str(2 * c),
        "@FORCES@": str(m),
        "@SIZES@": repr(tuple(reset_arrays(n, system.layout.size, c, m).values())),
        "@INSTANT@": repr(INSTANT),
    }
    source = routines_source(["falling", "reset_contacts", "advance"])
    return "\n\n".join([source, filled(python_template("contacts"), replacements)])


def switches_source(equations: Equations, arguments: str) -> str:
    """Define ``change``; empty where no state has two values.

    Parameters
    ----------
    arguments
        Those of the functions of the interface behind ``t`` and ``y``, with their defaults.
    """
    system = equations.system
    if not system.switches:
        return ""
    replacements = {
        "@A@": arguments,
        "@P@": passed_on(arguments),
        "@S@": str(len(system.switches)),
        "@SIZE@": str(system.layout.size),
    }
    source = routines_source(["change_values", *([] if system.contacts else ["advance"])])
    return "\n\n".join([source, filled(python_template("switches"), replacements)])


#: What holds the inputs over a step: functions of the module take them as a function.
_HELD_VALUES = """\
    values = u(t, y, p)

    def held(t, y, p):
        return values

"""


def steps_source(
    equations: Equations,
    arguments: str,
    options: Mapping[str, str | bool],
    errors: Mapping[str, str],
) -> list[str]:
    """Define functions of fixed steps that options ask for.

    Parameters
    ----------
    arguments
        Those of the functions of the interface behind ``t`` and ``y``, with their defaults.
    errors
        Function → a sentence on its measured error.
    """
    names = require_steps(equations, options)
    if not names:
        return []
    routines = routines_source([FIXED_STEPS[name].routine for name in names])
    texts = [routines, python_template("dynamics").rstrip() + "\n"]
    driven = _HELD_VALUES if equations.system.inputs else ""
    if driven and options["style"] == "numba":
        message = "no fixed steps: functions of numba cannot be handed inputs that are held"
        hint = "emit them without --style, or in another language"
        raise InputError(Problem(message, Mark(equations.presentation.file, 1, 1), hint))
    for name in names:
        method = FIXED_STEPS[name]
        lines = step_lines(equations, name, errors, "NaN", WIDTH - 8)
        replacements = {
            "@STEP@": name,
            "@A@": arguments,
            "@P@": "p, held" if driven else "p",
            "@HELD@": driven,
            "@NOTES@": f"\n{TAB}".join(lines),
            "@ROUTINE@": method.routine,
            "@ARRAYS@": str(method.arrays),
            "@SIZE@": str(equations.system.layout.size),
        }
        texts.append(filled(python_template("fixed_step"), replacements))
    return texts


def canonical_source(equations: Equations, arguments: str) -> str:
    """Define the functions of [q, p]."""
    replacements = {
        "@A@": arguments,
        "@P@": passed_on(arguments),
        "@N@": str(len(equations.system.coordinates)),
    }
    return filled(python_template("canonical"), replacements)


def recorded_source() -> str:
    """Define the function that looks inputs up in their recordings."""
    replacements = {"@ROUNDING@": repr(RECORDED_ROUNDING)}
    source = routines_source(["interpolated"])
    return "\n\n".join([source, filled(python_template("recorded"), replacements)])


_FIELD = "    E: np.ndarray\n"

_NOTE = """
    E dy = 0 are the changes that the constraints allow, E the derivative of their numbers, in
    the order of RESIDUALS. A is that of rhs, which has accelerations off the constraints too."""


def layout_tokens(layout: StateLayout) -> dict[str, str]:
    """Return texts of places in a state ``y``, of which n numbers are coordinates."""
    if not layout.states:
        return {
            "@HALF@": "len(y)//2",
            "@TWICE@": "",
            "@WHOLE@": "2*n",
            "@MOVING@": "",
            "@VELOCITIES@": "len(y)//2 :",
            "@STATES@": "",
            "@SIZE@": "2*len(COORDINATES)",
        }
    n = layout.coordinates
    return {
        "@HALF@": str(n),
        "@TWICE@": "2*n",
        "@WHOLE@": "len(y)",
        "@MOVING@": f"[:{2 * n}]",
        "@VELOCITIES@": f"{n}:{2 * n}",
        "@STATES@": ", *STATES",
        "@SIZE@": "2*len(COORDINATES) + len(STATES)",
    }


def whole_jacobians(
    equations: Equations,
    programs: Mapping[str, Program],
    arguments: str,
    documentation: Mapping[str, str],
) -> list[str]:
    """Define the functions that fill whole matrices with derivatives of which few are stored.

    Parameters
    ----------
    programs
        Programs of the derivatives by function.
    arguments
        Those of the functions of the interface behind ``t`` and ``y``, with their defaults.
    documentation
        That of functions by name.
    """
    mode = ", mode=FLIGHT" if equations.system.contacts else ""
    texts = []
    for name, program in programs.items():
        if program.jacobian is None or program.jacobian.pattern is None:
            continue
        function = name.removeprefix("contact_").removesuffix(ENTRIES)
        replacements = {
            "@FUNCTION@": function,
            "@DOC@": documentation[function],
            "@CONSTANT@": function.upper(),
            "@A@": arguments + mode,
            "@P@": passed_on(arguments + mode),
            "@SHAPE@": f"{program.jacobian.rows}, {program.jacobian.columns}",
        }
        texts.append(filled(python_template("whole_jacobian"), replacements))
    return texts


def linearization_source(equations: Equations, arguments: str) -> str:
    """Define the type of the result and the function.

    Parameters
    ----------
    arguments
        Those of the functions of the interface behind ``t`` and ``y``, with their defaults.
    """
    system = equations.system
    n, m, k = len(system.coordinates), len(system.inputs), len(system.outputs)
    size = system.layout.size
    plain, contacts = passed_on(arguments), bool(system.contacts)
    passed = f"{plain}, mode" if contacts else plain
    lines = [
        f"A = jacobian(t, y, {passed})",
        f"B = jacobian_u(t, y, {passed})" if m else f"B = np.zeros(({size}, 0) + y.shape[1:])",
        f"C = np.zeros(({k or n}, {size}) + y.shape[1:])",
        f"C[:] = _output_jacobian(t, y, {plain})" if k else f"C[range({n}), range({n})] = 1.0",
        f"D = np.zeros(({k or n}, {m}) + y.shape[1:])",
        *([f"D[:] = _output_jacobian_u(t, y, {plain})"] if k and m else []),
    ]
    if contacts or system.closures:
        lines.append(f"E = _constraint_jacobian(t, y, {passed})")
    closed = bool(system.pushing)
    replacements = {
        "@LINES@": "\n".join(f"    {line}" for line in lines),
        "@FIELDS@": _FIELD if closed else "",
        "@NOTE@": _NOTE if closed else "",
        "@HELD@": " The mode is kept." if contacts else "",
        "@OF@": "OUTPUTS" if k else "COORDINATES",
        "@A@": arguments + (", mode=FLIGHT" if contacts else ""),
        "@MATRICES@": "A, B, C, D, E" if closed else "A, B, C, D",
    }
    return filled(python_template("linearization"), replacements)


# -- the script ----------------------------------------------------------------------------

_SINGULAR = "the mass matrix is singular or a result not finite"
_SINGULAR_CLOSED = "a singular configuration or a result not finite"

#: What begins a step with recordings: no step sees two pieces of them.
_HELD = """\
        at = partial(recorded, at=s + h/2)
        held = partial(inputs, u=at)
"""


def _event_tokens(equations: Equations) -> dict[str, str]:
    """Return the tokens of a run that stops at events."""
    contacts, switches = len(equations.system.contacts), len(equations.system.switches)
    falls = ["events(t, y, self.p, mode=mode)"] if contacts else []
    falls += ["switches(t, y, self.p)"] if switches else []
    values = ["mode"] if contacts else []
    values += ["y[[*PLACES]].astype(int)"] if switches else []
    if contacts and switches:
        falls = [f"*{falls[0].replace('mode=mode', f'mode=mode[:{contacts}]')}", f"*{falls[1]}"]
        values = ["(*mode, *y[[*PLACES]].astype(int))"]
    mode = f", mode[:{contacts}]" if switches else ", mode"
    projected = "project(t + h, y + h/6*(k1 + 2*k2 + 2*k3 + k4), p@IN@)"
    return {
        "@FALLS@": ", ".join(falls),
        "@VALUES@": values[0],
        "@HAPPENS@": event_lines(
            python_template,
            [kind for kind, number in (("contacts", contacts), ("switches", switches)) if number],
            (f"if event < {contacts}:", ""),
            *(2 * TAB, TAB),
        ),
        "@NUMBER@": f"event - {contacts} if event >= {contacts} else -1" if contacts else "event",
        "@STEPPED@": projected
        if equations.system.multipliers
        else "y + h/6*(k1 + 2*k2 + 2*k3 + k4)",
        "@AT@": ", led back to what is closed" if equations.system.multipliers else "",
        "@TOO@": " and mode" if contacts else "",
        "@HELD_MODE@": mode if contacts else "",
        "@MODED@": ", mode=mode" if contacts else "",
        "@MODE@": ", mode=FLIGHT" if contacts else "",
        "@IN@": ", mode" if contacts else "",
        "@C@": str(contacts + switches),
        "@MOST@": str(2 * (contacts + switches)),
    }


def script_source(equations: Equations, decorator: str) -> str:
    """Define ``integrate`` and the run of the module as a script.

    Parameters
    ----------
    decorator
        Line above functions that are compiled.
    """
    system = equations.system
    start, size = system.simulate.start, system.layout.size
    until = start + 10.0 if system.simulate.until is None else system.simulate.until
    recorded = any(source.recording is not None for source in system.inputs)
    closed = bool(system.closures or system.contacts)
    asks = system.initial is None or any(p.value is None for p in system.parameters)
    initial = "INITIAL" if system.initial is not None else f'[float("nan")]*{size}'
    has_events = bool(system.contacts or system.switches)
    plain = not (closed or recorded or has_events)
    held_inputs = _HELD if recorded else ""
    begin, step = "", "y = integrate(y, t, following, steps, p)"
    if system.closures:
        begin = _checked(f"y, wrong = start(y, {start!r}, until, p)")
    if system.contacts:
        begin += _checked(f"y, mode, wrong = begin(y, {start!r}, until, p)")
        step = "y, mode = integrate(y, t, following, steps, p, mode, largest)"
    if system.switches:
        begin += f"    y = change({start!r}, y, p)\n    if y is None:\n"
        begin += '        sys.exit("a state with two values has neither at the start")\n'
        if not system.contacts:
            step = "y = integrate(y, t, following, steps, p, largest)"
    if has_events:
        begin += f"    largest = np.zeros({2 * (len(system.contacts) + len(system.switches))})\n"
        lines = held_inputs.replace("=s +", "=t +").splitlines(keepends=True)
        held_inputs = "".join(line[4:] for line in lines)
    reason = _SINGULAR_CLOSED if closed else _SINGULAR
    replacements = {
        "@NJIT@": f"{decorator}\n" if decorator and plain else "",
        "@HELD@": held_inputs,
        "@U@": ", held" if recorded else "",
        "@LED@": "        y = project(s + h, y, p)\n" if system.closures else "",
        "@MISSING@": python_template("main_missing") if asks else "",
        "@INITIAL@": initial,
        "@UNTIL@": repr(float(until)),
        "@STEPS@": str(steps_per_row(equations)),
        "@N@": str(size),
        **layout_tokens(system.layout),
        "@BEGIN@": begin,
        "@START@": repr(start),
        "@ROWS@": str(ROWS + 1),
        "@STEP@": step,
        "@REASON@": f"{reason}, or a recording ends" if recorded else reason,
        "@TOLERANCE@": repr(START_TOLERANCE),
        "@ROUNDING@": repr(64 * _ROUNDING),
        "@EVENTS@": str(MOST_EVENTS_A_STEP),
        "@BOUNCES@": str(MOST_REBOUNDS),
    }
    replacements = {**(_event_tokens(equations) if has_events else {}), **replacements}
    names = ["integrate_events" if has_events else "integrate"]
    names += ["begin_contacts"] if system.contacts else []
    names += ["start"] if system.closures else []
    return "\n\n".join(filled(python_template(name), replacements) for name in [*names, "main"])


def _checked(statement: str) -> str:
    return f"    {statement}\n    if wrong:\n        sys.exit(wrong)\n"
