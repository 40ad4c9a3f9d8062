"""The result of a simulation: a frozen value, its summary, its files and its plot."""

from __future__ import annotations

import io
import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from lagrange_cli.drawn import Film, Reported, draw_into
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import write_file
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Labels
from lagrange_cli.simulate.results.formats import Format, as_csv, as_npz, format_of

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.simulate.results.decimation import Decimated


#: Columns that can be asked for; every component of a particle is there without asking.
EXTRA_COLUMNS = ("energy", "positions", "forces", "conserved")


def require_forces(name: str, forces: Collection[str]) -> None:
    """Refuse columns of constraint forces where there are none.

    Raises
    ------
    InputError
        There are no ``forces``, nor multipliers.
    """
    if not forces:
        raise InputError(
            Problem(
                f"there are no constraint forces of '{name}': nothing is constrained, or they"
                " were not derived",
                hint="in Python: derive(forces=True)",
                rule="no-forces",
            )
        )


@dataclass(frozen=True)
class Event:
    """An event of a contact.

    Attributes
    ----------
    t
        Its time.
    name
        ``contact:NAME``, ``release:NAME``, or ``zeno:NAME`` if bounces have become too short and
        the contact stays closed.
    state
        Column → value just after the event.
    before
        Column → value just before it; None if velocities do not jump.
    """

    t: float
    name: str
    state: Mapping[str, float] = field(default_factory=dict)
    before: Mapping[str, float] | None = None


@dataclass(frozen=True)
class Slide:
    """A time for which the motion slides along a kink: an expression stays zero.

    Attributes
    ----------
    on
        The expression in the scene's language: the argument of ``abs`` or ``sign``, or the
        difference of two of ``min`` and ``max``.
    start, end
        Times; ``end`` is None where it slides at the last sample.
    """

    on: str
    start: float
    end: float | None


