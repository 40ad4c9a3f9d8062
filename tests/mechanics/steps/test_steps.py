"""Steps of derivations: compared with SymPy's own derivatives, and wrong ones are found."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
import sympy as sp

from lagrange_cli.errors import InputError, InternalError
from lagrange_cli.mechanics import derive, derive_uncertified, reduce
from lagrange_cli.mechanics.assembly import assemble
from lagrange_cli.mechanics.certify.certificate import Evidence, certify
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.step_values import DerivationSteps
from lagrange_cli.mechanics.steps.derive_steps import derive_steps
from lagrange_cli.mechanics.steps.steps_certificate import certify_steps
from lagrange_cli.scene import read_file, read_text
from tests.parts import changed

SYSTEMS = Path(__file__).parents[3] / "systems"

#: Everything that has a line: a moved support, a potential of a force, of the velocity, drag, a
#: force on the particle and one on the coordinate, a term that acts on no particle.
FULL = """
name: full
parameters: {m: 1.4, l: {value: 0.8, positive: true}, g: 9.81, I: 0.3, A: 0.2, w: 3, c: 0.1, F: 2}
particles: {bob: {mass: m, position: [x, y, z]}}
coordinates: [theta, phi]
definitions:
  x: A*cos(w*t) + l*sin(theta)*cos(phi)
  y: l*sin(theta)*sin(phi)
  z: -l*cos(theta)
kinetic: {turning: I*dot(phi)^2*cos(theta)/2}
potentials: {weight: m*g*z, magnetic: c*(x*dot(y) - y*dot(x)), bend: c*theta^4}
dissipation: {air: c*(dot(x)^2 + dot(z)^2)/2, hinge: c*dot(theta)^2/2}
forces:
  push: {on: bob, force: [F*cos(w*t), F*y, 0]}
  motor: {on: theta, force: F*dot(phi)}
initial: {theta: 0.7, phi: 0.3}
"""


@cache
def certified(text: str) -> tuple[Uncertified, Evidence, Equations]:
    derivation = derive_uncertified(reduce(read_text(text)))
    evidence = certify(derivation, 30, 3)
    return derivation, evidence, assemble(derivation, evidence)


@cache
def full_steps() -> DerivationSteps:
    return derive_steps(*certified(FULL), "dalembert")


def by_sympy(expression: sp.Expr, equations: Equations) -> sp.Expr:
    """The total time derivative by SymPy's own rules, over functions of time."""
    t = equations.system.t
    moving = {}
    for c in equations.system.coordinates:
        path = sp.Function(f"path_{c.name}", real=True)(t)
        moving |= {c.a: path.diff(t, 2), c.v: path.diff(t), c.q: path}
    back = {path: symbol for symbol, path in moving.items()}
    rate = expression.xreplace(moving).diff(t)
    for c in equations.system.coordinates:
        for symbol in (c.a, c.v, c.q):
            rate = rate.subs(moving[symbol], back[moving[symbol]])
    return rate


def same(first: sp.Expr, second: sp.Expr) -> bool:
    return bool(sp.simplify(sp.expand(first - second)) == 0)


@pytest.mark.parametrize("scene", ["pendulums/double_pendulum", "beads/bead_on_rotating_hoop"])
def test_rates_are_those_that_sympy_finds(scene: str) -> None:
    equations = derive(read_file(str(SYSTEMS / f"{scene}.yaml")), steps="dalembert")
    assert equations.derivation.steps is not None
    for body in equations.derivation.steps.bodies:
        for part in body.components:
            assert same(part.velocity, by_sympy(part.position, equations))
            assert same(part.acceleration, by_sympy(part.velocity, equations))
            for symbol, slope in part.partials:
                assert same(slope, part.position.diff(symbol))
    parts = zip(equations.system.coordinates, equations.derivation.steps.coordinates, strict=True)
    for c, steps in parts:
        assert same(steps.momentum, equations.system.lagrangian.diff(c.v))
        assert same(steps.momentum_rate, by_sympy(steps.momentum, equations))
        assert same(steps.slope, equations.system.lagrangian.diff(c.q))
        assert same(steps.residual, steps.momentum_rate - steps.slope)


