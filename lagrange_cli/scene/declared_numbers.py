"""Numbers that a scene declares beside coordinates: parameters, inputs, states of first order, and
the controllers that sample these and hold inputs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from lagrange_cli.errors import Mark
from lagrange_cli.files import Recording
from lagrange_cli.scene.language.expression import Equation, Expression


@dataclass(frozen=True, slots=True)
class DeclaredParameter:
    """A named constant.

    Attributes
    ----------
    name, mark
        Its name and its place.
    value
        Its value, None if it stays symbolic.
    unit, description, latex
        Texts for readers, None if absent.
    positive
        True if the scene declares it positive.
    """

    name: str
    mark: Mark
    value: Expression | None = None
    unit: str | None = None
    positive: bool = False
    description: str | None = None
    latex: str | None = None


@dataclass(frozen=True, slots=True)
class DeclaredInput:
    """A given function of time.

    Attributes
    ----------
    name, mark
        Its name and its place.
    expression
        Its value over t and parameters, None if it is recorded.
    recording
        The file that holds its values, None if it is an expression.
    """

    name: str
    mark: Mark
    expression: Expression | None = None
    recording: Recording | None = None


@dataclass(frozen=True, slots=True)
class DeclaredSwitch:
    """Inequalities that make a state 1, and 0; where neither holds, it stays as it is."""

    on: Equation
    off: Equation


@dataclass(frozen=True, slots=True)
class DeclaredState:
    """A state of first order, ẋ = ``rate``, or one that a switch sets; its texts may be None."""

    name: str
    mark: Mark
    rate: Expression
    unit: str | None = None
    description: str | None = None
    latex: str | None = None
    switch: DeclaredSwitch | None = None

    @property
    def expressions(self) -> Iterator[Expression]:
        """Its rate, then both sides of the inequalities of its switch."""
        yield self.rate
        for condition in () if self.switch is None else (self.switch.on, self.switch.off):
            yield from (condition.left, condition.right)


@dataclass(frozen=True, slots=True)
class SampledValue:
    """A name whose value changes at samples alone, its place, and the new value at a sample."""

    name: str
    mark: Mark
    expression: Expression


@dataclass(frozen=True, slots=True)
class DeclaredController:
    """A sampled controller: it sets inputs and its memory at samples, between which they hold.

    Attributes
    ----------
    name, mark
        Its name and its place.
    every
        Time between samples: a number, or the name of a parameter.
    held_inputs
        The inputs that it holds, over the state and the memory as they are before the sample.
    memory
        The states that it keeps between samples, each by its next value over the same.
    """

    name: str
    mark: Mark
    every: Expression
    held_inputs: tuple[SampledValue, ...]
    memory: tuple[SampledValue, ...] = ()

    @property
    def values(self) -> tuple[SampledValue, ...]:
        """All that the controller sets."""
        return (*self.held_inputs, *self.memory)
