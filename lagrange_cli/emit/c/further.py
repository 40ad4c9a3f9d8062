"""Functions of emitted C that ``--with`` asks for: derivatives, canonical equations, fixed steps.

Each has its declaration for the header and its definition. A linearization is put together of
Jacobians; the canonical equations are functions of [q, p] around those of [q, v].
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from textwrap import wrap
from typing import TYPE_CHECKING

from lagrange_cli.emit.c.constraints import mode_target, workspace_size
from lagrange_cli.emit.c.solvers import routine_texts
from lagrange_cli.emit.c.target import CTarget, wrapped
from lagrange_cli.emit.fixed_steps import FIXED_STEPS, step_note
from lagrange_cli.emit.initial_state import residual_labels
from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.shared_code import momentum_names
from lagrange_cli.emit.template_files import c_template
from lagrange_cli.program.emitted_functions import DERIVATIVES, ENTRIES
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.jacobians import Jacobian
from lagrange_cli.state_layout import StateLayout

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Function → what it differentiates by, and how many there are.
_BY = {
    "jacobian": ("y[k]", "@ROWS@"),
    "jacobian_u": ("input u[k]", "@NAME@_INPUTS"),
    "jacobian_p": ("parameter k of the structure", "@NAME@_PARAMETERS"),
}

_WHOLE = """
/* out[i*@COLUMNS@ + k]: the derivative of dydt[i] by @BY@@WHILE@; @ROWS@ rows. */
int @NAME@_@FUNCTION@(@OUT@);
"""

_PATTERN = """
/* The same where it need not be zero: out[m], m < @MACRO@,
 * for i = @NAME@_@FUNCTION@_rows[m] and k = @NAME@_@FUNCTION@_columns[m]. */
