"""Forms of families are what they stand for: each is read back at every element."""

import random
from itertools import pairwise
from pathlib import Path

import mpmath
import pytest

from lagrange_cli import api
from lagrange_cli.mechanics.families.elements import element_of
from lagrange_cli.mechanics.families.families import families_in
from lagrange_cli.mechanics.families.instances import Instances
from lagrange_cli.mechanics.numerics.autodiff import evaluate
from lagrange_cli.report.contents.derivation.contents import derivation_text
from tests.mechanics.families import scenes
from tests.mechanics.families.reading import DIGITS, Page

SYSTEMS = Path(__file__).resolve().parents[3] / "systems"

GENERATED = {
    "chain between walls": (scenes.chain(6), 4),
    "chain between walls, declared": (scenes.declared_chain(9), 9),
    "free chain": (scenes.chain(12, ends="free"), 10),
    "free chain, declared": (scenes.declared_chain(7, walls=False), 5),
    "ring": (scenes.chain(5, ends="ring"), 5),
    "ring of four": (scenes.chain(4, ends="ring"), 4),
    "ring of numbered names": (scenes.chain(7, ends="ring", numbered=True), 7),
    "ring with cubic forces": (scenes.chain(6, ends="ring", power=4), 6),
    "masses of their own": (scenes.chain(8, masses="own"), 6),
    "masses that grow": (scenes.chain(8, masses="growing", ends="ring"), 8),
    "square net": (scenes.net(4, 4), 16),
    "long net": (scenes.net(5, 3), 15),
    "free net": (scenes.net(5, 6, frame=False), 26),
    "bodies": (scenes.pairs(5), 10),
    "bodies of one mass": (scenes.pairs(4, masses="equal"), 8),
    "bodies of growing mass": (scenes.pairs(6, masses="growing"), 12),
}

SHIPPED = [
    "celestial/pleiades",
    "chains/fput",
    "chains/net_of_springs",
    "chains/oscillator_ring",
    "chains/pendulum_chain",
    "chains/toda_ring",
]

#: Sizes that take longest: other scenes have sizes of two digits, and even ones.
LARGE = {("chains/pendulum_chain", 12), ("chains/net_of_springs", 6)}


def _loaded(name, **sizes):
    if name in GENERATED:
        return api.loads(GENERATED[name][0])
    return api.load(SYSTEMS / f"{name}.yaml", parameters=sizes)


def _state(equations):
    """A random value for every symbol, by the names of the scene language."""
    chance = random.Random(11)
    symbols = {s for c in equations.system.coordinates for s in (c.q, c.v, c.a)}
    symbols |= {p.symbol for p in equations.system.parameters} | {equations.system.t}
    symbols |= {c.multiplier for c in equations.system.pushing}
    point = {s: mpmath.mpf(chance.uniform(0.2, 1.2)) for s in sorted(symbols, key=str)}
    values = {}
    for symbol, value in point.items():
        values[symbol.name] = value
        order = len(symbol.name) - len(symbol.name.lstrip("d")) if "dot(" in symbol.name else 0
        bare = symbol.name.removeprefix("ddot(").removeprefix("dot(").removesuffix(")")
        element = element_of(bare)
        if element is not None:
            name = f"{['', 'dot(', 'ddot('][min(order, 2)]}{element.name}{')' if order else ''}"
            values[name] = value
    return point, values


def _agree(ours, theirs):
    return abs(ours - theirs) <= mpmath.mpf(10) ** -30 * max(1, abs(theirs))


def _checked(equations, families, page):
    """Compare every form with what it stands for; give how many were compared."""
    point, values = _state(equations)
    meanings = page.beyond()
    count = 0
    whole = {"kinetic": equations.system.kinetic, "potential": equations.system.potential}
    for name, expression in whole.items():
        form = getattr(families, name)
        if form is not None:
            ours = page.plain(page.form(form), {}).value(values, meanings)
            assert _agree(ours, evaluate([expression], point)[0]), page.form(form)
            count += 1
    for row in families.motion:
        rows = [equations.derivation.shown[k] for k in row.covers]
        for at, shown in zip(page.places(row), rows, strict=True):
            named = element_of(shown.coordinate)
            assert page.name(row.name, at) == named.name
            text = page.row(row)
            ours = page.plain(text, at).value(values, meanings)
            assert _agree(ours, evaluate([shown.residual], point)[0]), (text, at)
            divisor = page.text(page.notation.part(row, row.shown.divided_by))
            ours = page.plain(divisor, at).value(values, meanings)
            assert _agree(ours, evaluate([shown.divided_by], point)[0]), (divisor, at)
            count += 1
    named = [(c.name, c.expression) for c in equations.system.closures]
    positions = [(c.name, c.position) for c in equations.system.cartesian_names]
    for found, expressions in (
        (families.closures, named),
        (families.definitions(positions), positions),
    ):
        for row in found:
            for at, k in zip(page.places(row), row.covers, strict=True):
                name, expression = expressions[k]
                assert page.name(row.name, at) == element_of(name).name
                ours = page.plain(page.whole(row), at).value(values, meanings)
                assert _agree(ours, evaluate([expression], point)[0]), (row.name, at)
                count += 1
    return count


