"""The protocol of an integrator, and how to add one.

An integrator sees ``rhs(t, y)`` and nothing else of the problem: no symbols, parameters or scene.
To add a method, subclass :class:`Integrator` and list the class in
:data:`~lagrange_cli.simulate.integrators.INTEGRATORS`; help, choices and tests derive from there.
An implementer promises:

1. **State.** After construction ``t`` and ``y`` are the start; after each
   :meth:`~Integrator.step` they are the end of that step. ``y`` is a fresh array that later steps
   leave alone.
2. **One step a call.** ``step(limit)`` makes one accepted step forward in time, never beyond
   ``limit``, which is ``t_end`` where ``interpolates`` is true and may be any later time else.
3. **Failure.** A step that cannot be made (underflow of the step, a value
   that is not finite, a solver that does not converge) raises
   :class:`StepError` and leaves ``t`` and ``y`` at the last good state.
   ``rhs`` returns NaN where it is undefined; it never raises.
4. **Samples.** With ``interpolates`` true, :meth:`~Integrator.interpolate`
   gives states within the last step about as accurate as its ends; with false
   the caller makes steps end on the sample times and never interpolates.
5. **Tolerance.** An adaptive method keeps its estimate of each step's error
   in component i below ``atol[i] + rtol[i]·|y[i]|`` in the root mean square;
   nothing absolute hides in it, so that units do not matter. A method with
   ``adaptive`` false ignores the tolerance and steps by ``control.step``.
6. **Steps.** ``first_step`` and ``max_step`` of the control are obeyed.
7. **Counters.** ``evaluations`` counts the calls of the right-hand side, ``steps``
   the accepted steps, ``remade`` those that were made again for a sharp function.
8. **Determinism.** The same problem and control give the same bits; no clock,
   no random number, no state shared between instances.
9. **Many steps.** :meth:`~Integrator.advance` gives the same bits however its
   work is divided into calls. The implementation here, in single steps, serves every
   method; compiled ones do it in one call.
10. **Declared properties.** ``order``, ``variable_order``, ``adaptive``,
   ``implicit``, ``symplectic``, ``projects`` and ``needs`` say what the method is;
   tests measure each of them for every registered method.
11. **Constraints.** If ``rhs`` has a projection (:class:`.right_hand_side.StructuredRhs`), the
   end of every accepted step is projected and the next step starts from there, slope included; so
   are the samples between. States of :meth:`~Integrator.interpolate` are not. A projection that
   fails is a step that cannot be made. A method whose own equations hold its states on the
   constraints, to its tolerance, may go on from the state before its projection. One that can
   do neither has ``projects`` false and is not started.
12. **Pieces.** If the inputs of ``rhs`` have pieces, steps end with each of them. A
   method that sees ``rhs(t, y)`` alone is begun anew in each by :func:`.piecewise.in_pieces`.
13. **Events.** After :meth:`~Integrator.stop_at` the run ends at the first + → − zero crossing
   of some functions: ``t`` and ``y`` are there, projected, ``end_event`` is the function's
   number, and no later sample is filled. Methods without interpolant cannot.
14. **Going on.** :meth:`~Integrator.state` gives all that later steps depend on as plain values,
   and :meth:`~Integrator.restore`, called where a run of the same start and control has made no
   step, makes that run go on bit by bit as the other one. ``state_attributes`` lists those that
   are the state beside those of every integrator; where more is to be done a method extends
   both. One whose state is out of reach has ``resumes`` false.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

import numpy as np

from lagrange_cli.phrases import Phrase
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.events import EventSearch, TerminalEvents, ZeroCrossing
from lagrange_cli.simulate.integrators.observed_motion import SETTLING, ObservedMotion
from lagrange_cli.simulate.integrators.right_hand_side import Projection, Rhs, structured

#: The state of a run: numbers, texts, arrays, None, and sequences and mappings of these by names.
SavedState: TypeAlias = Mapping[str, Any]

#: Why a run ends where its state cannot be projected.
UNMET = Phrase("the constraints cannot be met")

#: Why a run ends where numbers overflow.
NOT_FINITE = Phrase("the state is no longer finite")

#: Why a run ends where steps are too short beside the last place of the time.
UNDERFLOW = Phrase("the step size underflowed")


class StepError(Exception):
    """A step could not be made; ``reason`` is a phrase for a person."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


