"""Maps of a number of the members of a grid over the plane of two names that they vary."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lagrange_cli.errors import InputError, Problem, nearest
from lagrange_cli.notation.symbols import latex_unit
from lagrange_cli.pictures.mathematics import reduction_axis
from lagrange_cli.pictures.picture import Axis, PlaneMap, at_time, in_dollars, unit_of_column
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.plan.enumeration import GridMembers
from lagrange_cli.simulate.ensemble.store.result import unit_of
from lagrange_cli.simulate.model.labels import Label, Labels

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.plan.enumeration import Members
    from lagrange_cli.simulate.ensemble.plan.plan import Plan


def _refused(message: str, hint: str = "") -> InputError:
    return InputError(Problem(message, hint=hint, rule="map"))


@dataclass(frozen=True)
class Plane:
    """The plane of two varied names over which a number of the members is drawn.

    Attributes
    ----------
    members
        All of them.
    x, y
        Names of the axes.
    """

    members: GridMembers
    x: str
    y: str

    @classmethod
    def of_axes(cls, members: Members, names: tuple[str, ...]) -> Plane:
        """Return the plane of two names.

        Raises
        ------
        InputError
            Members are not all combinations of some values of these two.
        """
        example = "--vary 'theta1=linspace(-3,3,200)' --vary 'theta2=linspace(-3,3,200)'"
        if not isinstance(members, GridMembers):
            raise _refused("a map is of members that are varied", example)
        for name in names:
            if name not in members.names:
                raise _refused(f"'{name}' is not varied", nearest(name, members.names) or example)
        if len(names) != 2 or names[0] == names[1]:
            raise _refused("a map is over two names", f"--map {','.join(members.names[:2])}")
        for name, axis in zip(members.names, members.axes, strict=True):
            if name in names and len(axis) < 2:
                raise _refused(f"'{name}' has one value", example)
            if name not in names and len(axis) > 1:
                said = f"'{name}' varies beside {' and '.join(names)}, of which the map is"
                raise _refused(said, f"give '{name}' one value: --vary '{name}=[1]'")
        return cls(members, *names)

    def drawn(self, plan: Plan, wanted: str | None) -> str:
        """Return the name of the array that is drawn.

        Parameters
        ----------
        plan
            Plan of the runs, which says what is stored.
        wanted
            A reduction, or a column whose end is meant; None for the only reduction.

        Raises
        ------
        InputError
            There is no such number, or it is not said which one.
        """
        reductions = [reduction.text for reduction in plan.selection.reductions]
        if wanted is None:
            if len(reductions) != 1:
                hint = "--reduce 'max(theta)' once, or --plot-of with a reduction or a column"
                raise _refused("what is the map of?", hint)
            return f"reduced/{reductions[0]}"
        if wanted in reductions:
            return f"reduced/{wanted}"
        columns = plan.model.columns if plan.selection.final else ()
        if wanted in columns:
            return f"final/{wanted}"
        hint = nearest(wanted, [*reductions, *columns])
        hint = hint or ("" if plan.selection.final else "--final keeps the ends of columns")
        raise _refused(f"'{wanted}' is no reduction and no column whose end is kept", hint)

    def map_of(self, arrays: Mapping[str, Any], name: str, plan: Plan, times: Array) -> PlaneMap:
        """Return the map of a result.

        Parameters
        ----------
        arrays
            Arrays of the result by name.
        name
            Name of the array that is drawn.
        plan
            Plan of the runs.
        times
            Times of the samples, shape (samples,).

        Raises
        ------
        InputError
            The number that a value stands for is not known.
        """
        labels = plan.model.labels
        x, y = (self._axis(arrays, name) for name in (self.x, self.y))
        values = self._over_plane(arrays[name])
        if self._is_first(self.x):
            values = values.T
        ordered = np.argsort(x), np.argsort(y)
        units = {labels.unit(name) for name in (self.x, self.y)}
        return PlaneMap(
            labels.title or plan.model.name,
            x[ordered[0]],
            y[ordered[1]],
            values[ordered[1]][:, ordered[0]],
            _varied(plan, self.x, times[0]),
            _varied(plan, self.y, times[0]),
            _bar(labels, name, plan, times[-1]),
            len(units) == 1 and None not in units,
        )

    def _over_plane(self, values: Array) -> Array:
        """Give an array of members the shape of the plane, the name that is varied first first."""
        shape = [len(axis) for axis in self.members.axes if len(axis) > 1]
        return np.asarray(values).reshape(shape)

    def _axis(self, arrays: Mapping[str, Any], name: str) -> Array:
        """Return the numbers that the values of a name stand for."""
        across = 1 if self._is_first(name) else 0
        values = self._over_plane(arrays[f"given/{name}"])
        known = np.where(np.isnan(values), -np.inf, values).max(axis=across)
        if not np.isfinite(known).all():
            raise _refused(f"no member with some value of '{name}' could be begun")
        return np.asarray(known)

    def _is_first(self, name: str) -> bool:
        second_axis = self.y if name == self.x else self.x
        names = self.members.names
        return names.index(name) < names.index(second_axis)


def _varied(plan: Plan, name: str, start: float) -> Axis:
    """Return the quantity of an axis: a parameter, or a value at the start."""
    labels, is_start = plan.model.labels, name in plan.member.initial
    symbol = labels.symbol(name)
    symbol = at_time(symbol, start) if is_start else symbol
    return Axis(in_dollars(symbol), unit_of_column(labels, name))


def _bar(labels: Labels, name: str, plan: Plan, until: float) -> Axis:
    """Return the quantity of the array that is drawn."""
    kind, _, written = name.partition("/")
    if kind == "final":
        symbol = at_time(labels.symbol(written), until)
        return Axis(in_dollars(symbol), unit_of_column(labels, written))
    reductions = {reduction.text: reduction for reduction in plan.selection.reductions}
    unit = unit_of(name, labels, reductions)
    shown = None if unit is None else Label(latex_unit(unit), unit)
    return reduction_axis(reductions[written], shown, labels)
