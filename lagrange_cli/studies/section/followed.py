"""A motion over panels of time, with its polynomials there and its points in a section."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.model.requested_outputs import section_outputs
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.studies.chebyshev import (
    DEGREE,
    Flags,
    Interpolated,
    Series,
    interpolated,
)
from lagrange_cli.studies.section.roots import Zeros, zeros_of

#: Parts into which a panel is divided: more of them need fewer runs, and more samples. Not tuned.
PARTS = 4

#: Distance of a condition from zero, over its changes in a panel, beyond which it does not vanish
#: on the way to a border of where it has values. Not tuned.
_FAR = 10.0

#: Part of the size of a number that polynomials may leave out where they only show its course
#: between nodes. Not tuned.
_BLURRED = 1e-3


@dataclass(frozen=True)
class Mesh:
    """Panels of a motion.

    Attributes
    ----------
    edges
        Their ends, shape (panels + 1,).
    """

    edges: Array

    @classmethod
    def equal(cls, start: float, until: float, count: int) -> Mesh:
        return cls(np.linspace(start, until, count + 1))

    def until(self, end: float) -> Mesh:
        """Cut the panels at a time."""
        count = int(np.searchsorted(self.edges, end, side="left"))
        return Mesh(np.append(self.edges[:count], end))

    def divided(self, which: Flags) -> Mesh:
        """Divide some panels."""
        counts = np.where(which, PARTS, 1)
        lengths = np.repeat(np.diff(self.edges) / counts, counts)
        number = np.arange(len(lengths)) - np.repeat(np.cumsum(counts) - counts, counts)
        edges = np.repeat(self.edges[:-1], counts) + number * lengths
        return Mesh(np.append(edges, self.edges[-1]))


@dataclass(frozen=True)
class FollowedMotion:
    """A run over a mesh, and its points in the section.

    Attributes
    ----------
    model, run, mesh
        The motion.
    tolerance
        Part of the state that polynomials may leave out, over scales.
    """

    model: Model
    run: Trajectory
    mesh: Mesh
    tolerance: float

    @property
    def edges(self) -> Array:
        return self.mesh.edges

    @cached_property
    def names(self) -> tuple[tuple[str, ...], ...]:
        """Names of the columns of each condition: its value, and derivatives by the state."""
        conditions = sum(_is_value(name) for name in self.model.outputs)
        return section_outputs(conditions, self.model.layout.size)

    @cached_property
    def scales(self) -> Array:
        return np.array([self.run.scales[name] for name in self.model.state_names])

    @property
    def estimated(self) -> float:
        return self.run.estimated or 0.0

    def errors(self, condition: int) -> Array:
        """Return the largest error of a condition in each panel, from that of the state."""
        total = np.zeros(len(self.run.t))
        for name, scale in zip(self.names[condition][1:], self.scales, strict=True):
            total += self.estimated * scale * np.abs(self.run.columns[name])
        rows = np.arange(len(self.edges) - 1)[:, None] * DEGREE + np.arange(DEGREE + 1)
        return np.asarray(total[rows].max(axis=1))

    @cached_property
    def series(self) -> Series:
        return Series.through(self.edges, self.run.columns[self.names[0][0]])

    @cached_property
    def zeros(self) -> Zeros:
        return zeros_of(self.series, self.errors(0))

    def column_at(self, name: str, t: Array) -> Interpolated:
        """Interpolate a column at some times; at the start it is exact."""
        values = self.run.energy if name == "energy" else self.run.columns[name]
        known = interpolated(self.edges, values, self.series.panels_of(t), t)
        at_start = t == self.edges[0]
        return known._replace(
            values=np.where(at_start, values[0], known.values),
            left_out=np.where(at_start, 0.0, known.left_out),
        )

    def satisfied(self, t: Array) -> tuple[Flags, Flags]:
        """Return at which times all inequalities hold, and at which that is open."""
        holds, is_open, start = np.ones(len(t), bool), np.zeros(len(t), bool), self.edges[0]
        panels = self.series.panels_of(t)
        for condition in range(1, len(self.names)):
            value = self.column_at(self.names[condition][0], t)
            error = np.where(t == start, 0.0, self.errors(condition)[panels]) + value.left_out
            is_open = is_open & (value.values >= -error) | holds & (np.abs(value.values) < error)
            holds &= value.values >= error
            holds &= (value.values > 0) | (error > 0)
        return holds, is_open

    @cached_property
    def points(self) -> Array:
        """Times of the points, shape (m,)."""
        return self.zeros.t[self.satisfied(self.zeros.t)[0]]

    @cached_property
    def open(self) -> Array:
        """Times at which the number of points is open."""
        holds, is_open = self.satisfied(self.zeros.open)
        _, at_border = self.satisfied(self.zeros.t)
        places = [self.zeros.open[holds | is_open], self.zeros.t[at_border]]
        middles = (self.edges[1:] + self.edges[:-1]) / 2
        return np.unique(np.concatenate([*places, middles[self.blurred]]))

    @cached_property
    def states(self) -> list[Interpolated]:
        """Each component of the state at the points."""
        return [self.column_at(name, self.points) for name in self.model.state_names]

    @cached_property
    def delays(self) -> tuple[Array, Array]:
        """Errors of the times of points: from the run, and from the polynomials."""
        t, start = self.points, self.edges[0]
        crossing = self.column_at(self.names[0][0], t)
        with np.errstate(divide="ignore"):
            steepness = np.where(t == start, np.inf, np.abs(crossing.slopes))
            of_run = self.errors(0)[self.series.panels_of(t)] / steepness
            return of_run, crossing.left_out / steepness

    def point_errors(self) -> tuple[Array, Array]:
        """Return the errors of points over scales, of the run and of polynomials, both (m,)."""
        of_run, of_polynomials = self.delays
        span = self.edges[-1] - self.edges[0]
        errors = np.where(self.points == self.edges[0], 0.0, self.estimated)
        errors, left_out = np.maximum(errors, of_run / span), of_polynomials / span
        for known, scale in zip(self.states, self.scales, strict=True):
            speed = np.abs(known.slopes) / scale
            errors = np.maximum(errors, self.estimated + speed * of_run)
            left_out = np.maximum(left_out, known.left_out / scale + speed * of_polynomials)
        errors = np.where(self.points == self.edges[0], 0.0, errors)
        return errors, np.where(self.points == self.edges[0], 0.0, left_out)

    @cached_property
    def blurred(self) -> Flags:
        """Panels in which polynomials do not show the course of the motion, or of a condition.

        A passage that is shorter than the time between nodes shows there in velocities.
        """
        flags = np.zeros(len(self.edges) - 1, bool)
        for name, scale in self._sizes():
            values = self.run.columns[name]
            left_out = Series.through(self.edges, values).left_out
            flags |= ~(left_out <= _BLURRED * scale) & ~self._decided(values)
        return flags

    def _decided(self, values: Array) -> Flags:
        """Tell where a condition has no value at all, or is far from zero beside the border of
        where it has some."""
        rows = np.arange(len(self.edges) - 1)[:, None] * DEGREE + np.arange(DEGREE + 1)
        within = np.where(np.isfinite(values[rows]), values[rows], np.nan)
        has_value = np.isfinite(within)
        with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
            low, high = np.nanmin(within, axis=1), np.nanmax(within, axis=1)
        far = np.minimum(np.abs(low), np.abs(high)) > _FAR * (high - low)
        return np.asarray(~has_value.any(axis=1) | (~has_value.all(axis=1) & far))

    def _sizes(self) -> Iterator[tuple[str, float]]:
        """Yield the columns of the state and of conditions, with the size of each."""
        yield from zip(self.model.state_names, self.scales.tolist(), strict=True)
        for names in self.names:
            sizes = np.abs(self.run.columns[names[0]])
            yield names[0], float(sizes[np.isfinite(sizes)].max(initial=0.0))

    def to_divide(self) -> Flags:
        """Return which panels are too long to resolve points, or their number."""
        wanted = self.blurred.copy()
        _, left_out = self.point_errors()
        panels = self.series.panels_of
        wanted[panels(self.points)[left_out > self.tolerance]] = True
        at = panels(self.open)
        wanted[at] |= self.series.left_out[at] > self.errors(0)[at]
        for condition in range(1, len(self.names)):
            value = self.column_at(self.names[condition][0], self.open)
            wanted[at] |= value.left_out > self.errors(condition)[at]
        return wanted


def _is_value(output: str) -> bool:
    return output.startswith("section ") and " by " not in output
