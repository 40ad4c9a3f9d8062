"""Mass matrix and forcing of generated scenes against Euler–Lagrange in plain SymPy."""

from __future__ import annotations

import random
from dataclasses import dataclass, field

import mpmath
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mpf

from lagrange_cli.mechanics import derive, derive_uncertified, reduce
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.scene import read_text
from tests.mechanics.mechanics_support import derived, few

t = sp.Symbol("t", real=True)


@dataclass
class Model:
    """A system twice: as a scene's text, and as T, V, D and Q over plain symbols."""

    coordinates: list[str] = field(default_factory=list)
    particles: list[str] = field(default_factory=list)
    potentials: list[str] = field(default_factory=list)
    kinetic: list[str] = field(default_factory=list)
    forces: list[str] = field(default_factory=list)
    dissipation: list[str] = field(default_factory=list)
    kinetic_energy: sp.Expr = sp.S.Zero
    potential: sp.Expr = sp.S.Zero
    rayleigh: sp.Expr = sp.S.Zero
    generalized: dict[str, sp.Expr] = field(default_factory=dict)
    places: list[tuple[sp.Expr, ...]] = field(default_factory=list)

    def q(self, name: str) -> sp.Symbol:
        return sp.Symbol(name, real=True)

    def v(self, name: str) -> sp.Symbol:
        return sp.Symbol(f"v_{name}", real=True)

    def rate(self, expr: sp.Expr) -> sp.Expr:
        moving = (sp.diff(expr, self.q(c)) * self.v(c) for c in self.coordinates)
        return sp.diff(expr, t) + sp.Add(*moving)

    def add_particle(self, place: tuple[sp.Expr, ...], mass: sp.Rational) -> None:
        self.places.append(place)
        texts = ", ".join(f'"{written(e)}"' for e in place)
        self.particles.append(
            f"  p{len(self.places)}: {{mass: {written(mass)}, position: [{texts}]}}"
        )
        speed = sp.Add(*(self.rate(e) ** 2 for e in place))
        self.kinetic_energy += mass * speed / 2

    def text(self) -> str:
        sections = [f"coordinates: [{', '.join(self.coordinates)}]"]
        for name in ("particles", "potentials", "kinetic", "forces", "dissipation"):
            lines = getattr(self, name)
            if lines:
                sections += [f"{name}:", *lines]
        return "\n".join(sections) + "\n"

    def reference(self) -> tuple[sp.Matrix, sp.Matrix]:
        """M and f from L = T − V by the textbook's formula."""
        lagrangian = self.kinetic_energy - self.potential
        v = [self.v(c) for c in self.coordinates]
        momenta = [sp.diff(lagrangian, x) for x in v]
        mass = sp.Matrix([[sp.diff(p, x) for x in v] for p in momenta])
        forcing = []
        for name, p in zip(self.coordinates, momenta, strict=True):
            known = sp.diff(lagrangian, self.q(name)) - self.rate(p)
            friction = sp.diff(self.rayleigh, self.v(name))
            forcing.append(known - friction + self.generalized.get(name, sp.Integer(0)))
        return mass, sp.Matrix(forcing)


def written(expr: sp.Expr) -> str:
    """In the scene language; velocities as ``dot``."""
    text = str(sp.sympify(expr)).replace("**", "^")
    for s in sorted(sp.sympify(expr).free_symbols, key=str):
        if s.name.startswith("v_"):
            text = text.replace(s.name, f"dot({s.name[2:]})")
    return text


