"""C for the simulation: the emitted functions over dummy names, in one text to compile and load.

The function bodies are those of :mod:`lagrange_cli.emit.c.module`; coordinates and
parameters have numbers instead of the scene's names, so that no text of a
scene reaches the compiler and equal systems have equal texts.

Guarded right-hand sides end at a singular configuration that a motion cannot pass. The singular
configuration of a chart of polar kind (the pole of spherical angles) is stepped over unseen if a
motion passes it closer than steps resolve: the true motion turns there within no time, the numbers
come out on the other side. A right-hand side that does not exist on the other side makes
integrators shorten their steps until they resolve the passage, or end before it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple
from fractions import Fraction

from lagrange_cli.emit.c.body import function_text
from lagrange_cli.emit.c.constraints import impact_text, project_text, residual_text
from lagrange_cli.emit.c.module import blocks_of, functions_used
from lagrange_cli.emit.c.solvers import helper_text, loop_helpers, solver_text
from lagrange_cli.emit.c.target import CNames, CTarget, Real, real_type
from lagrange_cli.emit.template_files import c_template, filled
from lagrange_cli.program.emitted_functions import multipliers_beside
from lagrange_cli.program.graph.operands import Coefficient
from lagrange_cli.program.printing import decimal_literal
from lagrange_cli.program.program import Program, result_count
from lagrange_cli.simulate.native.simd import LANES_HEADER, lanes_text
from lagrange_cli.simulate.native.taylor import TAYLOR_HEADER, taylor_text
from lagrange_cli.state_layout import StateLayout

#: The program whose numbers vanish at singular configurations.
GUARD_PROGRAM = "places"

#: Right-hand sides that have a guarded form, and what the names of perturbed ones hold.
_GUARDED = ("rhs", "disturbed", "sided_rhs", "sided_disturbed")
_PERTURBED = "disturbed"

_TEST = """\
    if (side[{k}]*place[{k}] < 0 && (side[{k}]*side[{k}] > 1{moves})) {{
        return 1;
    }}"""


def guard_source(
    programs: Mapping[str, Program],
    rates: Sequence[Sequence[int]],
    real: Real,
    lanes: str | None = None,
) -> str:
    """Write the guarded right-hand sides that follow a library, as ``system_guarded_NAME``.

    Parameters
    ----------
    programs
        Those of the library; empty text where :data:`GUARD_PROGRAM` is not among them.
    rates
        For each singular configuration the numbers, in the state, of the rates that move nothing
        there.
    lanes
        None: right-hand sides at one state. Else the text that has those at eight states at once,
        which is what the functions given back are for as well.
    """
    if GUARD_PROGRAM not in programs:
        return ""
    tests = [
        _TEST.format(k=k, moves="".join(f" || y[{i}] != 0" for i in numbers))
        for k, numbers in enumerate(rates)
    ]
    values = {
        "@REAL@": real.name,
        "@PLACES@": str(result_count(programs[GUARD_PROGRAM])),
        "@TESTS@": "\n".join(tests),
        "@NUMBERS@": str(programs["rhs"].layout.size),
    }
    # All perturbed ones are handed as many factors as the one that reads most.
    most = max((p.parameters for name, p in programs.items() if _PERTURBED in name), default=0)
    offsets = {
        name: most if _PERTURBED in name else program.parameters
        for name, program in programs.items()
    }
    template = c_template("guarded" if lanes is None else "guarded_lanes")
    return "\n".join(
        filled(template, {"@FUNCTION@": name, "@OFFSET@": str(offsets[name]), **values})
        for name in _GUARDED
        if name in programs and (lanes is None or f"system_{name}_lanes(" in lanes)
    )


class _AnyType(Real):
    """Doubles, or by an option of the compiler numbers of a wider type (:file:`numbers.h`)."""

    def literal(self, value: Coefficient) -> str:
        """Return a constant that reads as the number nearest to ``value`` in each type."""
        text = super().literal(value)  # refuses what is beyond doubles
        if Fraction(float(value)) == value:
            return text
        sign, digits = ("-", decimal_literal(-value)) if value < 0 else ("", decimal_literal(value))
        return f"{sign}R({digits})"


#: The numbers that simulations compute with first.
C_DOUBLE = _AnyType(*astuple(real_type("double")))

#: The beginning of a text, which is whole without other files where it computes with doubles.
_NUMBERS = """\
#ifdef LAGRANGE_WIDE
#include "numbers.h"
#else
#include <math.h>
#define R(constant) constant
#endif
"""

#: Functions that are evaluated at the samples of many motions.
_TABLES = ("energy", "positions", "velocities", "outputs")


def library_source(programs: Mapping[str, Program], real: Real = C_DOUBLE) -> str:
    """Write C with a function ``system_NAME`` for each program.

    With those of :func:`lagrange_cli.program.emitted_functions.constraint_programs` there
    is ``system_project`` too, with those of ``contact_programs`` beside it
    ``system_contact_project``, ``system_events`` and ``system_reset``;
    :func:`lagrange_cli.emit.c.constraints.workspace_size` is the size of ``work`` that serves all
    of them. The programs read parameters from an array at ``p``, of numbers of the type ``real``.
    """
    target = _target(programs, real)
    used = set().union(*(functions_used(program) for program in programs.values()))
    parts = [
        _NUMBERS,
        _parameter_type(programs, real),
        helper_text(used, target),
        solver_text(blocks_of(programs), programs.values(), target),
        loop_helpers(programs, target),
        *(_function_text(f, programs, target) for f in programs),
        residual_text(programs, target),
        *(project_text(programs, target, kind) for kind in ("", "contact_")),
        impact_text(programs, target),
        _both(programs),
    ]
    return "\n".join(filter(None, parts))


def _shared_prefixes(programs: Mapping[str, Program]) -> list[str]:
    """List the prefixes of right-hand sides whose accelerations and multipliers come from one
    solve."""
    functions = [(p, f"{p}rhs", f"{p}multipliers") for p in ("", "contact_")]
    known = [(p, *pair) for p, *pair in functions if programs.keys() >= {*pair}]
    return [p for p, a, b in known if multipliers_beside(programs[a]) == programs[b]]


def _function_text(function: str, programs: Mapping[str, Program], target: CTarget) -> str:
    """Write a function, that of multipliers by means of the right-hand side if it finds them."""
    prefix = function.removesuffix("multipliers")
    if prefix == function or prefix not in _shared_prefixes(programs):
        return function_text(function, programs[function], target)
    side = programs[f"{prefix}rhs"]
    (block,) = side.blocks
    numbers = {
        "@OF@": prefix,
        "@BEHIND@": str(side.layout.size),
        "@CLOSURES@": str(len(block.closures)),
        "@START@": str(block.size**2 + len(block.coordinates)),
    }
    return target.fill(c_template("shared_multipliers"), numbers)


def _both(programs: Mapping[str, Program]) -> str:
    """Write the event functions of contacts, then of surfaces; empty unless there are both."""
    if not {"gaps", "surfaces"} <= programs.keys():
        return ""
    return c_template("events_and_surfaces").replace(
        "@CONTACTS@", str(result_count(programs["gaps"]) // 2)
    )


def lanes_source(programs: Mapping[str, Program]) -> str:
    """Write right-hand sides at eight states at once, as functions ``system_NAME_lanes``.

    They follow the text of :func:`library_source`; empty where none has that form.
    """
    texts = _texts(lanes_text, [f for f, p in programs.items() if p.blocks], programs)
    return "\n".join([f'#include "{LANES_HEADER}"\n', *texts]) if any(texts) else ""


def taylor_source(programs: Mapping[str, Program]) -> str:
    """Write recurrences for the Taylor coefficients of right-hand sides, as functions
    ``system_NAME_taylor``; empty where one of them has none."""
    sides = _texts(taylor_text, ("rhs", "disturbed"), programs)
    return "\n".join([f'#include "{TAYLOR_HEADER}"\n', *sides]) if all(sides) else ""


def lane_tables_source(programs: Mapping[str, Program]) -> str:
    """Write the functions of samples at eight states at once, as ``system_NAME_lanes``.

    They follow the text of :func:`taylor_source`; those without that form are left out.
    """
    texts = _texts(lanes_text, [f for f in _TABLES if f in programs], programs)
    return "\n".join([_parameter_type(programs, C_DOUBLE), *texts])


def _texts(
    write: Callable[[str, Program, CTarget], str],
    functions: Sequence[str],
    programs: Mapping[str, Program],
) -> list[str]:
    """Write functions; those of large programs are empty, and their many names not even made."""
    small = {f for f in functions if not programs[f].is_large}
    if not small:
        return [""] * len(functions)
    target = _target(programs, C_DOUBLE)
    return [write(f, programs[f], target) if f in small else "" for f in functions]


def _parameter_type(programs: Mapping[str, Program], real: Real) -> str:
    return f"typedef struct {{ {real.name} p[{max(_parameters(programs), 1)}]; }} system_params;\n"


def _target(programs: Mapping[str, Program], real: Real) -> CTarget:
    side = programs["rhs"]
    return CTarget(_dummy_names(side.layout, _parameters(programs), side.driven), real)


def _parameters(programs: Mapping[str, Program]) -> int:
    return max(program.parameters for program in programs.values())


def _dummy_names(layout: StateLayout, parameters: int, driven: int) -> CNames:
    inputs = {f"p{i}": f"p->p[{i}]" for i in range(parameters)}
    inputs |= {name: name for name in layout.variables}
    inputs |= {f"u{i}": f"u[{i}]" for i in range(driven)}
    return CNames("system", (), inputs, parameter_array="p->p")
