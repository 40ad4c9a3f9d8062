"""simulate() where digits are lost, where nothing accelerates, and where motions are stiff."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.system.functions import interpreted
from tests.simulate.compiling import compiled_or_skip


def equations(scene):
    return loads(scene).derive().equations


def double_pendulum(ratio):
    return equations(
        scene=f"""
name: double
parameters: {{m1: 1.0, m2: {ratio}, g: 9.81}}
particles: {{a: {{mass: m1, position: [x1, y1, z1]}}, b: {{mass: m2, position: [x2, y2, z2]}}}}
plane: xz
coordinates: [p, q]
definitions: {{x1: sin(p), z1: -cos(p), x2: x1 + sin(q), z2: z1 - cos(q)}}
potentials: {{weight: {{gravity: g}}}}
initial: {{p: 0.5, q: 0.2, dot(p): 0, dot(q): 0}}
"""
    )


def well_conditioned(ratio):
    """The same pendulum written without differences of near numbers."""

    def rhs(t, y):
        p, q, u, v = y.tolist()
        g, s, c = 9.81, math.sin(p - q), math.cos(p - q)
        f1 = -ratio * v * v * s - (1 + ratio) * g * math.sin(p)
        f2 = u * u * s - g * math.sin(q)
        d = 1 + ratio * s * s
        return np.array([u, v, (f1 - ratio * c * f2) / d, ((1 + ratio) * f2 - c * f1) / d])

    return rhs


@pytest.mark.slow
@pytest.mark.parametrize("ratio", ["1e-9", "1e-3", "1e3", "1e6"])
def test_mass_ratios_are_right_or_refused(ratio):
    from lagrange_cli.simulate.accuracy.controller import integrate_to_accuracy
    from lagrange_cli.simulate.checkpoint.progress import Watch
    from lagrange_cli.simulate.runs.problem import InitialValueProblem

    until = 1.0 if float(ratio) < 1e4 else 0.1
    found = simulate(double_pendulum(ratio), until=until, accuracy=1e-6, samples=31)
    rhs = well_conditioned(float(ratio))
    of = InitialValueProblem(
        rhs, np.array([0.5, 0.2, 0, 0]), np.linspace(0, until, 31), ("angle",) * 2, (rhs, rhs)
    )
    reference = integrate_to_accuracy(of, 1e-9, Watch())
    assert len(reference.states) == 31
    for i, name in enumerate(["p", "q", "dot(p)", "dot(q)"]):
        apart = np.abs(found.columns[name] - reference.states[: len(found.t), i])
        assert apart.max() / found.scales[name] < 1.01e-6
    assert found.status == "ok" or found.exit_code == 1


def test_lost_digits_show_in_the_estimate():
    """m1 + m2 sin² taken as a difference loses digits; the estimate must know."""

    def rhs(t, y):
        p, v = y.tolist()
        big = 1e8
        return np.array([v, -((big + p) - big)])

    def off(t, y):
        p, v = y.tolist()
        big = 1e8
        return np.array([v, -((big + p) * (1 + 2**-52) - big)])

    from lagrange_cli.simulate.accuracy.controller import integrate_to_accuracy
    from lagrange_cli.simulate.checkpoint.progress import Watch
    from lagrange_cli.simulate.runs.problem import InitialValueProblem

    of = InitialValueProblem(
        rhs, np.array([1.0, 0.0]), np.linspace(0, 10, 51), ("length",), (off, off)
    )
    measured = integrate_to_accuracy(of, 1e-6, Watch())
    t = of.times[: len(measured.states)]
    error = np.abs(measured.states[:, 0] - np.cos(t)).max() / measured.scales[0]
    assert error <= measured.estimate < 1e-6
    assert len(integrate_to_accuracy(of, 1e-9, Watch()).states) < 51


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene",
    [
        """
name: pole
particles: {p: {mass: 1, position: [sin(theta)*cos(phi), sin(theta)*sin(phi), -cos(theta)]}}
coordinates: [theta, phi]
initial: {theta: 0, phi: 0, dot(theta): 1, dot(phi): 0}
""",
        """
name: nothing_turns
parameters: {I: 0, k: 1}
coordinates: [phi]
kinetic: {spin: I/2*dot(phi)^2}
potentials: {spring: k*phi^2/2}
initial: {phi: 1, dot(phi): 1}
""",
        """
name: nothing_turns_freely
parameters: {I: 0}
coordinates: [phi]
kinetic: {spin: I/2*dot(phi)^2}
initial: {phi: 0, dot(phi): 1}
""",
    ],
    ids=["chart singularity", "no inertia", "no inertia and no force"],
)
@pytest.mark.parametrize("how", [{"accuracy": 1e-6}, {"method": "RK45", "rtol": 1e-6}])
@pytest.mark.parametrize("way", ["compiled", "interpreted"])
def test_no_accelerations_at_the_start(scene, how, way):
    model = model_of(loads(scene).derive().equations)
    functions = compiled_or_skip(model) if way == "compiled" else interpreted(model, "asked for")
    said = "no accelerations at the start|the inertia of 'phi' vanishes with I = 0"
    with pytest.raises(InputError, match=said):
        simulate(model, until=1.0, functions=functions, **how)


@pytest.mark.slow
@pytest.mark.parametrize("way", ["compiled", "interpreted"])
def test_a_start_at_the_edge_of_where_the_equations_exist(way):
    """Moved by its last place it lies beyond the edge, where nothing can be measured."""
    scene = """
name: edge
particles: {p: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {well: -(1 - x^2)^(3/2)}
initial: {x: 1, dot(x): 0}
"""
    model = model_of(loads(scene).derive().equations)
    functions = compiled_or_skip(model) if way == "compiled" else interpreted(model, "asked for")
    found = simulate(model, until=1.0, accuracy=1e-6, functions=functions)
    assert found.status in ("accuracy_not_reached", "blow_up")
    assert found.holds_until == 0.0


@pytest.mark.slow
def test_stiff_systems_take_as_much_work_compiled_as_interpreted():
    scene = """
name: relaxation_oscillator
parameters: {mu: 200}
coordinates: [x]
kinetic: {inertia: dot(x)^2/2}
potentials: {spring: x^2/2}
forces: {valve: {on: x, force: mu*(1 - x^2)*dot(x)}}
initial: {x: 2, dot(x): 0}
"""
    model = model_of(loads(scene).derive().equations)
    ways = compiled_or_skip(model), interpreted(model, "asked for")
    work = [simulate(model, until=35.0, accuracy=1e-4, functions=f) for f in ways]
    assert [found.method for found in work] == ["Radau", "Radau"]
    native, python = (found.all_evaluations for found in work)
    assert native < 1.2 * python