def require_equal(model: Model, e: Equations, seed: int = 3) -> None:
    """M and f agree at random states to 25 digits of 30."""
    mass, forcing = model.reference()
    draw = random.Random(seed)
    for _ in range(2):
        state = {n: sp.Rational(draw.randint(-900, 900), 1000) for n in model.coordinates}
        speed = {n: sp.Rational(draw.randint(-900, 900), 700) for n in model.coordinates}
        clock = sp.Rational(draw.randint(1, 900), 1000)
        plain = {model.q(n): x for n, x in state.items()} | {t: clock}
        plain |= {model.v(n): x for n, x in speed.items()}
        ours = {c.q: state[c.name] for c in e.system.coordinates} | {e.system.t: clock}
        ours |= {c.v: speed[c.name] for c in e.system.coordinates}
        for j in range(len(model.coordinates)):
            pairs = [(forcing[j], e.system.forcing[j])]
            pairs += [
                (mass[j, k], e.system.mass_matrix[j][k]) for k in range(len(model.coordinates))
            ]
            for expected, found in pairs:
                first = mpf(sp.sympify(expected).xreplace(plain).evalf(30))
                second = mpf(sp.sympify(found).xreplace(ours).evalf(30))
                assert abs(first - second) <= mpf(10) ** -25 * (1 + abs(first))


ANGLE, SLIDE, SUPPORT, SPHERE = "angle", "slide", "support", "sphere"


@st.composite
def models(draw: st.DrawFn) -> Model:
    """A random tree of links, sliders and moving supports, and what acts on it."""
    model = Model()
    spatial = draw(st.booleans())
    joints = draw(
        st.lists(
            st.sampled_from([ANGLE, ANGLE, SLIDE, SUPPORT, *([SPHERE] if spatial else [])]),
            min_size=1,
            max_size=3,
        ).filter(lambda kinds: kinds.count(SUPPORT) < len(kinds))
    )
    plan: list[tuple[str, int, sp.Rational]] = []
    for kind in joints:
        length = sp.Rational(draw(st.integers(1, 8)), 4)
        plan.append((kind, draw(st.integers(0, 3)), length))
    names = {ANGLE: 1, SLIDE: 1, SUPPORT: 0, SPHERE: 2}
    model.coordinates = [f"q{i}" for i in range(sum(names[kind] for kind, _, _ in plan))]
    fresh = iter(model.coordinates)
    ends: list[tuple[sp.Expr, ...]] = [(sp.Integer(0),) * 3]
    for kind, parent, length in plan:
        x, y, z = ends[parent % len(ends)]
        if kind == ANGLE:
            q = model.q(next(fresh))
            end = (x + length * sp.sin(q), y, z - length * sp.cos(q))
        elif kind == SLIDE:
            q = model.q(next(fresh))
            end = (x + length * q, y + (q**2 / 2 if spatial else 0), z + q / 3)
        elif kind == SUPPORT:
            end = (x + length * sp.cos(2 * t), y, z + length * t**2 / 5)
        else:
            q, p = model.q(next(fresh)), model.q(next(fresh))
            end = (
                x + length * sp.sin(q) * sp.cos(p),
                y + length * sp.sin(q) * sp.sin(p),
                z - length * sp.cos(q),
            )
        ends.append(end)
        if kind != SUPPORT:
            model.add_particle(end, sp.Rational(draw(st.integers(1, 9)), 3))
    for name in model.coordinates:
        # Inertia of its own for every coordinate, also where the chart is singular.
        model.kinetic.append(f"  own_{name}: dot({name})^2/2")
        model.kinetic_energy += model.v(name) ** 2 / 2
    _load(draw, model)
    return model


