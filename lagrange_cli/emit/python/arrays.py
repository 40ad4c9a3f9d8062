"""Functions of many states at once: those of one, run over NumPy's functions.

The text of a function asks nothing of its numbers but through names of the module
(``sin``, ``array``, ``_holds``, …). The functions of arrays are the same code with
other objects under these names, so that nothing is written twice, and a single
state is as fast as without them. They are for states at all of which nothing goes
wrong; the others are found by halving and left to the functions of numbers.
"""

from __future__ import annotations

from collections.abc import Mapping

from lagrange_cli.emit.python.projection import helper_source
from lagrange_cli.emit.python.styles import array_functions
from lagrange_cli.emit.template_files import python_template
from lagrange_cli.program.program import Program

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
    """Definitions of what evaluates a function for many states.

    Parameters
    ----------
    words
        The names in the rest of the module.
    programs
        The programs of its functions. Where one has loops, its functions of one state are
        NumPy's too, and a few states are faster together as well.
    """
    few = 1 if any(program.parts for program in programs.values()) else _FEW
    rows = [f'    "{name}": {text},' for name, text in _OF_ARRAYS.items() if name in words]
    table = "\n".join(["_OF_ARRAYS = {", *rows, "}", ""])
    return [
        "#: Axes of y for one state; more are states beside each other.\n_AXES = 1\n",
        *([helper_source("solve_saddles")] if "_solve_saddle" in words else []),
        python_template("arrays").replace("@FEW@", str(few)),
        f"#: Names of functions of numbers, and what they are for arrays.\n{table}",
    ]
