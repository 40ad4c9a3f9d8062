"""Python: one module that needs NumPy alone and runs as a script.

Scene names appear as mangled identifiers, scene text only in comments and
string literals that ``ascii`` wrote.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from lagrange_cli.emit.naming import (
    PYTHON_MODULES,
    PYTHON_RESERVED,
    comment_text,
    file_stem,
    unique_identifiers,
)
from lagrange_cli.emit.python.constraints import (
    CONTACT_NOTES,
    contact_script,
    helper_source,
    interface_source,
    project_source,
)
from lagrange_cli.emit.python.derivatives import linearization_source
from lagrange_cli.emit.python.functions import (
    FUNCTIONS_OF_STATE,
    function_source,
    prelude,
    shared_sources,
    sharing,
    words_in,
)
from lagrange_cli.emit.python.heading import (
    constants,
    docstring,
    local_names,
    parameters_source,
    run_constants,
)
from lagrange_cli.emit.python.loops import index_tables_source
from lagrange_cli.emit.python.statements import DOUBLE_ROUNDING
from lagrange_cli.emit.python.styles import ARRAYS, array_functions
from lagrange_cli.emit.python.traced import traced_module
from lagrange_cli.emit.shared_code import (
    RECORDED_ROUNDING,
    described_input,
    polynomial_rows,
    programs_of_momenta,
    recorded_inputs,
)
from lagrange_cli.emit.template_files import filled, python_template
from lagrange_cli.program.emitted_functions import (
    INTERNAL_FUNCTIONS,
    constraint_programs,
    contact_programs,
    derivative_programs,
    program_of,
)
from lagrange_cli.program.lowered.routines.projection import START_TOLERANCE
from lagrange_cli.program.program import Program, optional_outputs
from lagrange_cli.program.systems.contact_systems import with_contact_flags

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: What the docstring of a module says.
ARRAY_NOTES = [
    "",
    "y may hold many states, as the columns of an array of shape (2n, m); t and each parameter",
    "are then numbers or arrays of shape (m,). Results have the shape that they have for one",
    "state, with m behind it, and NaN for states without a result. With SciPy, vectorized=True.",
]

#: Name in functions of numbers → what stands there for arrays.
_OF_ARRAYS = {
    **{
        f"_{name}" if name in ("sign", "min", "max") else name: text
        for name, text in array_functions("np").items()
        if name != "abs"
    },
    "array": "_stacked",
    "_AXES": "2",
    "_undefined": "_irregular",
    "_holds": "np.all",
    "_number": "np.asarray",
    "_numbers": "np.asarray",
    "_shaped": "lambda a, *shape: a.reshape(*shape, -1)",
    "_dot": 'partial(np.einsum, "i...,i...->...")',
    "_product": 'partial(np.einsum, "kai,ibk->abk")',
    "_solve_saddle": "_solve_saddles",
}

#: States that are faster one by one than by functions of NumPy: a number for a state costs some 30
#: ns, an operation of NumPy some µs.
_FEW = 16


def arrays_source(words: set[str], programs: Mapping[str, Program]) -> list[str]:
    """Return definitions of what evaluates a function for many states.

    Parameters
    ----------
    words
        The names in the rest of the module.
    programs
        The programs of its functions. Where one has loops, its functions of one state are
        NumPy's too, and a few states are faster together as well.
    """
    few_states = 1 if any(program.parts for program in programs.values()) else _FEW
    rows = [f'    "{name}": {text},' for name, text in _OF_ARRAYS.items() if name in words]
    table = "\n".join(["_OF_ARRAYS = {", *rows, "}", ""])
    return [
        "#: Axes of y for one state; more are states beside each other.\n_AXES = 1\n",
        *([helper_source("solve_saddles")] if "_solve_saddle" in words else []),
        python_template("arrays").replace("@FEW@", str(few_states)),
        f"#: Names of functions of numbers, and what they are for arrays.\n{table}",
    ]


def python_recorded(equations: Equations) -> list[str]:
    """The recordings of the inputs, and the function ``recorded``; nothing where there are none."""
    recordings = recorded_inputs(equations)
    if not recordings:
        return []
    lines = ["#: Number of the input, end, and rows: a start, coefficients from the lowest."]
    lines.append("RECORDED = [")
    for number, pieces in recordings:
        end = "inf" if math.isinf(pieces.end) else repr(pieces.end)
        lines += [
            f"    # {comment_text(described_input(equations, number))}",
            f"    ({number}, {end}, [",
        ]
        lines += [f"        {row}," for row in polynomial_rows(pieces)]
        lines.append("    ]),")
    return [
        "\n".join([*lines, "]", ""]),
        python_template("recorded").replace("@ROUNDING@", repr(RECORDED_ROUNDING)),
    ]


#: Lines of the script: where a step begins, after which a state is led back to the closures,
#: and where the run begins.
_SLOPE = "        k1 = rhs(s, y, p)\n"
_STEP = "        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)\n"
_START = "    p, y = Parameters(*parameters.values()), np.array(list(initial.values()))\n"
_CHECKED = """\
    y, wrong = start(y, run["until"], p)
    if wrong:
        return wrong
