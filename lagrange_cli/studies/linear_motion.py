"""The linear system beside a motion: A(t), B(t), C(t), D(t) at its samples.

Small changes of a motion y(t) with inputs u(t) obey d/dt δy = A(t) δy + B(t) δu and
δz = C(t) δy + D(t) δu, with the derivatives at y(t), u(t): what tracking controllers, Kalman
filters and time-varying regulators start from. The matrices are exact derivatives of the equations,
so that they are off by what the motion is off alone; how much that is, is measured beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from sympy import sign

from lagrange_cli.analysis.result import AlongMotion
from lagrange_cli.drawn import Reported
from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.phrases import Phrase
from lagrange_cli.simulate.system.linearization import LinearFunctions

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.simulate import Trajectory
    from lagrange_cli.simulate.arrays import Array

#: Changes of each state by what it may be off, with random signs, and what the largest change of a
#: matrix is multiplied by: of few draws it is too small.
_DRAWS, _SAFETY = 3, 2.0

#: Runs at most, each more accurate than the one before.
_MOST_RUNS = 3

#: Accuracy of a further run, as a part of what would do.
_MARGIN = 0.3

#: Arrays of names among those of a file.
NAMES = frozenset({"states", "inputs", "outputs"})

#: Accuracy to integrate with → the motion.
Simulate = Callable[[float], "Trajectory"]


@dataclass(frozen=True)
class LinearMotion(Reported):
    """A linear system along a motion.

    Attributes
    ----------
    name
        The scene's.
    status
        ``ok``, else the status of the motion, or ``accuracy_not_reached``.
    reason
        The same in words; empty where all is well.
    t
        Times, shape (m,).
    states, inputs, outputs
        Names of coordinates, of their ``dot`` and of states; of the scene's inputs; and of its
        outputs, else of the coordinates.
    y, u
        Values of states and inputs, shapes (m, 2n) and (m, inputs).
    matrices
        ``A``, ``B``, ``C``, ``D``, and ``E`` with constraints kept, whose changes have E δy = 0;
        each of shape (m, rows, columns).
    requested, estimated
        Largest error of a matrix, with states in their scales and relative to its largest number
        (of B by columns, of C and E by rows): what was asked for, and what is estimated.
    """

    name: str
    status: Literal["ok", "accuracy_not_reached", "stopped", "blow_up"]
    reason: str
    t: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    y: Array
    u: Array
    matrices: Mapping[str, Array]
    requested: float
    estimated: float

    def __repr__(self) -> str:
        """Return a line."""
        span = f"t = {self.t[0]:g} to {self.t[-1]:g}"
        return f"<LinearMotion of {self.name}: {len(self.t)} samples, {span}, {self.status}>"

    @property
    def arrays(self) -> dict[str, Array]:
        """All arrays by name, as an ``.npz`` file holds them."""
        named = {key: np.array(getattr(self, key), dtype=str) for key in sorted(NAMES)}
        return {"t": self.t, "y": self.y, "u": self.u, **self.matrices, **named}

    @property
    def summary(self) -> AlongMotion:
        """The same as a part of an analysis."""
        return AlongMotion(
            self.status,
            len(self.t),
            float(self.t[0]),
            float(self.t[-1]),
            self.states,
            self.inputs,
            self.outputs,
            "E" in self.matrices,
            self.requested,
            self.estimated,
            self.reason,
            {"t": self.t, "y": self.y, "u": self.u, **self.matrices},
        )


def linear_motion(equations: Equations, simulate: Simulate, accuracy: float) -> LinearMotion:
    """Linearize along a motion that is so accurate that the matrices are accurate, too.

    Raises
    ------
    InputError
        There are contacts or forces that jump; the matrices do not exist at a sample; or as the
        simulation.
    """
    _require_smooth(equations)
    functions = LinearFunctions(equations)
    system = _along(equations, functions, simulate(accuracy), accuracy)
    asked = accuracy
    for _ in range(_MOST_RUNS - 1):
        if system.status != "ok" or system.estimated <= accuracy:
            break
        asked *= _MARGIN * accuracy / system.estimated
        try:
            motion = simulate(asked)
        except InputError:
            break  # doubles do not hold so much
        system = _along(equations, functions, motion, accuracy)
    if system.status != "ok" or system.estimated <= accuracy:
        return system
    reason = Phrase(
        "the matrices are within {estimated}, not {accuracy}",
        estimated=f"{system.estimated:.2g}",
        accuracy=f"{accuracy:.2g}",
    )
    return replace(system, status="accuracy_not_reached", reason=reason)


def _require_smooth(equations: Equations) -> None:
    """Refuse contacts, forces and states that jump, and samples: at these changes jump, unlike in
    any A(t)."""
    system = equations.system
    if system.controllers:
        event = "a controller samples"
    elif any(expression.has(sign) for expression in system.forcing):
        event = "a force does"
    elif system.switches:
        event = f"the state '{system.switches[0].name}' does"
    elif system.contacts:
        event = f"the contact '{system.contacts[0].name}' opens"
    else:
        return
    message = f"small changes of a motion jump where {event}: no A(t), B(t) describe them"
    hint = "emit --with linearization gives the matrices at any state between"
    raise InputError(
        Problem(message, Mark(equations.presentation.file, 1, 1), hint, "linearization")
    )


def _along(
    equations: Equations, functions: LinearFunctions, motion: Trajectory, accuracy: float
) -> LinearMotion:
    """Evaluate the matrices at the samples of a motion, with the estimate of their error."""
    names = [c.name for c in equations.system.coordinates]
    states = equations.system.state_names
    y = np.array([motion.columns[name] for name in states]).T
    u = functions.inputs_at(motion.t, y)
    matrices = functions.matrices(motion.t, y, u)
    for values in matrices.values():
        lost = np.flatnonzero(~np.isfinite(values).all(axis=(1, 2)))
        if len(lost):
            message = f"the equations have no derivatives at t = {motion.t[lost[0]]:.6g}"
            raise InputError(Problem(message, rule="linearization"))
    scales = np.array([motion.scales[name] for name in states])
    estimated = _error(functions, motion, y, u, matrices, scales)
    return LinearMotion(
        equations.presentation.name,
        motion.status,
        motion.reason,
        motion.t,
        states,
        tuple(u.name for u in equations.system.inputs),
        tuple(name for name, _ in equations.system.outputs) or tuple(names),
        y,
        u,
        matrices,
        accuracy,
        estimated,
    )


def _error(
    functions: LinearFunctions,
    motion: Trajectory,
    y: Array,
    u: Array,
    matrices: Mapping[str, Array],
    scales: Array,
) -> float:
    """Return the largest change of a matrix if each state is off by its estimated error."""
    off = (motion.estimated or 0.0) * scales
    generator = np.random.default_rng(0)
    n = y.shape[1]
    largest = 0.0
    for _ in range(_DRAWS):
        moved = y + off * generator.choice([-1.0, 1.0], size=y.shape)
        for name, values in functions.matrices(motion.t, moved, u).items():
            change = _scaled(name, values - matrices[name], scales[:n])
            size = _scaled(name, matrices[name], scales[:n])
            axis = {"A": (0, 1, 2), "B": (0, 1), "D": (0,)}.get(name, (0, 2))
            sizes = np.abs(size).max(axis=axis, initial=0.0)
            changes = np.abs(change).max(axis=axis, initial=0.0)
            # Numbers that are zero throughout, and stay so, have no error.
            parts = np.divide(changes, sizes, out=np.zeros_like(changes), where=sizes > 0)
            largest = max(largest, float(np.max(parts, initial=0.0)))
    return _SAFETY * largest


def _scaled(name: str, values: Array, scales: Array) -> Array:
    """Return a matrix over states in their scales."""
    if name in "ACE":
        values = values * scales
    return values / scales[:, None] if name in "AB" else values
