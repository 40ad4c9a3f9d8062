"""Paths of stationary action as values, and their files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.drawn import Drawn, Reported
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import ending_of, write_file
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.results.formats import as_csv
from lagrange_cli.studies.path.measure import StationaryPath

if TYPE_CHECKING:
    from lagrange_cli.simulate.results.trajectory import Trajectory
    from lagrange_cli.studies.path.ends import End
    from lagrange_cli.studies.path.motions import Motions
    from lagrange_cli.studies.path.scan import Scan


@dataclass(frozen=True)
class Paths(Drawn, Reported):
    """Paths of stationary action between two configurations at two times.

    Attributes
    ----------
    first, last
        The ends that were asked for.
    solutions
        The paths in ascending order of their action; at least one.
    requested
        Accuracy that was asked for.
    starts
        Number of starts of the search.
    lost
        Number of candidates that could not be certified.
    turnable
        Coordinates of which L is the same a whole turn further.
    turns
        Largest number of whole turns by which ends of these were turned.
    motions
        Evaluates motions and actions.
    scan
        Scan over the initial velocities, with one degree of freedom; else None.
    deflated
        Number of the paths that were found by deflation of others.
    """

    first: End
    last: End
    solutions: tuple[StationaryPath, ...]
    requested: float
    starts: int
    lost: int
    turnable: tuple[str, ...]
    turns: int
    motions: Motions
    scan: Scan | None = None
    deflated: int = 0

    @property
    def name(self) -> str:
        return self.motions.models.motion.name

    @property
    def coordinates(self) -> tuple[str, ...]:
        return self.motions.coordinates

    @property
    def estimated(self) -> float:
        """Largest estimated error of all paths."""
        return max(path.estimated for path in self.solutions)

    @property
    def exit_code(self) -> int:
        """0 if all paths are as accurate as was asked for, else 1."""
        return 0 if self.estimated <= self.requested else 1

    def __repr__(self) -> str:
        kinds = ", ".join(path.conjugacy.kind for path in self.solutions)
        return (
            f"<Paths of {self.name}: {len(self.solutions)} ({kinds}), error {self.estimated:.1g}>"
        )

    def table(self) -> Mapping[str, Array]:
        """Return the samples of all paths under each other: the number of the path from 1 on,
        time, coordinates and velocities."""
        names = ("t", *self.motions.models.motion.state_names)
        parts = [
            np.column_stack(
                [np.full(len(path.trajectory.t), number), *_columns(path.trajectory, names)]
            )
            for number, path in enumerate(self.solutions, 1)
        ]
        return dict(zip(("solution", *names), np.vstack(parts).T, strict=True))

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the samples as ``.csv``.

        Raises
        ------
        InputError
            The ending is another one, or the file cannot be written.
        """
        import io

        ending = ending_of(path)
        if ending != ".csv":
            message = f"the samples of paths are written as .csv, not '{ending}'"
            raise InputError(Problem(message, hint="-o path.csv", rule="output"))
        file, table = io.BytesIO(), self.table()
        with as_csv(file, len(table["t"]), None) as add:
            add(table)
        write_file(path, file.getvalue())


def _columns(trajectory: Trajectory, names: tuple[str, ...]) -> list[Array]:
    return [trajectory.t if name == "t" else trajectory.columns[name] for name in names]