def _load(draw: st.DrawFn, model: Model) -> None:
    """Springs, weights, forces, friction, generalized potentials."""
    names = model.coordinates
    q, v = model.q(names[0]), model.v(names[-1])
    place = model.places[-1]
    first = model.places[0]
    chosen = draw(st.sets(st.integers(0, 7)))
    potentials = {
        0: 3 * place[2],
        1: sp.Add(*((a - b) ** 2 for a, b in zip(place, first, strict=True))) + q**2,
        2: sp.sqrt(sp.Add(*((a - 2) ** 2 for a in place)) + 1),
        3: v * sp.sin(q) * q + v**2 * q**2 / 20,
        4: sp.cos(q) * t,
    }
    for k, expr in potentials.items():
        if k in chosen:
            model.potentials.append(f'  u{k}: "{written(expr)}"')
            model.potential += expr
    if 5 in chosen:
        push = (sp.Integer(2), q * t, -v)
        body = f"p{len(model.places)}"
        texts = ", ".join(f'"{written(e)}"' for e in push)
        model.forces.append(f"  push: {{on: {body}, force: [{texts}]}}")
        for name in names:
            work = sp.Add(
                *(f * sp.diff(r, model.q(name)) for f, r in zip(push, place, strict=True))
            )
            model.generalized[name] = model.generalized.get(name, 0) + work
    if 6 in chosen:
        torque = sp.sin(t) - q * v
        model.forces.append(f'  torque: {{on: {names[-1]}, force: "{written(torque)}"}}')
        model.generalized[names[-1]] = model.generalized.get(names[-1], 0) + torque
    if 7 in chosen:
        drag = (1 + q**2) * v**2 / 4 + model.v(names[0]) ** 2 / 3
        model.dissipation.append(f'  drag: "{written(drag)}"')
        model.rayleigh += drag


@pytest.mark.slow
@given(models(), st.integers(0, 10**6))
@few
def test_generated_systems(model: Model, seed: int) -> None:
    e = derive(read_text("name: generated\n" + model.text()), points=2)
    require_equal(model, e, seed)
    assert e.derivation.account.cartesian == 3 * len(model.places)
    assert e.derivation.account.dof == len(model.coordinates)


@pytest.mark.slow
def test_products_beyond_the_budget_are_left_but_right(monkeypatch: pytest.MonkeyPatch) -> None:
    """A position of many terms: the sums stay factored, the equations stay true."""
    monkeypatch.setattr("lagrange_cli.mechanics.dynamics.lagrange.MOST_COLLECTED_PRODUCTS", 8_000)
    q = ["u", "v"]
    model = Model(coordinates=q)
    u, w = model.q("u"), model.q("v")
    terms = [sp.sin(k * u) * sp.cos((k % 5 + 1) * w) / k for k in range(1, 34)]
    model.add_particle((sp.Add(*terms), u, w), sp.Integer(2))
    scene = read_text("name: long\n" + model.text())
    derivation = derive_uncertified(reduce(scene))
    assert not derivation.collected
    e = derive(scene, points=1)
    assert any("budget" in remark for remark in e.derivation.remarks)
    require_equal(model, e)


def chain(n: int) -> str:
    """An n-link pendulum of point masses in absolute angles."""
    each = range(1, n + 1)
    lines = ["parameters:", "  g: 9.81"]
    lines += [f"  m{k}: 1\n  l{k}: {{value: 1, positive: true}}" for k in each]
    lines += ["plane: xz", "particles:"]
    lines += [f"  p{k}: {{mass: m{k}, position: [x{k}, y{k}, z{k}]}}" for k in each]
    lines += [f"coordinates: [{', '.join(f'th{k}' for k in each)}]", "definitions:"]
    for k in each:
        x, z = (f"x{k - 1} + ", f"z{k - 1} ") if k > 1 else ("", "")
        lines.append(f"  x{k}: {x}l{k}*sin(th{k})\n  z{k}: {z}-l{k}*cos(th{k})")
    return "\n".join([*lines, "potentials: {weight: {gravity: g}}"]) + "\n"


@pytest.mark.slow
def test_sixteen_links_cost_fewer_operations_than_lagranges_method() -> None:
    """4317 is SymPy 1.14's LagrangesMethod with common subexpressions taken out."""
    derivation = derive_uncertified(reduce(read_text("name: chain\n" + chain(16))))
    rows = enumerate(derivation.mass)
    mass = [sp.Add(*terms) for j, row in rows for k, terms in row.items() if k >= j]
    forcing = [sp.Add(*terms) for terms in derivation.forcing]
    shared, rest = sp.cse([*mass, *forcing])
    count = sum(sp.count_ops(e) for _, e in shared) + sum(sp.count_ops(e) for e in rest)
    assert count < 4317


