"""Every shipped scene, checked by routes that share nothing with the program.

The Lagrangians are those of ``textbook.py``, typed by hand; the equations of motion come from
SymPy's LagrangesMethod. Motions are those of ``tests/references``, stored with 22 digits, which
SciPy's DOP853 at rtol 1e-13 finds again from the equations of the books; emitted C is compiled and
called.
"""

from __future__ import annotations

import ctypes
import importlib.util
import json
import re
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from types import ModuleType

import mpmath
import numpy as np
import pytest
import sympy as sp
import yaml
from numpy.typing import NDArray

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.cache import open_cache
from lagrange_cli.check import check_paths
from lagrange_cli.errors import Mark
from lagrange_cli.mechanics import interpret
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.system import Input
from lagrange_cli.report.values.derivation import derivation_report
from lagrange_cli.scene import parse_expression, read_file
from tests.emit.emitted_c import shared_library
from tests.systems import lagranges_method
from tests.systems.lagranges_method import Constrained, Dynamics
from tests.systems.recordings import linear
from tests.systems.shipped import (
    APART,
    CONTACTS,
    NARROW,
    REFUSED,
    SCENES,
    SLICE,
    SYSTEMS,
    derived,
    every_scene,
    parameter_values,
    simulated,
    sliced,
    start,
)
from tests.systems.textbook import GENERALIZED_FORCES, LAGRANGIANS
from tests.systems.textbook_constraints import CLOSURES, ROLLING

Array = NDArray[np.float64]

#: Scenes without contacts: one right-hand side for all of a motion.
SMOOTH = [name for name in SCENES if name not in CONTACTS]

REFERENCES = Path(__file__).parents[1] / "references"

STATES = 20


@cache
def typed_dynamics(name: str) -> Dynamics:
    """Lagrange's equations of the Lagrangian that the book gives."""
    e = derived(name)
    names = [c.name for c in e.system.coordinates], [p.name for p in e.system.parameters]
    free = lagranges_method.from_typed(LAGRANGIANS[name], GENERALIZED_FORCES.get(name), *names)
    if name not in CLOSURES and name not in ROLLING:
        return free
    constraints = CLOSURES.get(name), ROLLING.get(name)
    return lagranges_method.constrained(free, *constraints, *names)


@dataclass(frozen=True)
class Reference:
    """States at some of the samples of a simulation, which have these numbers."""

    numbers: NDArray[np.int64]
    times: Array
    states: Array


@cache
def reference(name: str) -> Reference:
    """Return the motion that ``benchmarks/references.py`` computed in 113 binary digits."""
    e, scene = derived(name), SCENES[name]
    folder = REFERENCES / scene.parent.relative_to(SYSTEMS)
    # References are of the formulation that was asked for: contacts keep those of their scene.
    formulation = "minimal" if e.system.contacts else e.system.formulation
    file = folder / f"{name}.{formulation}.json"
    stored = json.loads(file.read_text(encoding="utf-8"))
    assert stored["coordinates"] == [c.name for c in e.system.coordinates]
    numbers, times, *columns = zip(*stored["samples"], strict=True)
    states = np.array([[float(text) for text in column] for column in columns]).T
    return Reference(np.array(numbers), np.array(times), states)


def random_states(name: str) -> list[tuple[float, Array, Array]]:
    """(t, q, v) near the trajectory, so that they are of its scale and within the charts."""
    random = np.random.default_rng(sum(name.encode()))
    motion, n = reference(name), len(derived(name).system.coordinates)
    rows = random.integers(0, len(motion.times), STATES)
    shifted = motion.states[rows] * (1 + 0.02 * random.uniform(-1, 1, (STATES, 2 * n)))
    states = [(float(motion.times[k]), y[:n], y[n:]) for k, y in zip(rows, shifted, strict=True)]
    dynamics = typed_dynamics(name)
    if isinstance(dynamics, Constrained):
        p = parameter_values(derived(name))
        return [(t, *dynamics.nearest(t, q, v, p)) for t, q, v in states]
    return states


def assert_close(found: list[Array], expected: list[Array], tolerance: float) -> None:
    """Component by component within the tolerance of its largest magnitude over all states."""
    a, b = np.array(found), np.array(expected)
    scale = np.abs(b).max(axis=0)
    # The rounding of 40 digits is no scale; what is exactly zero stays so.
    scale[(scale > 0) & (scale < 1e-25 * scale.max())] = scale.max()
    assert np.all(np.abs(a - b) <= tolerance * scale + np.finfo(float).tiny), np.abs(a - b) / scale