@pytest.mark.slow
def test_virtual_work_of_a_scene_that_has_everything() -> None:
    """Generalized forces by hand; d'Alembert's sums make up Lagrange's equations."""
    derivation, _, equations = certified(FULL)
    steps = full_steps()
    names = {p.name: p.symbol for p in equations.system.parameters}
    theta, phi = (c.q for c in equations.system.coordinates)
    force, length, w, t = names["F"], names["l"], names["w"], equations.system.t
    push, motor = steps.forces
    x = force * sp.cos(w * t) * length * sp.cos(theta) * sp.cos(phi)
    y = force * length * sp.sin(theta) * sp.sin(phi) * length * sp.cos(theta) * sp.sin(phi)
    assert same(dict(push.generalized)[theta], x + y)
    assert dict(motor.generalized) == {theta: force * equations.system.coordinates[1].v}
    assert set(steps.in_coordinates) == {"turning", "bend", "hinge", "motor"}
    for parts, coordinate in zip(steps.balances, steps.coordinates, strict=True):
        whole = parts.inertia - parts.work + parts.coordinates
        assert same(whole, coordinate.residual)
    assert steps.states == 3
    assert max(steps.mismatch, steps.difference) < 1e-25
    assert derivation.dissipation != 0


def _bodies(
    change: Callable[[DerivationSteps], dict[str, object]],
) -> Callable[..., DerivationSteps]:
    def changed(steps: DerivationSteps) -> DerivationSteps:
        (body,) = steps.bodies
        x, y, z = body.components
        component = replace(y, **change(steps))  # type: ignore[arg-type]
        return replace(steps, bodies=(replace(body, components=(x, component, z)),))

    return changed


def _y(steps: DerivationSteps, field: str) -> sp.Expr:
    value: sp.Expr = getattr(steps.bodies[0].components[1], field)
    return value


_NEARLY = 1 + sp.Rational(1, 10**20)

WRONG: dict[str, Callable[[DerivationSteps], DerivationSteps]] = {
    "position": _bodies(lambda s: {"position": _NEARLY * _y(s, "position")}),
    "velocity": _bodies(lambda s: {"velocity": -_y(s, "velocity")}),
    "acceleration": _bodies(lambda s: {"acceleration": _NEARLY * _y(s, "acceleration")}),
    "force": _bodies(lambda s: {"force": _NEARLY * _y(s, "force")}),
    "a partial derivative left out": _bodies(
        lambda s: {"partials": s.bodies[0].components[1].partials[:1]}
    ),
    "square": lambda s: replace(
        s, bodies=(replace(s.bodies[0], square=_NEARLY * s.bodies[0].square),)
    ),
    "kinetic term": lambda s: replace(
        s, kinetic=(replace(s.kinetic[0], resolved=2 * s.kinetic[0].resolved),)
    ),
    "potential": lambda s: replace(
        s,
        potentials=(replace(s.potentials[0], written=-s.potentials[0].written), *s.potentials[1:]),
    ),
    "component of a force": lambda s: replace(
        s,
        forces=(
            replace(
                s.forces[0],
                components=tuple((n, _NEARLY * e) for n, e in s.forces[0].components),
            ),
            s.forces[1],
        ),
    ),
    "generalized force left out": lambda s: replace(
        s, forces=(replace(s.forces[0], generalized=s.forces[0].generalized[:1]), s.forces[1])
    ),
    "work": lambda s: replace(
        s, balances=(replace(s.balances[0], work=_NEARLY * s.balances[0].work), s.balances[1])
    ),
    "inertia": lambda s: replace(
        s, balances=(s.balances[0], replace(s.balances[1], inertia=-s.balances[1].inertia))
    ),
    "terms in coordinates": lambda s: replace(
        s, balances=(replace(s.balances[0], coordinates=sp.Integer(0)), s.balances[1])
    ),
}
for _field in ("momentum", "momentum_rate", "slope", "drag"):

    def _scaled(steps: DerivationSteps, field: str = _field) -> DerivationSteps:
        first, second = steps.coordinates
        value = _NEARLY * getattr(first, field)
        return replace(steps, coordinates=(replace(first, **{field: value}), second))

    WRONG[_field] = _scaled
WRONG["equation"] = lambda s: replace(
    s, coordinates=(replace(s.coordinates[0], terms=s.coordinates[0].terms[1:]), s.coordinates[1])
)


