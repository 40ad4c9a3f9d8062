"""First-order matrices of a system at many states, run by Python."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lagrange_cli.program.emitted_functions import (
    ENTRIES,
    constraint_programs,
    derivative_programs,
    program_of,
)
from lagrange_cli.program.interpreter.interpreter import compiled
from lagrange_cli.program.lowered.lowering import lowered
from lagrange_cli.simulate.model.inputs import substitute_inputs
from lagrange_cli.simulate.system.inputs import read_recorded_inputs
from lagrange_cli.simulate.system.tables import bound
from lagrange_cli.simulate.system.tracing import InterpretedFunctions
from lagrange_cli.stages import announce

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.simulate.arrays import Array


#: States between two announcements of how far the evaluation is.
_ANNOUNCED = 1000


class LinearFunctions:
    """A, B, C, D of equations without contacts, and E where constraints are kept beside them.

    Raises
    ------
    InputError
        A file of inputs cannot be read; derivatives are too many to write out.
    """

    def __init__(self, equations: Equations) -> None:
        self._layout, self._driven = equations.system.layout, len(equations.system.inputs)
        self._rows = len(equations.system.outputs)
        derivatives = derivative_programs(equations, jacobian=False, linearization=True)
        derivatives = {name.removesuffix(ENTRIES): p for name, p in derivatives.items()}
        programs = {"rhs": program_of(equations, "rhs"), **derivatives}
        if equations.system.closures:
            programs["multipliers"] = constraint_programs(equations)["multipliers"]
        self._patterns = {
            name: program.jacobian.pattern
            for name, program in derivatives.items()
            if program.jacobian is not None
        }
        self._functions = InterpretedFunctions(
            {name: lowered(program, name) for name, program in programs.items()}
        )
        self._parameters = [float(p.value or np.nan) for p in equations.system.parameters]
        self._input = _inputs_of(equations, self._parameters) if equations.system.inputs else None

    def inputs_at(self, t: Array, y: Array) -> Array:
        """Evaluate the scene's inputs at states; shape (m, inputs)."""
        if self._input is None:
            return np.empty((len(t), 0))
        rows = [self._input(float(s), state) for s, state in zip(t, y, strict=True)]
        return np.array(rows, dtype=float)

    def matrices(self, t: Array, y: Array, u: Array) -> dict[str, Array]:
        """Evaluate the matrices by name, each of shape (m, rows, columns), NaN without values.

        Parameters
        ----------
        t, y, u
            Shapes (m,), (m, 2n) and (m, inputs).
        """
        layout, m, driven = self._layout, len(t), self._driven
        n, size = layout.coordinates, layout.size
        whole = {
            "A": np.zeros((m, size, size)),
            "B": np.zeros((m, size, driven)),
            "C": np.zeros((m, self._rows or n, size)),
            "D": np.zeros((m, self._rows or n, driven)),
        }
        self._fill(whole["A"], "jacobian", t, y, u)
        if driven:
            self._fill(whole["B"], "jacobian_u", t, y, u)
        if not self._rows:
            whole["C"][:, range(n), range(n)] = 1.0
        else:
            self._fill(whole["C"], "output_jacobian", t, y, u)
            if driven:
                self._fill(whole["D"], "output_jacobian_u", t, y, u)
        if "constraint_jacobian" in self._patterns:
            first = self._at("constraint_jacobian", t[0], y[0], u[0])
            whole["E"] = np.empty((m, *first.shape))
            self._fill(whole["E"], "constraint_jacobian", t, y, u)
        return whole

    def _fill(self, into: Array, name: str, t: Array, y: Array, u: Array) -> None:
        pattern = self._patterns[name]
        for k in range(len(t)):
            if k % _ANNOUNCED == 0:
                announce(f"evaluating the linear system at state {k + 1} of {len(t)}")
            values = self._at(name, t[k], y[k], u[k])
            if pattern is None:
                into[k] = values
            else:
                rows, columns = zip(*pattern, strict=True)
                into[k][list(rows), list(columns)] = values

    def _at(self, name: str, t: float, y: Array, u: Array) -> Any:
        return self._functions[name](float(t), y, self._parameters, u.tolist())


def _inputs_of(equations: Equations, parameters: list[float]) -> Any:
    """Make the function of t and y that evaluates the scene's inputs."""
    asked = tuple((u.name, u.symbol) for u in equations.system.inputs)
    known = substitute_inputs(replace(equations, system=replace(equations.system, outputs=asked)))
    function = compiled(lowered(program_of(known, "outputs"), "outputs"))
    files = tuple(u.recording for u in equations.system.inputs if u.recording is not None)
    recorded = read_recorded_inputs(files)
    return bound(function, parameters, None if recorded is None else recorded.pieces)