class UnfitError(Exception):
    """A method cannot take this right-hand side; ``reason`` is a phrase for a person."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


@dataclass(frozen=True)
class Loosening:
    """Absolute tolerances that grow with a motion.

    Attributes
    ----------
    since
        Times from which they hold, ascending from the start, shape (k,).
    rows
        The tolerances, shape (k, 2n).
    """

    since: Array
    rows: Array


@dataclass(frozen=True)
class Control:
    """The tolerances and step sizes of a run.

    Attributes
    ----------
    rtol, atol
        Tolerances of each component of y, relative and absolute, shape (2n,).
    first_step, max_step
        Times.
    step
        The step of methods that are not adaptive, None for others.
    autonomous
        Whether rhs is known not to depend on t, so that what rests goes on to.
    observed
        What is seen of the motion on the way, whose scales ``atol`` follows; None if nothing is.
    loosening
        What ``atol`` is brought up to date by; None if it stays.
    """

    rtol: Array
    atol: Array
    first_step: float
    max_step: float
    step: float | None = None
    autonomous: bool = False
    observed: ObservedMotion | None = None
    loosening: Loosening | None = None

    def loosen(self, t: float) -> None:
        """Let the absolute tolerances be those that hold at a time."""
        if self.loosening is not None:
            number = int(self.loosening.since.searchsorted(t, side="right")) - 1
            self.atol[:] = self.loosening.rows[max(number, 0)]


#: Changes of states with two values: the place of the state in y, and the time.
Toggles: TypeAlias = tuple[tuple[int, float], ...]

#: Slides along switching surfaces: number of the surface, time from and until, infinite so far.
Slides: TypeAlias = tuple[tuple[int, float, float], ...]

#: Of event functions: their signs, noise and reach (:mod:`.events`).
EventStart: TypeAlias = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True)
class Advance:
    """The number of samples filled, and why no further step can be made (None: it can)."""

    filled: int
    failure: str | None = None


class Integrator(ABC):
    """One run of a method over y' = rhs(t, y) from ``t0`` towards ``t_end`` > ``t0``.

    Class attributes, down to ``traces``, declare the method.

    Attributes
    ----------
    name, title
        As the user types it, and as text calls it.
    order, variable_order
        Order, the highest one where it varies.
    adaptive
        Steps are chosen by the tolerance, not fixed.
    implicit
        A-stable or stiffly stable, so that stiff systems do not force small steps.
    symplectic
        Steps are symplectic maps.
    needs
        Structure facts it relies on, names of :class:`~lagrange_cli.mechanics.findings.Facts`.
    interpolates, projects
        The fourth and the eleventh promise.
    state_attributes, resumes
        The last promise.
    repeats
        A step whose event is early in it is made again, shorter.
    package
        Optional package by its name in Python, and the extra that installs it.
    traces
        It needs the expressions of the right-hand side, and raises :class:`UnfitError`
        where they are not to be had.
    shortens
        True if steps are made shorter where the right-hand side does not exist, so that a run ends
        at the border; false if it ends where that is seen first.
    t, y, t_end
        Time and state, shape (2n,), of the run, and the time of its end.
    evaluations, steps, remade
        Counters, see the seventh promise.
    end_event
        Number of the event function at whose zero the run ended; None before.
    last_step
        Length of the last step.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    order: ClassVar[int]
    variable_order: ClassVar[bool] = False
    adaptive: ClassVar[bool] = True
    implicit: ClassVar[bool] = False
    symplectic: ClassVar[bool] = False
    needs: ClassVar[tuple[str, ...]] = ()
    interpolates: ClassVar[bool] = True
    projects: ClassVar[bool] = True
    state_attributes: ClassVar[tuple[str, ...]] = ()
    resumes: ClassVar[bool] = True
    repeats: ClassVar[bool] = False
    package: ClassVar[tuple[str, str] | None] = None
    traces: ClassVar[bool] = False
    shortens: ClassVar[bool] = True

    t: float
    y: Array
    t_end: float
    evaluations: int = 0
    steps: int = 0
    end_event: int | None = None
    last_step: float = 0.0
    remade: int = 0
    _projection: Projection | None = None
    _states: int = 0
    _search: EventSearch | None = None
    _observed: ObservedMotion | None = None
    _loosened: Control | None = None

    @property
    def dips(self) -> Sequence[ZeroCrossing]:
        """Least values of event functions within their reach of zero, in order."""
        return () if self._search is None else self._search.dips

    @property
    def toggles(self) -> Toggles:
        """Changes of states with two values so far, in order."""
        return ()

    @property
    def slides(self) -> Slides:
        """Slides along switching surfaces so far, in the order of their ends."""
        return ()

    @abstractmethod
    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        """Stand at (t0, y0)."""

    @abstractmethod
    def step(self, limit: float) -> None:
        """Make one step, to ``limit`` at most; raise :class:`StepError` if impossible."""

    def _advance_by_a_step(self) -> None:
        """Make one step by :meth:`advance`, for methods that are composed of others."""
        states = np.empty((1, len(self.y)))
        done = self.advance(np.array([np.inf]), states, most_steps=1, most_evaluations=float("inf"))
        if done.failure is not None:
            raise StepError(done.failure)

    def interpolate(self, times: Array) -> Array:
        """Evaluate states at ``times`` within the last step, shape (len(times), 2n)."""
        raise NotImplementedError(f"{self.name} does not interpolate")

    def stop_at(self, events: TerminalEvents) -> None:
        """End the run where one of the functions falls through zero."""
        if not self.interpolates:
            raise ValueError(f"steps of {self.name} have no interpolant to find events on")
        self._search = EventSearch(events)

    def observe(self, motion: ObservedMotion) -> None:
        """Let a motion see each step of :meth:`advance` from here on."""
        self._observed = motion

    def loosen_by(self, control: Control) -> None:
        """Let the tolerances of :meth:`advance` be brought up to date before each step."""
        self._loosened = control

    def again(self, t0: float, y0: Array, first_step: float, event_start: EventStart) -> bool:
        """Stand at another state with the same right-hand side, control and event functions, as
        if begun there; False where that is not to be had, and a run has to be made."""
        return False

    def state(self) -> SavedState:
        """Return all that later steps depend on."""
        names = ("t", "y", "steps", "evaluations", "end_event", *self.state_attributes)
        values = {name: getattr(self, name) for name in names if hasattr(self, name)}
        return values if self._search is None else {**values, "signs": self._search.signs}

    def restore(self, state: SavedState) -> None:
        """Go on where a run of this method with the same start and control stood."""
        for name in ("t", "y", "steps", "evaluations", "end_event", *self.state_attributes):
            if name in state:
                setattr(self, name, state[name])
        if self._search is not None:
            self._search.signs = list(state["signs"])

    def advance(
        self, times: Array, states: Array, *, most_steps: int, most_evaluations: float
    ) -> Advance:
        """Step on until all samples are filled, a limit is reached, or the run ends.

        Parameters
        ----------
        times
            Ascending, none before the start of the last step, shape (m,).
        states
            Receives the state at each sample that is reached, shape (m, 2n).
        most_steps, most_evaluations
            No further step begins after so many in this call.
        """
        filled = self.take(times, states, 0)
        first_steps, first_evaluations = self.steps, self.evaluations
        while (
            filled < len(times)
            and self.end_event is None
            and self.steps - first_steps < most_steps
            and self.evaluations - first_evaluations < most_evaluations
            and not (self._observed is not None and self._observed.ended)
        ):
            try:
                start, before = self.t, self.y
                if self._loosened is not None:
                    self._loosened.loosen(start)
                self.step(self.t_end if self.interpolates else float(times[filled]))
                self.steps += 1
                self.last_step = self.t - start
                event = self._event(start)
                end = np.searchsorted(times, event[0], side="right") if event else len(times)
                filled = self.take(times[:end], states, filled)
                if event is not None:
                    self._stop(*event)
                if self._observed is not None:
                    grown = self.steps > SETTLING and event is None
                    self._observed.add(start, before, self.t, self.y, grown)
            except StepError as error:
                return Advance(filled, error.reason)
        return Advance(filled)

    def _event(self, start: float) -> tuple[float, int] | None:
        """Locate the first zero crossing in the last step, which began at ``start``, or None."""
        return None if self._search is None else self._search.first(self._within, start, self.t)

    def _within(self, t: float) -> Array:
        """Evaluate the state at a time within the last step, on the constraints."""
        return self.y if t == self.t else self._projected(t, self.interpolate(np.array([t]))[0])

    def _stop(self, t: float, event: int) -> None:
        """Stand at the end of the run."""
        self.y = self._within(t)
        self.t, self.end_event = t, event

    @property
    def signs(self) -> tuple[float, ...]:
        """The present signs of the functions that end the run."""
        return () if self._search is None else tuple(self._search.signs)

    def take(self, times: Array, states: Array, filled: int) -> int:
        """Fill the samples that the last step has passed; return how many are filled."""
        reached = int(np.searchsorted(times, self.t, side="right"))
        if reached <= filled:
            return filled
        inside = times[filled:reached]
        if inside[-1] == self.t:
            states[reached - 1] = self.y
            inside = inside[:-1]
        if len(inside):
            samples = self.interpolate(inside)
            if not np.isfinite(samples).all():
                raise StepError(NOT_FINITE)
            if self._projection is not None:
                between = zip(inside.tolist(), samples, strict=True)
                samples = np.array([self._projected(t, y) for t, y in between])
            states[filled : filled + len(inside)] = samples
        return reached

    def _arrived(self, t: float, y: Array) -> Array:
        """Move the end of a step, if it is finite, onto the constraints."""
        if not np.isfinite(y).all():
            raise StepError(NOT_FINITE)
        return self._projected(t, y)

    def _projected(self, t: float, y: Array) -> Array:
        """Move a state onto the constraints; without any it is returned itself."""
        if self._projection is None:
            return y
        moved = self._projection(t, y)
        if not np.isfinite(moved).all():
            raise StepError(UNMET)
        return moved

    def _counted(self, rhs: Rhs) -> Rhs:
        """Count the calls of a right-hand side; its projection is kept."""
        structure = structured(rhs)
        self._projection, self._states = structure.project, structure.states

        def counted(t: float, y: Array) -> Array:
            self.evaluations += 1
            return rhs(t, y)

        return counted


