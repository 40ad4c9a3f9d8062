"""The registry of output formats: what ``lagrange emit --to`` can write.

Help, choices, documentation and tests derive from :data:`EMITTERS`. To add a
format, write a module with ``emit(equations, options) -> dict[str, str]`` and
add an :class:`Emitter` whose ``run`` imports it when called (importing this
module loads no format and no SymPy). :mod:`lagrange_cli.emit.base` says what a
format promises.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

from lagrange_cli.emit.base import Emitter, Option, OptionValue, Package, unknown_choice
from lagrange_cli.emit.naming import C_HEADERS, OCTAVE_RESERVED, PYTHON_MODULES
from lagrange_cli.report.document_options import DOCUMENTS

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations


def _document(
    name: str, equations: Equations, options: Mapping[str, OptionValue]
) -> dict[str, str]:
    from lagrange_cli.report.contents.derivation.documents import written_document

    return written_document(name, equations, options)


def _step_errors(equations: Equations, options: Mapping[str, OptionValue]) -> Mapping[str, str]:
    """Measure the errors of the fixed steps that are asked for: function → a sentence on it."""
    from lagrange_cli.emit.fixed_steps import FIXED_STEPS, require_steps

    errors = {}
    for name in require_steps(equations, options):
        from lagrange_cli.studies.step_error import step_error  # imports SciPy

        errors[name] = step_error(equations, FIXED_STEPS[name].routine, FIXED_STEPS[name].arrays)
    return errors


def _c(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    from lagrange_cli.emit.c.module import emit_c

    return emit_c(equations, options, _step_errors(equations, options))


def _python(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    from lagrange_cli.emit.python.module import emit_python

    return emit_python(equations, options, _step_errors(equations, options))


def _javascript(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    from lagrange_cli.emit.languages.javascript import emit_javascript

    return emit_javascript(equations, options, _step_errors(equations, options))


def _fortran(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    from lagrange_cli.emit.languages.fortran import emit_fortran

    return emit_fortran(equations, options, _step_errors(equations, options))


def _fmu(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    from lagrange_cli.emit.fmu.module import emit_fmu

    return emit_fmu(equations, options)


def _packed_fmu(name: str, texts: Mapping[str, str]) -> Package:
    from lagrange_cli.emit.fmu.module import pack_unit

    return pack_unit(name, texts)


def _octave(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    from lagrange_cli.emit.languages.octave import emit_octave

    return emit_octave(equations, options, _step_errors(equations, options))


def _cpp(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    from lagrange_cli.emit.languages.cpp import emit_cpp

    return emit_cpp(equations, options, _step_errors(equations, options))


def _rust(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    from lagrange_cli.emit.languages.rust import emit_rust

    return emit_rust(equations, options, _step_errors(equations, options))


def _tikz(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    from lagrange_cli.pictures.sketch.tikz import emit_tikz

    return emit_tikz(equations, options)


def _svg(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    from lagrange_cli.pictures.sketch.svg import emit_svg

    return emit_svg(equations, options)


_JACOBIAN = Option(
    "jacobian",
    "derivatives of the right-hand side",
    further=True,
)

_MAIN = Option("main", "a main that integrates and prints CSV")

_LINEARIZATION = Option(
    "linearization",
    "A, B, C, D at any state",
    further=True,
)

_CANONICAL = Option(
    "canonical",
    "Hamilton's equations and H",
    further=True,
)

_STEPS = (
    Option("step", "a fixed step of order 4 for real time", further=True),
    Option("midpoint", "a fixed step by the implicit midpoint rule", further=True),
)

EMITTERS: dict[str, Emitter] = {
    entry.name: entry
    for entry in (
        *(
            Emitter(
                name=name,
                title=form.title,
                extensions=(form.ending,),
                single_file=True,
                run=partial(_document, name),
                shows_steps=True,
                options=form.options,
            )
            for name, form in DOCUMENTS.items()
        ),
        Emitter(
            name="c",
            title="C99: a header and a source file that need only <math.h>",
            extensions=(".h", ".c"),
            single_file=False,
            run=_c,
            reserved=C_HEADERS,
            options=(
                Option(
                    "real",
                    "the floating-point type",
                    choices=("float", "double", "long-double"),
                    default="double",
                ),
                _MAIN,
                Option("header_only", "one header that holds the source behind a macro"),
                _JACOBIAN,
                _LINEARIZATION,
                _CANONICAL,
                *_STEPS,
            ),
        ),
        Emitter(
            name="python",
            title="Python: a module that needs only NumPy, runnable as a script",
            extensions=(".py",),
            single_file=True,
            run=_python,
            reserved=PYTHON_MODULES,
            options=(
                Option(
                    "style",
                    "the package that computes",
                    choices=("numpy", "numba", "jax", "casadi"),
                    default="numpy",
                ),
                _JACOBIAN,
                _LINEARIZATION,
                _CANONICAL,
                *_STEPS,
            ),
        ),
        Emitter(
            name="javascript",
            title="JavaScript: an ES module for browsers and Node.js, runnable as a script",
            extensions=(".mjs",),
            single_file=True,
            run=_javascript,
            options=(_JACOBIAN, *_STEPS),
        ),
        Emitter(
            name="fortran",
            title="Fortran 2018: a module of pure subroutines, without dependencies",
            extensions=(".f90",),
            single_file=True,
            run=_fortran,
            options=(
                Option("main", "a program that integrates and prints CSV"),
                _JACOBIAN,
                *_STEPS,
            ),
        ),
        Emitter(
            name="octave",
            title="Octave and MATLAB: a file that returns functions, runnable as a script",
            extensions=(".m",),
            single_file=True,
            run=_octave,
            reserved=OCTAVE_RESERVED,
            options=(_JACOBIAN, *_STEPS),
        ),
        Emitter(
            name="fmu",
            title="FMI unit: model exchange and co-simulation, with sources and a library",
            extensions=(".fmu",),
            single_file=False,
            run=_fmu,
            pack=_packed_fmu,
            options=(
                Option("fmi", "the version of the standard", choices=("2", "3"), default="2"),
            ),
        ),
        Emitter(
            name="cpp",
            title="C++17: a header of templates over the number type, for autodiff too",
            extensions=(".hpp",),
            single_file=True,
            run=_cpp,
            reserved=C_HEADERS,
            options=(_MAIN, _JACOBIAN, *_STEPS),
        ),
        Emitter(
            name="rust",
            title="Rust: a module that needs only core, and libm where there is no std",
            extensions=(".rs",),
            single_file=True,
            run=_rust,
            options=(_MAIN, _JACOBIAN, *_STEPS),
        ),
        Emitter(
            name="tikz",
            title="TikZ: a sketch of the system at its start, for \\input into LaTeX",
            extensions=(".tikz.tex",),
            single_file=True,
            run=_tikz,
        ),
        Emitter(
            name="svg",
            title="SVG: a sketch of the system at its start, for pages and browsers",
            extensions=(".svg",),
            single_file=True,
            run=_svg,
        ),
    )
}
"""Every format by the name that ``--to`` takes."""


def emitter(name: str) -> Emitter:
    """Return the format of that name.

    Raises
    ------
    InputError
        There is none; the message lists those there are.
    """
    if name not in EMITTERS:
        raise unknown_choice(
            f"unknown format '{name}'; there are {', '.join(EMITTERS)}", name, list(EMITTERS)
        )
    return EMITTERS[name]