@pytest.mark.slow
@pytest.mark.parametrize("name", [*SHIPPED, *GENERATED])
def test_every_form_reads_back_as_what_it_stands_for(name):
    equations = _loaded(name).derive().equations
    families = families_in(equations)
    with mpmath.workdps(DIGITS):
        assert _checked(equations, families, Page(equations, families)) > 4
    covered = [k for row in families.motion for k in row.covers]
    assert len(covered) == len(set(covered))
    if name in GENERATED:
        assert len(covered) == GENERATED[name][1]
    else:
        assert len(covered) == len(equations.system.coordinates)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "n"),
    [
        pytest.param(name, n, marks=pytest.mark.campaign if (name, n) in LARGE else ())
        for name in SHIPPED[1:]
        for n in ((4, 5, 6) if "net" in name else (4, 5, 7, 12))
    ],
)
def test_every_form_reads_back_at_any_size(name, n):
    equations = _loaded(name, n=n).derive().equations
    families = families_in(equations)
    with mpmath.workdps(DIGITS):
        assert _checked(equations, families, Page(equations, families)) > n


@pytest.mark.slow
@pytest.mark.parametrize("name", ["chain_of_rods", "hanging_net", "net_of_rods_and_springs"])
def test_equations_with_multipliers_are_families(name):
    equations = (
        api.load(SYSTEMS / "chains" / f"{name}.yaml", parameters={"n": 5}).derive().equations
    )
    families = families_in(equations)
    assert families.motion
    assert families.closures
    with mpmath.workdps(DIGITS):
        _checked(equations, families, Page(equations, families))


def test_forms_that_hold_only_where_some_functions_are_defined():
    names = [f"x{k}" for k in range(1, 6)]
    kinetic = " + ".join(f"m/2*dot({x})^2" for x in names)
    logs = " + ".join(f"log({b} - {a})" for a, b in pairwise(names))
    scene = "\n".join(
        [
            "name: logarithms",
            "parameters: {m: 1, k: 2}",
            f"coordinates: [{', '.join(names)}]",
            f"kinetic: {{t: {kinetic}}}",
            f"potentials: {{v: -k*({logs})}}",
            "initial: {" + ", ".join(f"{x}: {k}" for k, x in enumerate(names)) + "}",
        ]
    )
    text = api.loads(scene).derive().text()
    assert "V = -k Σᵢ₌₁⁴ ln(xᵢ₊₁ - xᵢ)" in text
    assert "m ẍᵢ - k / (xᵢ - xᵢ₋₁) + k / (xᵢ₊₁ - xᵢ) = 0, i = 2 … 4" in text


def test_wrong_forms_are_told_from_right_ones(monkeypatch):
    """Without the proof, the row of the inner masses stands for those at the walls as well."""
    equations = api.loads(scenes.chain(6)).derive().equations
    monkeypatch.setattr(Instances, "holds", lambda *_: True)
    families = families_in(equations)
    assert sum(len(row.covers) for row in families.motion) > 4
    with mpmath.workdps(DIGITS), pytest.raises((AssertionError, KeyError)):
        _checked(equations, families, Page(equations, families))


def test_masses_that_alternate_are_no_family():
    families = families_in(api.loads(scenes.chain(8, masses="alternating")).derive().equations)
    assert families is None or not families.motion


@pytest.mark.parametrize("n", [2, 3])
def test_two_or_three_are_written_out(n):
    equations = api.loads(scenes.chain(n, ends="ring")).derive().equations
    assert families_in(equations) is None
    assert "x[1]" in derivation_text(equations)


def test_ends_that_differ_stand_apart():
    text = api.loads(scenes.chain(6)).derive().text()
    assert "x₁   m ẍ₁ + k (2 x₁ - x₂) = 0" in text
    assert "xᵢ   m ẍᵢ + k (2 xᵢ - xᵢ₋₁ - xᵢ₊₁) = 0, i = 2 … 5" in text
    assert "x₆   m ẍ₆ + k (2 x₆ - x₅) = 0" in text


def test_a_ring_without_definitions_says_what_is_beyond_its_ends():
    text = api.loads(scenes.chain(5, ends="ring")).derive().text()
    assert "x₀ = x₅" in text
    assert "x₆ = x₁" in text
    assert "i = 1 … 5" in text


@pytest.mark.slow
def test_indices_of_parameters_are_kept():
    text = api.loads(scenes.pairs(5)).derive().text()
    assert "V = -G Σᵢ<ⱼ mᵢ mⱼ / √((xᵢ - xⱼ)² + (yᵢ - yⱼ)²)" in text
    assert "T = ½ Σᵢ₌₁⁵ mᵢ (ẋᵢ² + ẏᵢ²)" in text


