"""Model → RightHandSide: functions of t and y alone, in machine code or interpreted."""

from __future__ import annotations

import functools
import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from lagrange_cli.cache import Cache, open_cache
from lagrange_cli.errors import StoppedError
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.native.buffers import NativeLandmarks
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, WIDER_TYPES, NativeReal
from lagrange_cli.simulate.integrators.right_hand_side import Rhs, Sampling, structured
from lagrange_cli.simulate.model.model import Code, Model
from lagrange_cli.simulate.system.code import InterpretedCode, ModelCode, NativeCode
from lagrange_cli.simulate.system.contacts import ContactRhs
from lagrange_cli.simulate.system.inputs import RecordedInputs, read_recorded_inputs, with_functions
from lagrange_cli.simulate.system.libraries import Libraries, pieces_of
from lagrange_cli.simulate.system.rounding import first_flag, parameter_values
from lagrange_cli.simulate.system.singular_guard import guarded_rhs, singular_factors
from lagrange_cli.simulate.system.surfaces import MakeSurfaces, surfaces_maker
from lagrange_cli.simulate.system.tables import (
    ParameterTable,
    Table,
    interpreted_table,
    native_parameter_table,
    no_columns,
)
from lagrange_cli.simulate.system.tracing import functions_of
from lagrange_cli.toolchain.compiler import CompileError

#: No driven inputs.
_NONE: Mapping[str, Callable[[float], float]] = MappingProxyType({})

#: Part of a budget after which the compiler is given up, so that the rest is for Python.
_COMPILING = 0.5


@dataclass(frozen=True)
class WiderArithmetic:
    """Right-hand sides of a system in numbers wider than doubles.

    Attributes
    ----------
    real
        These numbers.
    rhs, perturbed, wider, widens
        As in :class:`RightHandSide`.
    landmarks
        Exponents of sharp functions; None if there are none.
    """

    real: NativeReal
    rhs: Rhs
    perturbed: tuple[Rhs, Rhs]
    landmarks: NativeLandmarks | None = None
    wider: Callable[[], WiderArithmetic | None] = lambda: None
    widens: bool = False


@dataclass(frozen=True)
class RightHandSide:
    """Functions of t and y = [q, q̇] of one model, with its parameters bound.

    Tables evaluate many states at once, t (m,) and y (m, 2n) to columns (m, k); NaN stands for
    values that do not exist.

    Attributes
    ----------
    rhs
        (t, y) → [q̇, q̈], shape (2n,). With closure equations it has a projection, with inputs from
        files pieces (:class:`.right_hand_side.StructuredRhs`); with contacts it is a
        :class:`.contacts.ContactRhs`.
    perturbed
        Two more of the same, with parameters and operations off by their rounding error.
    energy
        Σ q̇ ∂L/∂q̇ − L, one column.
    positions, velocities
        Cartesian names of the scene, and their rates.
    multipliers
        Multipliers of the closure equations.
    constraints
        Residuals φ, then φ̇ and ψ, of the closure equations.
    outputs
        Outputs that the scene asks for, then terms of conserved quantities.
    implementation
        Says in words what evaluates the functions.
    native
        They are machine code.
    wider
        Makes the right-hand sides in the next wider arithmetic, or None if there is none.
    widens
        ``wider`` may give some.
    recorded_inputs
        Recorded and driven inputs; None if there are none.
    forces
        Constraint forces, in machine code alone; None if they were not derived.
    guarded
        Makes the same with right-hand sides that do not exist beyond singular configurations, for
        the numbers of :func:`.singular_guard.guard_signs`.
    landmarks
        Exponents of sharp functions, which compiled integrators can watch.
    exponents
        Table of these exponents.
    singular
        Numbers that vanish at singular configurations of the coordinates.
    """

    rhs: Rhs
    perturbed: tuple[Rhs, Rhs]
    energy: Table
    positions: Table
    velocities: Table
    multipliers: Table
    constraints: Table
    outputs: Table
    implementation: str
    native: bool = False
    wider: Callable[[], WiderArithmetic | None] = lambda: None
    widens: bool = False
    recorded_inputs: RecordedInputs | None = None
    forces: ParameterTable | None = None
    guarded: Callable[[Array], RightHandSide] | None = None
    landmarks: NativeLandmarks | None = None
    exponents: Table = no_columns
    singular: Table = no_columns


def right_hand_side(
    model: Model, cache: Cache | None = None, budget: float | None = None
) -> RightHandSide:
    """Make the functions of a model: compiled if the machine has a C compiler, else interpreted.

    ``budget``: seconds for all that is done with them, from now on.

    Raises
    ------
    InputError
        A file of inputs cannot be read.
    """
    return KeptFunctions(cache)(model, budget)