@dataclass(frozen=True)
class Trajectory(Reported):
    """Samples of a motion with the estimate of their error.

    If coordinates are, or may become singular, a run has at least 501 samples, of which those
    asked for are given; scales, drifts and the estimate are those of all.

    Attributes
    ----------
    name
        The scene's.
    status
        ``ok``, ``accuracy_not_reached``, ``stopped`` or ``blow_up``.
    reason
        Words that say what happened when, if the status is not ``ok``; samples end there.
    t
        Sample times, shape (samples,). If memory was not to hold all samples, ``t`` and what
        goes with it has some of them, both ends included.
    columns
        Coordinates, Cartesian names of the scene, the ``dot(...)`` of both, and outputs →
        values of the shape of ``t``.
    energy
        Σ q̇ ∂L/∂q̇ − L, of that shape.
    coordinates
        Names of the coordinates.
    requested
        Accuracy asked for; None if a method was chosen instead.
    estimated
        Largest estimated error over its scale; None if a method was chosen instead.
    scales
        Name → scale in which errors of coordinates and of their ``dot(...)`` count.
    holds_until
        Time until which the promise holds.
    energy_drift
        Largest change of a conserved energy function over the largest kinetic part of it; None
        where it is not conserved.
    method, choice, formulation
        Method, the reason for it, and formulation of the equations.
    implementation
        Words that say what evaluated the equations and made the steps.
    steps, rhs_evaluations
        Those of the run itself.
    all_evaluations
        Includes the estimate of the run's error, and runs given up.
    seconds
        ``compile``, ``integrate`` and ``estimate``, and ``follow`` where coordinates were read
        off positions.
    constraint_drift
        Largest residual of the constraints kept beside the coordinates
        (:func:`.verification.drifts.constraint_drift`); None if there are none.
    multipliers, symbols
        Names of these constraints → λ at the samples, and its symbol in the equations.
    forces
        Columns ``force_x(PARTICLE)`` and ``lambda_NAME`` of other constraints, where forces
        were derived.
    events
        Events in order.
    slides
        Times for which the motion slides along kinks, in order of their starts.
    remarks
        Words that say what was done otherwise than the scene's coordinates suggest.
    exempt
        Sample times as close to a jump of velocities, or of a state with two values, as the
        estimated error of its time; these are outside of the promise there.
    written
        Name of the file that has all samples; None if memory has them.
    decimated
        Samples for a picture, if memory does not have all.
    energy_scale
        What changes of the energy are compared with in ``energy_drift``; None where it is.
    labels
        Names and units of the columns in pictures.
    conserved_drift
        Name of each conserved quantity → its largest change over the largest sum of the sizes of
        its terms, for ``energy`` and ``jacobi`` as in ``energy_drift``; None where a number is
        not finite. None unless it was asked for.
    equations
        Those that :meth:`animate` draws; None where they are not known to be of this motion, and in
        what was pickled.
    """

    name: str
    status: Literal["ok", "accuracy_not_reached", "stopped", "blow_up"]
    reason: str
    t: Array
    columns: Mapping[str, Array]
    energy: Array
    coordinates: tuple[str, ...]
    requested: float | None
    estimated: float | None
    scales: Mapping[str, float]
    holds_until: float | None
    energy_drift: float | None
    method: str
    implementation: str
    choice: str
    formulation: str
    steps: int
    rhs_evaluations: int
    all_evaluations: int
    seconds: Mapping[str, float]
    constraint_drift: float | None = None
    multipliers: Mapping[str, Array] = field(default_factory=dict)
    symbols: Mapping[str, str] = field(default_factory=dict)
    forces: Mapping[str, Array] = field(default_factory=dict)
    events: tuple[Event, ...] = field(default_factory=tuple)
    slides: tuple[Slide, ...] = ()
    remarks: tuple[str, ...] = ()
    exempt: tuple[float, ...] = ()
    written: str | None = None
    decimated: Decimated | None = None
    energy_scale: float | None = None
    labels: Labels = field(default_factory=Labels)
    conserved_drift: Mapping[str, float | None] | None = None
    equations: Equations | None = field(default=None, repr=False, compare=False)

    def __getstate__(self) -> dict[str, Any]:
        """Return the numbers alone, which are what travels between processes."""
        return {**self.__dict__, "equations": None}

    @property
    def exit_code(self) -> int:
        """0 where the run did what was asked, else 1."""
        return 0 if self.status == "ok" else 1

    def __repr__(self) -> str:
        """Return a line: a notebook would show all numbers."""
        error = "" if self.estimated is None else f", error {self.estimated:.1g}"
        span = f"t = {self.t[0]:g} to {self.t[-1]:g}"
        return f"<Trajectory of {self.name}: {len(self.t)} samples, {span}, {self.status}{error}>"

    @property
    def state(self) -> dict[str, float]:
        """Every name at the last sample."""
        return {name: float(values[-1]) for name, values in self.columns.items()}

    def _energies(self, extra: Collection[str]) -> list[str]:
        """List the columns of the energy function."""
        followed = (self.conserved_drift or {}) if "conserved" in extra else {}
        conserved = [name for name in ("energy", "jacobi") if name in followed]
        return list(dict.fromkeys([*(["energy"] if "energy" in extra else []), *conserved]))

    def table(self, extra: Collection[str] = ()) -> dict[str, Array]:
        """Gather the columns by name: ``t``, the state, and the requested :data:`EXTRA_COLUMNS`.

        ``energy``; ``positions``, which are part of the state; ``forces``,
        constraint forces as ``force_x(PARTICLE)`` where they were derived, and multipliers
        of constraints as ``lambda_NAME``, as the equations have them. Momenta and conserved
        quantities are part of the state where the motion was asked for them, but for ``energy``
        or ``jacobi``, which ``conserved`` adds.

        Raises
        ------
        InputError
            The scene has a coordinate of its own named ``energy``, or no forces.
        """
        table = {"t": self.t, **self.columns}
        for name in self._energies(extra):
            if name in table:
                said = f"the scene has a name '{name}' of its own"
                raise InputError(Problem(said, rule="column-clash"))
            table[name] = self.energy
        if "forces" in extra:
            require_forces(self.name, [*self.multipliers, *self.forces])
            table |= {self.symbols[name]: values for name, values in self.multipliers.items()}
            table |= self.forces
        return table

    def csv(self, extra: Collection[str] = ()) -> str:
        """Write the samples as CSV: a header of names, then numbers with 17 significant digits."""
        return self._bytes(as_csv, extra).decode()

    def npz(self, extra: Collection[str] = ()) -> bytes:
        """Write the samples as an NPZ archive, one array a name, the same bytes every time."""
        return self._bytes(as_npz, extra)

    def _bytes(self, form: Format, extra: Collection[str]) -> bytes:
        file = io.BytesIO()
        with form(file, len(self.t), None) as add:
            add(self.table(extra))
        return file.getvalue()

    def write(self, path: str | os.PathLike[str], extra: Collection[str] = ()) -> None:
        """Write ``.csv`` or ``.npz`` by the name's ending, whole or not at all.

        Raises
        ------
        InputError
            The ending is another one, or the file cannot be written.
        """
        write_file(path, self._bytes(format_of(path), extra))

    def animate(self, speed: float | None = None) -> Film:
        """Return a film of the motion, which notebooks play and which writes itself into files.

        ``speed``: units of time in a second of the film, as of :meth:`.Derivation.animate`.

        Raises
        ------
        InputError
            The motion is not of the scene's own parameters, or there is no picture of the system.
        """
        if self.equations is None:
            raise InputError(
                Problem(
                    "this motion is not known to be one of the scene with its own parameters",
                    hint="derive the scene with them: load(FILE, parameters=...)",
                    rule="usage",
                )
            )
        return Film(self.equations, [("", self)], speed)

    def plot(self, path: str | os.PathLike[str], of: str | None = None) -> None:
        """Draw the motion into a file: a picture by matplotlib, or ``.tex`` for pgfplots.

        Parameters
        ----------
        of
            What to draw, as ``lagrange simulate --plot-of`` takes it: ``"z:x, dot(theta):theta"``
            is z over x in one panel and a phase portrait in another. By default coordinates,
            velocities and energy over the time.

        Raises
        ------
        InputError
            matplotlib is not installed, or it cannot write such a file; nothing has a name that is
            asked for.
        """
        draw_into(path, self, of)
