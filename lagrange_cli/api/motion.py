"""Motions of the equations: one, many, and the model that both run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from os import PathLike, fspath
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.api.derived import Derived
from lagrange_cli.api.values import DrivenInputs, GivenValues, text_of, texts
from lagrange_cli.errors import InputError, Problem

if TYPE_CHECKING:
    from distributed import Client

    from lagrange_cli.cache import Cache
    from lagrange_cli.simulate import Trajectory
    from lagrange_cli.simulate.checkpoint.checkpoint import Checkpoint
    from lagrange_cli.simulate.cluster.tasks import Cluster
    from lagrange_cli.simulate.ensemble.plan.enumeration import Members
    from lagrange_cli.simulate.ensemble.plan.plan import MotionFunction
    from lagrange_cli.simulate.ensemble.run.cluster import ClusterEngine
    from lagrange_cli.simulate.ensemble.store.result import Ensemble
    from lagrange_cli.simulate.results.streaming import Stream
    from lagrange_cli.simulate.system.functions import RightHandSide

#: Members of an ensemble: all combinations of values, values one by one, or a lazy enumeration.
GivenMembers: TypeAlias = "Mapping[str, Iterable[float | str]] | Sequence[GivenValues] | Members"


def methods() -> tuple[str, ...]:
    """Return the names of the integration methods, beside ``auto``."""
    from lagrange_cli.simulate.integrators import INTEGRATORS

    return tuple(INTEGRATORS)


@contextmanager
def cluster_at(address: str, tell: Callable[[str], None]) -> Iterator[Cluster]:
    """Connect to a Dask cluster by the address of its scheduler, for a while.

    ``tell`` is called with remarks on it.

    Raises
    ------
    ClusterError
        There is none at this address, or Dask is not installed.
    """
    from lagrange_cli.simulate.cluster.tasks import Cluster, connected

    with connected(address) as client:
        yield Cluster(client, tell)


def _sensitive_inputs() -> InputError:
    message = "the motion's derivatives are not found with inputs that are Python functions"
    hint = "write the input in the scene, as an expression or a file"
    return InputError(Problem(message, hint=hint, rule="sensitivity"))


def _engine(client: Client) -> ClusterEngine:
    """Return what runs members on a user's cluster; remarks on it become warnings."""
    import warnings

    from lagrange_cli.simulate.cluster.tasks import Cluster
    from lagrange_cli.simulate.ensemble.run.cluster import ClusterEngine

    return ClusterEngine(Cluster(client, lambda text: warnings.warn(text, stacklevel=2)))


def sampled(distributions: Mapping[str, str], members: int, *, seed: int = 0) -> Members:
    """Return members of an ensemble whose values are drawn at random.

    Parameters
    ----------
    distributions
        Name of a parameter or initial value → ``uniform(a, b)``, ``loguniform(a, b)`` or
        ``normal(mean, deviation)``.
    members
        How many there are. None of them is made before it is simulated.
    seed
        The same members are drawn by the same number.

    Raises
    ------
    InputError
        There is no such distribution, or there are too many members.

    Examples
    --------
    >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
    >>> drawn = sampled({"theta": "uniform(-1, 1)"}, 100, seed=7)
    >>> derivation.ensemble(drawn, until=1.0, columns=[], final=True)
    <Ensemble of pendulum: 100 members, 401 samples; 100 ok>
    """
    from lagrange_cli.simulate.ensemble.plan.sampling import sampled as drawn

    return drawn([f"{name} ~ {text}" for name, text in distributions.items()], members, seed)


def members_given(values: GivenMembers) -> Members:
    """Return the members that a caller gives, as :meth:`Moving.ensemble` takes them.

    Raises
    ------
    InputError
        Values are missing, or there are too many members.
    """
    from lagrange_cli.simulate.ensemble.plan.enumeration import Members
    from lagrange_cli.simulate.ensemble.plan.sources import members_of

    if isinstance(values, Members):
        return values
    if isinstance(values, Mapping):
        return members_of({name: list(map(text_of, axis)) for name, axis in values.items()})
    return members_of([texts(member) for member in values])


def _sensitive_columns() -> InputError:
    message = "momenta and conserved quantities have no derivatives by starts and parameters here"
    return InputError(Problem(message, hint="leave out 'extra'", rule="sensitivity"))


