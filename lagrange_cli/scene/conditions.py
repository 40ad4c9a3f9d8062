"""Initial values, the section ``simulate`` and expectations of a scene, as frozen values.

Every ``mark`` is the place of its value in the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from lagrange_cli.errors import Mark
from lagrange_cli.scene.language.expression import Equation, Expression


@dataclass(frozen=True, slots=True)
class InitialValue:
    """A value of ``initial``, ``near`` or an expected state.

    Attributes
    ----------
    name
        The coordinate or Cartesian name.
    order
        0 for its value, 1 for its rate ``dot(name)``.
    mark
        Its place.
    value
        The value.
    """

    name: str
    order: int
    mark: Mark
    value: Expression


Formulation: TypeAlias = Literal["auto", "minimal", "multiplier"]
"""Minimal form, or multiplier form with closure equations; ``auto`` lets the program choose."""


@dataclass(frozen=True, slots=True)
class WrittenDefaults:
    """The section ``simulate`` as written; keys that are absent are None.

    Its fields are those of :class:`SimulationDefaults`, which holds their values.
    """

    mark: Mark | None = None
    until: Expression | None = None
    start: Expression | None = None
    accuracy: Expression | None = None
    samples: Expression | None = None
    step: Expression | None = None
    method: str | None = None
    rtol: Expression | None = None
    atol: Expression | None = None
    formulation: Formulation | None = None

    @property
    def numbers(self) -> tuple[Expression | None, ...]:
        """Entries that are expressions."""
        times = (self.until, self.start, self.step, self.samples)
        return (*times, self.accuracy, self.rtol, self.atol)

    def formulation_for(self, asked: Formulation | None) -> Formulation:
        """Return the formulation that is asked for, else the scene's, else ``auto``."""
        return asked or self.formulation or "auto"


@dataclass(frozen=True, slots=True)
class StateExpectation:
    """An expected state: ``state: {t: 1.0, x: 0.12, within: 1e-8}``.

    Attributes
    ----------
    mark
        Its place.
    time
        Time at which it is expected.
    values
        Expected values; names may be ``dot(x)`` (order 1).
    within
        Largest difference allowed.
    """

    mark: Mark
    time: Expression
    values: tuple[InitialValue, ...]
    within: Expression


@dataclass(frozen=True, slots=True)
class EventExpectation:
    """An expected event: ``{name: release:sphere, t: 0.72, within: 1e-9}``.

    Attributes
    ----------
    name, mark
        Kind of the event and name of its contact, ``release:sphere``; its place.
    time
        Time at which it is expected, None for any.
    within
        Largest difference in time allowed, None if the time is open.
    """

    name: str
    mark: Mark
    time: Expression | None = None
    within: Expression | None = None


@dataclass(frozen=True, slots=True)
class EquilibriumExpectation:
    """An expected equilibrium: ``{theta: 0, stability: unstable}``.

    Attributes
    ----------
    mark
        Its place.
    values
        Values of coordinates or Cartesian names there.
    stability, stability_mark
        The verdict expected of its stability, None for any; its place.
    """

    mark: Mark
    values: tuple[InitialValue, ...]
    stability: str | None = None
    stability_mark: Mark | None = None


@dataclass(frozen=True, slots=True)
class ErrorExpectation:
    """The refusal that a scene expects of itself: ``error: {kind: ..., contains: ...}``.

    Attributes
    ----------
    mark
        Its place.
    kind
        Kind of the error, None for any.
    contains
        Text within its message, None for any.
    """

    mark: Mark
    kind: str | None
    contains: str | None


@dataclass(frozen=True, slots=True)
class Expect:
    """The section ``expect``; keys that are absent are None or empty, and are not checked.

    Attributes
    ----------
    mark
        Place of the section.
    dof, dof_mark
        Degrees of freedom, and the place of the key.
    cyclic, cyclic_mark
        Names of cyclic coordinates, and the place of the key.
    conserved, conserved_mark
        Names of conserved quantities, and the place of the key.
    equations
        Equations of motion, each of which must be among the derived ones.
    lagrangian
        The Lagrangian.
    hamiltonian
        H over coordinates, their momenta ``p_NAME`` and t.
    states
        States of the motion.
    drift
        Names of quantities with the largest drift allowed.
    events
        Events of the motion.
    equilibrium
        Equations that together are a law of equilibrium, for all values of the parameters.
    equilibria, equilibria_mark
        Equilibria, and the place of the key; empty if there are to be none.
    frequencies, frequencies_mark
        Angular frequencies of all modes at the stable equilibrium, and the place of the key.
    error
        The refusal, if the scene is to be refused.
    """

    mark: Mark | None = None
    dof: int | None = None
    dof_mark: Mark | None = None
    cyclic: tuple[str, ...] | None = None
    cyclic_mark: Mark | None = None
    conserved: tuple[str, ...] | None = None
    conserved_mark: Mark | None = None
    equations: tuple[Equation, ...] | None = None
    lagrangian: Expression | None = None
    hamiltonian: Expression | None = None
    states: tuple[StateExpectation, ...] = ()
    drift: tuple[tuple[str, Expression], ...] = ()
    events: tuple[EventExpectation, ...] = ()
    equilibrium: tuple[Equation, ...] | None = None
    equilibria: tuple[EquilibriumExpectation, ...] | None = None
    equilibria_mark: Mark | None = None
    frequencies: tuple[Expression, ...] | None = None
    frequencies_mark: Mark | None = None
    error: ErrorExpectation | None = None


#: Samples of any run: rows of a table that a disk may hold.
MOST_SAMPLES = 10_000_000_000


@dataclass(frozen=True)
class SimulationDefaults:
    """The section ``simulate`` as numbers; keys that are absent are None.

    Attributes
    ----------
    until, start
        Last and first time.
    accuracy
        Largest error of each component, relative to its scale.
    samples, step
        Number of samples, or the time between them.
    method
        Name of the integration method.
    rtol, atol
        Tolerances of that method.
    formulation
        Minimal or multiplier form.
    mark
        Place of the section.
    """

    until: float | None = None
    start: float = 0.0
    accuracy: float | None = None
    samples: int | None = None
    step: float | None = None
    method: str | None = None
    rtol: float | None = None
    atol: float | None = None
    formulation: Formulation | None = None
    mark: Mark | None = None
