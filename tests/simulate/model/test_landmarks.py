"""Smooth forces narrower than a step, against what they do in closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lagrange_cli import load, loads
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.accuracy.method_selection import coarse_result
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.expressions import calls_and_powers
from lagrange_cli.simulate.model.inputs import substitute_inputs
from lagrange_cli.simulate.model.sharp_functions import peak_exponents
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.request import resolve
from lagrange_cli.simulate.simulation import problem_of
from lagrange_cli.simulate.system.functions import interpreted
from tests.simulate.compiling import compiled_or_skip

SCENE = """
parameters: {{w: {width}, c: 0.537, A: 0.1}}
particles: {{b: {{mass: 1, position: [x, 0, 0]}}}}
coordinates: [x]
forces: {{f: {{on: x, force: "A/w*{force}"}}}}
initial: {{x: 0, dot(x): 1}}
simulate: {{until: 1, accuracy: 1e-6, samples: 11}}
"""

#: Forces of s = (x − c)/w, and their work over A from a to b, both in widths.
FORCES = {
    "exp(-((x - c)/w)^2)": lambda a, b: math.sqrt(math.pi) / 2 * (math.erf(b) - math.erf(a)),
    "1/(1 + ((x - c)/w)^2)": lambda a, b: math.atan(b) - math.atan(a),
    "1/cosh((x - c)/w)^2": lambda a, b: math.tanh(b) - math.tanh(a),
    "(tanh(20*((x - c)/w + 1)) - tanh(20*((x - c)/w - 1)))/2": lambda a, b: 2.0,
}


@pytest.mark.slow
@pytest.mark.parametrize("width", [1e-3, 1e-5, 1e-7, 1e-9])
@pytest.mark.parametrize("force", FORCES)
def test_a_narrow_force_of_position_is_resolved(force: str, width: float) -> None:
    model = model_of(loads(SCENE.format(width=width, force=force)).derive().equations)
    found = simulate(model, functions=compiled_or_skip(model))
    assert found.status == "ok", found.reason
    a, b = -0.537 / width, (found.state["x"] - 0.537) / width
    speed = math.sqrt(1 + 2 * 0.1 * FORCES[force](a, b))
    assert abs(found.state["dot(x)"] - speed) <= min(1e-6, found.estimated) * speed
    # Nothing like a step for each width.
    assert found.steps < 300


@pytest.mark.parametrize("width", [1e-4, 3e-5, 1e-8])
def test_a_narrow_force_of_time_is_resolved(width: float) -> None:
    scene = SCENE.format(width=width, force="exp(-((t - c)/w)^2)")
    model = model_of(loads(scene).derive().equations)
    found = simulate(model, functions=compiled_or_skip(model))
    assert found.status == "ok", found.reason
    speed = 1 + 0.1 * math.sqrt(math.pi)
    assert abs(found.state["dot(x)"] - speed) <= min(1e-6, found.estimated) * speed


def test_a_narrow_force_beside_a_kink_is_resolved() -> None:
    scene = SCENE.format(width=1e-6, force="exp(-((x - c)/w)^2)")
    scene = scene.replace("initial", 'potentials: {v: "50*max(0, x - 0.8)^2"}\ninitial')
    model = replace(model_of(loads(scene).derive().equations), conserved=())
    found = simulate(model, functions=compiled_or_skip(model))
    assert found.status == "ok", found.reason
    speed = math.sqrt(1 + 0.2 * math.sqrt(math.pi))
    before = int(np.searchsorted(found.t, 0.65))
    assert found.columns["dot(x)"][before] == pytest.approx(speed, abs=1e-6)


@pytest.mark.slow
def test_what_steps_resolve_anyway_is_not_watched() -> None:
    """Orbits and lattices hold powers and exponentials, too: their runs do without."""
    for path in ("celestial/kepler", "celestial/pleiades", "chains/toda_ring"):
        model = model_of(load(f"systems/{path}.yaml").derive().equations)
        assert model.landmarks
        functions = compiled_or_skip(model)
        request = resolve(model, SimulationOptions())
        with np.errstate(all="ignore"):
            assert not coarse_result(problem_of(model, request, functions), 1e-10, Watch()).sharp


def test_exponents_are_those_of_sharp_functions_that_move() -> None:
    text = SCENE.format(width=0.1, force="exp(-((t - c)/w)^2)/(1 + x^2)*exp(w)*cos(x)^40")
    equations = substitute_inputs(loads(text).derive().equations)
    t, x = equations.system.t, equations.system.coordinates[0].q
    found = peak_exponents(equations, calls_and_powers(equations))
    assert {frozenset(e.free_symbols & {t, x}) for e in found} == {frozenset({t}), frozenset({x})}
    at = {s: 0.3 for e in found for s in e.free_symbols}
    values = sorted(float(e.subs(at)) for e in found)
    powers = [-math.log(1.09), 40 * math.log(math.cos(0.3))]
    assert all(any(math.isclose(v, p) for v in values) for p in powers)


@pytest.mark.slow
def test_where_nothing_watches_a_remark_tells_it() -> None:
    sharp = SCENE.format(width=1e-5, force="exp(-((t - c)/w)^2)")
    smooth = SCENE.format(width=1.0, force="exp(-((t - c)/w)^2)")
    for text, told in ((sharp, True), (smooth, False)):
        model = model_of(loads(text).derive().equations)
        found = simulate(model, functions=interpreted(model, "as the test asks"))
        assert any("less than a step" in remark for remark in found.remarks) is told
        watched = simulate(model, functions=compiled_or_skip(model))
        assert not watched.remarks


@pytest.mark.slow
def test_beside_contacts_a_remark_tells_it() -> None:
    text = SCENE.format(width=1e-5, force="exp(-((t - c)/w)^2)")
    text = text.replace("initial", "constraints: {wall: x <= 5}\ninitial")
    model = model_of(loads(text).derive().equations)
    found = simulate(model, functions=compiled_or_skip(model))
    assert any("beside contacts" in remark for remark in found.remarks)
