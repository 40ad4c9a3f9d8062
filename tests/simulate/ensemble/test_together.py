"""Members stepped side by side by their Taylor series: against single runs, closed forms, and
each other."""

from __future__ import annotations

import itertools
import math
import subprocess

import numpy as np
import pytest

from lagrange_cli.api import loads
from lagrange_cli.scene import SceneText
from lagrange_cli.simulate import kernels
from lagrange_cli.simulate.ensemble.plan.plan import Plan, Task
from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues, Recipe
from lagrange_cli.simulate.ensemble.plan.variants import differ_in_numbers
from lagrange_cli.simulate.ensemble.run import batched as together
from lagrange_cli.simulate.ensemble.run.batched_results import batched_results
from lagrange_cli.simulate.ensemble.run.run import run_block, run_blocks
from lagrange_cli.simulate.integrators.native.c_types import EXTENDED
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.simulation import simulate
from lagrange_cli.toolchain.compiler import CompileError, find_compiler
from tests.simulate.compiling import skip_without_compiler
from tests.simulate.ensemble.listed_members import tasks_of, unchanged

#: Plans of one key are one plan.
KEYS = map(str, itertools.count())

HOW = {"until": 5.0, "accuracy": 1e-9, "samples": 51}

#: Scenes whose equations have series: functions, quotients, the time, several kinds of coordinates.
SCENES = {
    "double_pendulum": """
parameters: {m1: 1, m2: 1, l1: 1, l2: 1, g: 9.81}
plane: xz
particles:
  upper: {mass: m1, position: [l1*sin(a), y1, -l1*cos(a)]}
  lower: {mass: m2, position: [l1*sin(a) + l2*sin(b), y2, -l1*cos(a) - l2*cos(b)]}
coordinates: [a, b]
potentials: {weight: {gravity: g}}
initial: {a: 1.5, b: 2.0, dot(a): 0.1, dot(b): 0}
""",
    "kepler": """
parameters: {m: 1, k: 1}
particles: {p: {mass: m, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {newton: -k/sqrt(x^2 + y^2)}
initial: {x: 1, y: 0, dot(x): 0, dot(y): 1.1}
""",
    "valley": """
parameters: {m: 1, k: 0.5, c: 0.01}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {valley: k*(exp(x) + exp(-2*x))}
dissipation: {drag: c*dot(x)^2/2}
initial: {x: 1, dot(x): 0}
""",
    "shaken": """
parameters: {m: 1, l: 1, g: 9.81, w: 3}
plane: xz
particles: {p: {mass: m, position: [l*sin(q) + sin(w*t)/10, y, -l*cos(q)]}}
coordinates: [q]
potentials: {weight: {gravity: g}}
outputs: {reach: l*sin(q)}
initial: {q: 0.4, dot(q): 0}
""",
    "thrown": """
parameters: {m: 1, g: 9.81}
particles: {p: {mass: m, position: [x, 0, z]}}
coordinates: [x, z]
potentials: {weight: m*g*z}
initial: {x: 0, z: 1, dot(x): 2, dot(z): 3}
""",
}

#: What members have of their own.
VARIED = {
    "double_pendulum": {"a": (1.4, 1.6), "m2": (0.5, 2.0), "dot(b)": (-1.0, 1.0)},
    "kepler": {"k": (0.9, 1.2), "dot(y)": (0.7, 1.2)},
    "valley": {"x": (-1.0, 1.5), "c": (0.01, 0.3)},
    "shaken": {"w": (1.0, 5.0), "q": (-1.0, 1.0), "l": (0.5, 2.0)},
    "thrown": {"g": (1.0, 10.0), "dot(z)": (-2.0, 5.0)},
}


@pytest.fixture(autouse=True)
def require_compiler():
    try:
        find_compiler()
    except CompileError as error:
        skip_without_compiler(error.reason)


def plan_of(name, how=HOW, **more):
    title = name if name in SCENES else "scene"
    found = Recipe(SceneText("scene.yaml", f"name: {title}\n{SCENES.get(name, name)}".encode()))
    names = tuple(VARIED.get(name, ("x",)))
    first = dict(zip(names, (row[0] for row in rows_of(name, 2)[:1]), strict=False))
    own = MemberValues.for_scene(first, found.scene())
    model = found.model(MemberValues())
    assert differ_in_numbers(found, MemberValues(), model)
    return Plan(
        next(KEYS), found, names, own, model, True, how["samples"], SimulationOptions(**how), **more
    )


