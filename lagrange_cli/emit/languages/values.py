"""Values of an emitted module: quantities, functions of closures and contacts, recorded inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lagrange_cli.program.lowered.functions import Function
from lagrange_cli.program.lowered.routines.impacts import reset_arrays
from lagrange_cli.state_layout import StateLayout


@dataclass(frozen=True)
class Quantity:
    """A coordinate, parameter or input.

    Attributes
    ----------
    name
        Its name in the scene.
    identifier
        Its name in the module.
    note
        Name, unit and description, as text of a comment.
    value
        Its value in the scene; None where it must be given.
    """

    name: str
    identifier: str
    note: str
    value: float | None = None


@dataclass(frozen=True)
class Projection:
    """The functions by which a state is led back to its closures.

    Attributes
    ----------
    functions
        Functions that only the routines ``lead_positions`` and ``lead_velocities`` call, each with
        its documentation.
    positions, closures
        Numbers of closures of positions, and of all closures.
    residuals
        Names of the results of ``constraints``.
    """

    functions: tuple[tuple[Function, str], ...]
    positions: int
    closures: int
    residuals: tuple[str, ...]


@dataclass(frozen=True)
class Contacts:
    """One-sided constraints, and the functions that the interface of a mode is made of.

    Attributes
    ----------
    names
        Names of the contacts, in the order of a mode.
    functions
        Functions that only routines and the interface call, each with its documentation.
    public
        Function of the interface that takes a mode → the function that it calls.
    closures
        Number of closures beside the contacts, whose multipliers come first.
    """

    names: tuple[str, ...]
    functions: tuple[tuple[Function, str], ...]
    public: Mapping[str, Function]
    closures: int

    @property
    def count(self) -> int:
        """The number of contacts."""
        return len(self.names)

    @property
    def multipliers(self) -> int:
        """The number of multipliers, those of closures among them."""
        return self.closures + self.count


@dataclass(frozen=True)
class Switches:
    """States with two values.

    Attributes
    ----------
    names
        Their names, in the order of the function ``switches``.
    places
        Their places in a state, counted from 0.
    """

    names: tuple[str, ...]
    places: tuple[int, ...]


@dataclass(frozen=True)
class Recorded:
    """A recorded input.

    Attributes
    ----------
    number
        Its number among the inputs.
    text
        Where it is recorded.
    width
        Numbers of a row: the time at which a polynomial begins, then its coefficients.
    table
        The rows.
    first, last
        Times between which it is known, to the rounding of times.
    """

    number: int
    text: str
    width: int
    table: tuple[float, ...]
    first: float
    last: float

    @property
    def rows(self) -> int:
        """The number of rows."""
        return len(self.table) // self.width


def takes_mode(function: Function) -> bool:
    """Tell whether a function reads the flags of contacts, and targets behind them."""
    return function.name == "impulse" or function.name.startswith("contact_")


@dataclass(frozen=True)
class Interface:
    """Everything that a module of one scene holds, without a language.

    Attributes
    ----------
    name
        The scene's name as an identifier that none of the others is.
    heading
        Lines of the comment at its head.
    coordinates, parameters, inputs, states
        The quantities that functions take, in their order.
    functions
        The functions, each with its documentation.
    names
        Name of an input of programs (``q0``, ``v0``, ``z0``, ``p0``, ``u0``) → its identifier.
    projection
        The closures that a state is led back to, contacts among them; None without any.
    contacts
        The one-sided constraints; None without any.
    recorded
        The inputs that are recorded in files.
    switches
        The states with two values; none, mostly.
    initial
        Initial state; None where the scene has none.
    start, until
        Times at which the script's run begins and ends.
    rows, steps
        Intervals of the table that the script prints, and integration steps in each.
    """

    name: str
    heading: tuple[str, ...]
    coordinates: tuple[Quantity, ...]
    parameters: tuple[Quantity, ...]
    inputs: tuple[Quantity, ...]
    functions: tuple[tuple[Function, str], ...]
    names: Mapping[str, str]
    projection: Projection | None
    contacts: Contacts | None
    recorded: tuple[Recorded, ...]
    initial: tuple[float, ...] | None
    start: float
    until: float
    rows: int
    steps: int
    states: tuple[Quantity, ...] = ()
    switches: Switches = Switches((), ())

    @property
    def state(self) -> tuple[str, ...]:
        """Names of the numbers of the state, as the script's table has them."""
        return self.layout.names([c.name for c in self.coordinates], [s.name for s in self.states])

    @property
    def inner(self) -> tuple[tuple[Function, str], ...]:
        """Functions that only routines and functions around them call, with documentation."""
        projection = () if self.projection is None else self.projection.functions
        return (*projection, *(() if self.contacts is None else self.contacts.functions))

    @property
    def reset_arrays(self) -> dict[str, int]:
        """Array that the routine ``reset_contacts`` overwrites → how many numbers it holds."""
        if self.contacts is None:
            return {}
        sizes = (self.contacts.count, self.contacts.multipliers)
        return reset_arrays(len(self.coordinates), self.layout.size, *sizes)

    @property
    def event_kinds(self) -> list[str]:
        """The kinds of events at which a run stops."""
        switches = ["switches"] if self.switches.names else []
        return [*(["contacts"] if self.contacts is not None else []), *switches]

    @property
    def events(self) -> int:
        """The number of contacts and of states with two values, at whose events a run stops."""
        contacts = 0 if self.contacts is None else self.contacts.count
        return contacts + len(self.switches.names)

    @property
    def closed(self) -> bool:
        """Tell whether there are closures, to which the start is led."""
        if self.contacts is not None:
            return self.contacts.closures > 0
        return self.projection is not None

    def takes_inputs(self, function: Function) -> bool:
        """Tell whether a function is handed the inputs: ``inputs`` reads those of recordings."""
        return bool(function.driven and (function.name != "inputs" or self.recorded))

    @property
    def layout(self) -> StateLayout:
        """Layout of the state vector."""
        return StateLayout(len(self.coordinates), len(self.states))
