"""Options of a simulation, as a user states them; importing them imports nothing else."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lagrange_cli.scene.conditions import SimulationDefaults

#: The name of the method that is chosen by the program.
AUTO = "auto"


def is_automatic(method: str | None) -> bool:
    """Tell whether a method is named that stands for the choice of one."""
    return method is not None and method.casefold() == AUTO


@dataclass(frozen=True, kw_only=True)
class SimulationOptions:
    """Options of a user who asks for a motion; None leaves one to the scene, then to the program.

    Attributes
    ----------
    until
        Time of the last sample, after the scene's ``from``.
    accuracy
        Largest error of any coordinate or velocity at any sample, relative to its scale;
        excludes the next three.
    method
        Name of an integrator, or ``auto``: the method that ``accuracy`` would use.
    rtol
        Local relative tolerance of a method.
    atol
        Local absolute tolerance, in the unit of each component; by default ``rtol``/100 of
        its scale.
    step
        Time between samples; of a method with fixed steps, its step.
    samples
        Number of samples, both ends included.
    budget
        Seconds after which the run stops and keeps what it has.
    times
        All sample times, ascending from the scene's start, in place of ``until``, ``step`` and
        ``samples``; not for methods that make their steps end there.
    usual_accuracy
        ``accuracy`` where neither these options nor the scene control the error; by default the
        program's.
    """

    until: float | None = None
    accuracy: float | None = None
    method: str | None = None
    rtol: float | None = None
    atol: float | None = None
    step: float | None = None
    samples: int | None = None
    budget: float | None = None
    times: tuple[float, ...] | None = None
    usual_accuracy: float | None = None

    @property
    def controls(self) -> tuple[str | float | None, ...]:
        """A method and its tolerances, which control the error without an accuracy."""
        return self.method, self.rtol, self.atol

    def completed(self, defaults: SimulationDefaults) -> SimulationOptions:
        """Take from the scene's section what controls the error, and when to sample, as a whole."""
        options = replace(self, method=None) if is_automatic(self.method) else self
        if options.accuracy is None and not any(x is not None for x in options.controls):
            options = replace(
                options,
                accuracy=defaults.accuracy,
                method=None if is_automatic(defaults.method) else defaults.method,
                rtol=defaults.rtol,
                atol=defaults.atol,
            )
        if options.accuracy is None and not any(x is not None for x in options.controls):
            options = replace(options, accuracy=self.usual_accuracy)
        if options.samples is None and options.step is None:
            options = replace(options, samples=defaults.samples, step=defaults.step)
        return options