def two_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Return a + b as a rounded sum and its exact rounding error (Knuth)."""
    s = a + b
    part = s - a
    return s, (a - (s - part)) + (b - part)


class FixedStep(Integrator):
    """Steps of ``control.step``, a shorter one at the end; the sum over steps is compensated."""

    adaptive = False
    interpolates = False
    state_attributes: ClassVar[tuple[str, ...]] = ("_low",)

    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        if control.step is None:
            raise ValueError(f"{self.name} needs control.step")
        self._rhs, self._h = self._counted(rhs), control.step
        self.t, self.y, self.t_end = t0, np.array(y0, dtype=float), t_end
        self._low = np.zeros_like(self.y)

    def step(self, limit: float) -> None:
        t = self.t
        # A remainder of rounding size joins the step rather than becoming one.
        t_new = t + self._h if limit - t > self._h * (1 + 1e-9) else limit
        y, low = two_sum(self.y, self._low + self._change(t, t_new - t))
        projected = self._arrived(t_new, y)
        if projected is not y:
            self._moved()
        self.t, self.y, self._low = t_new, projected, low

    @abstractmethod
    def _change(self, t: float, h: float) -> Array:
        """Return the change of the state over a step, without the rounding of the sum."""

    def _moved(self) -> None:
        """Forget what belongs to a state that was then projected."""
