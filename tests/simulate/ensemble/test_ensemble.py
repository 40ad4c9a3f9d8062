"""Ensembles: members are what single runs are, however they are divided, kept and put together."""

from __future__ import annotations

import dataclasses
import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lagrange_cli.errors import InputError
from lagrange_cli.scene import SceneText
from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
from lagrange_cli.simulate.ensemble.plan.enumeration import MOST_MEMBERS
from lagrange_cli.simulate.ensemble.plan.plan import Plan, Task
from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues, Recipe, require_known_names
from lagrange_cli.simulate.ensemble.plan.sources import grid, read_members
from lagrange_cli.simulate.ensemble.plan.variants import NumericMembers, differ_in_numbers
from lagrange_cli.simulate.ensemble.run import run as ensemble
from lagrange_cli.simulate.ensemble.run.run import REFUSED, run_block, run_members
from lagrange_cli.simulate.ensemble.store.opening import open_store
from lagrange_cli.simulate.ensemble.store.part_files import parts_of
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.parallel import in_any_order
from lagrange_cli.simulate.simulation import simulate
from tests.simulate.ensemble.listed_members import blocks_of_rows, tasks_of

#: Plans of one key are one plan.
KEYS = map(str, itertools.count())

SYSTEMS = Path(__file__).parents[3] / "systems"

PENDULUM = """
name: pendulum
parameters:
  m: 1
  l: {value: 2, positive: true}
  g: 9.81
  k: l/4
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
coordinates: [theta]
definitions: {x: l*sin(theta), z: -l*cos(theta)}
potentials: {weight: {gravity: g}, spring: k/2*theta^2}
initial: {theta: k, dot(theta): 0}
simulate: {until: 2, samples: 11, accuracy: 1e-8}
"""

#: The sign of z depends on where it is near to.
CIRCLE = """
name: circle
parameters: {m: 1, l: {value: 2, positive: true}, g: 9.81}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
constraints: {rod: x^2 + z^2 = l^2}
coordinates: [x]
potentials: {weight: {gravity: g}}
initial: {x: 0.1, dot(x): 0}
near: {z: -2}
"""

#: Ends at t = pi/2 for q = 0, dot(q) = 1: the coordinate is the tangent of the time.
BLOW_UP = """
name: blow_up
parameters: {a: 1}
particles: {p: {mass: 1, position: [x, 0, 0]}}
potentials: {v: -a*x^4/2 - x^2}
initial: {x: 0, dot(x): 1}
simulate: {until: 1, samples: 21, accuracy: 1e-6}
"""


def recipe(text, **more):
    return Recipe(SceneText("scene.yaml", text.encode()), **more)


def plan_of(text, names, first, **more):
    found = recipe(text)
    own = MemberValues.for_scene(dict(zip(names, first, strict=True)), found.scene())
    model = found.model(own)
    alone = differ_in_numbers(found, own, model)
    samples = model.defaults.samples
    return Plan(
        next(KEYS), found, tuple(names), own, model, alone, samples, SimulationOptions(), **more
    )


def blocks_of(plan, rows, jobs=1):
    found = in_any_order(run_block, tasks_of(plan, rows), jobs)
    return sorted(found, key=lambda block: block.number)


def joined(blocks, name):
    return np.concatenate([block.columns[name] for block in blocks])


# What members are.


def assert_is(block, k, single):
    """Member k of a block is what it is alone: the same bits, or side by side with others what
    both estimates allow."""
    assert block.words["status"][k] == single.status
    assert set(block.columns) == set(single.columns)
    side_by_side = block.words["method"][k] == "Taylor"
    assert side_by_side or block.figures["rhs_evaluations"][k] == single.rhs_evaluations
    allowed = block.figures["estimated"][k] + single.estimated
    for name, column in single.columns.items():
        found = block.columns[name][k]
        if not side_by_side:
            assert np.array_equal(found, column, equal_nan=True)
        elif name in single.scales:
            assert np.abs(found - column).max() <= allowed * single.scales[name]