"""
_MAIN = "def main(arguments):\n"


_SINGULAR = "{t}: the mass matrix is singular or a result not finite"
_SINGULAR_CLOSED = "{t}: a singular configuration or a result not finite"

#: What stands where a step begins, with recordings: no step sees two pieces of them.
_HELD = """\
        of = partial(recorded, at=s + h / 2)
        held = partial(inputs, u=of)
"""

#: Options that ask for further functions.
_FURTHER = ("jacobian", "linearization", "canonical")

#: The end of that sentence.
_NOT_FINITE = "or a result not finite"

#: The end of another one where there are inputs.
_DRIVEN = [
    "domain error, overflow). After p it takes u, a function of (t, y, p) that returns the",
    "values of INPUTS; without it they are those of the scene. With SciPy:",
]


def emit_python(equations: Equations, options: Mapping[str, str | bool]) -> dict[str, str]:
    """``NAME.py``.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in Python.
    InputError
        A constant is outside the range of a double, or the style cannot hold the scene.
    """
    if options["style"] != "numpy":
        asked = [name for name in _FURTHER if options[name]]
        text = traced_module(equations, str(options["style"]), asked)
        return {f"{file_stem(equations.presentation.name, PYTHON_MODULES)}.py": text}
    fields = unique_identifiers((p.name for p in equations.system.parameters), PYTHON_RESERVED)
    tables = python_recorded(equations)
    derivatives = derivative_programs(
        equations, jacobian=bool(options["jacobian"]), linearization=bool(options["linearization"])
    )
    canonical = bool(options["canonical"] and equations.system.coordinates)
    derivatives |= programs_of_momenta(equations) if canonical else {}
    programs, functions = _functions(equations, fields, bool(tables), derivatives)
    if options["linearization"]:
        functions += linearization_source(equations, derivatives, _arguments(equations))
    if canonical:
        functions.append(_canonical(equations))
    parameters = parameters_source(equations, fields)
    script = _script(equations)
    text = "\n".join([parameters, *functions, *tables, script])
    arrays = arrays_source(words_in("\n".join([text, *prelude(text)[1]])), programs)
    imports, helpers = prelude("\n".join([text, *arrays]))
    parts = [
        docstring(equations, _notes(equations), projected=True),
        _imports(imports, "\n".join([text, *arrays])),
        *helpers,
        *filter(None, [index_tables_source(programs.values())]),
        constants(equations, derivatives, momenta=canonical) + run_constants(equations),
        parameters,
        *arrays,
        *tables,
        *functions,
        script,
    ]
    return {f"{file_stem(equations.presentation.name, PYTHON_MODULES)}.py": "\n\n".join(parts)}


def _canonical(equations: Equations) -> str:
    """Define the functions of [q, p]."""
    arguments = _arguments(equations)
    replacements = {
        "@PASSED@": "p, u" if equations.system.inputs else "p",
        "@P@": arguments,
        "@N@": str(len(equations.system.coordinates)),
    }
    return filled(python_template("canonical"), replacements)


def _notes(equations: Equations) -> list[str]:
    """Return the lines of the module's docstring on its functions."""
    singular = "configuration" if equations.system.multipliers else "mass matrix"
    return [
        f"p a Parameters, and returns NaN where there is no result (a singular {singular}, a",
        *(_DRIVEN if equations.system.inputs else ["domain error, overflow). With SciPy:"]),
        "",
        "    solve_ivp(rhs, (0, 10), INITIAL, args=(DEFAULTS,))",
        *ARRAY_NOTES,
        *(CONTACT_NOTES if equations.system.contacts else []),
    ]