def simulate(
    derived: Derived,
    *,
    parameters: GivenValues | None = None,
    initial: GivenValues | None = None,
    inputs: DrivenInputs | None = None,
    sensitivity: Sequence[str] = (),
    extra: Sequence[str] = (),
    until: float | None = None,
    accuracy: float | None = None,
    method: str | None = None,
    rtol: float | None = None,
    atol: float | None = None,
    step: float | None = None,
    samples: int | None = None,
    budget: float | None = None,
    times: Sequence[float] | None = None,
    progress: Callable[[float], None] | None = None,
    reached: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
    functions: RightHandSide | None = None,
    cache: Cache | None = None,
    stream: Stream | None = None,
    checkpoint: Checkpoint | None = None,
) -> Trajectory:
    """Integrate the equations of motion; what was built and compiled serves further calls.

    Parameters
    ----------
    parameters, initial
        Values that replace those of the scene, as for :func:`load`. If they may change the
        equations, these are derived and certified again.
    inputs
        Functions of time that replace the scene's inputs of these names, as ``{"F": f}``;
        ``f(t)`` is a finite number. They are to be smooth: they are called wherever a method
        evaluates forces, and what they do between is not known. Python then evaluates the
        equations too, some 100 times slower than compiled code.
    sensitivity
        Names of coordinates, of their ``dot`` and of parameters: the derivatives of the
        motion by these starts and parameters are columns ``d(theta)/d(m)`` and
        ``dot(d(theta)/d(m))`` beside it, and are promised as it is. The scene's coordinates
        are kept.
    extra
        Further columns: ``momenta``, ∂L/∂q̇ of each coordinate; ``conserved``, whatever
        :meth:`analyze` finds conserved, with ``conserved_drift`` of each. The scene's
        coordinates are kept.
    until, accuracy, method, rtol, atol, step, samples, budget, times
        See :class:`.simulate.request.SimulationOptions`; by default the scene's.
    progress, reached, stop, functions, cache, stream, checkpoint
        See :class:`.simulate.simulation.RunContext`.

    Raises
    ------
    InputError
        As :func:`.simulate.simulation.simulate`.

    Examples
    --------
    >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
    >>> trajectory = derivation.simulate(until=1.0, accuracy=1e-9)
    >>> trajectory.status, round(trajectory.state["theta"], 6)
    ('ok', -1.491035)
    >>> derivation.simulate(until=1.0, initial={"theta": 0.1}).status
    'ok'
    >>> swung = derivation.simulate(until=1.0, sensitivity=["l"])
    >>> round(swung.state["d(theta)/d(l)"], 6)
    1.559491
    >>> derivation.simulate(until=1.0, extra=["conserved"]).conserved_drift.keys()
    dict_keys(['energy'])
    """
    from lagrange_cli.simulate.charts.simulation import (
        simulate_past_singularities,
        simulate_with_sensitivities,
    )
    from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues
    from lagrange_cli.simulate.options import SimulationOptions
    from lagrange_cli.simulate.simulation import RunContext
    from lagrange_cli.simulate.system.functions import KeptFunctions

    options = SimulationOptions(
        until=until,
        accuracy=accuracy,
        method=method,
        rtol=rtol,
        atol=atol,
        step=step,
        samples=samples,
        budget=budget,
        times=None if times is None else tuple(map(float, times)),
    )
    alike = cache is None and not inputs
    context = RunContext(
        functions=functions,
        kept_functions=derived.right_hand_sides if alike else KeptFunctions(cache, inputs or {}),
        cache=cache,
        stream=stream,
        checkpoint=checkpoint,
        progress=progress,
        reached=reached,
        stop=stop,
    )
    variants = derived.variants(frozenset(inputs or ()), (), tuple(extra))
    values = MemberValues(texts(parameters), texts(initial))
    if sensitivity:
        if inputs or extra:
            raise _sensitive_inputs() if inputs else _sensitive_columns()
        model = derived.sensitive_models.with_derivatives(
            sensitivity, values.parameters, values.initial
        )
        return simulate_with_sensitivities(model, options, context)
    free = variants.recipe.formulation == "auto" and not extra
    maker = partial(variants.with_multipliers, values) if free else None
    trajectory = simulate_past_singularities(variants.model_of(values), options, maker, context)
    is_own = not (parameters or inputs)
    return replace(trajectory, equations=derived.equations) if is_own else trajectory