@pytest.mark.slow
@pytest.mark.parametrize("name", WRONG)
def test_no_wrong_line_passes(name: str) -> None:
    wrong = WRONG[name](full_steps())
    assert wrong != full_steps()
    with pytest.raises(InternalError, match="a step of the derivation disagrees"):
        certify_steps(*certified(FULL), wrong, {})


def test_newton_s_equations_are_checked_with_the_constraint_forces() -> None:
    """m r̈ = F + f holds along a motion; with another f it is found not to."""
    scene = read_file(str(SYSTEMS / "rolling" / "wheel_down_incline.yaml"))
    derivation = derive_uncertified(reduce(scene))
    evidence = certify(derivation, 30, 3)
    equations = derive(scene, forces=True)
    steps = derive_steps(derivation, evidence, equations, "lagrange")
    assert equations.derivation.constraint_forces is not None
    (wheel,) = equations.derivation.constraint_forces.bodies
    x, y, z = wheel.components
    off = replace(
        equations.derivation.constraint_forces, bodies=(replace(wheel, components=(x, y, -z)),)
    )
    with pytest.raises(InternalError, match="a step of the derivation disagrees"):
        certify_steps(derivation, evidence, changed(equations, constraint_forces=off), steps, {})


@pytest.mark.parametrize(
    ("scene", "reason", "hint"),
    [
        ("chains/fput", "15 coordinates: at most 12", "-p n=2"),
        ("celestial/pleiades", "14 coordinates: at most 12", "derive it without --steps"),
    ],
)
def test_steps_of_large_scenes_are_refused(scene: str, reason: str, hint: str) -> None:
    with pytest.raises(InputError, match=reason) as refusal:
        derive(read_file(str(SYSTEMS / f"{scene}.yaml")), steps="lagrange")
    (problem,) = refusal.value.problems
    assert problem.rule == "steps-too-long"
    assert problem.hint is not None
    assert hint in problem.hint


#: Modules that reports without steps share with those that have some: the writer of labels,
#: Lagrange's equations as a law, and the keys of JSON.
SHARED = {"contents.steps", "contents.steps.writer", "contents.steps.by_lagrange", "values.steps"}


@pytest.mark.slow
def test_nothing_of_steps_is_loaded_unless_they_are_asked_for() -> None:
    code = (
        "import sys\n"
        "from lagrange_cli.api import load\n"
        f"derivation = load({str(SYSTEMS / 'lecture' / 'bead_on_parabola.yaml')!r}).derive()\n"
        "assert derivation.equations.derivation.steps is None\n"
        "derivation.text(), derivation.report()\n"
        "print(*(m for m in sys.modules if '.steps' in m))\n"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(run.stdout.split()) == {f"lagrange_cli.report.{name}" for name in SHARED}


@pytest.mark.parametrize("way", ["lagrange", "dalembert"])
def test_a_force_that_is_a_product_is_counted_once_before_like_terms_are_collected(way):
    """The factor q1 of a force is no multiplier."""
    scene = """
parameters: {m: 1.5, l: 0.7, g: 9.81}
particles:
  a: {mass: m, position: [l*sin(q1), 0, -l*cos(q1)]}
  b: {mass: m, position: [l*sin(q1) + l*sin(q2), 0, -l*cos(q1) - l*cos(q2)]}
coordinates: [q1, q2]
forces: {drive: {on: q2, force: q1*(dot(q2) - g)}}
"""
    equations = derive(read_text(scene), steps=way)
    steps = equations.derivation.steps
    assert steps is not None
    assert steps.states == 8
    coordinates = equations.system.coordinates
    speeds, accelerations = [c.v for c in coordinates], [c.a for c in coordinates]
    force = steps.generalized_force(coordinates[1].q)
    terms = steps.coordinates[1].ungathered_terms(speeds, accelerations, [], force)
    assert len(terms) == 7
    whole = sp.Add(*(coefficient * factor for coefficient, factor in terms))
    assert sp.expand(whole - steps.coordinates[1].residual) == 0


@pytest.mark.parametrize("way", ["lagrange", "dalembert"])
def test_the_push_of_a_contact_is_a_term_before_like_terms_are_collected(way):
    scene = """
coordinates: [x]
kinetic: {bead: (2 + cos(x))*dot(x)^2/2}
constraints: {floor: x >= -1}
initial: {x: 0}
"""
    steps = derive(read_text(scene), steps=way).derivation.steps
    assert steps is not None
    assert steps.states == 8