def _imports(of_math: Sequence[str], text: str) -> str:
    """Import what a module needs."""
    words = words_in(text)
    partial = ", partial" if "partial" in words else ""
    lines = [
        "import sys",
        *(["from bisect import bisect_right"] if "bisect_right" in words else []),
        f"from functools import cache{partial}",
        *of_math,
        "from types import FunctionType",
        "from typing import NamedTuple",
        "",
        "import numpy as np",
        "from numpy import array, asarray",
        "",
    ]
    return "\n".join(lines)


def _arguments(equations: Equations) -> str:
    """Return parameters of the functions of the interface behind t and y, with their defaults."""
    return "p=DEFAULTS" + (", u=inputs" if equations.system.inputs else "")


def _sources(
    programs: Mapping[str, Program],
    names: Mapping[str, str],
    parameter: Callable[[str], str],
    sequences: Sequence[tuple[str, int]] = (),
) -> Iterator[str]:
    """Write the functions of programs; ``parameter`` gives the last arguments of one by name."""
    shared = {f"{prefix}rhs": prefix for prefix in sharing(programs)}
    written = {f"{prefix}multipliers" for prefix in shared.values()}
    for name, program in programs.items():
        if name in shared:
            prefix = shared[name]
            yield from shared_sources(prefix, program, names, parameter(name), sequences, ARRAYS)
        elif name not in written:
            yield function_source(program, name, names, parameter(name), sequences, ARRAYS)


def _functions(
    equations: Equations,
    fields: Sequence[str],
    recorded: bool,
    derivatives: Mapping[str, Program],
) -> tuple[dict[str, Program], list[str]]:
    """Programs of the functions, and the definitions of all functions."""
    names = local_names(equations, fields)
    passed = "p, u" if equations.system.inputs else "p"
    arguments = _arguments(equations)
    interface = [*FUNCTIONS_OF_STATE, *optional_outputs(equations)]
    # What stands as a default is defined first.
    programs = {
        name: program_of(equations, name) for name in sorted(interface, key="inputs".__ne__)
    }
    contact_functions = contact_programs(with_contact_flags(equations))
    if contact_functions:
        programs["flight_rhs"] = programs.pop("rhs")
        flagged = {name: d for name, d in derivatives.items() if name.startswith("contact_")}
        contact_functions |= flagged
        programs |= {name: d for name, d in derivatives.items() if name not in flagged}
    else:
        programs |= constraint_programs(equations, programs["rhs"]) | dict(derivatives)
    texts = {
        **dict.fromkeys(INTERNAL_FUNCTIONS, "p"),
        "inputs": "p=DEFAULTS" + (", u=recorded" if recorded else ""),
        "flight_rhs": passed,
    }
    split = (("p", len(fields)), ("contact", 2 * len(equations.system.contacts)))
    return programs, [
        *_sources(programs, names, lambda name: texts.get(name, arguments)),
        *_sources(contact_functions, names, lambda n: f"{texts.get(n, passed)}, contact", split),
        *filter(None, [project_source(programs, "p=DEFAULTS", style=ARRAYS)]),
        *interface_source(contact_functions, arguments),
    ]


def _script(equations: Equations) -> str:
    """Write the script of the module; states are led back to the closures where there are any."""
    text = python_template("script")
    recorded = any(source.recording is not None for source in equations.system.inputs)
    if recorded:
        text = text.replace(_NOT_FINITE, f"{_NOT_FINITE}, or a recording ends")
        text = text.replace(_SLOPE, f"{_HELD}{_SLOPE}")
        text = re.sub(r"(k[1-4] = rhs\(.*), p\)", r"\1, p, held)", text)
    if equations.system.closures:
        text = text.replace(_STEP, f"{_STEP}        y = project(s + h, y, p)\n")
        text = text.replace(_START, f"{_START}{_CHECKED}")
        start = python_template("start").replace("@TOLERANCE@", repr(START_TOLERANCE))
        start = start.replace("@ROUNDING@", repr(64 * float(DOUBLE_ROUNDING)))
        text = text.replace(_MAIN, f"{start}\n\n{_MAIN}")
        text = text.replace(_SINGULAR, _SINGULAR_CLOSED)
    if equations.system.contacts:
        held_inputs = _HELD.replace("        ", "    ").replace("=s +", "=t +") if recorded else ""
        text = contact_script(text, held_inputs, float(DOUBLE_ROUNDING))
        text = text.replace(_SINGULAR, _SINGULAR_CLOSED)
    return text
