"""Systems with one-sided constraints: a right-hand side for each set of closed contacts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.events import TerminalEvents
from lagrange_cli.simulate.integrators.hybrid.contact_system import ContactMode, Gaps, HybridRhs
from lagrange_cli.simulate.integrators.right_hand_side import Rhs, Surfaces, structured
from lagrange_cli.simulate.system.code import ModelCode
from lagrange_cli.simulate.system.tables import StateFunction, Table


class ContactRhs(HybridRhs):
    """The right-hand side of a system with contacts.

    Parameters
    ----------
    flight
        The one with no contact closed.
    name
        Name, in ``code``, of the function that is it with contacts closed.
    parameters
        All that it reads; the flags of ``contacts`` contacts begin at ``first``.
    surfaces
        Makes the switching surfaces for parameters; None if there are none.
    """

    def __init__(
        self,
        flight: Rhs,
        code: ModelCode,
        name: str,
        parameters: Array,
        first: int,
        contacts: int,
        surfaces: Callable[[Array], Surfaces] | None = None,
    ) -> None:
        self.free, self._n = (False,) * contacts, code.coordinates
        self._flight, self._code, self._name = flight, code, name
        self._parameters, self._flags = parameters, slice(first, first + contacts)
        self._sides: dict[ContactMode, Rhs] = {self.free: flight}
        self._gaps = code.row("gaps", 2 * contacts, parameters)
        self._terms: StateFunction | None = None
        self._known: tuple[float, bytes, Gaps] | None = None
        self._surfaces = surfaces

    def __call__(self, t: float, y: Array) -> Array:
        return self._flight(t, y)

    def project(self, t: float, y: Array) -> Array:
        project = structured(self._flight).project
        return np.array(y) if project is None else project(t, y)

    def side(self, closed: ContactMode) -> Rhs:
        if closed not in self._sides:
            side = self._code.contact_side(self._name, self._with(closed))
            if self._surfaces is not None:
                side = side.with_surfaces(self._surfaces(self._with(closed)))
            self._sides[closed] = side
        return self._sides[closed]

    def _with(self, closed: ContactMode) -> Array:
        parameters = np.array(self._parameters)
        parameters[self._flags] = closed
        return parameters

    def terminal_events(
        self,
        closed: ContactMode,
        signs: tuple[float, ...],
        noise: tuple[float, ...],
        reach: tuple[float, ...] = (),
    ) -> TerminalEvents:
        parameters = self._with(closed)
        values = self._code.row("events", len(closed), parameters)
        native = self._code.events("events", parameters)
        return TerminalEvents(values, signs, noise, native, reach)

    def gaps(self, t: float, y: Array) -> Gaps:
        count, n, place = len(self.free), self._n, np.asarray(y, dtype=float).tobytes()
        # An event asks for them several times.
        if self._known is not None and self._known[:2] == (t, place):
            return self._known[2]
        if self._terms is None:
            self._terms = self._code.row("gap_terms", count * (n + 3), self._parameters)
        values, sizes = self._gaps(t, y).reshape(2, count)
        terms = self._terms(t, y)
        gradients, (rates, biases, _) = terms[: count * n], terms[count * n :].reshape(3, count)
        gaps = Gaps(values, sizes, gradients.reshape(count, n), rates, biases)
        self._known = t, place, gaps
        return gaps

    def table(self, name: str, columns: int, closed: ContactMode) -> Table:
        """Return another function of the system with contacts, at many states."""
        return self._code.table(name, columns, self._with(closed))

    def reset(
        self, t: float, y: Array, closed: ContactMode, event: int, bounce: float
    ) -> tuple[Array | None, ContactMode]:
        state, flags = self._code.reset(t, y, self._with(closed), event, bounce)
        if state is not None and not np.isfinite(state).all():
            return None, self.free
        return state, tuple((flags != 0).tolist())