@pytest.mark.slow
@pytest.mark.parametrize("names", [("m",), ("l",), ("theta", "dot(theta)"), ("l", "theta")])
def test_members_are_single_runs(names):
    values = {"m": ["1", "0.3"], "l": ["2", "0.7"], "theta": ["0.1", "pi/3"]}
    values["dot(theta)"] = ["-0.25", "1e-3"]
    rows = list(zip(*(values[name] for name in names), strict=True))
    plan = plan_of(PENDULUM, names, rows[0])
    assert plan.alone
    for block, row in zip(blocks_of(plan, rows), rows, strict=True):
        own = MemberValues.for_scene(dict(zip(names, row, strict=True)), plan.recipe.scene())
        assert_is(block, 0, simulate(plan.recipe.model(own)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "values", "alone", "together"),
    [
        ("celestial/arenstorf_orbit", {"mu": ("0.0121", "0.0123")}, True, True),
        ("contact/bouncing_ball", {"m": ("1.2", "1.1")}, False, False),
        ("oscillators/seismometer", {"m": ("2", "2.1"), "x": ("0", "0.001")}, True, False),
        ("pendulums/spherical_pendulum", {"theta": ("1", "1e-9"), "m": ("1", "2")}, True, False),
        ("pulleys/swinging_atwood", {"M": ("3", "3.1"), "r": ("1", "1.1")}, True, False),
        ("rolling/rolling_disk", {"m": ("2", "2.1")}, False, False),
    ],
)
def test_members_of_shipped_scenes_are_single_runs(scene, values, alone, together):
    path = SYSTEMS / f"{scene}.yaml"
    found = Recipe(SceneText(str(path), path.read_bytes()))
    first, own = (
        MemberValues.for_scene({name: both[k] for name, both in values.items()}, found.scene())
        for k in (0, 1)
    )
    model = found.model(first)
    assert differ_in_numbers(found, first, model) is alone
    how = {"until": model.defaults.start + 1.0, "accuracy": 1e-6, "samples": 11, "method": None}
    plan = Plan(next(KEYS), found, tuple(values), first, model, alone, 11, SimulationOptions(**how))
    block = run_block(Task(plan, 0, (tuple(both[1] for both in values.values()),)))
    member = found.model(own)
    single = simulate_past_singularities(
        member, plan.options, lambda: found.model(own, "multiplier")
    )
    assert single.status == "ok"
    assert (block.words["method"] == ["Taylor"]) is together
    assert_is(block, 0, single)


def test_what_rests_on_a_parameter_changes_with_it():
    plan = plan_of(PENDULUM, ["l"], ["2"])
    numbers = NumericMembers(plan.recipe, plan.member, plan.model)
    found = numbers.model_of(MemberValues({"l": "3"}))
    assert {p.name: p.value for p in found.parameters}["k"] == 0.75
    assert found.initial == (0.75, 0.0)
    assert found == plan.recipe.model(MemberValues({"l": "3"}))


@settings(max_examples=40, deadline=None)
@given(
    st.floats(1e-3, 1e3),
    st.floats(1e-3, 1e3),
    st.floats(-100, 100),
)
def test_models_of_numbers_are_those_of_the_scene(m, length, theta):
    if "numbers" not in NUMBERS:
        plan = plan_of(PENDULUM, ["m", "l", "theta"], ["1", "2", "0"])
        NUMBERS["numbers"] = NumericMembers(plan.recipe, plan.member, plan.model)
    own = MemberValues({"m": repr(m), "l": repr(length)}, {"theta": repr(theta)})
    found = NUMBERS["numbers"].model_of(own)
    values = {p.name: p.value for p in found.parameters}
    assert (values["m"], values["l"], values["k"]) == (m, length, length / 4)
    assert found.initial == (theta, 0.0)


#: Made once, at the first example.
NUMBERS: dict[str, NumericMembers] = {}


