"""Typst: names, keys of LaTeX, escaped text, parentheses across lines."""

import json

import pytest

from lagrange_cli.latex_allowlist import ACCENTS, SYMBOLS, check_latex
from lagrange_cli.notation.printers.typst import (
    balanced,
    typst_name,
    typst_number,
    typst_string,
    typst_text,
    typst_unit,
)
from tests.typst_compiler import pages, typst

HOSTILE = [
    '#panic("x") #read("/etc/passwd") #{while true {}}',
    "$x$ *bold* _it_ `raw` <label> @ref #1 = head",
    "= heading",
    "- item",
    "+ item",
    "/ term: text",
    "12. item",
    "// gone /* gone */ http://example.org ~ -- --- ... -1 -?",
    "\"straight\" and 'straight' \\u{41} \\ end \\",
    "two\nlines\n\n= three",
    "[content] {code} & % ^ | ; : ! ?",
    "Ωmega äöü ß 中文 \u202e 🚀 ½ µm",
    "\x00\x07\x1b[31m",
]


def printed(text):
    """Text without characters that do not print, its blanks one each."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def words_of(content):
    """The text of Typst's content."""
    if isinstance(content, list):
        return "".join(map(words_of, content))
    if content["func"] == "space":
        return " "
    assert content["func"] in ("text", "symbol", "sequence"), content
    return content["text"] if "text" in content else words_of(content["children"])


@pytest.mark.parametrize("text", HOSTILE)
def test_text_comes_out_as_itself(text):
    """In a paragraph, where lists and headings begin, too."""
    source = f"#metadata[\n{typst_text(text)}\n] <it>\n$ x_({typst_string(text)}) $"
    (found,) = json.loads(typst().query(source.encode(), "<it>", field="value"))
    assert words_of(found).strip() == printed(text)


@pytest.mark.parametrize(
    ("name", "order", "primes", "text"),
    [
        ("x", 0, 0, "x"),
        ("theta1", 1, 0, "dot(theta)_1"),
        ("theta_1", 2, 0, "dot.double(theta)_1"),
        ("phi", 0, 0, "phi.alt"),
        ("varphi", 0, 0, "phi"),
        ("Ω", 0, 0, "Omega"),
        ("x_bob", 0, 0, 'x_"bob"'),
        ("x[1,2]", 1, 0, "dot(x)_(1, 2)"),
        ("p_theta1", 0, 0, "p_(theta_1)"),
        ("lambda(rod)", 0, 0, 'lambda_"rod"'),
        ("angle", 1, 0, 'dot("angle")'),
        ("V_s", 0, 2, "V''_s"),
    ],
)
def test_names(name, order, primes, text):
    assert typst_name(name, order, primes=primes) == text


@pytest.mark.parametrize(
    ("latex", "text"),
    [
        (r"\alpha", "alpha"),
        (r"\varphi", "phi"),
        (r"\phi", "phi.alt"),
        (r"\hat{x}", "hat(x)"),
        (r"\theta_{1}", "scripts(theta_1)"),
        (r"x_12", "scripts(x_1 2)"),
        (r"x_\alpha^\beta", "scripts(x_alpha^beta)"),
        (r"{x}_{y_{z}}", "scripts(x_(y_z))"),
        (r"\vec{r}\,'", 'scripts(arrow(r) thin ""\')'),
        (r"x_{}", 'scripts(x_"")'),
        ("f(a,b)/2", r"f \( a \, b \) \/ 2"),
        (r"\mathbf x", "upright(bold(x))"),
    ],
)
def test_keys_of_latex(latex, text):
    assert check_latex(latex) is None
    assert typst_name("q", 0, latex) == text


def test_dots_stand_over_the_letter_of_a_key():
    assert typst_name("q", 1, r"\theta_{1}") == "scripts(dot(theta)_1)"
    assert typst_name("q", 2, r"\hat{x}") == "dot.double(hat(x))"


@pytest.mark.slow
def test_every_macro_of_latex_keys_compiles():
    keys = [rf"\{name}" for name in sorted(SYMBOLS)]
    keys += [rf"\{name}{{x}}_{{1}}^*" for name in sorted(ACCENTS)]
    keys += [r"x\,y\:z\;w\!v\ u", "A-z0'()+*/=.,|"]
    assert len(keys) == len(SYMBOLS) + len(ACCENTS) + 2 > 90
    for key in keys:
        assert check_latex(key) is None
        name = typst_name("q", 0, key)
        pages(f"$ {name} {typst_name('q', 1, key)} frac({name}^2, {name}) sqrt({name}) $")


@pytest.mark.parametrize(
    ("unit", "text"),
    [
        ("kg*m^2/s", r'upright("kg") thin upright("m")^2\/upright("s")'),
        ("m^(1/2)", r'upright("m")^(1\/2)'),
        ("1/m", r'1\/upright("m")'),
        (r"m^(#panic\()", '"m^(#panic\\\\()"'),
        ("°", '"°"'),
    ],
)
def test_units(unit, text):
    assert typst_unit(unit) == text
    pages(f"$ {text} $")


def test_numbers():
    assert [typst_number(n) for n in ("9.81", "1e-31", "6.67E-11")] == [
        *("9.81", "10^(-31)", "6.67 times 10^(-11)")
    ]


def test_parentheses_that_close_on_another_line_stand_alone():
    lines = ['a (b + sin(c) "(" ', "d) + (e) \\(", ") f"]
    assert balanced(lines) == ['a \\(b + sin(c) "(" ', "d\\) + (e) \\(", "\\) f"]