def test_letters_of_indices_mean_nothing_else():
    scene = scenes.chain(5, ends="ring").replace("k: 2", "i: 2").replace("k/2", "i/2")
    scene = scene.replace('"k": 2', '"i": 2')
    text = api.loads(scene).derive().text()
    assert "m ẍⱼ + i (2 xⱼ - xⱼ₋₁ - xⱼ₊₁) = 0, j = 1 … 5" in text


def test_all_elements_are_shown_on_request():
    derivation = api.load(SYSTEMS / "chains/toda_ring.yaml").derive()
    text = derivation.text(written_out=True)
    assert "q[6]   q̈[6] - exp(q[5] - q[6]) + exp(q[6] - q[1]) = 0" in text
    assert "Σ" not in text
    for to in ("latex", "markdown"):
        (short,) = derivation.emit(to).values()
        (long,) = derivation.emit(to, written_out=True).values()
        assert r"\sum" in short
        assert r"\dots" in short
        assert r"\sum" not in long
        assert "q_{6}" in long


@pytest.mark.slow
def test_pages_do_not_grow_with_the_number_of_elements():
    texts = [_loaded("chains/toda_ring", n=n).derive().text() for n in (8, 16)]
    assert len(texts[0].splitlines()) == len(texts[1].splitlines())


@pytest.mark.parametrize("n", [7, 16])
def test_products_that_stand_in_several_sums_are_gathered(n):
    """Heights of a chain hold those of all links above; their sum is not multiplied out."""
    equations = _loaded("chains/pendulum_chain", n=n).derive().equations
    text = derivation_text(equations)
    assert "\nV = -m g l Σᵢ₌₁ⁿ (n + 1 - i) cos θᵢ\n" in text
    assert "\nT = ½ m l² Σᵢ₌₁ⁿ Σⱼ₌₁ⁿ (n + 1 - max(i, j)) θ̇ᵢ θ̇ⱼ cos(θᵢ - θⱼ)\n" in text


def test_sums_over_springs_reach_the_fixed_ends_of_a_chain():
    shown = _loaded("chains/fput", n=6).derive()._repr_latex_()
    assert r"V & = \sum_{i = 0}^{n} \left( \frac{1}{2} (u_{i+1} - u_{i})^{2} +" in shown


def test_notebooks_show_families():
    shown = _loaded("chains/toda_ring").derive()._repr_latex_()
    assert r"i = 1, \dots, n" in shown
    assert shown.count(r"\ddot") == 1


CART = """
name: cart
sizes: {n: 6}
parameters: {m: 1, k: 2, c: 0.1, M: 3}
coordinates: ["u[i=1..n]", s]
definitions: {"u[0]": 0, "u[n+1]": 0}
kinetic: {masses: "sum(m*(dot(s) + dot(u[i]))^2/2, i=1..n)", cart: M/2*dot(s)^2}
potentials: {all: "sum(k/2*(u[i+1] - u[i])^2, i=0..n)"}
dissipation: {all: "sum(c/2*dot(u[i])^2, i=1..n)"}
"""


def test_equations_and_momenta_of_others_hold_sums():
    text = api.loads(CART).derive().text()
    assert "s    (6 m + M) s̈ + m Σᵢ₌₁ⁿ üᵢ = 0" in text
    assert "p_s = (6 m + M) ṡ + m Σᵢ₌₁ⁿ u̇ᵢ" in text
    assert "D = ½ c Σᵢ₌₁ⁿ u̇ᵢ²" in text


ROTORS = """
name: rotors
sizes: {n: 5}
parameters: {m: 1, k: 2}
coordinates: ["r[i=1..n]", "phi[i=1..n]"]
kinetic: {all: "sum(m/2*(dot(r[i])^2 + r[i]^2*dot(phi[i])^2), i=1..n)"}
potentials: {all: "sum(k/2*r[i]^2, i=1..n)"}
"""


def test_momenta_and_their_rates_are_families():
    derivation = api.loads(ROTORS).derive()
    assert "φᵢ   d/dt (m rᵢ² φ̇ᵢ) = 0, i = 1 … n" in derivation.text()
    assert "p_φᵢ = m rᵢ² φ̇ᵢ, i = 1 … n     φᵢ is cyclic" in derivation.text()
    assert "φᵢ ist zyklisch" in derivation.text(language="de")
    (document,) = derivation.emit("latex").values()
    assert r"p_{\phi_{i}} & = m r_{i}^{2} \dot{\phi}_{i},\quad i = 1, \dots, n" in document
    families = families_in(derivation.equations)
    page = Page(derivation.equations, families)
    point, values = _state(derivation.equations)
    (row,) = families.momenta
    for at, k in zip(page.places(row), row.covers, strict=True):
        with mpmath.workdps(DIGITS):
            expected = evaluate([derivation.equations.derivation.conserved[k].expression], point)[0]
            assert _agree(page.plain(page.whole(row), at).value(values, {}), expected)
