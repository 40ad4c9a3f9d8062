"""Model: the numbers, names and code of equations that a simulation needs, without symbols.

A model is made once from Equations (:mod:`.build`) and kept as JSON, so
that the same scene is simulated again without deriving it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from fractions import Fraction
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, Literal

from lagrange_cli.errors import Mark
from lagrange_cli.program.lowered.stored import StoredFunctions
from lagrange_cli.scene.bodies import ThreeAngles
from lagrange_cli.scene.conditions import SimulationDefaults
from lagrange_cli.simulate.model.labels import Labels
from lagrange_cli.state_layout import StateLayout

if TYPE_CHECKING:
    from lagrange_cli.files import Recording


#: Borders of the states at which equations hold: what is declared positive, tables, slips.
Border = Literal["positive", "table", "slip"]


@dataclass(frozen=True)
class ModelParameter:
    """A parameter of a model.

    Attributes
    ----------
    name
        Its name in the scene.
    value
        Its value; None if an option must give it.
    used
        The motion depends on it.
    decimal
        Its value with 40 digits, of use if ``value`` is the double nearest to it; may be empty.
    """

    name: str
    value: float | None
    used: bool
    decimal: str = field(default="", compare=False)


@dataclass(frozen=True)
class Code:
    """The same functions as lowered programs and in C, over dummy names.

    Attributes
    ----------
    c
        Text of :func:`lagrange_cli.simulate.native.sources.library_source`.
    lanes
        Text of its neighbour ``lanes_source``, which follows ``c``.
    functions
        The functions, to be interpreted. Those that have results in some systems alone are
        ``forces``, which are constraint forces and read accelerations and multipliers after the
        factors; ``singular``, which vanish at singular configurations; ``positive``, which are
        positive where the equations hold, if the scene says so; and ``steep``, the numbers of
        :func:`.sharp_functions.steep_program`.
    work
        Doubles of workspace that the functions take.
    factors
        Number of rounding factors, which the function ``disturbed`` reads after the scene's
        parameters.
    taylor
        Text of ``taylor_source``, which stands alone and may be empty.
    tables
        Text that follows ``taylor``.
    """

    c: str
    lanes: str
    functions: StoredFunctions
    work: int
    factors: int
    taylor: str = ""
    tables: str = ""


@dataclass(frozen=True)
class ChartSingularity:
    """A singular configuration of the coordinates.

    Attributes
    ----------
    where
        Equation in words of the scene that holds there.
    lost
        Coordinates that are not determined there.
    ends
        Coordinates end there; if false, the rates of ``lost`` move nothing.
    is_of_turns
        True if they are angles of three turns of one body, which a quaternion can replace.
    """

    where: str
    lost: tuple[str, ...]
    ends: bool
    is_of_turns: bool = False


@dataclass(frozen=True)
class FormerChart:
    """Coordinates that those of a model have replaced.

    Attributes
    ----------
    coordinates, kinds
        Their names and kinds, as in :class:`Model`.
    start
        [q, v] of them at the start; None if it is not known.
    functions
        ``positions`` and ``velocities``, which give the coordinates of the model, in their order,
        and their rates, for a state of these.
    steady
        Coordinates whose rates are proven to keep their signs, or to stay zero.
    positive
        Coordinates that the scene declares positive.
    turns
        Turns whose angles these coordinates are; without any, ``functions`` give the coordinates
        of the model.
    """

    coordinates: tuple[str, ...]
    kinds: tuple[str, ...]
    start: tuple[float, ...] | None
    functions: StoredFunctions
    steady: tuple[str, ...] = ()
    positive: tuple[str, ...] = ()
    turns: tuple[ThreeAngles, ...] = ()


@dataclass(frozen=True)
class ModelQuantity:
    """A conserved quantity among the outputs of a model.

    Attributes
    ----------
    name
        The output.
    terms
        Number of terms with whose sizes its changes are compared.
    """

    name: str
    terms: int


@dataclass(frozen=True)
class ModelController:
    """A sampled controller of a model.

    Attributes
    ----------
    every
        Time between samples: a number with 40 digits or a fraction, or the name of a parameter.
    places
        The numbers of y that it sets.
    """

    every: str
    places: tuple[int, ...]


@dataclass(frozen=True)
class Model:
    """A system of second order in time, M(q, t) a = f(q, v, t), ready to be integrated.

    Attributes
    ----------
    name
        The scene's.
    states
        States of first order, behind the velocities in y.
    controllers
        What sets some of these at samples; the code's function ``sampled`` gives their next values.
    coordinates, kinds
        One entry a coordinate; its kind is ``angle``, or a word that coordinates of the same
        dimension share.
    cartesian
        Cartesian names of the scene.
    parameters
        Parameters of the scene, with their values.
    initial
        [q, v] at the start, None if the scene gives none; ``suggested`` then has values.
    initial_decimals
        The same with 40 digits, as ``decimal`` of parameters; may be empty.
    defaults
        Section ``simulate`` of the scene.
    conserved
        Kinds of conserved quantities.
    facts
        Structure facts by name.
    formulation
        Formulation of the equations, in a word.
    code
        Functions of the system.
    multipliers, symbols
        Constraints that are kept beside the coordinates, if any, for which the code has
        ``multipliers``, ``constraints`` and ``project``; symbols of their multipliers and of
        those of ``contacts``, as ``lambda_rod``.
    residuals
        Numbers that the code's function ``constraints`` gives.
    outputs
        Names of what the scene asks for besides; the code's function ``outputs`` gives them.
    quantities
        Conserved quantities among these, beside the energy; their terms follow the outputs, as
        further ones without a name. None unless they were asked for.
    suggested
        Coordinates with values that could be given as the start.
    forces
        Constraint forces, which the code has where they were asked for.
    recordings
        Inputs whose values are read from files at each run; the code takes the numbers of their
        present pieces (:mod:`.system.inputs`) as ``u``.
    driven
        Inputs whose values whoever simulates gives; in ``u`` they follow those of recordings.
    contacts
        One-sided constraints, for which the code has the functions of
        :mod:`lagrange_cli.program.systems.contact_systems`.
    singular
        Places that the coordinates do not cover, at which numbers of ``singular`` vanish.
    positive, table_ends, slips
        Names that the scene declares positive, whose values ``positive`` gives; ends of tables,
        as ``T(600)``, with numbers behind these that are positive within; and norms of velocities
        by which forces are divided, with numbers that are positive until they vanish.
    chart
        Coordinates that these have replaced; None if there are none.
    massless
        Coordinates whose inertia vanishes everywhere with the parameters that are 0.
    steep
        Equations of the places of unbounded slopes, of which ``steep`` gives numbers.
    surfaces
        For each switching surface of ``abs``, ``sign``, ``min`` and ``max``, True if it hangs
        on positions and time alone (:mod:`lagrange_cli.simulate.model.switching_surfaces`).
    switches
        Numbers of the states with two values, in the order of the last surfaces, at which they
        change.
    surface_names
        The expressions that vanish on these surfaces.
    continuous
        Number of quantities that jump at surfaces only if an impulse acts.
    landmarks
        Number of exponents of sharp functions
        (:mod:`lagrange_cli.simulate.model.sharp_functions`).
    labels
        Names and units of columns in pictures.
    """

    name: str
    coordinates: tuple[str, ...]
    kinds: tuple[str, ...]
    cartesian: tuple[str, ...]
    parameters: tuple[ModelParameter, ...]
    initial: tuple[float, ...] | None
    defaults: SimulationDefaults
    conserved: tuple[str, ...]
    facts: Mapping[str, bool]
    formulation: str
    code: Code
    multipliers: tuple[str, ...] = ()
    symbols: tuple[str, ...] = ()
    residuals: int = 0
    outputs: tuple[str, ...] = ()
    quantities: tuple[ModelQuantity, ...] | None = None
    suggested: tuple[tuple[str, str], ...] = ()
    forces: tuple[str, ...] = ()
    recordings: tuple[Recording, ...] = ()
    driven: tuple[str, ...] = ()
    contacts: tuple[str, ...] = ()
    singular: tuple[ChartSingularity, ...] = ()
    positive: tuple[str, ...] = ()
    table_ends: tuple[str, ...] = ()
    slips: tuple[str, ...] = ()
    chart: FormerChart | None = None
    massless: tuple[str, ...] = ()
    steep: tuple[str, ...] = ()
    surfaces: tuple[bool, ...] = ()
    switches: tuple[int, ...] = ()
    surface_names: tuple[str, ...] = ()
    continuous: int = 0
    landmarks: int = 0
    labels: Labels = field(default_factory=Labels)
    initial_decimals: tuple[str, ...] = field(default=(), compare=False)
    states: tuple[str, ...] = ()
    controllers: tuple[ModelController, ...] = ()

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the numbers of a state: coordinates, then their ``dot``."""
        return self.layout.names(self.coordinates, self.states)

    @property
    def borders(self) -> tuple[str, ...]:
        """Borders of the states at which the equations hold: positive, ends of tables, slips."""
        return (*self.positive, *self.table_ends, *self.slips)

    def border_kind(self, name: str) -> Border:
        """Return what a border is of."""
        return "slip" if name in self.slips else "table" if name in self.table_ends else "positive"

    @property
    def layout(self) -> StateLayout:
        """Layout of the state vector."""
        return StateLayout(len(self.coordinates), len(self.states))

    @property
    def output_count(self) -> int:
        """Number of values that the code's function ``outputs`` gives."""
        return len(self.outputs) + sum(quantity.terms for quantity in self.quantities or ())

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of a trajectory, each once."""
        rates = (f"dot({name})" for name in self.cartesian)
        former = () if self.chart is None else self.chart.coordinates
        of_former = (f"dot({name})" for name in former)
        names = (*self.state_names, *self.cartesian, *rates, *former, *of_former, *self.outputs)
        return tuple(dict.fromkeys(names))

    @property
    def numbers(self) -> list[float]:
        """Values of the parameters; 0 for those that none is known of."""
        return [0.0 if p.value is None else p.value for p in self.parameters]

    @property
    def exact_numbers(self) -> list[Fraction | None]:
        """Values of the parameters with 40 digits; None if only the double is known."""
        pairs = zip(self.numbers, self.parameters, strict=True)
        return [_exact(value, parameter.decimal) for value, parameter in pairs]

    @property
    def exact_initial(self) -> list[Fraction | None]:
        """The start with 40 digits, None for numbers of which only the double is known."""
        start = self.initial or ()
        pairs = zip_longest(start, self.initial_decimals[: len(start)], fillvalue="")
        return [_exact(float(value), str(decimal)) for value, decimal in pairs]

    @property
    def periods(self) -> tuple[Fraction, ...]:
        """Times between the samples of controllers, as exact as they are known."""
        pairs = zip(self.parameters, self.numbers, self.exact_numbers, strict=True)
        known = {p.name: Fraction(value) if x is None else x for p, value, x in pairs}
        return tuple(known.get(c.every) or Fraction(c.every) for c in self.controllers)

    def to_json(self) -> dict[str, Any]:
        """Return the model as values that JSON holds; doubles keep all their digits."""
        return asdict(self)

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Model:
        """Make the model that :meth:`to_json` gave."""
        fields = dict(value)
        lists: tuple[str, ...] = ("coordinates", "kinds", "cartesian", "conserved")
        lists += ("multipliers", "symbols", "outputs", "forces", "contacts", "massless", "surfaces")
        lists += (
            "steep",
            "initial_decimals",
            "driven",
            "positive",
            "table_ends",
            "slips",
            "states",
        )
        lists += ("surface_names", "switches")
        for name in lists:
            fields[name] = tuple(fields[name])
        fields["parameters"] = tuple(ModelParameter(**p) for p in fields["parameters"])
        fields["suggested"] = tuple((name, value) for name, value in fields["suggested"])
        fields["initial"] = None if fields["initial"] is None else tuple(fields["initial"])
        fields["recordings"] = tuple(_recording(**r) for r in fields["recordings"])
        if fields["quantities"] is not None:
            fields["quantities"] = tuple(ModelQuantity(**q) for q in fields["quantities"])
        fields["defaults"] = _defaults(**fields["defaults"])
        functions = StoredFunctions(**fields["code"]["functions"])
        fields["code"] = Code(**{**fields["code"], "functions": functions})
        controllers = (
            ModelController(c["every"], tuple(c["places"])) for c in fields["controllers"]
        )
        fields["controllers"] = tuple(controllers)
        fields["labels"] = Labels(**fields["labels"])
        fields["singular"] = tuple(_place(**place) for place in fields["singular"])
        fields["chart"] = None if fields["chart"] is None else _chart(**fields["chart"])
        return cls(**fields)


def _exact(value: float, decimal: str) -> Fraction | None:
    """Return what a decimal says, if it is what a double has rounded."""
    if value == 0:
        return Fraction(0)  # also of 1e-999999999, which is none to write as a fraction
    return Fraction(decimal) if decimal and float(decimal) == value else None


def _defaults(mark: dict[str, Any] | None, **fields: Any) -> SimulationDefaults:
    return SimulationDefaults(mark=None if mark is None else Mark(**mark), **fields)


def _place(where: str, lost: list[str], ends: bool, is_of_turns: bool) -> ChartSingularity:
    return ChartSingularity(where, tuple(lost), ends, is_of_turns)


def _chart(
    coordinates: list[str],
    kinds: list[str],
    start: list[float] | None,
    functions: dict[str, str],
    steady: list[str],
    positive: list[str],
    turns: list[dict[str, Any]],
) -> FormerChart:
    begun = None if start is None else tuple(start)
    names = tuple(coordinates), tuple(kinds)
    stored = StoredFunctions(**functions)
    by_quaternions = (
        ThreeAngles(turn["axes"], tuple(turn["angles"]), tuple(turn["parts"])) for turn in turns
    )
    borders = tuple(steady), tuple(positive)
    return FormerChart(*names, begun, stored, *borders, tuple(by_quaternions))


def _recording(mark: dict[str, Any], column_mark: dict[str, Any], **fields: Any) -> Recording:
    from lagrange_cli.files import Recording

    return Recording(mark=Mark(**mark), column_mark=Mark(**column_mark), **fields)