#define @MACRO@ @SIZE@
extern const int @NAME@_@FUNCTION@_rows[@SIZE@];
extern const int @NAME@_@FUNCTION@_columns[@SIZE@];
int @NAME@_@FUNCTION@_entries(@OUT@);
"""


def derivatives_of(programs: Mapping[str, Program]) -> dict[str, Jacobian]:
    """Function of the interface → where its results are."""
    return {
        function: program.jacobian
        for function in DERIVATIVES
        for name, program in programs.items()
        if name.removeprefix("contact_").removesuffix(ENTRIES) == function
        and program.jacobian is not None
    }


def derivative_declarations(
    derivatives: Mapping[str, Jacobian], target: CTarget, *, contacts: bool
) -> str:
    """Declare the functions, with their comments."""
    outer = mode_target(target) if contacts else target
    texts = []
    for function, jacobian in derivatives.items():
        by, columns = _BY[function]
        replacements = {
            "@WHILE@": " while mode stays" if contacts else "",
            "@BY@": by,
            "@COLUMNS@": columns,
            "@ROWS@": str(jacobian.rows),
            "@MACRO@": f"@NAME@_{function.upper()}_NONZERO",
            "@SIZE@": str(jacobian.size),
            "@FUNCTION@": function,
            "@OUT@": outer.arguments("out"),
        }
        text = _WHOLE if jacobian.pattern is None else _WHOLE + _PATTERN
        for token, replacement in replacements.items():
            text = text.replace(token, replacement)
        texts.append(text)
    return "".join(texts)


def pattern_texts(
    programs: Mapping[str, Program], target: CTarget, *, contacts: bool
) -> Iterator[str]:
    """Define the arrays that tell where sparse results stand, and the functions that fill whole
    matrices with them."""
    outer = mode_target(target) if contacts else target
    for function, jacobian in derivatives_of(programs).items():
        if jacobian.pattern is None:
            continue
        rows, columns = zip(*jacobian.pattern, strict=True)
        for name, numbers in (("rows", rows), ("columns", columns)):
            head = f"const int {target.prefix}_{function}_{name}[{jacobian.size}] = {{"
            yield "\n".join([head, *wrapped(", ".join(map(str, numbers)), 1, 1), "};", ""])
        replacements = {
            "@OUT@": outer.arguments("out"),
            "@PASSED@": _passed(contacts=contacts),
            "@FUNCTION@": function,
            "@SIZE@": str(jacobian.size),
            "@COLUMNS@": str(jacobian.columns),
            "@WHOLE@": str(jacobian.rows * jacobian.columns),
        }
        yield target.fill(c_template("whole_jacobian"), replacements)


def _passed(*, contacts: bool) -> str:
    return f"t, y, u, p, {'mode, ' if contacts else ''}work"


def linearization_declaration(equations: Equations, target: CTarget) -> str:
    """Declare the function, with its comment."""
    n, size = len(equations.system.coordinates), equations.system.layout.size
    mode_note = [" While mode stays."] if equations.system.contacts else []
    outputs = "outputs z in the order above" if equations.system.outputs else "coordinates z = q"
    inputs = len(equations.system.inputs)
    driven = f"{size} by {inputs}" if inputs else "not there, no inputs"
    rows = len(equations.system.outputs) or n
    lines = [
        "The linearization at a state, of first order, by rows:",
        "  d/dt dy = A dy + B du,  dz = C dy + D du",
        f"of small changes dy of y and du of u, and of the {outputs}.",
        f"A {size} by {size}; B {driven}; C {rows} by {size};"
        f" D {f'{rows} by {inputs}' if inputs else 'likewise'}.",
        *(
            [_CLOSED.format(len(residual_labels(equations)), size)]
            if equations.system.pushing
            else []
        ),
        "A null pointer stands for what is not wanted." + "".join(mode_note),
    ]
    text = "\n".join(f" * {line}" for part in lines for line in part.splitlines())
    return f"\n/*\n{text}\n */\nint @NAME@_linearization({_arguments(equations, target)});\n"


_CLOSED = """\
E {} by {}, the derivative of the numbers of @NAME@_constraints by y: changes
that the constraints allow have E dy = 0. A is that of @NAME@_rhs, which has
accelerations off the constraints too."""


def linearization_text(
    equations: Equations, programs: Mapping[str, Program], target: CTarget
) -> str:
    """Define the function."""
    layout, m = equations.system.layout, len(equations.system.inputs)
    calls = _wanted("A", ["status = @NAME@_jacobian(@PASSED@, A);"])
    if m:
        calls += _wanted("B", ["status = @NAME@_jacobian_u(@PASSED@, B);"])
    calls += _outputs(equations, layout, m)
    calls += _constraints(equations)
    unused = [] if m else ["    (void)B;", "    (void)D;"]
    body = "\n".join([*unused, *calls])
    text = c_template("linearization").replace("@BODY@", body)
    replacements = {
        "@COUNTER@": "" if equations.system.outputs else "i, ",
        "@ARGUMENTS@": _arguments(equations, target),
        "@PASSED@": _passed(contacts=bool(equations.system.contacts)),
        "@START@": str(workspace_size(programs)),
    }
    return target.fill(text, replacements)


def _arguments(equations: Equations, target: CTarget) -> str:
    outer = mode_target(target) if equations.system.contacts else target
    matrices = ", ".join(
        f"{target.real.name} *{name}" for name in ("ABCDE" if equations.system.pushing else "ABCD")
    )
    return outer.arguments("A").removesuffix(f"{target.real.name} *A") + matrices


def _outputs(equations: Equations, layout: StateLayout, m: int) -> list[str]:
    """Fill C and D; without outputs of the scene they are the coordinates."""
    if equations.system.outputs:
        lines = _wanted("C", ["status = @NAME@_output_jacobian(@PLAIN@, C);"])
        if m:
            lines += _wanted("D", ["status = @NAME@_output_jacobian_u(@PLAIN@, D);"])
        return [line.replace("@PLAIN@", "t, y, u, p, work") for line in lines]
    n, size = layout.coordinates, layout.size
    zeros = [f"for (i = 0; i < {n * size}; ++i) {{", "    C[i] = @ZERO@;", "}"]
    ones = [f"for (i = 0; i < {n}; ++i) {{", f"    C[i*{size} + i] = @ONE@;", "}"]
    lines = _wanted("C", [*zeros, *ones])
    if m:
        lines += _wanted("D", [f"for (i = 0; i < {n * m}; ++i) {{", "    D[i] = @ZERO@;", "}"])
    return lines


def _constraints(equations: Equations) -> list[str]:
    if equations.system.contacts:
        lines = [
            "@REAL@ *const contact = work + @START@;",
            "(void)@NAME@_flags(mode, contact);",
            "status = @NAME@_contact_constraint_jacobian(t, y, u, p, contact, work, E);",
        ]
        return _wanted("E", lines)
    if equations.system.closures:
        return _wanted("E", ["status = @NAME@_constraint_jacobian(@PASSED@, E);"])
    return []


def _wanted(array: str, lines: list[str]) -> list[str]:
    inner = (f"        {line}" for line in lines)
    return [f"    if (status == 0 && {array} != 0) {{", *inner, "    }"]


#: Numbers of the function ``energy``, of which the last is H.
_ENERGIES = 3


def canonical_workspace_size(programs: Mapping[str, Program], coordinates: int) -> int:
    """Return numbers of workspace with a state [q, v] and energies."""
    return workspace_size(programs) + 2 * coordinates + _ENERGIES


def canonical_declarations(equations: Equations, target: CTarget) -> str:
    """Declare the functions, with their comments."""
    n = len(equations.system.coordinates)
    momenta = "\n".join(
        f" *   z[{n + k}]  {comment_text(name)}" for k, name in enumerate(momentum_names(equations))
    )
    text = c_template("interface_canonical").replace("@MOMENTA@", momenta)
    return "\n" + _filled(text, target)


def canonical_text(equations: Equations, target: CTarget) -> str:
    """Define the functions."""
    n = len(equations.system.coordinates)
    text = c_template("canonical")
    replacements = {"@N@": str(n), "@BEHIND@": str(2 * n), "@ENERGIES@": str(_ENERGIES)}
    for token, value in replacements.items():
        text = text.replace(token, value)
    return target.fill(_filled(text, target))


def _filled(text: str, target: CTarget) -> str:
    """Put in lists of arguments, of which the state is z or y and the result named."""
    for token, state, result in (
        ("@TO@", "y", "z"),
        ("@FROM@", "z", "y"),
        ("@RATES@", "z", "dzdt"),
        ("@H@", "z", "out"),
    ):
        text = text.replace(
            token, target.arguments(result).replace("*y, const", f"*{state}, const")
        )
    return text


# -- fixed steps, for real time: no allocation, the inputs held over a step ------------------

#: A function of the interface around its routine.
_FUNCTION = """\
int @NAME@_@STEP@(@REAL@ t, @REAL@ *y, const @REAL@ *u, const @NAME@_params *p, @REAL@ h,
    @REAL@ *work)
{
    @REAL@ *const own = work + @NAME@_WORK;
    int status = 0;
    if (!@NAME@_@ROUTINE@(@SIZE@, u, p, work, &status, t, h, y, @ARRAYS@) && status == 0) {
        status = 3;
    }
    return status;
}
"""


def step_text(equations: Equations, target: CTarget, asked: list[str]) -> str:
    """Write the functions, and the routines behind them."""
    size = equations.system.layout.size
    parts = routine_texts([FIXED_STEPS[name].routine for name in asked], target)
    for name in asked:
        method = FIXED_STEPS[name]
        arrays = ", ".join(f"own + {k * size}" if k else "own" for k in range(method.arrays))
        tokens = {"@STEP@": name, "@ROUTINE@": method.routine, "@SIZE@": str(size)}
        parts.append(target.fill(_FUNCTION, {**tokens, "@ARRAYS@": arrays}))
    return "\n".join(parts)


def step_declarations(
    equations: Equations, target: CTarget, asked: list[str], errors: Mapping[str, str]
) -> str:
    """Declare the functions, with what was measured of their errors."""
    if not asked:
        return ""
    lines = list(_documented(equations, target.prefix, asked, errors))
    most = max(FIXED_STEPS[name].arrays for name in asked) * equations.system.layout.size
    real, prefix = target.real.name, target.prefix
    arguments = (
        f"{real} t, {real} *y, const {real} *u, const {prefix}_params *p, {real} h, {real} *work"
    )
    declared = [f"int {prefix}_{name}({arguments});" for name in asked]
    size = f"#define {prefix}_STEP_WORK ({prefix}_WORK + {most})"
    return "\n".join(
        ["", "/*", *(f" * {line}".rstrip() for line in lines), " */", size, *declared, ""]
    )


def _documented(
    equations: Equations, prefix: str, asked: list[str], errors: Mapping[str, str]
) -> Iterator[str]:
    yield "Fixed steps for real time: y at t becomes y at t + h, with u held in between."
    yield f"work holds {prefix}_STEP_WORK numbers. A result of 3: the iteration does not settle,"
    yield "since h is too long; y is left as it was unless the result is 0."
    if equations.system.closures:
        yield f"Steps leave closures by their errors: {prefix}_project leads back."
    for name in asked:
        text = f"{prefix}_{name}: {step_note(name, errors)}"
        yield from wrap(text, 90, subsequent_indent="  ")
