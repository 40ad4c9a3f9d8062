"""Models of one scene with other values: what one of them needed serves those that follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

from lagrange_cli.simulate.ensemble.plan.recipe import (
    MemberValues,
    NumericMembers,
    Recipe,
    differ_in_numbers,
)
from lagrange_cli.simulate.model.model import Model

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations


class Variants:
    """Models of one scene with other values.

    Parameters
    ----------
    recipe
        The scene, and what options say of all models.
    make
        Makes the model of the scene's own values.
    """

    def __init__(self, recipe: Recipe, make: Callable[[], Model]) -> None:
        self.recipe, self._make = recipe, make
        # By the names of values: what makes further models, None if values are more than numbers.
        self._numeric: dict[frozenset[str], NumericMembers | None] = {}

    @cached_property
    def model(self) -> Model:
        """The model of the scene's own values."""
        return self._make()

    @cached_property
    def _multiplier_model(self) -> Model:
        return self.recipe.model(MemberValues(), "multiplier")

    def of(self, member: MemberValues) -> Model:
        """Return the model of other values; refuses as :meth:`.members.Recipe.model`."""
        names = _names(member)
        if not names:
            return self.model
        if names in self._numeric:
            numeric = self._numeric[names]
            model = None if numeric is None else numeric.of(member)
            return self.recipe.model(member) if model is None else model
        model = self.recipe.model(member)
        if model.code == self.model.code:
            model = replace(model, code=self.model.code)
        alone = differ_in_numbers(self.recipe, member, model)
        self._numeric[names] = NumericMembers(self.recipe, member, model) if alone else None
        return model

    def with_multipliers(self, member: MemberValues) -> Model:
        """Return the model of the multiplier formulation."""
        return self.recipe.model(member, "multiplier") if _names(member) else self._multiplier_model

    def differ_in_numbers(self, member: MemberValues, model: Model) -> bool:
        """Answer :func:`.members.differ_in_numbers` for the model that :meth:`of` returned."""
        numeric = self._numeric[_names(member)]
        if numeric is None or numeric.values(member) is not None:
            return numeric is not None
        # Other signs than those that were asked about may lead to other equations.
        return differ_in_numbers(self.recipe, member, model)


def _names(member: MemberValues) -> frozenset[str]:
    return frozenset({*member.parameters, *member.initial})


def variants_of(equations: Equations, recipe: Recipe, make: Callable[[], Model]) -> Variants:
    """Return the models of equations that a recipe led to.

    Parameters
    ----------
    equations
        If the choice of their formulation was the program's, the scene's comes first.
    recipe
        With the inputs that are driven, numbers of motions, a section, and further outputs.
    make
        Makes their model if there are none of these.

    Raises
    ------
    InputError
        As :meth:`.members.Recipe.prepared`.
    """
    from lagrange_cli.simulate.model.build import model_of

    if recipe.formulation == "auto" and equations.simulate.formulation == "multiplier":
        chosen = replace(recipe, formulation="multiplier")
        return Variants(chosen, lambda: chosen.model(MemberValues()))
    if not (recipe.driven or recipe.reductions or recipe.section or recipe.extra):
        return Variants(recipe, make)
    prepared = recipe.prepared(equations)
    return Variants(recipe, lambda: model_of(prepared))
