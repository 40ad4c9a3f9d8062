"""Scene → models of the members of an ensemble.

If members differ in numbers alone, a model is made once: the scene's equations are derived again
without any value, and if that changes nothing they are those of all members. Then a member is the
model with other parameters and another start. Each member is derived by itself if its values
change the equations (one chooses among the solutions of a constraint), if a start is given in
other names than the coordinates, or if a parameter has another sign.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.errors import InputError, Problem, nearest
from lagrange_cli.files.rows import DECIMAL_NUMBER
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.model import Model

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.scene.defaults import SimulationDefaults
    from lagrange_cli.scene.model import Scene
    from lagrange_cli.scene.reader import SceneText
    from lagrange_cli.simulate.ensemble.plan.enumeration import Members
    from lagrange_cli.simulate.model.reductions import Reduction
    from lagrange_cli.simulate.model.sections import WrittenCondition


@dataclass(frozen=True)
class MemberValues:
    """Values of one member: texts of expressions by name."""

    parameters: Mapping[str, str] = field(default_factory=dict)
    initial: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, values: Mapping[str, str], scene: Scene) -> MemberValues:
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


@dataclass(frozen=True)
class Recipe:
    """A scene, and what options say of all members.

    Attributes
    ----------
    text
        Text of the scene, with values that all members have.
    forces
        Constraint forces are derived.
    formulation
        Formulation of the equations; None for the scene's.
    driven
        Names of inputs whose values whoever simulates gives.
    reductions
        Numbers of motions for which the model has outputs.
    section
        Condition whose values are further outputs; None if there is none.
    extra
        Further outputs, as :data:`.further_outputs.FURTHER` names them.
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
            Located: what is wrong with it.
        """
        member = member or MemberValues()
        return self.text.read(member.parameters, member.initial)

    def model(self, member: MemberValues, formulation: Formulation | None = None) -> Model:
        """Derive the model of a member.

        Raises
        ------
        InputError
            Located: what is wrong with it.
        """
        scene = self.scene(member)
        wanted = scene.simulate.formulation_for(formulation or self.formulation)
        return self.derived(scene, wanted)

    def derived(self, scene: Scene, formulation: Formulation) -> Model:
        """Derive the model of a scene that was read; refuses as :meth:`model`."""
        from lagrange_cli.mechanics import derive
        from lagrange_cli.simulate.model.build import model_of

        return model_of(self.prepared(derive(scene, forces=self.forces, formulation=formulation)))

    def prepared(self, equations: Equations) -> Equations:
        """Return equations with what a model of this recipe has beside those of the scene.

        Raises
        ------
        InputError
            Located: a reduction or a section is of nothing that the equations have; or a driven
            input is none.
        """
        from lagrange_cli.simulate.model.further_outputs import with_further_outputs
        from lagrange_cli.simulate.model.inputs import with_driven_inputs
        from lagrange_cli.simulate.model.reductions import with_reductions
        from lagrange_cli.simulate.model.sections import with_section

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
        varied |= {p.name for p in scene.parameters if _names(p.value) & varied}
    return varied


def _names(expression: Any) -> set[str]:
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
            used = _names(parse_expression(text, mark)) - known
            if used:
                unknown = min(used)
                said = f"'{unknown}' is no parameter of the scene"
                raise InputError(Problem(said, mark, nearest(unknown, known), "unknown-name"))


def differ_in_numbers(recipe: Recipe, member: MemberValues, model: Model) -> bool:
    """Tell if members differ from the ``model`` of one of them in numbers alone."""
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
    if NumericMembers(recipe, member, model).of(member) != model:
        return False
    try:
        without = recipe.derived(_without_values(scene), "minimal")
    except InputError:
        return False
    return _equations(without) == _equations(model)


def _without_values(scene: Scene) -> Scene:
    """Remove the values of a scene, so that none can choose anything."""
    from lagrange_cli.scene.conditions import WrittenDefaults

    parameters = tuple(replace(p, value=None) for p in scene.parameters)
    return replace(scene, parameters=parameters, initial=(), near=(), simulate=WrittenDefaults())


def _equations(model: Model) -> Model:
    """Remove the numbers of a model, and labels, which say of values what units they are in."""
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
        That of all of them.
    member, model
        Values and model of one member.
    """

    def __init__(self, recipe: Recipe, member: MemberValues, model: Model) -> None:
        self._scene, self._model = recipe.scene(member), model
        assert model.initial is not None
        self._values, self._start = [p.value for p in model.parameters], model.initial
        self._parameters = {p.name: k for k, p in enumerate(model.parameters)}
        self._place = {name: k for k, name in enumerate(model.coordinates)}
        varied = varied_parameters(self._scene, member)
        resting = varied - set(member.parameters)
        used_names = set[str]().union(*(_names(value.value) for value in self._scene.initial))
        self._plain = not resting and not used_names & set(member.parameters)
        self._timed = any(_names(entry) & varied for entry in self._scene.simulate.numbers)

    def of(self, member: MemberValues) -> Model | None:
        """Make the model of a member; None if a parameter has another sign, which may matter.

        Raises
        ------
        InputError
            Located: a value that is none.
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
        decimals = () if texts is None else tuple(texts.get(name, kept) for name, kept in named)
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
        """Evaluate the parameters and the start of a member; None as in :meth:`of`.

        Raises
        ------
        InputError
            Located: a value that is none.
        """
        if self._is_plain(member):
            parameters = {name: float(text) for name, text in member.parameters.items()}
            initial = {name: float(text) for name, text in member.initial.items()}
        else:
            parameters, initial = self._evaluated(member)
        return self._with(parameters, initial)

    def of_all(self, given: Mapping[str, Array]) -> tuple[NDArray[np.int64], Array, Array] | None:
        """Find the parameters and the starts of members that are given by plain numbers.

        Parameters
        ----------
        given
            Name → number of each member, shape (members,).

        Returns
        -------
        Which members have them, as :meth:`of`; their parameters, shape (m, parameters); and their
        starts, (m, 2n). None if further values depend on these.
        """
        if not self._plain:
            return None
        count = len(next(iter(given.values())))
        own = np.ones(count, bool)
        values = np.tile([value or 0.0 for value in self._values], (count, 1))
        starts = np.tile(np.array(self._start, dtype=float), (count, 1))
        for name, numbers in given.items():
            if name in self._parameters:
                k = self._parameters[name]
                own &= np.sign(numbers) == np.sign(values[:, k])
                own &= self._values[k] is not None
                values[:, k] = numbers
            else:
                starts[:, self._number(name)] = numbers
        return np.flatnonzero(own).astype(np.int64), values[own], starts[own]

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

    def _with(
        self, parameters: Mapping[str, float], initial: Mapping[str, float]
    ) -> tuple[tuple[float | None, ...], tuple[float, ...]] | None:
        values, start = list(self._values), list(self._start)
        for name, value in parameters.items():
            k = self._parameters[name]
            if _sign(values[k]) != _sign(value):
                return None
            values[k] = value
        for name, value in initial.items():
            start[self._number(name)] = value
        return tuple(values), tuple(start)

    def _number(self, name: str) -> int:
        """Return the number of ``q`` or ``dot(q)`` in a state."""
        if name in self._place:
            return self._place[name]
        return len(self._place) + self._place[name.removeprefix("dot(").removesuffix(")")]


def _sign(value: float | None) -> Sequence[bool]:
    return (value is None, value is not None and value > 0, value is not None and value < 0)
