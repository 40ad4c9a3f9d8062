"""Python over symbols: modules for JAX and CasADi, of the same programs in other vocabularies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.emit.naming import PYTHON_RESERVED, unique_identifiers
from lagrange_cli.emit.python.functions import FUNCTIONS_OF_STATE, function_source
from lagrange_cli.emit.python.heading import (
    constants,
    docstring,
    local_names,
    parameters_source,
)
from lagrange_cli.emit.python.styles import Style, array_functions
from lagrange_cli.emit.template_files import filled, python_template
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.program.emitted_functions import (
    INTERNAL_FUNCTIONS,
    constraint_programs,
    program_of,
)
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.program import Program, optional_outputs

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations


@dataclass(frozen=True)
class _Library:
    """A library that evaluates expressions by itself.

    Attributes
    ----------
    functions
        Function of a program → text of the callee.
    template
        The name of what stands for the names that functions call.
    notes
        What the docstring of a module says of its functions.
    """

    functions: Mapping[str, str]
    template: str
    notes: tuple[str, ...]


_OTHERWISE = {"abs": "fabs", "pow": "power", "min": "fmin", "max": "fmax"}

_LIBRARIES = {
    "jax": _Library(
        array_functions("jnp"),
        "style_jax",
        (
            "p a Parameters, numbers or arrays of JAX, and can be handed to jax.jit, jax.vmap and",
            "jax.grad. Where there is no result they return NaN, or what is not finite. JAX",
            "computes with 32 bits unless it is told otherwise:",
            "",
            '    jax.config.update("jax_enable_x64", True)',
            "    step = jax.jit(jax.vmap(rhs, (None, 1, None), 1))",
        ),
    ),
    "casadi": _Library(
        {name: f"casadi.{_OTHERWISE.get(name, name)}" for name in PROGRAM_FUNCTIONS},
        "style_casadi",
        (
            "p a Parameters, over numbers and expressions of CasADi (SX). Where there is no result",
            "they give NaN, or what is not finite. function(rhs) is the casadi.Function:",
            "",
            "    function(rhs)(0, INITIAL, DEFAULTS)",
            "    function(rhs).jacobian()",
        ),
    ),
}

#: What the docstring says besides where there are inputs.
_DRIVEN = {
    "jax": ["", "After p they take u, a function of (t, y, p) that returns the values of INPUTS."],
    "casadi": [
        "",
        "After p they take u, a function of (t, y, p) that returns the values of INPUTS; the",
        "casadi.Function takes their values.",
    ],
}


def traced_module(equations: Equations, style: str, further: Sequence[str]) -> str:
    """Write a module whose functions take expressions of a library, ``jax`` or ``casadi``.

    ``further``: functions of derivatives that are asked for besides.

    Raises
    ------
    InputError
        The scene has contacts or recordings, which ask for branches, or is written as loops; or
        derivatives are asked for, which the library finds by itself.
    """
    if further:
        problem = f"--with {further[0]} is for --style numpy"
        if further[0] != "canonical":
            problem += f"; {style} differentiates by itself"
        raise InputError(Problem(problem, rule="usage"))
    library = _LIBRARIES[style]
    fields = unique_identifiers((p.name for p in equations.system.parameters), PYTHON_RESERVED)
    programs = _programs(equations, style)
    names = local_names(equations, fields)
    arguments = "p=DEFAULTS" + (", u=inputs" if equations.system.inputs else "")
    vocabulary = Style(library.functions, traced=True)
    notes = [*library.notes, *(_DRIVEN[style] if equations.system.inputs else [])]
    head = "from math import nan\nfrom typing import NamedTuple"
    of_inputs = {"inputs": "p=DEFAULTS"}
    parts = [
        docstring(equations, notes, projected=False),
        f"{head}\n\n{python_template(library.template)}",
        constants(equations, {}),
        parameters_source(equations, fields),
        *(
            function_source(program, name, names, of_inputs.get(name, arguments), (), vocabulary)
            for name, program in programs.items()
        ),
        *([_casadi_function(equations)] if style == "casadi" else []),
    ]
    return "\n\n".join(parts)


def _programs(equations: Equations, style: str) -> dict[str, Program]:
    """Programs of the functions, ``inputs`` first, which stands as a default.

    Raises
    ------
    InputError
        As :func:`traced_module`.
    """
    if equations.system.contacts:
        raise _refused(style, "contacts open and close at events, which it cannot follow")
    if any(source.recording is not None for source in equations.system.inputs):
        raise _refused(style, "inputs from a file are looked up, which its expressions cannot do")
    wanted = [*FUNCTIONS_OF_STATE, *optional_outputs(equations)]
    programs = {name: program_of(equations, name) for name in sorted(wanted, key="inputs".__ne__)}
    further = constraint_programs(equations)
    programs |= {name: further[name] for name in further if name not in INTERNAL_FUNCTIONS}
    if any(program.parts for program in programs.values()):
        raise _refused(style, "code of a system of this size is loops, which assign to arrays")
    return programs


def _refused(style: str, reason: str) -> InputError:
    return InputError(
        Problem(
            f"style '{style}' does not suit this scene: {reason}",
            hint="--style numpy holds every scene",
            rule="style",
        )
    )


def _casadi_function(equations: Equations) -> str:
    """Define the function that makes a ``casadi.Function``."""
    driven = bool(equations.system.inputs)
    text = python_template("casadi_function")
    inputs = python_template("casadi_inputs") if driven else ""
    return filled(text, {"@INPUTS@": inputs, "@AND@": ", u" if driven else ""})
