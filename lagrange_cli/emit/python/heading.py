"""The parts of a Python module before its functions: docstring, constants, parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from lagrange_cli.emit.initial_state import rates_note, residual_labels, steps_per_row
from lagrange_cli.emit.naming import comment_text, described, domain_note, unique_identifiers
from lagrange_cli.emit.python.constraints import contact_constants
from lagrange_cli.emit.python.derivatives import pattern_constants
from lagrange_cli.emit.shared_code import momentum_names
from lagrange_cli.program.program import Program
from lagrange_cli.version import __version__

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Rows that the script prints, and steps from one to the next.
_ROWS = 500
_STEPS_PER_ROW = 20


def local_names(equations: Equations, fields: Sequence[str]) -> dict[str, str]:
    """Map dummy name → local name of all inputs of the programs."""
    coordinates = unique_identifiers((c.name for c in equations.system.coordinates), frozenset())
    driven = unique_identifiers((source.name for source in equations.system.inputs), frozenset())
    names = {f"p{i}": f"p_{field}" for i, field in enumerate(fields)}
    for kind in "qv":
        names |= {f"{kind}{i}": f"{kind}_{name}" for i, name in enumerate(coordinates)}
    return names | {f"u{i}": f"u_{name}" for i, name in enumerate(driven)}


def docstring(equations: Equations, notes: Sequence[str], *, projected: bool) -> str:
    """Write what the module says of itself.

    Parameters
    ----------
    notes
        Lines on its functions.
    projected
        Whether there is a function that leads states back to the closures.
    """
    name = comment_text(equations.presentation.name)
    lines = [
        f"{name}: {comment_text(equations.presentation.title)}"
        if equations.presentation.title
        else name
    ]
    if equations.presentation.description:
        lines += ["", comment_text(equations.presentation.description)]
    lines += [
        "",
        *_statement(equations, projected),
        "the order of COORDINATES, then their velocities v. Every function takes (t, y, p) with",
        *notes,
        *domain_note(equations),
        "",
        f"Made by lagrange {__version__} from the scene with SHA-256",
        comment_text(equations.presentation.digest),
        "This output is yours: use it as you like, under any terms.",
    ]
    return '"""' + "\n".join(lines) + '\n"""'


def _statement(equations: Equations, projected: bool) -> list[str]:
    if not equations.system.multipliers:
        return [
            "Equations of motion M(q, t) a = f(q, v, t). The state y holds the coordinates q in"
        ]
    if equations.system.contacts:
        return [
            "Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with the closures and",
            "contacts of MULTIPLIERS beside them: l[k] is the multiplier and g[k] the gradient of",
            "one, so that l[k]*g[k] is the generalized force that it exerts. project leads a state",
            "back to what is closed, to be called after each step. y holds the coordinates q in",
        ]
    last = [
        "that l[k]*g[k] is the generalized force that it exerts. project leads a state back to",
        "the closures, to be called after each step. The state y holds the coordinates q in",
    ]
    alone = ["that l[k]*g[k] is the force that it exerts. The state y holds the coordinates q in"]
    return [
        "Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with the closures of",
        "MULTIPLIERS beside them: l[k] is the multiplier and g[k] the gradient of closure k, so",
        *(last if projected else alone),
    ]


def run_constants(equations: Equations) -> str:
    """Define the run of the script."""
    defaults = equations.system.simulate
    until = defaults.start + 10.0 if defaults.until is None else defaults.until
    steps = steps_per_row(equations, _ROWS, _STEPS_PER_ROW)
    return f"START, UNTIL, ROWS, STEPS = {defaults.start!r}, {float(until)!r}, {_ROWS}, {steps}\n"


def constants(
    equations: Equations, derivatives: Mapping[str, Program], *, momenta: bool = False
) -> str:
    """Define the names of what arrays hold, and the initial state; ``momenta``: theirs too."""
    initial = equations.system.initial
    state = None if initial is None else [*initial.positions, *initial.velocities]
    return "\n".join(
        [
            *(f"# {described(c)}" for c in equations.system.coordinates if c.unit or c.description),
            f"COORDINATES = {_strings([c.name for c in equations.system.coordinates])}",
            f"CARTESIAN = {_strings([c.name for c in equations.system.cartesian_names])}",
            f"PARAMETERS = {_strings([p.name for p in equations.system.parameters])}",
            *([f"MOMENTA = {_strings(momentum_names(equations))}"] if momenta else []),
            *_asked_for(equations),
            *_closures(equations),
            *pattern_constants(derivatives),
            "",
            f"INITIAL = {state!r}",
            "",
        ]
    )


def _asked_for(equations: Equations) -> list[str]:
    inputs = [source.name for source in equations.system.inputs]
    outputs = [name for name, _ in equations.system.outputs]
    sections = (("INPUTS", inputs), ("OUTPUTS", outputs))
    return [f"{name} = {_strings(names)}" for name, names in sections if names]


def _closures(equations: Equations) -> list[str]:
    if not equations.system.multipliers:
        return []
    texts = [f"# {comment_text(f'{c.name}: {c.text}')}" for c in equations.system.closures]
    return [
        *texts,
        *(f"# {line}" for line in rates_note(equations)),
        f"MULTIPLIERS = {_strings(equations.system.multipliers)}",
        f"RESIDUALS = {_strings(residual_labels(equations))}",
        *contact_constants(equations),
    ]


def parameters_source(equations: Equations, fields: Sequence[str]) -> str:
    """Define the type of the parameters, with their values in the scene."""
    lines = [
        "class Parameters(NamedTuple):",
        '    """Parameters; NaN stands for one that must be given."""',
    ]
    for parameter, field in zip(equations.system.parameters, fields, strict=True):
        value = "nan" if parameter.value is None else repr(float(parameter.value))
        line = f"    {field}: float = {value}"
        if parameter.unit or parameter.description or parameter.name != field:
            line += f"  # {described(parameter)}"
        lines.append(line)
    return "\n".join([*lines, "", "", "DEFAULTS = Parameters()", ""])


def _strings(texts: Sequence[str]) -> str:
    """Return a tuple of string literals in plain ASCII."""
    return ascii(tuple(texts))
