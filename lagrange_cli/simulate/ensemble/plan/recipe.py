"""Scene and options → the model of a member of an ensemble, derived with the member's values."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from lagrange_cli.errors import InputError, Problem, nearest
from lagrange_cli.files.rows import DECIMAL_NUMBER
from lagrange_cli.simulate.model.model import Model

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.scene.model import Scene
    from lagrange_cli.scene.reader import SceneText
    from lagrange_cli.simulate.ensemble.plan.enumeration import Members
    from lagrange_cli.simulate.model.requested_outputs import Reduction, WrittenCondition


@dataclass(frozen=True)
class MemberValues:
    """Values of one member: texts of expressions by name."""

    parameters: Mapping[str, str] = field(default_factory=dict)
    initial: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def for_scene(cls, values: Mapping[str, str], scene: Scene) -> MemberValues:
        """Divide values between parameters of a scene (and sizes) and initial values."""
        return cls.divided(
            values, {p.name for p in scene.parameters} | {size.name for size in scene.sizes}
        )

    @classmethod
    def divided(cls, values: Mapping[str, str], parameters: Collection[str]) -> MemberValues:
        """Divide values by the names of parameters and sizes."""
        return cls(
            {name: text for name, text in values.items() if name in parameters},
            {name: text for name, text in values.items() if name not in parameters},
        )

    @property
    def names(self) -> frozenset[str]:
        """Names of all values."""
        return frozenset({*self.parameters, *self.initial})


@dataclass(frozen=True)
class Recipe:
    """A scene with the options that all members share.

    Attributes
    ----------
    text
        Text of the scene, with values that all members have.
    forces
        Constraint forces are derived.
    formulation
        Formulation of the equations; None for the scene's.
    driven
        Names of inputs whose values the caller of a simulation gives.
    reductions
        Numbers of motions for which the model has outputs.
    section
        Condition whose values are further outputs; None if there is none.
    extra
        Further outputs, as :data:`.requested_outputs.FURTHER` names them.
    """

    text: SceneText
    forces: bool = False
    formulation: Formulation | None = None
    driven: frozenset[str] = frozenset()
    reductions: tuple[Reduction, ...] = ()
    section: WrittenCondition | None = None
    extra: tuple[str, ...] = ()

    def scene(self, member: MemberValues | None = None) -> Scene:
        """Read the scene with the values of a member.

        Raises
        ------
        InputError
            Located: the scene with these values is refused.
        """
        member = member or MemberValues()
        return self.text.read(member.parameters, member.initial)

    def model(self, member: MemberValues, formulation: Formulation | None = None) -> Model:
        """Derive the model of a member.

        Raises
        ------
        InputError
            Located: the scene with these values is refused.
        """
        scene = self.scene(member)
        wanted = scene.simulate.formulation_for(formulation or self.formulation)
        return self.derived(scene, wanted)

    def derived(self, scene: Scene, formulation: Formulation) -> Model:
        """Derive the model of a scene that was read; refuse as :meth:`model`."""
        from lagrange_cli.mechanics import derive
        from lagrange_cli.simulate.model.build import model_of

        return model_of(self.prepared(derive(scene, forces=self.forces, formulation=formulation)))

    def prepared(self, equations: Equations) -> Equations:
        """Return equations with the driven inputs and the further outputs of this recipe.

        Raises
        ------
        InputError
            Located: a reduction or a section names no value of the equations, or a driven input is
            no input of the scene.
        """
        from lagrange_cli.simulate.model.inputs import with_driven_inputs
        from lagrange_cli.simulate.model.requested_outputs import (
            with_further_outputs,
            with_reductions,
            with_section,
        )

        equations = with_reductions(equations, self.reductions)
        if self.section is not None:
            equations = with_section(equations, self.section)
        return with_further_outputs(with_driven_inputs(equations, self.driven), self.extra)


def numeric_values(scene: Scene) -> tuple[dict[str, float | None], dict[str, float | None]]:
    """Evaluate parameters that have a value, and initial values by ``x`` or ``dot(x)``."""
    from lagrange_cli.mechanics.symbols.values import ParameterValues

    values = ParameterValues(scene)
    parameters = {p.name: values.float(p.value) for p in scene.parameters if p.value is not None}
    start = {
        f"dot({entry.name})" if entry.order else entry.name: values.float(entry.value)
        for entry in scene.initial
    }
    return parameters, start


def varied_parameters(scene: Scene, member: MemberValues) -> set[str]:
    """Find parameters that differ between members: varied ones, and those that depend on them."""
    varied, before = set(member.parameters), set[str]()
    while varied != before:
        before = set(varied)
        varied |= {p.name for p in scene.parameters if used_names(p.value) & varied}
    return varied


def used_names(expression: Any) -> set[str]:
    """Return the names in an expression, which may be None."""
    from lagrange_cli.scene.language.expression import names_in

    return set() if expression is None else {name.name for name in names_in(expression.node)}


def require_known_names(members: Members, scene: Scene) -> None:
    """Refuse sizes, which change the equations, and names in values that are no parameters.

    Raises
    ------
    InputError
        At the first of them.
    """
    from lagrange_cli.scene import parse_expression

    sizes = {size.name for size in scene.sizes}
    for name, head in zip(members.names, members.heads, strict=True):
        if name in sizes:
            said = f"the size '{name}' cannot differ between members: it changes the equations"
            raise InputError(Problem(said, head, f"-p {name}=...", "ensemble"))
    known = {"pi"} | {p.name for p in scene.parameters} | sizes
    for text, mark in members.cells():
        if not DECIMAL_NUMBER.fullmatch(text):
            used = used_names(parse_expression(text, mark)) - known
            if used:
                unknown = min(used)
                said = f"'{unknown}' is no parameter of the scene"
                raise InputError(Problem(said, mark, nearest(unknown, known), "unknown-name"))
