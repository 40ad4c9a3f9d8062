"""Members with recorded inputs: all of them are of the file that the run began with."""

from __future__ import annotations

import math

import pytest

from lagrange_cli import InputError, load

SCENE = """
name: driven
parameters: {m: 1, k: 4}
particles: {mass: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
inputs: {F: {file: f.csv, column: F, interpolation: linear}}
forces: {drive: {on: mass, force: [F, 0, 0]}}
initial: {x: 1, dot(x): 0}
simulate: {until: 5, samples: 6, accuracy: 1e-8}
"""

MEMBERS = {"k": [float(k) for k in range(1, 41)]}


def record(folder, size):
    rows = [f"{t / 10},{size * math.sin(t / 10)}" for t in range(61)]
    (folder / "f.csv").write_text("\n".join(["t,F", *rows]) + "\n")


@pytest.fixture
def scene(tmp_path, monkeypatch):
    (tmp_path / "scene.yaml").write_text(SCENE)
    record(tmp_path, 1.0)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "scene.yaml"


def interrupt(part):
    raise KeyboardInterrupt


@pytest.mark.slow
def test_a_run_does_not_go_on_with_another_recording(scene):
    derivation = load("scene.yaml").derive()
    with pytest.raises(KeyboardInterrupt):
        derivation.ensemble(MEMBERS, store="out.npz", progress=interrupt)
    record(scene.parent, 5.0)
    with pytest.raises(InputError, match="is of another ensemble"):
        load("scene.yaml").derive().ensemble(MEMBERS, store="out.npz", resume=True)
