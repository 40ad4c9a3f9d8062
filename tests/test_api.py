"""The Python interface gives what the commands give."""

from __future__ import annotations

import doctest
import json
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from unittest.mock import Mock

import numpy as np
import pytest
from click.testing import CliRunner

import lagrange_cli
from lagrange_cli import InputError, api, load, loads
from lagrange_cli.api.analyzed import matrices_of
from lagrange_cli.api.remembered import SceneSource
from lagrange_cli.api.remembered_scene import RememberedScene
from lagrange_cli.api.workspace import Workspace
from lagrange_cli.cli.main import lagrange
from lagrange_cli.cli.session import Session

ROOT = Path(__file__).resolve().parents[1]
HOLE = ROOT / "systems" / "lecture" / "masses_through_hole.yaml"


@pytest.fixture(scope="module")
def derivation():
    return load(HOLE).derive()


def output_of(*words: str) -> str:
    done = CliRunner().invoke(lagrange, [str(word) for word in words], obj=Session())
    assert done.exit_code == 0, done.output
    return done.stdout


def test_report_is_that_of_the_command(derivation):
    ours = json.loads(json.dumps(derivation.report()))
    assert ours == json.loads(output_of("derive", HOLE, "--json"))


def test_str_is_that_of_the_command(derivation):
    assert str(derivation) == output_of("derive", HOLE)


def test_emission_is_that_of_the_command(derivation):
    assert derivation.emit("latex") == {
        "masses_through_hole.tex": output_of("emit", HOLE, "--to", "latex")
    }


def test_simulation_is_that_of_the_command(derivation):
    ours = derivation.simulate(until=1.0, accuracy=1e-9)
    theirs = json.loads(output_of("simulate", HOLE, "--until", "1", "--accuracy", "1e-9", "--json"))
    assert ours.state == theirs["state"]
    assert ours.status == theirs["status"] == "ok"


def test_parameters_and_initial_values_replace_those_of_the_scene():
    changed = load(HOLE, parameters={"M": 3}, initial={"dot(theta)": "2*pi"}).derive().equations
    assert {p.name: p.value for p in changed.system.parameters}["M"] == 3.0
    assert changed.system.initial.velocities[1] == pytest.approx(6.283185307179586, rel=1e-15)


def test_an_end_over_parameters_follows_them():
    text = """
    parameters: {m: 1.0, k: 4.0}
    particles: {bob: {mass: m, position: [x, 0, 0]}}
    coordinates: [x]
    potentials: {spring: k*x^2/2}
    initial: {x: 1}
    simulate: {until: 2*pi/sqrt(k)}
    """
    derivation = loads(text).derive()
    for k in (4, 16, 1, "2 + 7"):
        run = derivation.simulate(parameters={"k": k})
        assert run.t[-1] == loads(text, parameters={"k": k}).derive().simulate().t[-1]
        assert run.state["x"] == pytest.approx(1.0)


@pytest.mark.slow
def test_sizes_replace_those_of_the_scene_and_its_equations():
    ring = ROOT / "systems" / "chains" / "oscillator_ring.yaml"
    derivation = load(ring).derive()
    for n in (4, 5, 6):
        ours = derivation.simulate(parameters={"n": n}, until=1.0)
        alone = load(ring, parameters={"n": n}).derive().simulate(until=1.0)
        assert ours.state == alone.state
        assert f"x[{n}]" in ours.state
        assert f"x[{n + 1}]" not in ours.state


def test_further_simulations_build_and_compile_nothing(derivation, monkeypatch):
    first = derivation.simulate(until=1.0)
    refuse = Mock(side_effect=AssertionError)
    monkeypatch.setattr("lagrange_cli.simulate.model.build.model_of", refuse)
    monkeypatch.setattr("lagrange_cli.simulate.system.functions.Libraries", refuse)
    assert (derivation.simulate(until=1.0).energy == first.energy).all()


def test_values_of_a_simulation_are_those_of_a_scene_with_them():
    path, values = ROOT / "systems" / "pendulums/double_pendulum.yaml", {"m1": 2.0, "l2": "1/2"}
    derivation = load(path).derive()
    for changed in (values, {**values, "m1": 3}, values):
        ours = derivation.simulate(parameters=changed, initial={"theta1": 1}, until=1.0)
        alone = load(path, parameters=changed, initial={"theta1": 1}).derive().simulate(until=1.0)
        assert ours.state == alone.state