def rows_of(name, members):
    random = np.random.default_rng(7)
    ranges = VARIED.get(name, {"x": (0.0, 1.0)}).values()
    columns = [random.uniform(*ends, members).tolist() for ends in ranges]
    return [tuple(map(repr, row)) for row in zip(*columns, strict=True)]


def single_of(plan, row):
    own = MemberValues.for_scene(dict(zip(plan.names, row, strict=True)), plan.recipe.scene())
    options = dict(vars(plan.options))
    options.pop("usual_accuracy")  # of a file of defaults, where a scene says nothing
    return simulate(plan.recipe.model(own), **options)


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_members_are_single_runs_within_both_estimates(name):
    plan, rows = plan_of(name), rows_of(name, 11)
    block = run_block(Task(plan, 0, tuple(rows)))
    assert block.words["method"] == ["Taylor"] * 11
    assert block.words["status"] == ["ok"] * 11
    assert (block.figures["estimated"] < 1e-9).all()
    for k in (0, 4, 10):
        single = single_of(plan, rows[k])
        assert single.method != "Taylor"
        assert list(block.columns) == list(single.columns)
        allowed = block.figures["estimated"][k] + single.estimated
        for column, scale in single.scales.items():
            off = np.abs(block.columns[column][k] - single.columns[column]).max()
            assert off <= allowed * scale
        for column in set(single.columns) - set(single.scales):
            assert block.columns[column][k] == pytest.approx(single.columns[column], abs=1e-7)
        drift = single.energy_drift
        assert math.isnan(block.figures["energy_drift"][k]) == (drift is None)


@pytest.mark.slow
def test_a_throw_is_exact():
    plan, rows = plan_of("thrown"), rows_of("thrown", 9)
    block = run_block(Task(plan, 0, tuple(rows)))
    t = np.linspace(0, 5, 51)
    g, speed = np.array(rows, dtype=float).T[:, :, None]
    exact = 1 + speed * t - g / 2 * t**2
    assert np.abs(block.columns["z"] - exact).max() <= 1e-14 * np.abs(exact).max()
    assert block.varied["g"].tolist() == g[:, 0].tolist()


@pytest.mark.slow
def test_an_orbit_closes():
    """One revolution, with eccentricities up to 0.5, after Kepler's third law."""
    plan, rows = plan_of("kepler"), rows_of("kepler", 8)
    k, speed = np.array(rows, dtype=float).T
    axis = 1 / (2 - speed**2 / k)
    periods = 2 * math.pi * np.sqrt(axis**3 / k)
    for row, period in list(zip(rows, periods.tolist(), strict=True))[:3]:
        options = SimulationOptions(until=period, accuracy=1e-11, samples=21)
        batched = batched_results(plan.model, options, ())
        (known,) = batched.run(np.array([[1, 0, 0, float(row[1])]]), np.array([[1, float(row[0])]]))
        assert abs(known.columns["x"][0, -1] - 1) < 1e-10
        assert abs(known.columns["y"][0, -1]) < 1e-10


@pytest.mark.slow
def test_members_do_not_depend_on_their_neighbours():
    plan, rows = plan_of("double_pendulum"), rows_of("double_pendulum", 13)
    all_of_them = run_block(Task(plan, 0, tuple(rows)))
    turned = run_block(Task(plan, 0, tuple(rows[::-1])))
    alone = run_block(Task(plan, 0, (rows[6],)))
    for name, column in all_of_them.columns.items():
        assert column.tobytes() == turned.columns[name][::-1].tobytes()
        assert column[6].tobytes() == alone.columns[name][0].tobytes()
    for name, figures in all_of_them.figures.items():
        assert np.array_equal(figures, turned.figures[name][::-1], equal_nan=True)


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_blocks_are_the_same_with_any_number_of_jobs(jobs):
    plan, rows = plan_of("valley"), [*rows_of("valley", 40), ("nan*0", "0.1"), ("1", "-0.1")]
    found = sorted(
        run_blocks(plan, tasks_of(plan, rows), jobs, unchanged), key=lambda block: block.number
    )
    assert [s for b in found for s in b.words["status"]] == ["ok"] * 40 + ["refused", "ok"]
    x = np.concatenate([b.columns["x"] for b in found if "x" in b.columns])
    before = JOBS.setdefault("x", x.tobytes())
    assert x.tobytes() == before


