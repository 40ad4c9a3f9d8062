"""Motions from one configuration with some initial velocity, their Jacobi fields and actions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lagrange_cli.errors import AccuracyError, InputError
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.simulation import RunContext, integrate
from lagrange_cli.simulate.system.functions import KeptFunctions

if TYPE_CHECKING:
    from lagrange_cli.cache import Cache
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.results.trajectory import Trajectory
    from lagrange_cli.studies.path.ends import End
    from lagrange_cli.studies.path.models import PathModels

#: Accuracy of the motion that shows whether there are motions at all.
_ROUGH = 1e-3

#: Factor by which less accuracy is asked of a motion that does not hold it, up to the last.
_LOOSER, _COARSEST = 100, 1e-5


@dataclass(frozen=True)
class Shot:
    """A motion with its Jacobi fields, promised and sampled.

    Attributes
    ----------
    t
        Sample times, shape (m,).
    q, v
        Coordinates and velocities, shape (m, n).
    fields, rates
        Jacobi fields ∂q/∂q̇(t0) and their rates, shape (m, n, n): a column for each field.
    estimated
        Largest estimated error of any of these, over its scale.
    scales
        Scales of the coordinates, then of the velocities, shape (2, n).
    steps
        Steps of the integrator.
    """

    t: Array
    q: Array
    v: Array
    fields: Array
    rates: Array
    estimated: float
    scales: Array
    steps: int


@dataclass(frozen=True)
class ActionValues:
    """Lagrangian, momenta and mass matrix at m states of n coordinates.

    Attributes
    ----------
    lagrangian
        L, shape (m,).
    momenta
        ∂L/∂q̇, shape (m, n).
    inertia
        Mass matrix ∂²L/∂q̇², shape (m, n, n).
    """

    lagrangian: Array
    momenta: Array
    inertia: Array


class Motions:
    """Motions of one system, with its functions compiled once.

    Parameters
    ----------
    models
        Models of the system.
    cache
        Keeps what is compiled; by default the user's.
    stop
        Asked often; once it is true a run ends.
    """

    def __init__(
        self,
        models: PathModels,
        cache: Cache | None = None,
        stop: Callable[[], bool] | None = None,
    ) -> None:
        self.models = models
        self.coordinates = models.motion.coordinates
        self.size = len(self.coordinates)
        functions_of = KeptFunctions(cache)
        self._motion, self._jacobi = functions_of(models.motion), functions_of(models.jacobi)
        self._contexts = [
            RunContext(functions=functions, cache=cache, stop=stop)
            for functions in (self._motion, self._jacobi)
        ]

    def require(self, first: End, last: End, accuracy: float, samples: int) -> None:
        """Refuse a first end from which nothing can be simulated.

        Raises
        ------
        InputError
            As :func:`.simulate.simulation.simulate`.
        """
        times, v = np.array([first.t, last.t]), (last.q - first.q) / (last.t - first.t)
        model = _started(self.models.motion, np.concatenate([first.q, v]), times)
        context = self._contexts[0]
        context.resolved(model, _options(times, accuracy, samples))
        integrate(model, context.resolved(model, _options(times, _ROUGH, 2)), context)

    def accelerations(self, t: Array, q: Array, v: Array) -> Array:
        """Evaluate accelerations at m states: (m,), (m, n), (m, n) to (m, n)."""
        states = np.hstack([q, v])
        rhs, n = self._motion.rhs, self.size
        return np.array([rhs(time, y)[n:] for time, y in zip(t.tolist(), states, strict=True)])

    def slopes(self, t: Array, q: Array, v: Array) -> tuple[Array, Array]:
        """Differentiate accelerations by coordinates and by velocities, shape (m, n, n) each."""
        rhs, n, zero = self._jacobi.rhs, self.size, np.zeros(self.size**2)
        unit = np.eye(n).ravel()
        slopes = np.empty((2, len(t), n, n))
        for k, time in enumerate(t.tolist()):
            for part, seeds in enumerate(((unit, zero), (zero, unit))):
                y = np.concatenate([q[k], seeds[0], v[k], seeds[1]])
                # Fields stand one after the other, and are columns here.
                slopes[part, k] = rhs(time, y)[-n * n :].reshape(n, n).T
        return slopes[0], slopes[1]

    def action_values(self, t: Array, q: Array, v: Array) -> ActionValues:
        """Evaluate the Lagrangian, momenta and mass matrix at m states."""
        n = self.size
        values = self._motion.outputs(t, np.hstack([q, v]))
        inertia = np.empty((len(t), n, n))
        rows, columns = np.tril_indices(n)
        inertia[:, rows, columns] = inertia[:, columns, rows] = values[:, 1 + n :]
        return ActionValues(values[:, 0], values[:, 1 : 1 + n], inertia)

    def shot(self, times: Array, q: Array, v: Array, accuracy: float) -> Shot | None:
        """Promise a motion and its Jacobi fields at some times; None if there is none to the end,
        or none that accurate."""
        n, none = self.size, np.zeros(self.size**2)
        start = np.concatenate([q, none, v, np.eye(n).ravel()])
        model = _started(self.models.jacobi, start, times)
        context = self._contexts[1]
        try:
            request = context.resolved(model, _options(times, accuracy, 2))
            trajectory = integrate(model, replace(request, times=times), context)
        except (AccuracyError, InputError):
            return None
        if trajectory.status != "ok":
            return None
        states = np.array([trajectory.columns[name] for name in model.state_names])
        positions, velocities = np.split(states, 2)
        scales = np.array([trajectory.scales[name] for name in model.state_names])
        return Shot(
            times,
            positions[:n].T,
            velocities[:n].T,
            _fields(positions[n:], n),
            _fields(velocities[n:], n),
            trajectory.estimated or 0.0,
            np.array([part[:n] for part in np.split(scales, 2)]),
            trajectory.steps,
        )

    def simulated(
        self, times: Array, q: Array, v: Array, accuracy: float, samples: int
    ) -> Trajectory | None:
        """Simulate the motion as ``lagrange simulate`` does, in the scene's coordinates; None as
        :meth:`shot`."""
        model = _started(self.models.motion, np.concatenate([q, v]), times)
        options = _options(times, accuracy, samples)
        try:
            trajectory = simulate_past_singularities(model, options, None, self._contexts[0])
        except InputError:
            return None
        return trajectory if trajectory.status == "ok" else None


def looser(accuracy: float) -> float | None:
    """Return the next accuracy to ask of a motion that does not hold this one, or None."""
    return _LOOSER * accuracy if accuracy < _COARSEST else None


def _started(model: Model, start: Array, times: Array) -> Model:
    """Return a model with a start that is known in doubles alone."""
    begun = replace(model.defaults, start=float(times[0]))
    return replace(model, initial=tuple(start.tolist()), initial_decimals=(), defaults=begun)


def _options(times: Array, accuracy: float, samples: int) -> SimulationOptions:
    return SimulationOptions(until=float(times[-1]), accuracy=accuracy, samples=samples)


def _fields(columns: Array, n: int) -> Array:
    """Give columns of fields, shape (n·n, m), the shape (m, n, n)."""
    return columns.reshape(n, n, -1).transpose(2, 1, 0)
