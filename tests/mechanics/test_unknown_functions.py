"""Unknown functions: what is derived for them holds for every function put in their place."""

from __future__ import annotations

from functools import partial

import pytest
import sympy as sp
from sympy.core.function import AppliedUndef

from lagrange_cli import loads
from lagrange_cli.check.check import check_scene
from lagrange_cli.errors import InputError

CENTRAL = """
parameters: {m: {positive: true}, k: {positive: true}, a: {positive: true}}
functions: {V: FUNCTION}
coordinates: [r, phi]
particles: {body: {mass: m, position: [r*cos(phi), r*sin(phi), 0]}}
potentials: {central: V(r)}
initial: {r: 1}
"""

CURVE = """
parameters: {m: {positive: true}, g: 9.81, k: 1, a: 2}
functions: {f: FUNCTION}
coordinates: [x]
definitions: {z: f(x), y: 0}
particles: {bead: {mass: m, position: [x, y, z]}}
potentials: {weight: m*g*z}
"""

SUPPORT = """
parameters: {m: {positive: true}, l: {positive: true}, g: 9.81, k: 1, a: 2}
functions: {X: FUNCTION}
coordinates: [theta]
particles: {bob: {mass: m, position: [X(t) + l*sin(theta), 0, -l*cos(theta)]}}
potentials: {weight: m*g*z_bob}
"""

DAMPER = """
parameters: {m: {positive: true}, k: 1, a: 2}
functions: {F: FUNCTION}
coordinates: [x]
particles: {body: {mass: m, position: [x, 0, 0]}}
forces: {drag: {on: x, force: -F(dot(x)) - 3*F(2*x + 1)}}
"""

SCENES = {"V": (CENTRAL, "r"), "f": (CURVE, "x"), "X": (SUPPORT, "t"), "F": (DAMPER, "x")}
GIVEN = ["k*{0}^2/2 + a*{0}^4", "-k/sqrt({0}^2 + a)", "a*exp(-k*{0}) + sin(k*{0})", "a"]


def with_function(name, body=None):
    text, argument = SCENES[name]
    given = argument if body is None else f"{{of: s, equals: '{body.format('s')}'}}"
    return loads(text.replace("FUNCTION", given)).derive().equations


def put_in(expression, equations, body):
    """Replace each unknown function, with its derivatives, by SymPy's of a body."""
    place = sp.Dummy(real=True)
    symbols = {p.name: p.symbol for p in equations.system.parameters}
    value = sp.sympify(body.format("place_"), locals={**symbols, "place_": place}, rational=True)

    def replaced(call):
        order = call.func.__name__.count("'")
        return sp.diff(value, place, order).xreplace({place: call.args[0]})

    return expression.replace(lambda e: isinstance(e, AppliedUndef), replaced)


@pytest.mark.slow
@pytest.mark.parametrize("body", GIVEN)
@pytest.mark.parametrize("name", list(SCENES))
def test_a_given_function_in_place_of_the_unknown_one(name, body):
    unknown, given = with_function(name), with_function(name, body)
    symbols = {
        p.symbol: q.symbol
        for p, q in zip(unknown.system.parameters, given.system.parameters, strict=True)
    }
    pairs = [*zip(unknown.system.forcing, given.system.forcing, strict=True)]
    for row, other in zip(unknown.system.mass_matrix, given.system.mass_matrix, strict=True):
        pairs += zip(row, other, strict=True)
    for general, special in pairs:
        difference = put_in(general, unknown, body).xreplace(symbols) - special
        at = {
            s: sp.Rational(n + 3, 7) for n, s in enumerate(sorted(difference.free_symbols, key=str))
        }
        assert abs(sp.N(difference.xreplace(at), 40)) < 1e-30


def test_the_form_of_textbooks():
    derivation = loads(CENTRAL.replace("FUNCTION", '{of: r, latex: "\\\\Phi"}')).derive()
    assert "r   m r̈ - m r φ̇² + V′(r) = 0" in derivation.text()
    assert r"m \ddot{r} - m r \dot{\phi}^{2} + {\Phi}'(r)" in derivation._repr_latex_()
    residual = derivation.report()["equations"][0]["residual"]
    assert residual == "m*ddot(r) - m*r*dot(phi)^2 + V'(r)"
    curve = loads(CURVE.replace("FUNCTION", "x")).derive().text()
    assert "(1 + f′(x)²) ẍ + ẋ² f′(x) f″(x) + g f′(x) = 0   (divided by m)" in curve