def test_every_scene_has_a_lagrangian_from_a_book() -> None:
    assert set(LAGRANGIANS) == set(SCENES)
    assert len(SCENES) >= 60


@pytest.mark.slow
def test_scenes_have_the_names_of_their_files_and_a_source() -> None:
    scenes = {name: read_file(str(path)) for name, path in SCENES.items()}
    assert [scene.name for scene in scenes.values()] == list(SCENES)
    for name, path in SCENES.items():
        if path.parent.name != "lecture" and name != "trammel":
            description = scenes[name].description or ""
            assert re.search(r"\b(1[6-9]|20)\d\d\b", description), name


def structures(name: str) -> set[object]:
    """Keys of a scene down to the second level, and facts and counts of its equations."""
    sections = yaml.load(SCENES[name].read_text(encoding="utf-8"), yaml.CSafeLoader)
    keys: set[object] = set()
    for section, entries in sections.items():
        keys.add(section)
        if section in ("constraints", "forces", "inputs", "kinetic", "potentials", "simulate"):
            mappings = [entry for entry in entries.values() if isinstance(entry, dict)]
            keys |= {(section, *sorted(map(str, entry))) for entry in mappings}
    e = derived(name)
    facts = {fact for fact, holds in asdict(e.derivation.facts).items() if holds is True}
    constraints = len(e.system.closures), len(e.system.contacts)
    return {*keys, *facts, e.system.formulation, *(min(count, 2) for count in constraints)}


@pytest.mark.slow
def test_the_slice_has_each_structure() -> None:
    """A scene with a new structure belongs into the slice that all campaigns draw from."""
    assert set(NARROW) <= set(SLICE) <= set(SCENES)
    covered = set().union(*map(structures, SLICE))
    assert {name: structures(name) - covered for name in SCENES if structures(name) - covered} == {}


@pytest.mark.slow
@every_scene
def test_certified(name: str) -> None:
    certificate = derived(name).derivation.certificate
    assert certificate.points >= (8 if len(derived(name).system.coordinates) <= 24 else 2)
    assert certificate.digits >= 30
    assert 0 <= certificate.mismatch <= 1e-25


#: Scenes whose Lagrangian SymPy differentiates for seconds; the slice has smaller nets and chains.
LONG = {"pleiades", "net_of_rods_and_springs", "hanging_net", "pendulum_chain", "fput"}


@pytest.mark.slow
@sliced(SCENES, set(SCENES) - LONG)
def test_agrees_with_lagranges_method_on_the_books_lagrangian(name: str) -> None:
    e, typed = derived(name), typed_dynamics(name)
    compare_dynamics(numeric_dynamics(e), typed, name)
    if not e.system.contacts:
        p, states = parameter_values(e), random_states(name)
        accelerations = [typed.accelerations(t, q, v, p) for t, q, v in states]
        assert_close(accelerations, exact_accelerations(name), 1e-10)


@pytest.mark.slow
@sliced(SCENES)
def test_agrees_with_lagranges_method_on_its_own_lagrangian(name: str) -> None:
    e = derived(name)
    generalized = [
        sum((f.generalized[j] for f in e.system.forces), sp.Integer(0))
        - sp.diff(e.system.dissipation, c.v)
        for j, c in enumerate(e.system.coordinates)
    ]
    expected = lagranges_method.from_lagrangian(
        written_out(e, e.system.lagrangian),
        [written_out(e, force) for force in generalized],
        [(c.q, c.v) for c in e.system.coordinates],
        [p.symbol for p in e.system.parameters],
        e.system.t,
    )
    compare_dynamics(numeric_dynamics(e), expected, name)


def written_out(e: Equations, expression: sp.Expr) -> sp.Expr:
    """With the scene's functions of time for its inputs."""
    return expression.subs(
        [(given.symbol, function_of_time(e, given)) for given in e.system.inputs]
    )


def function_of_time(e: Equations, given: Input) -> sp.Expr:
    if given.recording is None:
        return given.expression
    assert given.recording.interpolation == "linear"
    file = SCENES[e.presentation.name].parent / given.recording.file
    return linear(str(file.relative_to(SYSTEMS)), given.recording.column, e.system.t)


