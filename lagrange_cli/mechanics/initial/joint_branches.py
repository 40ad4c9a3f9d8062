"""Select configurations in which joints are as they are meant, among those that their equations
allow: a weld without a turn that is left, a disk whose lowest point touches."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InconsistentStartError, InputError, Problem
from lagrange_cli.mechanics.numerics.autodiff import Tape
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.scene.model import Constraint

_ZERO = mpf(0)


class JointBranches:
    """The branches of a scene's joints at its parameters and start time.

    Parameters
    ----------
    constants
        Values of parameters and t.
    """

    def __init__(self, reduced: Reduced, constants: Mapping[sp.Symbol, mpf]) -> None:
        self._constraints: list[Constraint] = []
        positive = []
        for constraint in reduced.scene.constraints:
            if constraint.joint is not None and constraint.joint.positive is not None:
                self._constraints.append(constraint)
                positive.append(reduced.resolve(reduced.convert(constraint.joint.positive)))
        self._constants = [(x, _ZERO, _ZERO) for x in constants.values()]
        self._tape = Tape(positive, [*(c.q for c in reduced.coordinates), *constants])

    def possible(self, configurations: Sequence[list[mpf]]) -> list[list[mpf]]:
        """Select the configurations in which all joints are as they are meant.

        Raises
        ------
        InputError
            There is none; the message names a joint of the first.
        """
        admitted = [q for q in configurations if not any(self._wrong(q))]
        if not admitted:
            self.require(configurations[0])
        return admitted

    def require(self, q: Sequence[mpf]) -> None:
        """Refuse a configuration in which a joint is not as it is meant."""
        for constraint in self._wrong(q):
            raise _on_another_branch(constraint)

    def _wrong(self, q: Sequence[mpf]) -> Iterator[Constraint]:
        if not self._constraints:
            return
        run = self._tape.run([*((x, _ZERO, _ZERO) for x in q), *self._constants], 0)
        for constraint, value in zip(self._constraints, run.values, strict=True):
            if not value > 0:
                yield constraint


def _on_another_branch(constraint: Constraint) -> InputError:
    joint = constraint.joint
    assert joint is not None
    if joint.kind == "weld":
        first, second = joint.parts
        what = f"the axes of '{first}' and '{second}' are turned against each other"
        hint = "give angles under 'initial' or 'near' at which the axes coincide"
    else:
        what = f"the highest point of '{joint.parts[0]}' touches"
        hint = "turn the body so that its centre is on the side of the normal"
    return InconsistentStartError(
        Problem(
            f"constraint '{constraint.name}' is not as it is meant at the start: {what}",
            constraint.mark,
            hint=hint,
            rule="initial-inconsistent",
        )
    )