def test_conserved_quantities_are_proven():
    central = loads(CENTRAL.replace("FUNCTION", "r")).derive()
    assert [c["name"] for c in central.report()["conserved"]] == ["p_phi", "energy"]
    assert central.report()["cyclic"] == ["phi"]
    driven = loads(SUPPORT.replace("FUNCTION", "t")).derive()
    assert driven.report()["conserved"] == []


def test_expectations_are_checked(tmp_path):
    equations = (
        "[\"m*ddot(r) - m*r*dot(phi)^2 + V'(r) = 0\", 'r*ddot(phi) + 2*dot(r)*dot(phi) = 0']"
    )
    scene = tmp_path / "central.yaml"
    text = CENTRAL.replace("FUNCTION", "r") + f"expect: {{equations: {equations}}}\n"
    scene.write_text(text)
    assert check_scene(str(scene)).outcome == "pass"
    scene.write_text(text.replace("V'(r) = 0", "V''(r) = 0"))
    assert check_scene(str(scene)).outcome == "fail"


def test_code_needs_the_function():
    derivation = loads(CENTRAL.replace("FUNCTION", "r")).derive()
    formats = ("c", "python")
    for make in (*(partial(derivation.emit, name) for name in formats), derivation.model):
        with pytest.raises(InputError, match="function 'V' is not given") as caught:
            make()
        assert caught.value.problems[0].hint.startswith("V: {of: r, equals:")
    assert derivation.emit("latex")


@pytest.mark.slow
def test_a_given_function_is_simulated():
    values = "m: 1, k: 4, a: 0.5"
    text = CENTRAL.replace("m: {positive: true}, k: {positive: true}, a: {positive: true}", values)
    text = text.replace("initial: {r: 1}", "initial: {r: 1, phi: 0, dot(r): 0, dot(phi): 1}")
    given = loads(text.replace("FUNCTION", "{of: s, equals: k*s^2/2 + a*s^4}"))
    inline = loads(
        text.replace("functions: {V: FUNCTION}\n", "").replace("V(r)", "k*r^2/2 + a*r^4")
    )
    first, second = (s.derive().simulate(until=3, accuracy=1e-10).state for s in (given, inline))
    assert first == pytest.approx(second, rel=1e-9)


def test_functions_of_functions():
    text = CENTRAL.replace("{V: FUNCTION}", "{U: r, V: {of: s, equals: U(s^2) + k*U'(s)}}")
    assert "V = k U′(r) + U(r²)" in loads(text).derive().text().replace(
        "U(r²) + k U′(r)", "k U′(r) + U(r²)"
    )


REFUSED = {
    "functions: {V: q}": "unknown name 'q' in function 'V'",
    "functions: {sin: r}": "'sin' is reserved",
    "functions: {V: {of: r, equals: q*r}}": "'q' in function 'V' is neither its argument nor",
    "functions: {V: {of: r, equals: V(r)}}": "unknown function 'V'",
    "functions: {V: {of: r, equals: W(r)}, W: r}": "unknown function 'W'",
    "functions: {V: [r]}": "expected the name of its argument",
    "functions: {V: {equals: r}}": "function 'V' has no 'of'",
    "functions: {r: r}": "'r' is a function and also a coordinate",
    "functions: {'V[1]': r}": "function 'V[1]' has an index",
    "functions: {V: r}\noutputs: {o: V}": "unknown name 'V'",
    "functions: {V: r}\noutputs: {o: 'V(r, phi)'}": "takes 1 argument, found 2",
    "functions: {V: r}\noutputs: {o: W(r)}": "unknown function 'W'",
    'functions: {V: r}\noutputs: {o: "sin\'(r)"}': "unknown function",
    'functions: {V: r}\noutputs: {o: "V\'"}': "unexpected character",
}


@pytest.mark.parametrize("lines", list(REFUSED))
def test_refused(lines):
    text = CENTRAL.replace("functions: {V: FUNCTION}", lines).replace(
        "central: V(r)", "central: k*r"
    )
    with pytest.raises(InputError) as caught:
        loads(text)
    assert any(REFUSED[lines] in p.message for p in caught.value.problems), caught.value
