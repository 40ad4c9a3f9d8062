"""Points of Poincaré sections, of one motion or of many."""

from __future__ import annotations

import io
import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from lagrange_cli.drawn import Reported, draw_into
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import write_file
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Labels
from lagrange_cli.simulate.results.formats import format_of

#: The status of a member that cannot be begun.
REFUSED = "refused"


@dataclass(frozen=True)
class SectionPoints:
    """Points at which one motion meets a section.

    Attributes
    ----------
    t
        Times, ascending, shape (m,).
    columns
        Coordinates, Cartesian names of the scene and the ``dot(...)`` of both → values, shape (m,).
    energy
        The energy function there, shape (m,).
    error
        Largest estimated error of a coordinate or velocity at each point, relative to its scale,
        and of the time, relative to the span; shape (m,). None if a method was chosen.
    open
        Times at which the motion touches the section, or comes so close to it, or to the border
        of an inequality, that its error decides whether there are points; ascending.
    status, reason, requested, estimated, scales, holds_until, energy_drift, method
        As of the motion's :class:`.simulate.results.trajectory.Trajectory`.
    runs
        Number of times that the motion was run.
    seconds
        Seconds of the whole computation.
    given
        Values in which this member differs from others, as texts; empty for a single motion.
    """

    t: Array
    columns: Mapping[str, Array]
    energy: Array
    error: Array | None
    open: tuple[float, ...]
    status: str
    reason: str
    requested: float | None
    estimated: float | None
    scales: Mapping[str, float]
    holds_until: float | None
    energy_drift: float | None
    method: str
    runs: int
    seconds: float
    given: Mapping[str, str] = field(default_factory=dict)

    @property
    def uncertain(self) -> int:
        """Number of points that are not known to the accuracy that was asked for."""
        if self.error is None or self.requested is None:
            return 0
        return int((self.error > self.requested).sum())

    @property
    def complete(self) -> bool:
        """True if the motion was followed to its end, and all points are known, and how many."""
        return self.status == "ok" and not self.uncertain and not self.open


@dataclass(frozen=True)
class Section(Reported):
    """A Poincaré section: the points at which one motion, or each of many, meets a condition.

    Attributes
    ----------
    name
        Name of the scene.
    condition
        The condition as it was written.
    members
        Points of each motion; one for a single motion.
    coordinates
        Names of the coordinates.
    free
        Coordinates that the equation does not fix, whose phase portraits a picture shows.
    turning
        Angles that a picture shows between −π and π, since whole turns change nothing.
    labels
        Names and units of the columns in pictures.
    """

    name: str
    condition: str
    members: tuple[SectionPoints, ...]
    coordinates: tuple[str, ...]
    free: tuple[str, ...]
    turning: tuple[str, ...]
    labels: Labels = field(default_factory=Labels)

    def __len__(self) -> int:
        return sum(len(points.t) for points in self.members)

    def __repr__(self) -> str:
        motions = f" of {len(self.members)} motions" if len(self.members) > 1 else ""
        return f"<Section of {self.name} where {self.condition}: {len(self)} points{motions}>"

    @property
    def t(self) -> Array:
        """Times of the points of all members, one member after the other."""
        return np.concatenate([points.t for points in self.members])

    @property
    def member(self) -> Array:
        """Number of the member of each point."""
        return np.repeat(np.arange(len(self.members)), [len(points.t) for points in self.members])

    @property
    def columns(self) -> dict[str, Array]:
        """Columns of the points of all members, one member after the other."""
        every = [points.columns for points in self.members]
        names = dict.fromkeys(name for columns in every for name in columns)
        return {
            name: np.concatenate(
                [p.columns.get(name, np.full(len(p.t), np.nan)) for p in self.members]
            )
            for name in names
        }

    @property
    def exit_code(self) -> int:
        """0 if every motion was followed and all points are known, and how many; else 1."""
        return 0 if all(points.complete for points in self.members) else 1

    def table(self, extra: Collection[str] = ()) -> dict[str, Array]:
        """Return column name → values of all points: ``t``, the state, ``error``.

        Several motions have a first column ``member``. ``extra`` may have ``energy``.

        Raises
        ------
        InputError
            The scene has a name of its own as one of these.
        """
        table = {"member": self.member.astype(float)} if len(self.members) > 1 else {}
        table["t"] = self.t
        further = {}
        if "energy" in extra:
            further["energy"] = np.concatenate([points.energy for points in self.members])
        if all(points.error is not None for points in self.members):
            errors = [np.zeros(0) if p.error is None else p.error for p in self.members]
            further["error"] = np.concatenate(errors)
        for name in (*table, *further):
            if name != "t" and name in self.columns:
                said = f"the scene has a name '{name}' of its own"
                raise InputError(Problem(said, rule="column-clash"))
        return {**table, **self.columns, **further}

    def write(self, path: str | os.PathLike[str], extra: Collection[str] = ()) -> None:
        """Write the points as ``.csv`` or ``.npz``, whole or not at all.

        Raises
        ------
        InputError
            The ending is another one, or the file cannot be written.
        """
        table, file = self.table(extra), io.BytesIO()
        with format_of(path)(file, len(self), None) as add:
            add(table)
        write_file(path, file.getvalue())

    def plot(self, path: str | os.PathLike[str], of: str | None = None) -> None:
        """Draw the points into a file, as :meth:`.Trajectory.plot` draws a motion.

        By default the velocity of each coordinate that the equation does not fix over it.

        Raises
        ------
        InputError
            matplotlib is not installed, or it cannot write such a file; nothing has a name that is
            asked for.
        """
        draw_into(path, self, of)