#: What was found with another number of jobs.
JOBS: dict[str, bytes] = {}


# With a method, without a promise.


@pytest.mark.slow
def test_auto_keeps_to_its_tolerance_and_estimates_nothing():
    rows = rows_of("double_pendulum", 5)
    exact = run_block(Task(plan_of("double_pendulum"), 0, tuple(rows))).columns["a"]
    errors = []
    for rtol in (1e-6, 1e-9, 1e-12):
        how = {"until": 5.0, "method": "auto", "rtol": rtol, "samples": 51}
        block = run_block(Task(plan_of("double_pendulum", how), 0, tuple(rows)))
        assert block.words["method"] == ["Taylor"] * 5
        assert np.isnan(block.figures["estimated"]).all()
        errors.append(np.abs(block.columns["a"] - exact).max() / rtol)
    assert max(errors) < 1e4
    assert min(errors) > 1e-3


@pytest.mark.parametrize(
    "how", [{"method": "DOP853", "rtol": 1e-9}, {"method": "RK4", "step": 0.01}]
)
def test_a_method_that_is_named_is_taken(how):
    plan, (row,) = plan_of("valley", {"until": 1.0, "samples": 11, **how}), rows_of("valley", 1)
    block, single = run_block(Task(plan, 0, (row,))), single_of(plan, row)
    assert block.words["method"] == [how["method"]]
    assert block.columns["x"][0].tobytes() == single.columns["x"].tobytes()


# What is not decided side by side.


@pytest.mark.slow
def test_accuracies_that_cannot_be_held_end_where_they_do():
    """Close to the separatrix the last place of the start is too much after some time."""
    text = """
parameters: {m: 1, l: 1, g: 9.81}
plane: xz
particles: {p: {mass: m, position: [l*sin(x), y, -l*cos(x)]}}
coordinates: [x]
potentials: {weight: {gravity: g}}
initial: {x: 0.5, dot(x): 0}
"""
    plan = plan_of(text, {"until": 60.0, "accuracy": 1e-9, "samples": 601})
    rows = [("1.0",), ("3.14159265358979323846264338327950288",)]
    block = run_block(Task(plan, 0, tuple(rows)))
    assert block.words["status"] == ["ok", "accuracy_not_reached"]
    assert block.words["method"][0] == "Taylor"
    single = single_of(plan, rows[1])
    assert single.status == "accuracy_not_reached"
    assert 0 < block.figures["holds_until"][1] < 60
    assert block.figures["holds_until"][1] == pytest.approx(single.holds_until, abs=4)
    assert block.words["reason"][1].startswith("accuracy 1e-09 holds until")
    kept = int(np.isfinite(block.columns["x"][1]).sum())
    angle = block.columns["x"][1, :kept]
    shared = min(kept, len(single.t))
    assert np.abs(angle[:shared] - single.columns["x"][:shared]).max() < 2e-9


@pytest.mark.slow
def test_chaos_ends_what_wider_arithmetic_was_asked_for():
    """The last place of a double decides after some time, whatever computes with it."""
    plan = plan_of("double_pendulum", {"until": 20.0, "accuracy": 1e-9, "samples": 201})
    row = tuple({"a": "2.5", "m2": "1", "dot(b)": "0"}[name] for name in plan.names)
    block, single = run_block(Task(plan, 0, (row,))), single_of(plan, row)
    assert block.words["method"] == ["Taylor"]
    assert block.words["status"] == ["accuracy_not_reached"]
    assert block.figures["holds_until"][0] <= single.holds_until
    assert block.words["reason"][0].startswith("accuracy 1e-09 holds until")
    assert 2 < block.figures["holds_until"][0] < 20
    assert block.figures["estimated"][0] < 1e-9
    kept = min(int(np.isfinite(block.columns["a"][0]).sum()), len(single.t))
    assert np.abs(block.columns["a"][0, :kept] - single.columns["a"][:kept]).max() < 2e-9


