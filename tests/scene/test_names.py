"""Names: what they may be, where they may stand, and what they rest on."""

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.latex_allowlist import check_latex
from lagrange_cli.scene import read_text

BOB = "particles: {bob: {mass: 1, position: [x, y, z]}}\n"


def rules(text: str) -> list[str]:
    with pytest.raises(InputError) as caught:
        read_text(text)
    return [problem.rule for problem in caught.value.problems]


@pytest.mark.parametrize(
    "text",
    [
        # Components by either name, abbreviations, time, and names of other languages.
        BOB + "potentials: {v: x*x_bob + z_bob*t}\n",
        BOB + "definitions: {v: dot(x), e: v^2}\nkinetic: {k: e + dot(y)*v}\n",
        BOB + "definitions: {x: y + z_bob, h: x}\ncoordinates: [y, z]\nconstraints: {c: h = 1}\n",
        BOB + "parameters: {E: 1, I: 2, N: 3, S: E, Q: I*pi, lambda: 4}\npotentials: {v: E*x}\n",
        # One name in two positions; a position in terms of another's component.
        "particles: {a: {mass: 1, position: [x, 0, 0]}, b: {mass: 1, position: [x, y, z]}}\n",
        "particles: {a: {mass: 1}, b: {mass: 1, position: [x_a, 1 + y_a, z_a]}}\n",
        # A point may have a name of its own.
        BOB + "points: {pulley: [0, 0, h]}\nconstraints: {c: z + h = 1}\n",
        # A mass in terms of constant definitions; a parameter that is a particle's name.
        "parameters: {m: 1, a: 2}\ndefinitions: {mu: m/2}\nparticles: {a: {mass: mu}}\n",
        BOB + "coordinates: [r, theta]\ndefinitions: {x: r*cos(theta), y: r*sin(theta), z: 0}\n"
        "initial: {x: 1, r: 2, dot(theta): 1, dot(z_bob): 0}\n",
        BOB + "potentials: {v: 'abs(x) + max(x, y) + sign(z)'}\n",
        BOB + "expect: {cyclic: [x], conserved: [energy, jacobi, p_x]}\n",
        # Exact beside rounded: 2^1200 is no double.
        BOB + "parameters: {a: sqrt(4), b: 2, c: a^2, d: b^2, e: d^100, f: e^6/e^6}\n",
    ],
)
def test_accepted(text: str) -> None:
    read_text(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (BOB + "potentials: {v: bob}\n", ["unknown-name"]),
        (BOB + "potentials: {v: x_bobb}\n", ["unknown-name"]),
        ("particles: {b: {mass: 1, position: [0, 0, -h]}}\n", ["unknown-name"]),
        (BOB + "coordinates: [x_bob]\n", ["clash"]),
        (BOB + "definitions: {x_bob: 1}\n", ["clash"]),
        (BOB + "parameters: {x_bob: 1}\n", ["clash"]),
        ("parameters: {x_bob: 1}\nparticles: {bob: {mass: 1}}\n", ["clash"]),
        (BOB + "parameters: {bob1: 1, bob_1: 2}\n", ["clash"]),
        (BOB + "parameters: {x_: 1}\n", ["clash"]),
        (BOB + "parameters: {a: {latex: '\\theta'}}\ncoordinates: [theta]\n", ["clash"]),
        ("particles: {p1: {mass: 1}, p_1: {mass: 1}}\n", ["clash", "clash", "clash", "clash"]),
        ("particles: {b: {mass: 1, position: [_, y, z]}}\n", ["name"]),
        ("coordinates: [t]\n", ["reserved"]),
        ("definitions: {sum: 1}\n", ["reserved"]),
        ("coordinates: [dot]\n", ["reserved"]),
        (BOB + "definitions: {a: b, b: a}\n", ["cycle"]),
        (BOB + "definitions: {x: x + 1}\n", ["cycle"]),
        ("particles: {a: {mass: 1, position: [y_a, x_a, 0]}}\n", ["cycle"]),
        ("parameters: {a: a}\n", ["cycle"]),
        (BOB + "forces: {f: {on: bob, force: [1, 2, 3]}}\ncoordinates: [bob]\n", ["clash"]),
        (BOB + "near: {x: dot(y)}\n", ["not-constant"]),
        (BOB + "definitions: {v: dot(x)}\nconstraints: {c: dot(v) = 0}\n", ["misplaced-rate"]),
        (BOB + "definitions: {v: dot(x)}\npotentials: {u: dot(v)}\n", ["misplaced-rate"]),
        (BOB + "definitions: {r: abs(x)}\nconstraints: {c: r = 0}\n", ["not-smooth"]),
        (BOB + "expect: {conserved: [p_bob]}\n", ["unknown-name"]),
    ],
)
def test_refused(text: str, expected: list[str]) -> None:
    assert rules(text) == expected


@pytest.mark.slow
def test_a_long_chain_of_definitions_is_no_circle() -> None:
    lines = [f"  q{i}a: q{i - 1}a + 1\n" for i in range(5000, 0, -1)]
    scene = read_text(BOB + "definitions:\n" + "".join(lines) + "  q0a: x\n")
    assert len(scene.definitions) == 5001


def test_growth_through_a_chain_is_refused_before_it_is_computed() -> None:
    lines = "".join(f"  q{i}a: q{i - 1}a*q{i - 1}a\n" for i in range(1, 200))
    assert "limit" in rules(BOB + "definitions:\n  q0a: 1.00001\n" + lines)
    assert "limit" in rules(BOB + "parameters:\n  q0a: 1.00001\n" + lines)


def test_warning_of_a_name_that_stands_alone() -> None:
    scene = read_text("particles: {b: {mass: 1, position: [x, y, zz]}}\npotentials: {v: x*y_b}\n")
    assert [(w.rule, w.severity, w.mark.column) for w in scene.warnings if w.mark] == [
        ("lone-name", "warning", 43)
    ]
    for mention in ("coordinates: [x, y, zz]", "initial: {zz: 0}", "plane: xy"):
        text = "particles: {b: {mass: 1, position: [x, y, zz]}}\npotentials: {v: x*y}\n" + mention
        assert read_text(text).warnings == ()
    assert read_text("particles: {b: {mass: 1}}").warnings == ()


@pytest.mark.parametrize(
    "text",
    [
        *("x", "x_1", r"\theta_{1}", r"\dot{\theta}^2", r"\mathrm{kin}", "x'", "x''_1"),
        *(r"\hat{x}_{\mathrm{b}}", r"\ell", r"{x}_{y_{z}}", r"\vec{r}\,'", "A^{*}", r"\vec x"),
    ],
)
def test_latex_that_passes(text: str) -> None:
    assert check_latex(text) is None


@pytest.mark.parametrize(
    "text",
    [
        *("", " ", "$x$", "x%", "x&y", "x~", "#1", "x\n", "é", "x" * 101, r"\\", r"\_", r"\(x\)"),
        *(r"\input{x}", r"\write18{ls}", r"\def\x{}", r"\csname x\endcsname", r"\begin{x}", r"\%"),
        *(
            "x^^41",
            "x__1",
            "x_1_2",
            "x^1^2",
            "x'^2",
            "_",
            "x_",
            r"\hat",
            r"\hat_x",
            r"x_\hat{y}",
            "x_'",
            r"\hat\vec x",
            r"\hat}",
        ),
        *("{", "}", "{x", "x}", "}{", r"\thetaa", r"\$", "\\"),
    ],
)
def test_latex_that_is_refused(text: str) -> None:
    assert check_latex(text)
