"""Models of one scene with other values, derived as seldom as possible.

If members differ in numbers alone, a model is made once: the scene's equations are derived again
without any value, and if that changes nothing they are those of all members. Then a member is the
model with other parameters and another start. Each member is derived by itself if its values
change the equations (one chooses among the solutions of a constraint), if a start is given in
other names than the coordinates, or if a parameter has another sign.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.errors import InputError
from lagrange_cli.files.rows import DECIMAL_NUMBER
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.plan.recipe import (
    MemberValues,
    Recipe,
    numeric_values,
    used_names,
    varied_parameters,
)
from lagrange_cli.simulate.model.model import Model

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.scene.conditions import SimulationDefaults
    from lagrange_cli.scene.model import Scene


def differ_in_numbers(recipe: Recipe, member: MemberValues, model: Model) -> bool:
    """Decide whether members differ from the ``model`` of one of them in numbers alone."""
    scene = recipe.scene(member)
    initial_names = [(value.name, value.order) for value in scene.initial]
    if not {size.name for size in scene.sizes}.isdisjoint(member.parameters):
        return False
    simple = not (model.multipliers or model.contacts or model.chart)
    if not simple or not {name for name, _ in initial_names} <= set(model.coordinates):
        return False
    if not {p.name for p in model.parameters} <= {p.name for p in scene.parameters}:
        return False  # a constant of integration follows the start
    if model.initial is None or not {(name, 0) for name in model.coordinates} <= set(initial_names):
        return False
    if NumericMembers(recipe, member, model).model_of(member) != model:
        return False
    try:
        without = recipe.derived(_without_values(scene), "minimal")
    except InputError:
        return False
    return _equations(without) == _equations(model)


def _without_values(scene: Scene) -> Scene:
    """Remove the values of a scene, so that none can choose among solutions."""
    from lagrange_cli.scene.conditions import WrittenDefaults

    parameters = tuple(replace(p, value=None) for p in scene.parameters)
    return replace(scene, parameters=parameters, initial=(), near=(), simulate=WrittenDefaults())


def _equations(model: Model) -> Model:
    """Remove the numbers of a model, and its labels, since units follow from values."""
    return replace(
        model,
        parameters=(),
        initial=None,
        defaults=type(model.defaults)(),
        suggested=(),
        labels=type(model.labels)(),
    )


class NumericMembers:
    """Models of members that differ from one in numbers alone.

    Parameters
    ----------
    recipe
        Recipe of all members.
    member, model
        Values and model of one member.
    """

    def __init__(self, recipe: Recipe, member: MemberValues, model: Model) -> None:
        self._scene, self._model = recipe.scene(member), model
        assert model.initial is not None
        self._values, self._start = [p.value for p in model.parameters], model.initial
        self._parameters = {p.name: k for k, p in enumerate(model.parameters)}
        self._place = {name: k for k, name in enumerate(model.state_names)}
        varied = varied_parameters(self._scene, member)
        dependent = varied - set(member.parameters)
        entries = (*self._scene.initial, *self._scene.state_starts)
        referenced = set[str]().union(*(used_names(value.value) for value in entries))
        self._plain = not dependent and not referenced & set(member.parameters)
        self._timed = any(used_names(entry) & varied for entry in self._scene.simulate.numbers)

    def model_of(self, member: MemberValues) -> Model | None:
        """Return the model of a member; None if a parameter has another sign, with which the
        equations may be others.

        Raises
        ------
        InputError
            Located: a text without a value.
        """
        numbers = self.values(member)
        if numbers is None:
            return None
        values, start = numbers
        texts = {**member.parameters, **member.initial} if self._is_plain(member) else None
        pairs = zip(self._model.parameters, values, strict=True)
        parameters = tuple(
            replace(p, value=value, decimal="" if texts is None else texts.get(p.name, p.decimal))
            for p, value in pairs
        )
        named = zip(self._model.state_names, self._model.initial_decimals, strict=False)
        decimals = () if texts is None else tuple(texts.get(name, text) for name, text in named)
        return replace(
            self._model,
            parameters=parameters,
            initial=start,
            initial_decimals=decimals,
            defaults=self._defaults(member) if self._timed else self._model.defaults,
        )

    def _defaults(self, member: MemberValues) -> SimulationDefaults:
        """Evaluate the section ``simulate``, which depends on values."""
        from lagrange_cli.mechanics.initial.simulation_defaults import simulation_defaults
        from lagrange_cli.mechanics.symbols.values import ParameterValues

        scene = self._with_values(member)
        return simulation_defaults(scene, ParameterValues(scene))

    def _is_plain(self, member: MemberValues) -> bool:
        """Tell if the values of a member are numbers that nothing else depends on."""
        texts = [*member.parameters.values(), *member.initial.values()]
        return self._plain and all(DECIMAL_NUMBER.fullmatch(text) for text in texts)

    def values(
        self, member: MemberValues
    ) -> tuple[tuple[float | None, ...], tuple[float, ...]] | None:
        """Evaluate the parameters and the start of a member; None as in :meth:`model_of`.

        Raises
        ------
        InputError
            Located: a text without a value.
        """
        if self._is_plain(member):
            parameters = {name: float(text) for name, text in member.parameters.items()}
            initial = {name: float(text) for name, text in member.initial.items()}
        else:
            parameters, initial = self._evaluated(member)
        return self._with_numbers(parameters, initial)

    def plain_numbers(
        self, columns: Mapping[str, Array]
    ) -> tuple[NDArray[np.int64], Array, Array] | None:
        """Return the parameters and the starts of members whose values are plain numbers.

        Parameters
        ----------
        columns
            Name → number of each member, shape (members,).

        Returns
        -------
        Numbers of the members that :meth:`model_of` has models of, their parameters, shape
        (m, parameters), and their starts, (m, 2n); None if further values depend on these.
        """
        if not self._plain:
            return None
        count = len(next(iter(columns.values())))
        same_sign = np.ones(count, bool)
        values = np.tile([value or 0.0 for value in self._values], (count, 1))
        starts = np.tile(np.array(self._start, dtype=float), (count, 1))
        for name, numbers in columns.items():
            if name in self._parameters:
                k = self._parameters[name]
                same_sign &= np.sign(numbers) == np.sign(values[:, k])
                same_sign &= self._values[k] is not None
                values[:, k] = numbers
            else:
                starts[:, self._place[_written(name)]] = numbers
        members = np.flatnonzero(same_sign).astype(np.int64)
        return members, values[same_sign], starts[same_sign]

    def _evaluated(self, member: MemberValues) -> tuple[dict[str, float], dict[str, float]]:
        """Evaluate all values as the scene's expressions give them."""
        values, start = numeric_values(self._with_values(member))
        return (
            {name: value for name, value in values.items() if value is not None},
            {name: value for name, value in start.items() if value is not None},
        )

    def _with_values(self, member: MemberValues) -> Scene:
        """Replace values of the scene."""
        from lagrange_cli.scene.language.problems import Problems
        from lagrange_cli.scene.reading.overrides import override_initial, override_parameters

        problems = Problems()
        scene = override_parameters(self._scene, member.parameters, problems)
        scene = override_initial(scene, member.initial, problems)
        problems.raise_if_any()
        return scene

    def _with_numbers(
        self, parameters: Mapping[str, float], initial: Mapping[str, float]
    ) -> tuple[tuple[float | None, ...], tuple[float, ...]] | None:
        values, start = list(self._values), list(self._start)
        for name, value in parameters.items():
            k = self._parameters[name]
            if _sign(values[k]) != _sign(value):
                return None
            values[k] = value
        for name, value in initial.items():
            start[self._place[_written(name)]] = value
        return tuple(values), tuple(start)


