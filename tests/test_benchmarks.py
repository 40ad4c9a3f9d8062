"""The benchmarks run, and what they time is right."""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import math
import os
import runpy
import shutil
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("frozen_garbage")]

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


def _needs_compiler() -> None:
    if shutil.which("cc") is None:
        message = "no C compiler is installed"
        if os.environ.get("CI") == "true":
            pytest.fail(message)
        pytest.skip(message)


def run_benchmark(name: str, *words: str | Path) -> str:
    """Run a benchmark as its own program, in this process; return what it prints."""
    path, printed = str(BENCHMARKS / f"{name}.py"), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(printed):
        patch.syspath_prepend(BENCHMARKS)
        patch.setattr(sys, "argv", [path, *map(str, words)])
        code: object = 0
        try:
            runpy.run_path(path, run_name="__main__")
        except SystemExit as ended:
            code = ended.code
    assert not code
    return printed.getvalue()


def run_main(module: ModuleType, *words: str | Path) -> str:
    """Run the main function of a benchmark whose module was changed; return what it prints."""
    printed = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(printed):
        patch.setattr(sys, "argv", [str(module.__file__), *map(str, words)])
        assert module.main() == 0
    return printed.getvalue()


@pytest.fixture
def integration(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The module of the benchmark of that name, with an eighth of its tolerances."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    module = importlib.import_module("integration")
    every = module.powers
    monkeypatch.setattr(module, "powers", lambda first, last, part: every(first, last, 8 * part))
    return module


def test_derivation_compares_every_method_with_the_closed_form(tmp_path: Path) -> None:
    output = tmp_path / "derivation.json"
    sizes = ["--sizes", "2", "3", "--largest-sympy", "2", "--repetitions", "1"]
    printed = run_benchmark("derivation", *sizes, "--json", output)
    rows = json.loads(output.read_text())["rows"]
    taking_part = {(row["n"], row["method"]) for row in rows}
    assert {(2, "SymPy LagrangesMethod"), (3, "lagrange, certified")} <= taking_part
    assert (3, "SymPy LagrangesMethod") not in taking_part
    assert all(row["mismatch"] < 1e-12 for row in rows)
    assert printed.count("\n| 2 |") == 1


@pytest.mark.parametrize(
    "commands",
    [
        ("emit --to c",),
        pytest.param(("derive", "emit --to c", "simulate"), marks=pytest.mark.campaign),
    ],
)
def test_startup_compares_whole_commands_cold_and_warm(
    commands: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    startup = importlib.import_module("startup")
    assert {*commands} <= {*startup.COMMANDS}
    chosen = {name: startup.COMMANDS[name] for name in commands}
    monkeypatch.setattr(startup, "COMMANDS", chosen)
    output = tmp_path / "startup.json"
    words = ["--repetitions", "1", "--json", output, "--mechanicsdsl", ""]
    printed = run_main(startup, *words)
    rows = json.loads(output.read_text())["rows"]
    taking_part = {(row["program"], row["cache"]) for row in rows}
    assert {(f"lagrange {c}", cache) for c in commands for cache in ("cold", "warm")} < taking_part
    assert all(row["same_output"] for row in rows)
    (reference,) = [row for row in rows if row["program"] == "import numpy"]
    assert reference["ratio"] == 1
    assert all(row["processor_seconds"] > 0 for row in rows)
    assert printed.count("\n| `") == len(rows)


@pytest.mark.compiler
def test_right_hand_sides_agree_with_the_closed_form(tmp_path: Path) -> None:
    _needs_compiler()
    output = tmp_path / "right_hand_side.json"
    run_benchmark("right_hand_side", "--quick", "--json", output)
    found = json.loads(output.read_text())
    taking_part = {(row["n"], row["method"]) for row in found["rows"]}
    assert {(2, "lagrange, C"), (2, "written by hand, C"), (4, "lagrange, C")} <= taking_part
    assert (4, "NumPy, lambdify and solve") in taking_part
    assert all(row["mismatch"] < 1e-12 for row in found["rows"])
    assert "-O2" in found["about"]["options"]


@pytest.mark.compiler
def test_integration_measures_errors_against_a_reference(
    integration: ModuleType, tmp_path: Path
) -> None:
    _needs_compiler()
    output = tmp_path / "integration.json"
    words = ["--turns", "1", "--until", "2", "--samples", "21", "--json", output]
    printed = run_main(integration, *words)
    found = json.loads(output.read_text())
    assert found["reference_error"] < 1e-25
    errors: dict[str, list[float]] = {}
    for row in found["rows"]:
        errors.setdefault(row["solver"], []).append(row["error"])
        # A solver of order 8 or more that is told rtol makes an error of that order.
        assert row["error"] < 1e4 * row["rtol"]
    methods = ["lagrange, Gauss16", "lagrange, DOP853"]
    peers = ["SciPy DOP853 over lambdify", "SciPy LSODA over lambdify"]
    assert list(errors)[:4] == [*methods, *peers]
    assert all(min(own) < 1e-4 * own[0] for own in errors.values())
    assert min(errors[methods[0]]) < 1e-12
    of = {(entry["solver"], entry["error"]): entry for entry in found["summary"]}
    assert set(of) == {(solver, error) for solver in errors for error in (1e-6, 1e-9, 1e-12)}
    for (solver, error), entry in of.items():
        assert "seconds" not in entry or (entry["reached"] and min(errors[solver]) <= error)
    assert of[methods[0], 1e-9]["ratio"]["median"] == of[methods[0], 1e-9]["fastest_ratio"] == 1
    assert "ratio" in of[peers[0], 1e-9]
    assert printed.count("\n| lagrange, Gauss16 |") == 2


@pytest.mark.compiler
def test_ensembles_keep_their_accuracy(tmp_path: Path) -> None:
    _needs_compiler()
    output = tmp_path / "ensemble.json"
    words = ["--members", "2", "--turns", "1", "--jobs", "1", "--json", output]
    printed = run_benchmark("ensemble", *words)
    promised, *others = json.loads(output.read_text())["rows"]
    assert promised["error"] < 1e-9
    assert all(row["error"] < 1e-6 for row in others)
    assert printed.count("\n| lagrange, ") == 3


def test_times_at_an_error_lie_between_runs_that_enclose_it(integration: ModuleType) -> None:
    errors = integration.falling([1e-2, 1e-5, 1e-3, 1e-6, 1e-6])
    assert errors == pytest.approx([1e-2, 1e-4, 1e-4, 1e-6, 1e-6])
    points = list(zip(errors, [1.0, 2.0, 3.0, 12.0, 50.0], strict=True))
    assert integration.seconds_at(points, 1e-3) == pytest.approx(math.sqrt(2))
    assert integration.seconds_at(points, 1e-5) == pytest.approx(6)
    assert integration.seconds_at(points, 1.0001e-6) == pytest.approx(12, rel=1e-3)
    assert integration.seconds_at(points, 1.1e-2) is None
    assert integration.seconds_at(points, 0.9e-6) is None


@pytest.mark.compiler
def test_runs_of_the_integration_are_cut(
    integration: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    _needs_compiler()
    times = np.linspace(0, 2, 11)
    exact = np.array(integration.reference(times, (1.5, 2.0)), dtype=float)
    monkeypatch.setattr(integration, "MOST_EVALUATIONS", 60)
    candidates = integration.solvers(times, (1.5, 2.0))
    rows = integration.measure(candidates, exact, 1)
    strict = [row for row in rows if row["rtol"] < 2e-13]
    assert {row["solver"] for row in strict} == {solver.name for solver in candidates}
    assert all(row["error"] is None and not row["seconds"] for row in strict)
    entries = integration.summarized(rows)
    assert not any(entry["reached"] for entry in entries)
    assert "| not reached |" in integration.table(entries, integration.milliseconds)


@pytest.mark.compiler
def test_right_hand_sides_of_chains_agree_with_newtons_law(tmp_path: Path) -> None:
    _needs_compiler()
    output = tmp_path / "chains.json"
    sizes = ["--sizes", "4", "12", "--count", "40", "80", "120"]
    printed = run_benchmark("chains", *sizes, "--repetitions", "1", "--json", output)
    rows = json.loads(output.read_text())["rows"]
    assert {(4, "lagrange, C"), (12, "lagrange, C")} <= {(row["n"], row["method"]) for row in rows}
    assert all(row["mismatch"] < 1e-12 for row in rows)
    ours = [row for row in rows if row["method"] == "lagrange, C"]
    assert set(ours[0]["seconds_to_make"]) == {"read", "derive", "emit", "compile"}
    assert printed.count("\n| 12 |") == 1
    counts = [
        int(line.split("|")[2])
        for n in (40, 80, 120)
        for line in printed.splitlines()
        if line.startswith(f"| {n} |")
    ]
    assert counts[2] - counts[1] == counts[1] - counts[0]  # linear in the number of links


@pytest.mark.compiler
def test_hard_motions_are_right() -> None:
    _needs_compiler()
    printed = run_benchmark("hard_motions", "e = 0.99, orbits: 1", "top")
    cells = [line.split(" | ") for line in printed.splitlines()[3:]]
    assert [row[0].removeprefix("| ").split(",")[0] for row in cells] == [
        *("Kepler", "Kepler", "pendulum 1e-9 from the top")
    ]
    assert all(float(row[3]) <= float(row[2]) < 1e-9 for row in cells)
    assert "compiled C, " in cells[-1][-1]


def test_long_runs_are_compared_with_elliptic_functions(tmp_path: Path) -> None:
    _needs_compiler()
    output, page = tmp_path / "long_run.json", tmp_path / "page.md"
    words = ["--periods", "60", "--samples", "21", "--steps", "40", "80"]
    run_benchmark("long_run", *words, "--json", output, "--docs", page)
    rows = json.loads(output.read_text())
    last = {row["steps_a_period"]: row for row in rows if row["periods"] == 60}
    assert 0 < last[40]["phase"] <= last[40]["estimate"] < 1e-4
    # Order six: half the step, a 64th of the error.
    assert 50 < last[40]["phase"] / last[80]["phase"] < 80
    assert last[40]["drift"] < 1e-8
    assert page.read_text().count("\n| Gauss6 |") == len(rows)


def test_a_tumbling_body_keeps_its_energy_and_its_length(tmp_path: Path) -> None:
    _needs_compiler()
    output = tmp_path / "tumbling.json"
    run_benchmark("tumbling", "--turns", "300", "--samples", "21", "--json", output)
    last = json.loads(output.read_text())[-1]
    assert last["turns"] == 300
    assert last["energy"] < 3e-13
    assert last["length"] < 1e-15
    assert last["momentum"] < 3e-13
    assert last["spin"] < 1e-9


@pytest.mark.slow
@pytest.mark.compiler
def test_the_cost_of_the_promise_is_that_of_every_scene(tmp_path: Path) -> None:
    _needs_compiler()
    output = tmp_path / "promise.json"
    scene = BENCHMARKS.parent / "systems" / "pendulums" / "pendulum.yaml"
    run_benchmark("promise", scene, "--repeat", "2", "--json", output)
    rows = json.loads(output.read_text())
    assert [row["accuracy"] for row in rows] == [1e-3, 1e-6, 1e-9]
    assert all(0 < row["run"] < row["whole"] and row["status"] == "ok" for row in rows)
    assert all(row["estimate"] < row["accuracy"] for row in rows)


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize(
    "scene",
    [
        "celestial/kepler",
        pytest.param("constraints/four_bar_linkage", marks=pytest.mark.campaign),
    ],
)
def test_peers_of_the_promise_have_no_larger_error(scene: str) -> None:
    _needs_compiler()
    printed = run_benchmark("promise_peers", "--turns", "1", "--scenes", scene)
    rows = [line.strip("| ").split(" | ") for line in printed.splitlines()[2:]]
    assert [row[:2] for row in rows] == [[scene.split("/")[1], eps] for eps in ("1e-06", "1e-09")]
    for _, eps, error, _, _, theirs, _ in rows:
        # Below this the rounding of NumPy's solver decides, which differs between processors.
        assert float(theirs) <= max(float(error), 1e-10)
        assert float(error) < float(eps)


@pytest.mark.slow
@pytest.mark.compiler
def test_errors_fall_with_tolerances() -> None:
    _needs_compiler()
    scenes = [
        BENCHMARKS.parent / "systems" / f"{name}.yaml"
        for name in ("celestial/kepler", "pendulums/pendulum")
    ]
    printed = run_benchmark("tolerances", *scenes, "--repeat", "1")
    rows = [line.strip("| ").split(" | ") for line in printed.splitlines()]
    ratios = {(row[0], row[1]): float(row[2]) for row in rows if row[0] in ("DOP853", "Gauss16")}
    assert all(1e-6 < ratio < 1e4 for ratio in ratios.values())
    assert {("DOP853", "1e-03"), ("DOP853", "1e-12"), ("Gauss16", "1e-03")} <= ratios.keys()


@pytest.mark.slow
@pytest.mark.compiler
def test_derivatives_take_fewer_right_hand_sides_than_differences() -> None:
    _needs_compiler()
    scene = BENCHMARKS.parent / "systems" / "pendulums" / "triple_pendulum.yaml"
    printed = run_benchmark("jacobians", scene, "--rounds", "9")
    name, n, _, _, ratio, _ = printed.splitlines()[2].strip("| ").split(" | ")
    assert (name, n) == ("triple_pendulum", "3")
    assert 1 < float(ratio) < 2 * 3 + 1


def test_random_scenes_with_states() -> None:
    _needs_compiler()
    words = ("--scenes", "3", "--promise", "3", "--in-languages", "0", "--seed", "500")
    printed = run_benchmark("states", *words)
    assert "| rhs | 9 |" in printed
    assert "Beyond the promise, with status ok: 0." in printed
    assert "Wrong: 0." in printed