def numeric_dynamics(e: Equations) -> Dynamics:
    """The program's M and f as numerical functions, through no code of its own."""
    arguments = (
        e.system.t,
        [c.q for c in e.system.coordinates],
        [c.v for c in e.system.coordinates],
        [p.symbol for p in e.system.parameters],
    )
    return Dynamics(
        sp.lambdify(arguments, written_out(e, sp.Matrix(e.system.mass_matrix)), "numpy", cse=True),
        sp.lambdify(arguments, written_out(e, sp.Matrix(e.system.forcing)), "numpy", cse=True),
    )


def compare_dynamics(found: Dynamics, expected: Dynamics, name: str) -> None:
    """M and f at random states, with parameters shifted at random too.

    Entries are made comparable, whatever their units, by the kinetic metric:
    M_ij/sqrt(|M_ii M_jj|) and f_i/sqrt(|M_ii|).
    """
    random = np.random.default_rng(1)
    values = np.array(parameter_values(derived(name)))
    matrices, forcings = [], []
    for t, q, v in random_states(name):
        p = list(values * (1 + 0.01 * random.uniform(0, 1, len(values))))
        m, expected_m = (np.asarray(d.mass_matrix(t, q, v, p)) for d in (found, expected))
        f, expected_f = (d.forcing(t, q, v, p).ravel() for d in (found, expected))
        size = np.sqrt(np.abs(np.diag(expected_m)))
        unit = 1 / np.where(size > 0, size, size.max())
        matrices.append(np.abs(m - expected_m) * np.outer(unit, unit))
        forcings.append((np.abs(f - expected_f) * unit, np.abs(expected_f * unit).max()))
    assert np.max(matrices) <= 1e-12
    assert max(d.max() for d, _ in forcings) <= 1e-11 * max(size for _, size in forcings)


@cache
def exact_accelerations(name: str) -> list[Array]:
    """The symbolic right-hand side at the random states, evaluated with 40 digits."""
    e = derived(name)
    arguments = [
        e.system.t,
        [c.q for c in e.system.coordinates],
        [c.v for c in e.system.coordinates],
        [p.symbol for p in e.system.parameters],
    ]
    n, k = len(e.system.coordinates), len(e.system.closures)
    jacobian = sp.Matrix(k, n, [g for closure in e.system.closures for g in closure.gradient])
    matrix = sp.Matrix(e.system.mass_matrix).row_join(-jacobian.T)
    matrix = matrix.col_join(jacobian.row_join(sp.zeros(k, k)))
    right = sp.Matrix([*e.system.forcing, *(-closure.bias for closure in e.system.closures)])
    mass = sp.lambdify(arguments, written_out(e, matrix), "mpmath", cse=True)
    forcing = sp.lambdify(arguments, written_out(e, right), "mpmath", cse=True)
    found = []
    with mpmath.workdps(40):
        p = [mpmath.mpf(value) for value in parameter_values(e)]
        for t, q, v in random_states(name):
            state = (mpmath.mpf(t), list(map(mpmath.mpf, q)), list(map(mpmath.mpf, v)), p)
            solution = mpmath.lu_solve(mass(*state), forcing(*state))
            found.append(np.array([float(x) for x in solution[:n]]))
    return found