@pytest.mark.slow
@pytest.mark.parametrize("value", ["0", "-1"])
def test_another_sign_is_derived_anew(value):
    plan = plan_of(PENDULUM, ["g"], ["9.81"])
    numbers = NumericMembers(plan.recipe, plan.member, plan.model)
    assert numbers.model_of(MemberValues({"g": value})) is None
    (block,) = blocks_of(plan, [(value,)])
    alone = simulate(plan.recipe.model(MemberValues({"g": value})))
    assert block.columns["theta"][0].tobytes() == alone.columns["theta"].tobytes()


def test_values_that_choose_a_solution_are_derived_one_by_one():
    found = recipe(CIRCLE, formulation="minimal")
    own = MemberValues({}, {"x": "0.1"})
    model = found.model(own)
    assert model.coordinates == ("x",)
    assert not model.multipliers
    assert not differ_in_numbers(found, own, model)


@pytest.mark.slow
def test_a_start_in_other_names_is_derived_one_by_one():
    text = PENDULUM.replace("initial: {theta: k, dot(theta): 0}", "initial: {x: 1, z: -sqrt(3)}")
    found = recipe(text)
    own = MemberValues({"m": "1"})
    model = found.model(own)
    assert not differ_in_numbers(found, own, model)
    plan = Plan(
        next(KEYS), found, ("l",), MemberValues({"l": "2"}), model, False, 11, SimulationOptions()
    )
    blocks = blocks_of(plan, [("2",), ("3",)])
    assert blocks[0].words["status"] == ["ok"]
    assert blocks[0].columns["theta"][0, 0] == pytest.approx(math.pi / 6, abs=1e-15)
    assert blocks[1].words["status"] == [REFUSED]
    assert "'z' violates the constraints" in blocks[1].words["reason"][0]
    assert "theta" not in blocks[1].columns


# What becomes of them.


@pytest.mark.slow
def test_members_that_fail_are_listed_and_keep_what_holds():
    rows = [("1", "1"), ("200", "1"), ("1", "1e400*0 + 1e308*10")]
    plan = plan_of(BLOW_UP, ["a", "dot(x)"], rows[0])
    assert plan.alone
    blocks = blocks_of(plan, rows)
    assert [block.words["status"][0] for block in blocks] == ["ok", "blow_up", REFUSED]
    x, holds = blocks[1].columns["x"][0], blocks[1].figures["holds_until"][0]
    kept = np.isfinite(x)
    assert 2 <= kept.sum() < 21
    assert kept[: kept.sum()].all()
    assert holds == np.linspace(0, 1, 21)[kept.sum() - 1]
    assert blocks[2].words["reason"][0]


@pytest.mark.slow
def test_each_member_estimates_its_own_error():
    rows = [(repr(x),) for x in (0.01, 0.5, 3.0)]
    plan = plan_of(PENDULUM, ["theta"], rows[0])
    estimated = np.concatenate([b.figures["estimated"] for b in blocks_of(plan, rows)])
    assert len(set(estimated.tolist())) == 3
    assert (estimated < 1e-8).all()


def test_an_interrupted_block_is_not_finished(monkeypatch):
    plan = plan_of(PENDULUM, ["m"], ["1"])
    stopped = dataclasses.replace(simulate(plan.model), status="stopped")
    monkeypatch.setattr(ensemble, "batched_results", lambda *_: None)
    monkeypatch.setattr(ensemble, "simulate_past_singularities", lambda *_, **__: stopped)
    blocks = blocks_of_rows(plan, [("1",), ("2",)])
    store = open_store(None, blocks, resume=False)
    assert not run_members(blocks, store)
    assert store.finished == {}


# In which order, and what is kept.


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_do_not_depend_on_jobs(tmp_path, jobs):
    plan = plan_of(PENDULUM, ["theta"], ["0.1"])
    rows = [(repr(x),) for x in np.linspace(0.1, 3, 5).tolist()]
    blocks = blocks_of_rows(plan, rows)
    written = []
    for number in (1, jobs):
        output = str(tmp_path / f"{number}.npz")
        store = open_store(output, blocks, resume=False)
        assert run_members(blocks, store, jobs=number)
        store.complete(np.linspace(0, 2, 11))
        written.append((tmp_path / f"{number}.npz").read_bytes())
        assert not parts_of(output).exists()
    assert written[0] == written[1]


