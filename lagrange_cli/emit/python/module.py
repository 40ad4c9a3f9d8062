"""Python: one module that needs NumPy alone and runs as a script.

Scene names appear as identifiers, scene text only in comments and string literals that ``ascii``
wrote. Functions are lowered programs (:mod:`lagrange_cli.emit.python.body` prints them); what leads
from one to the next (projection, events, the script) are templates.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from lagrange_cli.emit.naming import PYTHON_MODULES, comment_text, file_stem
from lagrange_cli.emit.python.body import function_text
from lagrange_cli.emit.python.heading import constants, docstring, parameters_source, recordings
from lagrange_cli.emit.python.interface import (
    canonical_source,
    contacts_source,
    layout_tokens,
    linearization_source,
    projection_source,
    recorded_source,
    script_source,
    steps_source,
    switches_source,
    whole_jacobians,
)
from lagrange_cli.emit.python.layout import TAB, Signature, Tables, defined
from lagrange_cli.emit.python.names import SceneNames, scene_names
from lagrange_cli.emit.python.traced import refuse_branches, refuse_further, traced_text
from lagrange_cli.emit.python.vocabulary import VOCABULARIES, Vocabulary
from lagrange_cli.emit.shared_code import programs_of_momenta
from lagrange_cli.emit.template_files import filled, python_template
from lagrange_cli.errors import InputError
from lagrange_cli.program.emitted_functions import (
    CANONICAL_PARTS,
    ENTRIES,
    INTERNAL_FUNCTIONS,
    SLOPES,
    constraint_programs,
    contact_programs,
    derivative_programs,
    multipliers_beside,
    optional_outputs,
    program_of,
)
from lagrange_cli.program.kinds import ProgramKind
from lagrange_cli.program.lowered.lowering import lowered
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.blocks import LARGEST_UNROLLED
from lagrange_cli.program.systems.contact_systems import with_contact_flags

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Functions that every module has.
FUNCTIONS_OF_STATE = ("rhs", "mass_matrix", "forcing", "energy", "positions", "velocities")

#: Options that ask for further functions.
_FURTHER = ("jacobian", "linearization", "canonical", "step", "midpoint")

#: Functions that take flags of contacts, and those that take targets too.
_FLAGGED = frozenset({"gaps", "gap_terms"})

#: Helpers of functions, by the names of their templates.
_SOLVERS = {
    "solve": {"numpy": "solve", "numba": "solve_numba", "jax": "solve_jax"},
    "solve_definite": {"casadi": "solve_definite_casadi"},
    "solve_banded": {"numpy": "solve_banded", "numba": "solve_banded"},
    "solve_sparse": {"numpy": "solve_sparse", "numba": "solve_sparse"},
}

_DOCS = {
    "rhs": "State derivative [v, a].",
    "flight": "State derivative while all contacts are open.",
    "solution": "Accelerations, then multipliers.",
    "mass_matrix": "Mass matrix M(q, t) of M a = f, n by n.",
    "forcing": "Forcing f(q, v, t) of M a = f.",
    "energy": "Energy function: the sum of v dL/dv, less L (T + V in most systems).",
    "positions": "Cartesian names, in the order of CARTESIAN.",
    "velocities": "Time derivatives of the Cartesian names, in the order of CARTESIAN.",
    "inputs": "Inputs as the scene has them at time t, in the order of INPUTS.",
    "outputs": "Outputs, in the order of OUTPUTS.",
    "switches": "Numbers, one for each of SWITCHES, that are positive as long as its value stays.",
    "multipliers": "Multipliers, in the order of MULTIPLIERS.",
    "constraints": "Residuals: lhs - rhs of closures of positions, then rates of all closures.",
    "position_error": "Closures of positions, then the magnitudes behind them.",
    "position_reach": "Squares of the gradients of closures of positions, over the masses.",
    "position_change": "Change of q that makes the linearized closures vanish.",
    "velocity_error": "Rates of the closures, then the magnitudes behind them.",
    "velocity_change": "Change of v that makes the rates of the closures vanish.",
    "gaps": "Gaps of all contacts, then the magnitudes behind them.",
    "gap_terms": "Gradients of the gaps, by rows; their rates; biases; restitutions.",
    "impulse": "Change of v that changes the rates of closed contacts by the targets.",
    "jacobian": "Derivatives of rhs by y, by rows.",
    "jacobian_u": "Derivatives of rhs by the inputs, in the order of INPUTS, by rows.",
    "jacobian_p": "Derivatives of rhs by the parameters, in their order, by rows.",
    "output_jacobian": "Derivatives of the outputs by q, then by v.",
    "output_jacobian_u": "Derivatives of the outputs by the inputs.",
    "constraint_jacobian": "Derivatives of what constraints gives by q, then by v.",
    "momenta": "Momenta dL/dv.",
    "legendre": "Velocities of momenta, which stand in their places.",
    "momentum_rates": "Rates of the momenta at a state.",
}


def emit_python(
    equations: Equations,
    options: Mapping[str, str | bool],
    step_errors: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, str]:
    """``NAME.py``.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in Python.
    InputError
        A constant is outside the range of a double, or the style cannot hold the scene.
    """
    text = _Module(equations, options, step_errors).text()
    return {f"{file_stem(equations.presentation.name, PYTHON_MODULES)}.py": text}


#: Function that gives accelerations and multipliers, and those that it is evaluated for.
_SOLUTION = "solution"
_SHARING = ("rhs", "multipliers")


def _with_solution(programs: dict[str, Program], prefix: str) -> dict[str, Program]:
    """Put the solution for accelerations and multipliers before the functions that share it.

    A right-hand side that has rates of states too is solved by itself.
    """
    rhs = programs[f"{prefix}rhs"]
    if rhs.states or multipliers_beside(rhs) is None:
        return programs
    return {f"{prefix}{_SOLUTION}": replace(rhs, kind=ProgramKind.SOLUTION)} | programs


class _Module:
    """Parts of a module in their order."""

    def __init__(
        self,
        equations: Equations,
        options: Mapping[str, str | bool],
        step_errors: Mapping[str, str],
    ) -> None:
        self.equations = equations
        self.step_errors = step_errors
        self.options = options
        self.style = str(options["style"])
        self.traced = self.style in ("jax", "casadi")
        if self.traced:
            refuse_further(self.style, [name for name in _FURTHER if options[name]])
            refuse_branches(self.style, equations, loops=False)
        self.vocabulary: Vocabulary = VOCABULARIES[self.style]
        self.names: SceneNames = scene_names(equations)
        self.tables = Tables()
        self.driven = bool(equations.system.inputs)
        self.canonical = bool(options["canonical"] and equations.system.coordinates)
        self.derivatives = derivative_programs(
            equations,
            jacobian=bool(options["jacobian"]),
            linearization=bool(options["linearization"]),
        )
        self.programs = self._programs()
        #: Arguments of the functions of the interface behind t and y.
        self.arguments = "p=DEFAULTS" + (", u=inputs" if self.driven else "")

    def _programs(self) -> dict[str, Program]:
        """Build the programs by function; what stands as a default comes first."""
        equations = self.equations
        momenta = programs_of_momenta(equations) if self.canonical else {}
        wanted = [*FUNCTIONS_OF_STATE, *optional_outputs(equations)]
        names = sorted(wanted, key="inputs".__ne__)
        programs = {name: program_of(equations, name) for name in names}
        if equations.system.contacts:
            flight = {"flight_rhs" if name == "rhs" else name: programs[name] for name in names}
            contacts = contact_programs(with_contact_flags(equations))
            return flight | _with_solution(contacts, "contact_") | self.derivatives
        further = constraint_programs(equations, programs["rhs"])
        if self.traced:
            further = {k: further[k] for k in further if k not in INTERNAL_FUNCTIONS}
            loops = any(program.parts for program in (*programs.values(), *further.values()))
            refuse_branches(self.style, equations, loops=loops)
            return programs | further | momenta
        return _with_solution(programs | further, "") | self.derivatives | momenta

    def text(self) -> str:
        """Return the whole module."""
        equations = self.equations
        functions = [self._function(name) for name in self.programs]
        body = [*functions, *self._around()]
        recorded = [] if self.traced else [recordings(equations)]
        recorded += [recorded_source()] if recorded and recorded[0] else []
        words = set(re.findall(r"\w+", "\n".join([*body, *recorded])))
        head = [docstring(equations, self.style) + "\n" + self._imports(words)]
        head[0] += "\n" + constants(
            equations, self.derivatives, momenta=self.canonical, arrays=not self.traced
        )
        parts = [
            *head,
            parameters_source(equations, self.names.fields),
            self.tables.source(),
            *recorded,
            *self._solvers(words),
            *body,
        ]
        return "\n\n".join(filter(None, parts))

    def _imports(self, words: set[str]) -> str:
        plain = [] if self.traced else ["import sys"]
        plain += ["from functools import partial"] if "partial" in words else []
        lines = [*plain, "from typing import NamedTuple", "", *self.vocabulary.imports, ""]
        return "\n".join(lines)

    def _solvers(self, words: set[str]) -> list[str]:
        decorator = f"{self.vocabulary.decorator}\n" if self.vocabulary.decorator else ""
        return [
            filled(python_template(templates[self.style]), {"@NJIT@": decorator})
            for name, templates in _SOLVERS.items()
            if name in words and self.style in templates
        ]

    def _function(self, name: str) -> str:
        signature = self._signature(name)
        solution = f"{name.removesuffix('rhs').removesuffix('multipliers')}{_SOLUTION}"
        if name != solution and solution in self.programs and name.endswith(_SHARING):
            body = self._of_solution(name.endswith("rhs"), signature)
            return defined(signature, body, self.vocabulary)
        function = lowered(self.programs[name], name)
        if self.traced:
            return traced_text(function, signature, self.names, self.vocabulary)
        return function_text(function, signature, self.names, self.vocabulary, self.tables)

    def _of_solution(self, is_rhs: bool, signature: Signature) -> list[str]:
        """Return the lines that take accelerations or multipliers from the solution of both."""
        n, call = len(self.equations.system.coordinates), f"_{_SOLUTION}({signature.passed})"
        result = f"np.concatenate((y[{n}:], {call}[:{n}]))" if is_rhs else f"{call}[{n}:]"
        return [*(TAB + line for line in signature.opening), f"{TAB}return {result}"]

    def _signature(self, name: str) -> Signature:
        """Choose name, arguments and documentation of a function."""
        flagged = name.startswith("contact_") or name == "impulse"
        plain = name.removeprefix("contact_")
        inner = plain in INTERNAL_FUNCTIONS | CANONICAL_PARTS | _FLAGGED or name in SLOPES
        inner = inner or name == "impulse" or plain == _SOLUTION
        arguments = self.arguments
        if name == "inputs":
            is_recorded = any(u.recording is not None for u in self.equations.system.inputs)
            arguments = "p=DEFAULTS" + (", u=recorded" if is_recorded else "")
        elif plain in INTERNAL_FUNCTIONS and name != "flight_rhs":
            arguments = "p"
        elif inner or name == "flight_rhs":
            arguments = "p, u" if self.driven else "p"
        if flagged:
            arguments += ", mode" if inner else ", mode=FLIGHT"
        if name == "impulse":
            arguments += ", targets"
        if name == "flight_rhs":
            return Signature("flight", arguments, _DOCS["flight"], (), self._shown())
        opening: tuple[str, ...] = ()
        if name == "contact_rhs":
            passed = "p, u" if self.driven else "p"
            opening = ("if not any(mode):", f"    return flight(t, y, {passed})")
        solved = _SOLUTION if _SOLUTION in self.programs else "rhs"
        shown = self._shown() if name == solved else ()
        label = f"_{plain}" if inner else plain
        whole = plain.removesuffix(ENTRIES)
        doc = _DOCS[whole]
        if self.equations.system.states:
            doc = doc.replace("[v, a]", "[v, a, r]")
        if plain != whole:
            places = f"{whole.upper()}_ROWS, {whole.upper()}_COLUMNS"
            doc = f"Numbers of {whole} at {places}; all others are zero."
        return Signature(label, arguments, doc, opening, shown)

    def _shown(self) -> tuple[str, ...]:
        """Return the equations of motion as comments, where they are short."""
        if len(self.equations.system.coordinates) > LARGEST_UNROLLED:
            return ()
        # Here and not above: simulation prints programs too, and no expressions.
        from lagrange_cli.notation.scene_language import to_scene_language

        texts = []
        try:
            equations = self.equations.derivation.shown
        except InputError:  # a chain of bodies too long to be written
            return ()
        for equation in equations:
            text = comment_text(to_scene_language(equation.residual, self.equations))
            texts.append(f"{comment_text(equation.coordinate)}: {text} = 0")
        return tuple(text for text in texts if len(text) <= 92)

    def _around(self) -> list[str]:
        """Return the functions that call those of programs, and the script."""
        equations = self.equations
        if self.style == "casadi":
            inputs = python_template("casadi_inputs") if self.driven else ""
            values = {"@INPUTS@": inputs, "@AND@": ", u" if self.driven else ""}
            values |= layout_tokens(equations.system.layout)
            return [filled(python_template("casadi_function"), values)]
        if self.traced:
            return []
        linear = self.options["linearization"] and equations.system.coordinates
        return [
            *whole_jacobians(equations, self.derivatives, self.arguments, _DOCS),
            *([linearization_source(equations, self.arguments)] if linear else []),
            *([canonical_source(equations, self.arguments)] if self.canonical else []),
            projection_source(equations, self.programs),
            contacts_source(equations, self.arguments),
            switches_source(equations, self.arguments),
            *steps_source(equations, self.arguments, self.options, self.step_errors),
            script_source(equations, self.vocabulary.decorator),
        ]