def test_the_masses_of_a_chain_are_summed() -> None:
    e = derived(chain(4))
    m = [p.symbol for p in e.system.parameters if p.name.startswith("m")]
    lengths = [p.symbol for p in e.system.parameters if p.name.startswith("l")]
    angles = [c.q for c in e.system.coordinates]
    for j in range(4):
        for k in range(4):
            below = sp.Add(*m[max(j, k) :])
            difference = sp.cos(angles[j] - angles[k])
            expected = below * lengths[j] * lengths[k] * difference
            assert sp.expand(e.system.mass_matrix[j][k] - expected) == 0


def test_forces_add_up_whatever_they_act_on() -> None:
    """A force on a point, on a particle and on a coordinate; virtual work by hand."""
    text = (
        "parameters: {m: 2, l: 3, c: 5}\nplane: xz\n"
        "particles: {bob: {mass: m, position: [x, y, z]}}\npoints: {half: [x/2, 0, z/2]}\n"
        "coordinates: [q]\ndefinitions: {x: l*sin(q), z: -l*cos(q)}\n"
        "forces:\n  push: {on: bob, force: [c, 0, 0]}\n  lift: {on: half, force: [0, 0, c]}\n"
        "  turn: {on: q, force: c*dot(q)}\n"
    )
    e = derived(text)
    c, l, m = (next(p.symbol for p in e.system.parameters if p.name == n) for n in "clm")  # noqa: E741
    q, v = e.system.coordinates[0].q, e.system.coordinates[0].v
    work = c * l * sp.cos(q) + c * l * sp.sin(q) / 2 + c * v
    assert sp.expand(e.system.forcing[0] - work) == 0
    assert sp.expand(e.system.mass_matrix[0][0] - m * l**2) == 0
    parts = {f.name: f.generalized[0] for f in e.system.forces}
    assert parts == {"push": c * l * sp.cos(q), "lift": c * l * sp.sin(q) / 2, "turn": c * v}


def test_a_moving_point_does_work_only_through_coordinates() -> None:
    """A force on a driven support enters no equation of a coordinate that does not move it."""
    text = (
        "particles: {bob: {mass: 1, position: [x, 0, 0]}}\npoints: {hand: [cos(t), 0, 0]}\n"
        "coordinates: [x]\nforces: {grip: {on: hand, force: [7, 0, 0]}}\n"
    )
    e = derived(text)
    assert e.system.forcing == (0,)


def test_a_support_at_constant_speed_moves_what_stands_on_it() -> None:
    """T is that of the whole velocity, though the speed of the support holds no t."""
    e = derived(
        "parameters: {m: 1, u: 2}\nparticles: {bob: {mass: m, position: [s + u*t, 0, 0]}}\n"
        "coordinates: [s]\n"
    )
    m, u = (p.symbol for p in e.system.parameters)
    v = e.system.coordinates[0].v
    assert sp.expand(e.system.kinetic - m * (v + u) ** 2 / 2) == 0
    momentum, jacobi = e.derivation.conserved
    assert sp.expand(momentum.expression - m * (v + u)) == 0
    assert jacobi.kind == "jacobi"
    assert sp.expand(jacobi.expression - m * (v**2 - u**2) / 2) == 0