def python_module(e: Equations, folder: Path) -> ModuleType:
    (file,) = EMITTERS["python"].emit(e).items()
    path = folder / file[0]
    path.write_text(file[1], encoding="utf-8")
    spec = importlib.util.spec_from_file_location(f"emitted_{e.presentation.name}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class CompiledC:
    """The emitted C, built as a shared library and called through its interface."""

    def __init__(self, e: Equations, folder: Path) -> None:
        files = EMITTERS["c"].emit(e)
        assert sorted(files) == [f"{e.presentation.name}.c", f"{e.presentation.name}.h"]
        for file, text in files.items():
            (folder / file).write_text(text, encoding="utf-8")
        loaded = shared_library(folder / f"{e.presentation.name}.c")
        self._rhs = getattr(loaded, f"{e.presentation.name}_rhs")
        self._inputs = getattr(loaded, f"{e.presentation.name}_inputs") if e.system.inputs else None
        self._given = (ctypes.c_double * max(1, len(e.system.inputs)))()
        self._recorded = {
            k: sp.lambdify(e.system.t, function_of_time(e, given))
            for k, given in enumerate(e.system.inputs)
            if given.recording is not None
        }
        size = re.search(
            rf"#define {e.presentation.name}_WORK (\d+)", files[f"{e.presentation.name}.h"]
        )
        assert size is not None
        self._work = (ctypes.c_double * max(1, int(size[1])))()
        # A structure of doubles is laid out as an array of them.
        self._parameters = (ctypes.c_double * max(1, len(e.system.parameters)))()
        getattr(loaded, f"{e.presentation.name}_defaults")(self._parameters)
        self.parameters = list(self._parameters)[: len(e.system.parameters)]

    def rhs(self, t: float, y: Array) -> Array:
        state, result = (ctypes.c_double * len(y))(*y), (ctypes.c_double * len(y))()
        time, others = ctypes.c_double(t), (self._parameters, self._work)
        given = None if self._inputs is None else self._given
        for k, recorded in self._recorded.items():
            self._given[k] = recorded(t)
        read = given if self._recorded else None
        assert self._inputs is None or self._inputs(time, state, read, *others, given) == 0
        assert self._rhs(time, state, given, *others, result) == 0
        return np.array(result)


@pytest.mark.slow
@pytest.mark.compiler
@sliced(SMOOTH)
def test_emitted_code_agrees_with_the_symbolic_equations(name: str, tmp_path: Path) -> None:
    e = derived(name)
    module, compiled = python_module(e, tmp_path), CompiledC(e, tmp_path)
    assert compiled.parameters == parameter_values(e)
    n = len(e.system.coordinates)
    in_c, in_python = [], []
    for t, q, v in random_states(name):
        y = np.concatenate([q, v])
        for results, rhs in ((in_c, compiled.rhs), (in_python, module.rhs)):
            dydt = np.asarray(rhs(t, y))
            assert np.array_equal(dydt[:n], v)
            results.append(dydt[n:])
    assert_close(in_c, exact_accelerations(name), 1e-12)
    assert_close(in_python, exact_accelerations(name), 1e-12)


#: Scenes of which motions are compared: beside the slice a stiff one and close encounters.
MOVED = {*SLICE, "andrews_squeezer", "arenstorf_orbit", "pleiades"}


@pytest.mark.slow
@sliced(SMOOTH, MOVED)
def test_simulation_keeps_its_promise(name: str) -> None:
    """Every coordinate and velocity within accuracy times scale of the reference."""
    e, trajectory = derived(name), simulated(name)
    assert trajectory.status == "ok", trajectory.reason
    assert trajectory.requested == e.system.simulate.accuracy
    assert trajectory.t[-1] == e.system.simulate.until
    chosen, exact = reference(name).numbers, reference(name).states
    assert np.array_equal(trajectory.t[chosen], reference(name).times)
    names = [c.name for c in e.system.coordinates]
    names += [f"dot({c})" for c in names]
    for column, expected in zip(names, exact.T, strict=True):
        found = trajectory.columns[column][chosen]
        assert np.abs(found - expected).max() <= trajectory.requested * scale_of(e, column, exact)


def scale_of(e: Equations, column: str, exact: Array) -> float:
    """The scale that the accuracy is promised in, from the reference.

    R is the largest change of a length, 1 for an angle; scale(q) = max(R, 1e-3 G) with G the
    largest R among coordinates of its kind; scale(q̇) = max(|q̇|, scale(q)/T).
    """
    n = len(e.system.coordinates)
    names = [c.name for c in e.system.coordinates]
    travel = np.abs(exact[:, :n] - exact[0, :n]).max(axis=0)
    ranges = np.where([c.is_angle for c in e.system.coordinates], 1.0, travel)
    k = names.index(column.removeprefix("dot(").removesuffix(")"))
    alike = [
        r
        for r, c in zip(ranges, e.system.coordinates, strict=True)
        if c.unit == e.system.coordinates[k].unit
    ]
    scale = max(ranges[k], 1e-3 * max(alike)) or 1.0
    if column in names:
        return float(scale)
    assert e.system.simulate.until is not None
    return max(
        float(np.abs(exact[:, n + k]).max()),
        scale / (e.system.simulate.until - e.system.simulate.start),
    )


@pytest.mark.slow
@sliced(SMOOTH, set(SLICE) - {"seismometer"})
def test_references_are_motions_of_the_books_equations(name: str) -> None:
    e, motion = derived(name), reference(name)
    y0 = start(e)
    assert motion.states[0] == pytest.approx(y0, rel=1e-14, abs=1e-14)
    rough = np.where(y0 == 0, np.abs(y0).max(initial=1e-3) * 1e-3, np.abs(y0))
    solve = lagranges_method.integrate
    states = solve(typed_dynamics(name), parameter_values(e), y0, motion.times, rough)
    names = [c.name for c in e.system.coordinates]
    names += [f"dot({c})" for c in names]
    for column, found, expected in zip(names, states.T, motion.states.T, strict=True):
        assert np.abs(found - expected).max() <= 1e-8 * scale_of(e, column, motion.states)


@pytest.mark.slow
@sliced(SCENES, MOVED)
def test_energy_stays_where_it_is_conserved(name: str) -> None:
    e, trajectory = derived(name), simulated(name)
    conserved = any(c.kind in ("energy", "jacobi") for c in e.derivation.conserved)
    assert (trajectory.energy_drift is not None) == conserved
    if trajectory.energy_drift is not None:
        assert trajectory.energy_drift <= 1e-7


def require_passes(paths: list[str]) -> int:
    """Check scenes, of which none may fail, and return their number."""
    report = check_paths(paths, cache=open_cache())
    assert [(s.path, s.problems) for s in report.scenes if s.outcome != "pass"] == []
    return len(report.scenes)


@pytest.mark.slow
def test_check_passes_on_the_slice_and_every_refusal() -> None:
    paths = [*map(str, REFUSED), *(str(SCENES[name]) for name in SLICE)]
    assert require_passes(paths) == len(paths)


@pytest.mark.campaign
@pytest.mark.slow
def test_check_passes_on_every_scene_and_every_refusal() -> None:
    assert require_passes([str(SYSTEMS)]) == len(SCENES) + len(APART) + len(REFUSED)
    assert len(REFUSED) >= 5


def test_report_of_masses_through_hole() -> None:
    e = derived("masses_through_hole")
    report = derivation_report(e)
    assert report["cartesian"] == 6
    assert report["constraints"] == 4
    assert report["dof"] == 2
    assert report["cyclic"] == ["theta"]
    (momentum,) = [c["expression"] for c in report["conserved"] if c["name"] == "p_theta"]
    parsed = interpret(e, parse_expression(momentum, Mark("report", 1, 1, momentum)))
    by_name = {p.name: p.symbol for p in e.system.parameters}
    r, theta = e.system.coordinates
    assert sp.expand(parsed - by_name["M"] * r.q**2 * theta.v) == 0


#: The lecture's accounts: 3N, K, DOF.
ACCOUNTS = {
    "bead_on_parabola": (3, 2, 1),
    "masses_through_hole": (6, 4, 2),
    "rigid_triangle": (9, 3, 6),
    "rigid_tetrahedron": (12, 6, 6),
    "rigid_tetrahedron_centre": (15, 9, 6),
    "particle_on_sphere": (3, 1, 2),
    "bead_on_rotating_wire": (3, 2, 1),
    "pendulum_driven_support": (3, 2, 1),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", list(ACCOUNTS))
def test_account_of_the_lecture(name: str) -> None:
    account = derived(name).derivation.account
    assert (account.cartesian, account.constraints, account.dof) == ACCOUNTS[name]
    assert account.implied == 0


def test_redundant_rod_is_named() -> None:
    e = derived("rigid_tetrahedron_centre")
    statuses = {line.name: line.status for line in e.derivation.account.lines}
    assert [name for name, status in statuses.items() if status == "redundant"] == ["spoke4"]
    (warning,) = e.derivation.warnings
    assert "spoke4" in warning.message
    assert warning.rule == "redundant"


@pytest.mark.parametrize(
    ("name", "moving"),
    [("bead_on_rotating_wire", ["wire"]), ("pendulum_driven_support", ["rod"])],
)
def test_constraints_that_depend_on_time_are_classified(name: str, moving: list[str]) -> None:
    e = derived(name)
    assert e.derivation.facts.rheonomic
    assert [line.name for line in e.derivation.account.lines if line.rheonomic] == moving
    assert not any(c.name == "energy" for c in e.derivation.conserved)


def test_torque_of_a_cartesian_force() -> None:
    """Q_θ = F · ∂r/∂θ of a horizontal force on a pendulum (virtual work)."""
    e = derived("pendulum_with_force")
    (force,) = e.system.forces
    p = {parameter.name: parameter.symbol for parameter in e.system.parameters}
    (theta,) = e.system.coordinates
    expected = p["F0"] * sp.cos(p["Omega"] * e.system.t) * p["l"] * sp.cos(theta.q)
    assert sp.simplify(force.generalized[0] - expected) == 0


def test_page_of_scenes_lists_every_scene() -> None:
    page = (SYSTEMS.parent / "docs" / "scenes.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"\(\.\./systems/([\w/]+\.yaml)\)", page))
    assert listed == {
        str(p.relative_to(SYSTEMS)) for p in (*SCENES.values(), *APART.values(), *REFUSED)
    }
