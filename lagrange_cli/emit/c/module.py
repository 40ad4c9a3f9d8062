"""C99: a header and a source file with the C interface of the documentation.

The code allocates nothing, keeps no state, calls only ``<math.h>``, and
compiles without warnings as C99 and as C++.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from lagrange_cli.cache import digest
from lagrange_cli.emit.c.body import function_text
from lagrange_cli.emit.c.constraints import (
    change_text,
    contact_target,
    interface_text,
    mode_workspace_size,
    project_text,
    residual_text,
)
from lagrange_cli.emit.c.further import (
    canonical_text,
    canonical_workspace_size,
    derivatives_of,
    linearization_text,
    pattern_texts,
    step_declarations,
    step_text,
)
from lagrange_cli.emit.c.header import header_text
from lagrange_cli.emit.c.main import main_text
from lagrange_cli.emit.c.solvers import (
    helper_text,
    loop_helpers,
    solver_text,
)
from lagrange_cli.emit.c.target import CTarget, real_type
from lagrange_cli.emit.fixed_steps import require_steps
from lagrange_cli.emit.initial_state import require_a_program
from lagrange_cli.emit.naming import C_HEADERS, file_stem
from lagrange_cli.emit.shared_code import programs_of_momenta, switch_places
from lagrange_cli.program.emitted_functions import (
    constraint_programs,
    contact_programs,
    derivative_programs,
    optional_outputs,
)
from lagrange_cli.program.operations import operands_of
from lagrange_cli.program.printing import functions_in
from lagrange_cli.program.program import Program, build_program
from lagrange_cli.program.solvers.blocks import MatrixBlock
from lagrange_cli.program.systems.contact_systems import with_contact_flags

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

_MATH = "#include <math.h>\n"

#: Function of the interface → outputs that it writes, one after the other.
_OUTPUTS: dict[str, tuple[str, ...]] = {
    "rhs": ("acceleration",),
    "mass_matrix": ("mass_matrix",),
    "forcing": ("forcing",),
    "energy": ("kinetic", "potential", "energy"),
    "positions": ("positions",),
}


def emit_c(
    equations: Equations,
    options: Mapping[str, str | bool],
    step_errors: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, str]:
    """Return ``NAME.h`` and ``NAME.c``, or the header alone that holds both.

    Parameters
    ----------
    options
        ``real``: ``float``, ``double`` or ``long-double``; ``main``: whether
        the source ends with a ``main`` that integrates and prints CSV; ``header_only``:
        whether the header holds the source, too.
    step_errors
        Function of fixed steps → a sentence on its measured error.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in C.
    InputError
        A constant is outside the range of the number type; ``main`` is asked for where
        nothing can move.
    """
    if options["main"]:
        require_a_program(equations)
    steps = require_steps(equations, options)
    target = CTarget.of(equations, real_type(str(options["real"])))
    programs = _programs(equations)
    linearized = bool(options["linearization"] and equations.system.coordinates)
    programs |= derivative_programs(
        equations, jacobian=bool(options["jacobian"]), linearization=linearized
    )
    canonical = bool(options["canonical"] and equations.system.coordinates)
    programs |= programs_of_momenta(equations) if canonical else {}
    stem = file_stem(equations.presentation.name, C_HEADERS)
    source = _source(equations, target, programs, stem)
    if linearized:
        source += "\n" + linearization_text(equations, programs, target)
    if canonical:
        source += "\n" + canonical_text(equations, target)
    if steps:
        source += "\n" + step_text(equations, target, steps)
    if options["main"]:
        source += main_text(equations, target)
    work = mode_workspace_size(programs, len(equations.system.contacts))
    if canonical:
        work = canonical_workspace_size(programs, len(equations.system.coordinates))
    header = header_text(
        equations,
        target,
        work,
        derivatives_of(programs),
        linearized=linearized,
        canonical=canonical,
        steps=step_declarations(equations, target, steps, step_errors),
    )
    if options["header_only"]:
        return {f"{stem}.h": _with_source(header, source, target.prefix)}
    stamp = f"0x{digest(header, source)[:8]}UL"
    size, macro = f"#define {target.prefix}_WORK ", f"#define {target.prefix}_EMISSION {stamp}\n"
    return {
        f"{stem}.h": header.replace(size, macro + size, 1),
        f"{stem}.c": source.replace(_MATH, _same_emission(target.prefix, stem, stamp) + _MATH, 1),
    }


def _with_source(header: str, source: str, prefix: str) -> str:
    """Return the header with the source behind it, which one file of a program asks for by a macro.
    It stands behind the guard: a file may include the header through another one before."""
    macro = f"{prefix}_IMPLEMENTATION"
    return (
        f"{header}\n"
        f"/* Define {macro} in one source file before it includes this header. */\n"
        f"#ifdef {macro}\n\n{source[source.index(_MATH) :]}\n#endif\n"
    )


def _same_emission(prefix: str, stem: str, stamp: str) -> str:
    """A source file with the header of another emission would be wrong in silence: fields and the
    size of the workspace would be others. Two files cannot be replaced in one step."""
    return (
        f"#if {prefix}_EMISSION != {stamp}\n"
        f'#error "{stem}.c and {stem}.h are not of one emission: emit both once more"\n'
        "#endif\n\n"
    )


def _programs(equations: Equations) -> dict[str, Program]:
    """Return the programs of all functions. With contacts those of the constraints read flags, and
    the right-hand side without any is one of two."""
    functions = _OUTPUTS | {name: (name,) for name in optional_outputs(equations)}
    programs = {name: build_program(equations, outputs) for name, outputs in functions.items()}
    if not equations.system.contacts:
        return programs | constraint_programs(equations, programs["rhs"])
    flight = {"flight_rhs": programs.pop("rhs")}
    return flight | programs | contact_programs(with_contact_flags(equations))


def _source(
    equations: Equations, target: CTarget, programs: Mapping[str, Program], stem: str
) -> str:
    used = set().union(*(functions_used(program) for program in programs.values()))
    parts = [
        f"/* {target.prefix}: see {stem}.h, which documents every function. */\n",
        f'#include "{stem}.h"\n\n{_MATH}',
        helper_text(used, target),
        solver_text(blocks_of(programs), programs.values(), target),
        loop_helpers(programs, target),
        _defaults(equations, target),
    ]
    contacts = len(equations.system.contacts)
    inner = contact_target(target, contacts)
    for function, program in programs.items():
        flags = program.parameters > len(target.names.fields)
        parts.append(function_text(function, program, inner if flags else target))
    parts += [*pattern_texts(programs, target, contacts=bool(contacts))]
    parts += [residual_text(programs, target), project_text(programs, target)]
    parts.append(change_text(programs, target, switch_places(equations)))
    if contacts:
        parts.append(interface_text(programs, target, contacts))
    return "\n".join(part for part in parts if part)


def blocks_of(programs: Mapping[str, Program]) -> list[MatrixBlock]:
    """Return the systems that right-hand sides solve, with contacts and without."""
    sides = [programs[name] for name in ("rhs", "flight_rhs", "contact_rhs") if name in programs]
    return [block for program in sides for block in program.blocks]


def functions_used(program: Program) -> set[str]:
    """Return the functions that a program calls."""
    return functions_in(operand for operand, _ in operands_of(program))


def _defaults(equations: Equations, target: CTarget) -> str:
    names, real = target.names, target.real
    lines = [f"void {names.prefix}_defaults({names.prefix}_params *p)", "{"]
    for parameter, field in zip(equations.system.parameters, names.fields, strict=True):
        value = "NAN" if parameter.value is None else real.value(parameter.value)
        lines.append(f"    p->{field} = {value};")
    if not equations.system.parameters:
        lines.append(f"    p->{names.empty_field} = {real.value(0.0)};")
    return "\n".join([*lines, "}", ""])