def test_joblib_serves_the_same_call():
    joblib = pytest.importorskip("joblib")
    plan = plan_of(PENDULUM, ["theta"], ["0.1"])
    rows = [("0.1",), ("0.2",), ("0.3",)]
    with joblib.parallel_config(backend="threading", n_jobs=2):
        blocks = blocks_of(plan, rows, jobs=None)
    expected = joined(blocks_of(plan, rows), "theta")
    assert joined(blocks, "theta").tobytes() == expected.tobytes()


def test_finished_blocks_are_not_run_again(tmp_path):
    plan = plan_of(PENDULUM, ["theta"], ["0.1"])
    blocks = blocks_of_rows(plan, [("0.1",), ("0.2",), ("0.3",)])
    output = str(tmp_path / "out.npz")
    store = open_store(output, blocks, resume=False)
    assert not run_members(blocks, store, budget=1e-9)
    assert sorted(store.finished) == [0]
    # What was cut off is no block.
    (parts_of(output) / "block-000000001.npz").write_bytes(b"PK\x03\x04 half")
    again = open_store(output, blocks, resume=True)
    assert sorted(again.finished) == [0]
    assert run_members(blocks, again)
    again.complete(np.linspace(0, 2, 11))
    with np.load(output) as found:
        assert found["theta"].shape == (3, 11)
        assert found["theta"][:, 0].tolist() == [0.1, 0.2, 0.3]
        assert found["given/theta"].tolist() == [0.1, 0.2, 0.3]


@pytest.mark.parametrize(
    ("key", "members", "resume", "said"),
    [
        ("key", 2, False, "interrupted"),
        ("other", 2, True, "another ensemble"),
        ("key", 3, True, "another ensemble"),
    ],
)
def test_blocks_of_something_else_are_refused(tmp_path, key, members, resume, said):
    plan = dataclasses.replace(plan_of(PENDULUM, ["theta"], ["0.1"]), key="key")
    rows = [(f"0.{k}",) for k in range(1, members + 1)]
    output = str(tmp_path / "out.npz")
    open_store(output, blocks_of_rows(plan, rows[:2]), resume=False)
    other = blocks_of_rows(dataclasses.replace(plan, key=key), rows)
    with pytest.raises(InputError, match=said):
        open_store(output, other, resume=resume)


def test_blocks_do_not_depend_on_where_they_are_run():
    plan = plan_of(PENDULUM, ["m"], ["1"])
    for members in (1, 15, 16, 100, 10_000):
        rows = [(str(k),) for k in range(members)]
        tasks = tasks_of(plan, rows)
        assert [row for task in tasks for row in task.rows] == rows
        assert max(len(task.rows) for task in tasks) <= 256
        assert len(tasks) >= min(members, 16)


# Ranges and files.


def test_ranges_make_grids_whose_last_varies_fastest():
    found = grid(["a=linspace(0, 1, 3)", "b=[2, pi/2]"])
    assert found.names == ("a", "b")
    assert [row[0] for row in found.rows()] == ["0.0", "0.0", "0.5", "0.5", "1.0", "1.0"]
    assert [row[1] for row in found.rows()] == ["2", "pi/2"] * 3


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("logspace(-1, 1, 3)", [0.1, 1, 10]),
        ("geomspace(0.5, 8, 5)", [0.5, 1, 2, 4, 8]),
        ("geomspace(-1, -4, 3)", [-1, -2, -4]),
        ("linspace(0, 2*pi, 5)", [0, math.pi / 2, math.pi, 1.5 * math.pi, 2 * math.pi]),
        ("linspace(5, 6, 1)", [5]),
    ],
)
def test_values_of_ranges(text, values):
    (found,) = zip(*grid([f"a={text}"]).rows(), strict=True)
    assert [float(x) for x in found] == pytest.approx(values, rel=1e-14)