def test_values_may_change_the_equations():
    path = ROOT / "systems" / "pendulums/double_pendulum.yaml"
    derivation = load(path).derive()
    for g in (1, 0):  # of another sign
        alone = load(path, parameters={"g": g}).derive().simulate(until=1.0)
        assert derivation.simulate(parameters={"g": g}, until=1.0).state == alone.state


def test_a_trajectory_shows_itself_in_a_line(derivation):
    trajectory = derivation.simulate(until=1.0)
    assert repr(trajectory) == (
        "<Trajectory of masses_through_hole: 501 samples, t = 0 to 1, ok,"
        f" error {trajectory.estimated:.1g}>"
    )


def test_notebook_shows_the_equations_typeset(derivation):
    shown = derivation._repr_latex_()
    assert shown.startswith(r"\subsection*{")
    equations = shown.partition(r"\paragraph{Equations of motion}")[2]
    assert r"(M + m) \ddot{r}" in equations


def test_text_of_a_scene():
    text = HOLE.read_text(encoding="utf-8")
    assert loads(text).derive().equations.derivation.account.dof == 2


def test_values_are_frozen(derivation):
    with pytest.raises(AttributeError):
        derivation.equations = None
    assert repr(derivation) == "<Derivation of masses_through_hole>"


def test_errors_are_those_of_the_command():
    with pytest.raises(InputError, match="no such file"):
        load("nowhere.yaml")
    with pytest.raises(InputError, match="unknown format 'fortram'"):
        load(HOLE).derive().emit("fortram")


def test_every_exported_name_is_there():
    assert all(hasattr(lagrange_cli, name) for name in lagrange_cli.__all__)


def test_formulation_of_the_scene():
    text = HOLE.read_text(encoding="utf-8")
    chosen = text.replace("simulate: {", "simulate: {formulation: multiplier, ")
    assert chosen != text
    scene = loads(chosen, times={"until": "1 + 1"})
    assert scene.derive(formulation=None).equations.system.formulation == "multiplier"
    assert scene.derive().equations.system.formulation == "minimal"
    assert scene.derive().model().defaults.until == 2.0


class Noting(Workspace):
    """A workspace that notes the details it is told."""

    details: list[str]

    def detail(self, text: str) -> None:
        self.details.append(text)


@pytest.mark.usefixtures("cache_folder")
def test_a_remembered_scene_derives_a_model_once():
    workspace = Noting()
    workspace.details = []
    text = b"parameters: {m: 1}\nparticles: {ball: {mass: m, position: [x, 0, 0]}}\n"
    source = SceneSource("ball.yaml", text)
    scene = RememberedScene(workspace, source, {"m": "2"})
    first, second = scene.model(), scene.model()
    assert first == second
    assert [text.split()[0] for text in workspace.details] == ["derived", "from"]
    assert RememberedScene(workspace, source, {"m": "3"}).model() != first


def test_names_of_the_interface_are_there():
    assert all(hasattr(api, name) for name in api.__all__)
    assert set(api.__all__) <= set(dir(api))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = api.nothing


def test_matrices_and_written_forms_are_those_of_the_command(tmp_path):
    pendulum = ROOT / "systems/pendulums/pendulum.yaml"
    ours, theirs = tmp_path / "ours.npz", tmp_path / "theirs.npz"
    analysis = load(pendulum).derive().analyze("linearization")
    analysis.write_matrices(ours)
    shown = output_of("analyze", pendulum, "--linearization", "-o", theirs)
    assert analysis.written("text").text() == shown
    known, wanted = np.load(ours), np.load(theirs)
    assert sorted(known) == sorted(wanted)
    assert all((known[name] == wanted[name]).all() for name in wanted)
    with pytest.raises(InputError, match="no linear system"):
        matrices_of({"linearization": None, "left_out": [{"reason": "none"}]})


@pytest.mark.slow
@pytest.mark.usefixtures("frozen_garbage")
def test_the_examples_in_docstrings_hold(monkeypatch):
    monkeypatch.chdir(ROOT)
    names = {"load": load, "loads": loads}
    modules = [import_module(f"{api.__name__}.{m.name}") for m in iter_modules(api.__path__)]
    results = [doctest.testmod(module, extraglobs=names) for module in modules]
    assert sum(r.failed for r in results) == 0
    assert sum(r.attempted for r in results) >= 10