@pytest.mark.slow
def test_a_pulse_between_steps_is_seen_or_left_to_a_single_run():
    text = """
parameters: {m: 1, k: 1, s: 0.02}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
forces: {pulse: {on: x, force: exp(-((t - 7.03)/s)^2)}}
initial: {x: 1, dot(x): 0}
"""
    how = {"until": 10.0, "accuracy": 1e-8, "samples": 11}
    plan = plan_of(text, how)
    block, single = run_block(Task(plan, 0, (("1",),))), single_of(plan, ("1",))
    assert block.columns["x"][0] == pytest.approx(single.columns["x"], abs=2e-8)
    assert abs(block.columns["x"][0, -1] - math.cos(10)) > 1e-3  # the pulse has acted


@pytest.mark.parametrize(
    "force", ["tanh(x)", "abs(x)", "atan(x)", "max(x, 0)", "log(x + 9)", "x^(1/3)", "sign(x)"]
)
def test_what_has_no_series_is_run_one_by_one(force):
    text = f"""
parameters: {{m: 1}}
particles: {{p: {{mass: m, position: [x, 0, 0]}}}}
coordinates: [x]
forces: {{push: {{on: x, force: "-({force})"}}}}
initial: {{x: 1, dot(x): 0}}
"""
    plan = plan_of(text, {"until": 0.5, "accuracy": 1e-6, "samples": 3})
    assert plan.model.code.taylor == ""
    assert batched_results(plan.model, plan.options, ()) is None


def test_without_a_compiler_members_are_run_one_by_one(monkeypatch):
    def none():
        raise CompileError("no C compiler was found")

    monkeypatch.setattr(together, "find_compiler", none)
    plan, (row,) = plan_of("valley"), rows_of("valley", 1)
    block, single = run_block(Task(plan, 0, (row,))), single_of(plan, row)
    assert block.words["method"] == [single.method]
    assert block.columns["x"][0].tobytes() == single.columns["x"].tobytes()


def test_an_interrupt_ends_the_block(monkeypatch):
    plan, rows = plan_of("valley"), rows_of("valley", 3)

    def interrupted(*_):
        raise KeyboardInterrupt
        yield

    monkeypatch.setattr(together.BatchedMembers, "promised", interrupted)
    assert run_block(Task(plan, 0, tuple(rows))) is None


# The C.


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_the_c_is_clean_for_any_width(tmp_path, name):
    code = model_of(loads(f"name: {name}\n{SCENES[name]}").derive().equations).code
    files = {"series.c": code.taylor + code.tables, **kernels.batched_files()}
    wide = {"series.c": code.taylor, **kernels.batched_files()}
    for options, texts in (
        ((), files),
        (("-DLAGRANGE_DIM=4",), files),
        (kernels.options_of(EXTENDED), wide),
    ):
        for path, text in texts.items():
            (tmp_path / path).write_text(text)
        strict = ("-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-fsyntax-only")
        sources = [path for path in texts if path.endswith(".c")]
        command = [*find_compiler().command, *strict, *options, *sources]
        subprocess.run(command, cwd=tmp_path, check=True)


@pytest.mark.parametrize("distance", [1e-2, 1e-6])
def test_a_start_at_a_perihelion_is_resolved(distance):
    """Half a revolution later the comet is at its aphelion, at rest but for angular momentum."""
    options = SimulationOptions(**{**HOW, "until": math.pi, "accuracy": 1e-6})
    batched = batched_results(plan_of("kepler").model, options, ())
    speed = math.sqrt((2 - distance) / distance)
    (known,) = batched.run(np.array([[distance, 0, 0, speed]]), np.array([[1.0, 1.0]]))
    assert known.columns["x"][0, -1] == pytest.approx(distance - 2, abs=2e-6)
    assert known.columns["y"][0, -1] == pytest.approx(0, abs=2e-6)
    assert known.columns["dot(y)"][0, -1] == pytest.approx(
        -distance * speed / (2 - distance), abs=1e-6 * speed
    )