@pytest.mark.parametrize(
    "text",
    [
        *("", "m", "m=", "=[1]", "m=1", "m=[]", "m=[1,]", "m=[1,,2]", "m=linspace(1,2)"),
        *("m=linspace(1,2,0)", "m=linspace(1,2,-3)", "m=linspace(1,2,2.5)", "m=[1)"),
        *("m=linspace(1,2,999999999)", "m=geomspace(0,1,3)", "m=geomspace(-1,1,3)"),
        *("m=logspace(0,400,3)", "m=linspace(q,2,3)", "m=eval(1,2,3)", "m=[1e999]"),
        *('m=[__import__("os")]', "m=linspace(1/0,2,3)", "m=" + "(" * 5000, "m=[\x1b[31m]"),
    ],
)
def test_what_is_no_range_is_refused_in_its_place(text):
    with pytest.raises(InputError) as refusal:
        grid([text])
    assert refusal.value.problems[0].mark.file == "--vary"


def test_too_many_members_are_refused_before_they_are_made():
    with pytest.raises(InputError, match=f"{MOST_MEMBERS:,}"):
        grid([f"{name}=linspace(0,1,1000)" for name in "abcd"])
    with pytest.raises(InputError, match="twice"):
        grid(["a=[1]", "a=[2]"])


def read(tmp_path, text, name="members.csv"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_members(str(path))


def test_files_of_both_kinds_say_the_same(tmp_path):
    csv = read(tmp_path, "\ufeffm, dot( theta ) ,theta\r\n1,-.5,pi/4\r\n\r\n2,1e-3,0\r\n")
    yaml = read(
        tmp_path,
        "- {m: 1, dot(theta): -.5, theta: pi/4}\n- {theta: 0, m: 2, dot(theta): 1e-3}\n",
        "members.yaml",
    )
    assert csv.names == yaml.names == ("m", "dot(theta)", "theta")
    assert [*csv.rows()] == [*yaml.rows()] == [("1", "-.5", "pi/4"), ("2", "1e-3", "0")]
    assert csv.mark(1, "theta").line == 4


@pytest.mark.parametrize(
    ("name", "text", "line"),
    [
        ("a.csv", "", 1),
        ("a.csv", "m\n", 1),
        ("a.csv", "m,m\n1,2\n", 1),
        ("a.csv", "m,\n1,2\n", 1),
        ("a.csv", "m\n1\n2,3\n", 3),
        ("a.csv", "m\n1\n1e999\n", 3),
        ("a.csv", "m,k\n1,\n", 2),
        ("a.csv", 'm\n"1\n', 2),
        ("a.csv", "m\n1 2\n", 2),
        ("a.csv", b"m\n\xff\n", 2),
        ("a.csv", b"m\n\0\n", 2),
        ("a.yaml", "", 1),
        ("a.yaml", "m: 1\n", 1),
        ("a.yaml", "- 1\n", 1),
        ("a.yaml", "- {m: 1}\n- {k: 1}\n", 2),
        ("a.yaml", "- {m: 1, k: 2}\n- {m: 1}\n", 2),
        ("a.yaml", "- {m: [1]}\n", 1),
        ("a.yaml", "- {m: !!python/object:os.system 1}\n", 1),
        ("a.yaml", "- {m: 1", 2),
        ("a.txt", "m\n1\n", 1),
    ],
)
def test_what_is_wrong_in_a_file_is_reported_at_its_line(tmp_path, name, text, line):
    with pytest.raises(InputError) as refusal:
        read(tmp_path, text, name)
    mark = refusal.value.problems[0].mark
    assert (mark.file.endswith(name), mark.line) == (True, line)


@pytest.mark.parametrize("text", ["nan", "inf", "theta", "2*q", "t"])
def test_names_in_values_are_those_of_parameters(tmp_path, text):
    scene = recipe(PENDULUM).scene()
    members = read(tmp_path, f"l,m\n1,2*k\n1,{text}\n")
    with pytest.raises(InputError) as refusal:
        require_known_names(members, scene)
    assert refusal.value.problems[0].mark.line == 3


def test_files_that_are_none_are_refused(tmp_path):
    (tmp_path / "folder.csv").mkdir()
    for name in ("folder.csv", "none.csv"):
        with pytest.raises(InputError):
            read_members(str(tmp_path / name))