def ensemble(
    derived: Derived,
    members: GivenMembers,
    *,
    until: float | None = None,
    accuracy: float | None = None,
    method: str | None = None,
    rtol: float | None = None,
    atol: float | None = None,
    step: float | None = None,
    samples: int | None = None,
    extra: Sequence[str] = (),
    columns: Sequence[str] | None = None,
    final: bool = False,
    reduce: Sequence[str] = (),
    functions: Mapping[str, MotionFunction] | None = None,
    store: str | PathLike[str] | None = None,
    resume: bool = False,
    jobs: int | None = 1,
    client: Client | None = None,
    progress: Callable[[float], None] | None = None,
) -> Ensemble:
    """Simulate many motions, each with an accuracy of its own.

    Parameters
    ----------
    members
        Parameters and initial values, numbers or expressions. A mapping of names to values
        combines all of them, the last name varies fastest; a sequence of mappings with the
        same names has them one by one; :func:`lagrange_cli.sampled` draws them.
    until, accuracy, method, rtol, atol, step, samples
        As for :meth:`simulate`.
    extra
        Further columns: ``energy``, ``forces``.
    columns
        Names of the columns that are kept of all samples, ``[]`` for none; None for all.
    final
        Keep all columns at the last sample.
    reduce
        Numbers of each motion, as ``lagrange simulate --reduce`` takes them.
    functions
        Further numbers by name: functions of a motion with ``t`` and ``columns``. No error of
        these is estimated.
    store
        Where the result is written as blocks of members are finished, in place of memory: a
        path that ends in ``.npz``, ``.parquet`` or ``.zarr``, or for the last an address that
        fsspec opens, as ``s3://bucket/out.zarr``. Arrays of the result are read from there
        when they are asked for; ``xarray.open_zarr`` opens a store itself.
    resume
        Go on with what an interrupted run left there; it is refused otherwise, and where
        ``functions`` are given: whether they are the same cannot be told.
    jobs
        Members that are simulated at a time: 1 in this process alone, more in threads and
        other processes, None as joblib is configured.
    client
        A ``distributed.Client`` of a Dask cluster, whose workers run the members in place of
        this machine and write them into the store, in a folder that they share.
    progress
        Called with the part of the members that are finished.

    Raises
    ------
    InputError
        None of a few members can be derived, or an option is wrong. Others that cannot be
        begun have the status ``refused``. The store is of another ensemble, or cannot be
        written. Workers of the cluster are unlike this process, or were lost; what is finished
        is kept, and ``resume`` goes on.

    Examples
    --------
    >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
    >>> ensemble = derivation.ensemble({"theta": [0.1, 0.2], "l": [1, 2, 3]}, until=1.0)
    >>> ensemble
    <Ensemble of pendulum: 6 members, 401 samples; 6 ok>
    >>> ensemble.columns["theta"].shape, ensemble.given["l"].tolist()
    ((6, 401), [1.0, 2.0, 3.0, 1.0, 2.0, 3.0])
    >>> swings = derivation.ensemble(
    ...     {"theta": [0.1, 0.2]}, until=5.0, columns=[], reduce=["max(theta)"]
    ... )
    >>> swings.reduced["max(theta)"].round(9).tolist()
    [0.1, 0.2]
    """
    from lagrange_cli.simulate.ensemble.plan.plan import Selection
    from lagrange_cli.simulate.ensemble.run.run import simulate_members
    from lagrange_cli.simulate.model.requested_outputs import read_reduction
    from lagrange_cli.simulate.options import SimulationOptions

    options = SimulationOptions(
        until=until,
        accuracy=accuracy,
        method=method,
        rtol=rtol,
        atol=atol,
        step=step,
        samples=samples,
    )
    reductions = tuple(read_reduction(text, "reduce") for text in dict.fromkeys(reduce))
    names = None if columns is None else tuple(columns)
    return simulate_members(
        derived.variants(frozenset(), reductions, ()),
        members_given(members),
        options,
        extra=tuple(extra),
        selection=Selection(names, final, reductions, dict(functions or {})),
        output=None if store is None else fspath(store),
        resume=resume,
        jobs=jobs,
        engine=None if client is None else _engine(client),
        progress=progress,
    )
