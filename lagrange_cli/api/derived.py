"""The values of a derivation, and the models that are made of it once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.scene.reader import SceneText
    from lagrange_cli.simulate.ensemble.plan.variants import Variants
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.model.requested_outputs import Reduction
    from lagrange_cli.simulate.model.sensitivities import SensitiveModels
    from lagrange_cli.simulate.system.functions import KeptFunctions


@dataclass(frozen=True)
class Derived:
    """Certified equations and where they came from.

    Attributes
    ----------
    equations
        The equations, with all that is known of the system.
    source
        The scene's text, with the values that were derived.
    formulation
        The formulation that was asked for; where it was the program's choice, a simulation may
        take the other one at singular configurations.
    forces
        Constraint forces were derived.
    """

    equations: Equations
    source: SceneText
    formulation: Formulation = "auto"
    forces: bool = False

    def model(self, sensitivity: Sequence[str] = (), *, extra: Sequence[str] = ()) -> Model:
        """Return the equations as code, without symbols, as simulations run them.

        Parameters
        ----------
        sensitivity
            What the motion is differentiated by, as in :meth:`simulate`.
        extra
            Further outputs, as in :meth:`simulate`.
        """
        if extra:
            from lagrange_cli.simulate.model.requested_outputs import with_further_outputs

            equations = with_further_outputs(self.equations, extra)
            return replace(self, equations=equations).model(sensitivity)
        return (
            self.sensitive_models.with_derivatives(sensitivity, {}, {})
            if sensitivity
            else self._model
        )

    @cached_property
    def _model(self) -> Model:
        from lagrange_cli.simulate.model.build import model_of

        return model_of(self.equations)

    @cached_property
    def sensitive_models(self) -> SensitiveModels:
        from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues, Recipe
        from lagrange_cli.simulate.ensemble.plan.variants import variants_of
        from lagrange_cli.simulate.model.sensitivities import SensitiveModels

        recipe = Recipe(self.source, self.forces, self.equations.system.formulation)
        variants = variants_of(self.equations, recipe, self.model)

        def model(parameters: Mapping[str, str], initial: Mapping[str, str]) -> Model:
            values = MemberValues(parameters, initial)
            made = variants.model_of(values)
            # Numbers that depend on others come as doubles from variants.
            exact = None not in (*made.exact_numbers, *made.exact_initial)
            return made if exact else recipe.model(values)

        return SensitiveModels(self.equations, model)

    @cached_property
    def right_hand_sides(self) -> KeptFunctions:
        from lagrange_cli.simulate.system.functions import KeptFunctions

        return KeptFunctions()

    @cached_property
    def variants(
        self,
    ) -> Callable[[frozenset[str], tuple[Reduction, ...], tuple[str, ...]], Variants]:
        """Driven inputs, reductions and further outputs → models with other values."""
        from lagrange_cli.simulate.ensemble.plan.recipe import Recipe
        from lagrange_cli.simulate.ensemble.plan.variants import variants_of

        recipe = partial(Recipe, self.source, self.forces, self.formulation)
        return lru_cache(
            lambda driven, reductions, extra: variants_of(
                self.equations, recipe(driven, reductions, extra=extra), self.model
            )
        )