def _written(name: str) -> str:
    """Write ``dot( q )`` as the names of a state have it."""
    return name.replace(" ", "")


def _sign(value: float | None) -> Sequence[bool]:
    return (value is None, value is not None and value > 0, value is not None and value < 0)


class Variants:
    """Models of one scene with other values.

    Parameters
    ----------
    recipe
        The scene with the options that all models share.
    make
        Makes the model of the scene's own values.
    """

    def __init__(self, recipe: Recipe, make: Callable[[], Model]) -> None:
        self.recipe, self._make = recipe, make
        # Names of values → makers of further models, one for each choice of signs; none if these
        # values change more than numbers.
        self._numeric: dict[frozenset[str], list[NumericMembers]] = {}

    @cached_property
    def model(self) -> Model:
        """The model of the scene's own values."""
        return self._make()

    @cached_property
    def _multiplier_model(self) -> Model:
        return self.recipe.model(MemberValues(), "multiplier")

    def model_of(self, member: MemberValues) -> Model:
        """Return the model of other values; refuse as :meth:`.recipe.Recipe.model`."""
        names = member.names
        if not names:
            return self.model
        for numeric in self._numeric.get(names, ()):
            model = numeric.model_of(member)
            if model is not None:
                return model
        model = self.recipe.model(member)
        if model.code == self.model.code:
            model = replace(model, code=self.model.code)
        is_decided = names in self._numeric and not self._numeric[names]
        if not is_decided:
            makers = self._numeric.setdefault(names, [])
            if differ_in_numbers(self.recipe, member, model):
                makers.append(NumericMembers(self.recipe, member, model))
        return model

    def with_multipliers(self, member: MemberValues) -> Model:
        """Return the model of the multiplier formulation."""
        return self.recipe.model(member, "multiplier") if member.names else self._multiplier_model

    def differ_in_numbers(self, member: MemberValues, model: Model) -> bool:
        """Answer :func:`differ_in_numbers` for a model from :meth:`model_of`."""
        makers = self._numeric[member.names]
        if not makers or any(numeric.values(member) is not None for numeric in makers):
            return bool(makers)
        # Signs for which this is not decided yet may lead to other equations.
        return differ_in_numbers(self.recipe, member, model)


def variants_of(equations: Equations, recipe: Recipe, make: Callable[[], Model]) -> Variants:
    """Return the models of equations that a recipe led to.

    Parameters
    ----------
    equations
        If ``auto`` is to choose their formulation, one that the scene names comes first.
    recipe
        Names the inputs that are driven, reductions, a section, and further outputs.
    make
        Makes their model if there are none of these.

    Raises
    ------
    InputError
        As :meth:`.recipe.Recipe.prepared`.
    """
    from lagrange_cli.simulate.model.build import model_of

    if recipe.formulation == "auto" and equations.system.simulate.formulation == "multiplier":
        chosen = replace(recipe, formulation="multiplier")
        return Variants(chosen, lambda: chosen.model(MemberValues()))
    if not (recipe.driven or recipe.reductions or recipe.section or recipe.extra):
        return Variants(recipe, make)
    prepared = recipe.prepared(equations)
    return Variants(recipe, lambda: model_of(prepared))