@pytest.mark.slow
@given(models())
@few
def test_the_energies_of_generated_systems(model: Model) -> None:
    """T and V as declared, not only up to what changes no equation."""
    e = derive(read_text("name: generated\n" + model.text()), points=1)
    ours = {model.q(c.name): c.q for c in e.system.coordinates} | {t: e.system.t}
    ours |= {model.v(c.name): c.v for c in e.system.coordinates}
    names = [e.system.t, *(s for c in e.system.coordinates for s in (c.q, c.v))]
    state = {s: sp.Rational(2 * k + 3, 3 * k + 7) for k, s in enumerate(names)}
    for found, expected in (
        (e.system.kinetic, model.kinetic_energy),
        (e.system.potential, model.potential),
    ):
        value = sp.sympify(expected).xreplace(ours).xreplace(state).evalf(30)
        assert abs(found.xreplace(state).evalf(30) - value) <= 1e-25 * (1 + abs(value))


def test_kinetic_terms_need_no_particles() -> None:
    """Any Lagrangian: here with terms of third and first degree in velocities."""
    text = (
        "parameters: {k: 2}\ncoordinates: [u, w]\n"
        "kinetic: {T: dot(u)^2*(1 + w^2)/2 + dot(w)^2/2 + dot(u)^3*w/6 + u*dot(w)}\n"
        "potentials: {V: k*u*w}\n"
    )
    e = derived(text)
    u, w = (c.q for c in e.system.coordinates)
    du, dw = (c.v for c in e.system.coordinates)
    k = e.system.parameters[0].symbol
    expected = sp.Matrix([[1 + w**2 + du * w, 0], [0, 1]])
    assert (sp.Matrix(e.system.mass_matrix) - expected).applyfunc(sp.expand) == sp.zeros(2)
    forces = [
        -k * w - 2 * w * du * dw - du**2 * dw / 2 + dw,
        -k * u + w * du**2 + du**3 / 6 - du,
    ]
    assert [sp.expand(f - g) for f, g in zip(e.system.forcing, forces, strict=True)] == [0, 0]


@pytest.mark.parametrize(
    ("potential", "force"),
    [
        ("abs(x)", lambda x: -mpmath.sign(x)),
        ("max(x, 1)^2", lambda x: -2 * x if x > 1 else mpf(0)),
        ("min(x, 1)*x", lambda x: mpf(-1) if x > 1 else -2 * x),
        ("abs(log(x))", lambda x: -mpmath.sign(mpmath.log(x)) / x),
        ("abs(sqrt(x) - 1)", lambda x: -mpmath.sign(mpmath.sqrt(x) - 1) / (2 * mpmath.sqrt(x))),
        ("x^2*sign(x)", lambda x: -2 * abs(x)),
        ("sign(log(x))*x", lambda x: -mpmath.sign(mpmath.log(x))),
        ("norm(x, 3)", lambda x: -x / mpmath.hypot(x, 3)),
        ("atan2(x, 2)", lambda x: -2 / (4 + x * x)),
        ("x^x", lambda x: -(x**x) * (1 + mpmath.log(x))),
        ("acosh(1 + x)", lambda x: -1 / mpmath.sqrt((1 + x) ** 2 - 1)),
    ],
)
@pytest.mark.parametrize("at", ["1.75", "0.3"])
def test_potentials_of_every_kind(potential: str, force: object, at: str) -> None:
    e = derived(
        "particles: {bead: {mass: 1, position: [x, 0, 0]}}\n"
        f'coordinates: [x]\npotentials: {{v: "{potential}"}}\ninitial: {{x: {at}}}'
    )
    value = e.system.forcing[0].xreplace({e.system.coordinates[0].q: sp.Rational(at)})
    assert float(value) == pytest.approx(float(force(mpf(at))), rel=1e-12, abs=1e-12)


def test_a_potential_may_diverge_at_rest() -> None:
    """U = −log q̇ − …: nothing says that U exists where velocities vanish."""
    e = derived(
        "coordinates: [x]\nkinetic: {T: dot(x)^2/2}\n"
        "potentials: {u: log(dot(x)), w: x^2}\ninitial: {x: 1, dot(x): 2}"
    )
    v = e.system.coordinates[0].v
    assert sp.simplify(e.system.mass_matrix[0][0] - (1 + 1 / v**2)) == 0