@dataclass(frozen=True)
class _Evaluators:
    """The functions of a model over its code, compiled or interpreted.

    Attributes
    ----------
    code
        Makes the code with inputs off by their rounding in a pattern not 0, and with right-hand
        sides that end at the numbers of :func:`.singular_guard.guard_signs`, if there are any.
    wider
        Makes right-hand sides in the next wider arithmetic, with such numbers or without; None
        if there is none.
    """

    model: Model
    code: Callable[[int, Array | None], ModelCode]
    wider: Callable[[Array | None], WiderArithmetic | None] = lambda guards: None

    def functions(self, implementation: str, singular: Table, **more: Any) -> RightHandSide:
        """Bind the parameters of the model to all functions."""
        model, exact = self.model, self.code(0, None)

        def table(name: str, columns: int) -> Table:
            return exact.table(name, columns, parameter_values(model)) if columns else no_columns

        rhs, perturbed = self._sides(None)
        plain = RightHandSide(
            rhs=rhs,
            perturbed=perturbed,
            energy=table("energy", 1),
            positions=table("positions", len(model.cartesian)),
            velocities=table("velocities", len(model.cartesian)),
            multipliers=table("multipliers", len(model.multipliers)),
            constraints=table("constraints", model.residuals),
            outputs=table("outputs", model.output_count),
            exponents=table("landmarks", model.landmarks),
            singular=singular,
            implementation=implementation,
            wider=partial(self.wider, None),
            **more,
        )

        @functools.cache
        def guarded(signs: tuple[float, ...]) -> RightHandSide:
            guards = np.array(signs)
            rhs, perturbed = self._sides(guards)
            wider = partial(self.wider, guards)
            within = replace(plain, rhs=rhs, perturbed=perturbed, wider=wider, guarded=None)
            return self._on_surfaces(within, guards)

        plain = replace(plain, guarded=lambda guards: guarded(tuple(guards.tolist())))
        return self._with_samples(self._with_contacts(self._on_surfaces(plain, None)))

    def _sides(self, guards: Array | None) -> tuple[Rhs, tuple[Rhs, Rhs]]:
        """Return the right-hand side and the two perturbed ones."""
        names = "rhs", "disturbed", "disturbed"
        rhs, one, two = (
            self.code(pattern, guards)
            .side(name, parameter_values(self.model, pattern))
            .with_states(len(self.model.states))
            for pattern, name in enumerate(names)
        )
        return rhs, (one, two)

    def _surfaces(self, guards: Array | None) -> MakeSurfaces | None:
        return surfaces_maker(self.model, lambda pattern: self.code(pattern, guards))

    def _on_surfaces(self, functions: RightHandSide, guards: Array | None) -> RightHandSide:
        """Give right-hand sides their switching surfaces, if there are any."""
        surfaces = self._surfaces(guards)
        if surfaces is None:
            return functions

        def side(rhs: Rhs, pattern: int) -> Rhs:
            parameters = parameter_values(self.model, pattern)
            return structured(rhs).with_surfaces(surfaces(pattern, "", parameters))

        return _changed(functions, side)

    def _with_contacts(self, functions: RightHandSide) -> RightHandSide:
        """Make right-hand sides for every set of closed contacts, if there are contacts."""
        model, surfaces, guarded = self.model, self._surfaces(None), functions.guarded
        if not model.contacts:
            return functions

        def side(flight: Rhs, pattern: int) -> ContactRhs:
            name = "contact_disturbed" if pattern else "contact_rhs"
            parameters = parameter_values(model, pattern)
            first = first_flag(model)
            of_contacts = None if surfaces is None else partial(surfaces, pattern, "contact_")
            count, code = len(model.contacts), self.code(pattern, None)
            return ContactRhs(flight, code, name, parameters, first, count, of_contacts)

        return replace(
            _changed(functions, side),
            guarded=guarded and (lambda guards: self._with_contacts(guarded(guards))),
        )

    def _with_samples(self, functions: RightHandSide) -> RightHandSide:
        """Give right-hand sides what controllers set at samples, if there are any."""
        model, guarded = self.model, functions.guarded
        if not model.controllers:
            return functions
        places = tuple(controller.places for controller in model.controllers)

        def side(rhs: Rhs, pattern: int) -> Rhs:
            parameters = parameter_values(model, pattern)
            values = self.code(pattern, None).row("sampled", sum(map(len, places)), parameters)
            return structured(rhs).with_sampling(Sampling(model.periods, places, values))

        return replace(
            _changed(functions, side),
            guarded=guarded and (lambda guards: self._with_samples(guarded(guards))),
        )


def _changed(functions: RightHandSide, side: Callable[[Rhs, int], Rhs]) -> RightHandSide:
    """Change the right-hand sides, by their patterns; no wider arithmetic has their change."""
    one, two = functions.perturbed
    return replace(
        functions,
        rhs=side(functions.rhs, 0),
        perturbed=(side(one, 1), side(two, 2)),
        wider=lambda: None,
        widens=False,
    )


# Machine code.


def compiled(model: Model, cache: Cache, budget: float = math.inf) -> RightHandSide:
    """Compile the functions of a model.

    Raises
    ------
    CompileError
        There is no compiler, or it failed, or took half of the ``budget``, in seconds.
    InputError
        A file of inputs cannot be read.
    """
    return KeptFunctions(cache).compiled(model, budget)


class KeptFunctions:
    """Makes functions of models; of those that differ in numbers alone, it compiles one.

    Functions of the last model are kept as they are, for each thread its own: they have memory in
    which they work.

    Parameters
    ----------
    cache
        Keeps what is compiled; by default the user's.
    driven
        Functions of time for the driven inputs of models, by their names.
    """

    def __init__(
        self, cache: Cache | None = None, driven: Mapping[str, Callable[[float], float]] = _NONE
    ) -> None:
        self._cache, self._driven = cache, driven
        self._libraries: dict[int, tuple[Code, Libraries]] = {}
        self._inputs: dict[tuple[Any, ...], RecordedInputs | None] = {}
        self._last = threading.local()

    def __call__(self, model: Model, budget: float | None = None) -> RightHandSide:
        """Make the functions of a model, as :func:`right_hand_side`."""
        if model.driven:
            driven = {name: self._driven[name] for name in model.driven}
            return interpreted(model, "an input is a Python function", driven)
        try:
            return self.compiled(model, math.inf if budget is None else budget)
        except CompileError as error:
            return interpreted(model, error.reason)

    def compiled(self, model: Model, budget: float = math.inf) -> RightHandSide:
        """Make compiled functions of a model, as :func:`compiled`."""
        started = time.perf_counter()
        cache = self._cache = open_cache() if self._cache is None else self._cache
        # A file of inputs may have changed since it was read.
        files = model.recordings, tuple(recording.stamp for recording in model.recordings)
        if files not in self._inputs:
            self._inputs = {files: read_recorded_inputs(model.recordings)}
        recorded, known = self._inputs[files], self._libraries.get(id(model.code))
        last: tuple[Any, ...] = getattr(self._last, "bound", (None,))
        if last[0] is model and last[1] is recorded and budget == math.inf:
            bound: RightHandSide = last[2]
            return bound
        if known is None:
            deadline = started + _COMPILING * budget
            libraries = Libraries(model, recorded, cache, DOUBLE, deadline)
            # The code is kept as well, so that no other one has its number.
            known = self._libraries[id(model.code)] = model.code, libraries
        bound = _native(known[1].with_numbers(model, recorded), cache, started + budget)
        if budget == math.inf:
            self._last.bound = model, recorded, bound
        return bound


def _native(libraries: Libraries, cache: Cache, deadline: float) -> RightHandSide:
    """Bind the parameters of a model to the functions of loaded libraries."""
    model, recorded = libraries.model, libraries.recorded_inputs
    singular: Table = no_columns
    forces: ParameterTable | None = None
    if model.singular:
        singular = partial(libraries.function("singular").table, columns=len(model.singular))
    if model.forces:
        known = np.empty(len(model.parameters) + len(model.coordinates) + len(model.symbols))
        function = libraries.function("forces", parameters=known)
        forces = native_parameter_table(function, len(model.forces))
    wider = partial(_wider, WIDER_TYPES, model, recorded, cache, deadline)
    return _Evaluators(model, partial(NativeCode, libraries), wider).functions(
        libraries.implementation,
        singular,
        native=True,
        widens=bool(WIDER_TYPES),
        recorded_inputs=recorded,
        forces=forces,
        landmarks=libraries.landmarks,
    )


def _wider(
    types: Sequence[NativeReal],
    model: Model,
    recorded: RecordedInputs | None,
    cache: Cache,
    deadline: float,
    guards: Array | None = None,
) -> WiderArithmetic | None:
    """Compile right-hand sides in the first of some types that the compiler has, or None.

    Raises
    ------
    StoppedError
        They were not ready at the deadline.
    """
    for number, real in enumerate(types, 1):
        try:
            libraries = Libraries(model, recorded, cache, real, deadline)
        except CompileError:
            if time.perf_counter() >= deadline:
                raise StoppedError from None
            continue
        # A compiler may take another type by that name: its numbers would be read wrongly.
        if 2.0 ** (1 - libraries.digits) == real.epsilon:
            wider = partial(_wider, types[number:], model, recorded, cache, deadline, guards)
            return WiderArithmetic(
                real,
                *libraries.sides(guards),
                landmarks=libraries.landmarks,
                wider=wider,
                widens=number < len(types),
            )
    return None


# Interpreted.


def interpreted(
    model: Model, reason: str, driven: Mapping[str, Callable[[float], float]] = _NONE
) -> RightHandSide:
    """Make functions of a model run by Python; ``reason`` says why they are not compiled.

    ``driven``: its driven inputs, by their names in order.

    Raises
    ------
    InputError
        A file of inputs cannot be read.
    """
    functions = functions_of(model.code.functions)
    inputs = with_functions(read_recorded_inputs(model.recordings), driven)

    def code(pattern: int, guards: Array | None) -> InterpretedCode:
        pieces = pieces_of(inputs, pattern)
        if guards is None:
            return InterpretedCode(model, functions, pieces)
        return InterpretedCode(model, functions, pieces, partial(guarded_rhs, model, guards))

    singular: Table = no_columns
    if model.singular:
        singular = interpreted_table(singular_factors(model), len(model.singular))
    return _Evaluators(model, code).functions(
        f"interpreted Python: {reason}", singular, recorded_inputs=inputs
    )
