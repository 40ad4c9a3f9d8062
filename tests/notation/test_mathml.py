"""MathML: each kind of node, names, keys of LaTeX, escaped text; all of it is MathML Core."""

import pytest

from lagrange_cli.latex_allowlist import ACCENTS, SYMBOLS, check_latex
from lagrange_cli.notation.layout import break_lines
from lagrange_cli.notation.printers.mathml import (
    MathmlPrinter,
    mathml,
    mathml_name,
    mathml_number,
    mathml_of_latex,
    mathml_signs,
    mathml_table,
    mathml_text,
    mathml_unit,
)
from lagrange_cli.notation.tree import (
    Dependence,
    DisplayCall,
    DisplayFraction,
    DisplayNumber,
    DisplayPi,
    DisplayPower,
    DisplayProduct,
    DisplayRange,
    DisplayRate,
    DisplayRoot,
    DisplaySeries,
    DisplaySum,
    DisplaySymbol,
    OrderTraits,
    SignedNode,
)
from tests.notation.mathml_reader import MathmlReader, assert_is_core, parsed

TRAITS = OrderTraits(Dependence.PARAMETER, 0, 0, "")


def letter(name, order=0, latex=None):
    return DisplaySymbol(name, order, latex, TRAITS)


def number(above, below=1, literal=None):
    return DisplayNumber(above, below, TRAITS, literal)


def total(*terms):
    return DisplaySum(tuple(SignedNode(sign == "-", node) for sign, node in terms), TRAITS)


def product(*factors):
    return DisplayProduct(factors, TRAITS)


def power(base, exponent):
    return DisplayPower(base, exponent, TRAITS)


def call(function, *arguments, order=None):
    return DisplayCall(function, arguments, TRAITS, order)


def series(body, *ranges):
    return DisplaySeries(body, ranges, TRAITS)


A, B, X, MASS = letter("a"), letter("b"), letter("x", 1), letter("mass")
SUM = total(("+", A), ("-", B))
MI_A, MI_B = "<mi>a</mi>", "<mi>b</mi>"
TIMES, THIN = "<mo>&#x2062;</mo>", '<mspace width="0.167em"/>'
APPLIED = "<mo>&#x2061;</mo>"
OPENING, CLOSING = '<mo stretchy="false">(</mo>', '<mo stretchy="false">)</mo>'
MI_MASS = '<mi mathvariant="normal">mass</mi>'
HALF = "<mfrac><mn>1</mn><mn>2</mn></mfrac>"
RANGE = DisplayRange("i", "1", "n-1")


@pytest.mark.parametrize(
    ("node", "text"),
    [
        (number(7), "<mn>7</mn>"),
        (number(1, 2), HALF),
        (number(981, 100, "9.81"), "<mn>9.81</mn>"),
        (DisplayPi(TRAITS), "<mi>π</mi>"),
        (X, '<mover accent="true"><mi>x</mi><mo>˙</mo></mover>'),
        (letter("q", 0, r"\theta_1"), "<msub><mi>θ</mi><mn>1</mn></msub>"),
        (SUM, f"{MI_A}<mo>−</mo>{MI_B}"),
        (total(("-", A), ("+", B)), f'<mo form="prefix">−</mo>{MI_A}<mo>+</mo>{MI_B}'),
        (product(number(1, 2), A, B), f"{HALF}{TIMES}{MI_A}{TIMES}{MI_B}"),
        (product(A, MASS), f"{MI_A}{TIMES}{THIN}{MI_MASS}"),
        (product(A, number(2)), f"{MI_A}<mo>⋅</mo><mn>2</mn>"),
        (product(A, SUM), f"{MI_A}{TIMES}{OPENING}{MI_A}<mo>−</mo>{MI_B}{CLOSING}"),
        (
            DisplayFraction(SUM, A, TRAITS),
            f"<mfrac><mrow>{MI_A}<mo>−</mo>{MI_B}</mrow>{MI_A}</mfrac>",
        ),
        (power(A, number(2)), f"<msup>{MI_A}<mn>2</mn></msup>"),
        (power(letter("a_1"), number(2)), f"<msubsup>{MI_A}<mn>1</mn><mn>2</mn></msubsup>"),
        (
            power(A, number(3, 2)),
            f"<msup>{MI_A}<mrow><mn>3</mn>"
            '<mo lspace="0em" rspace="0em">/</mo><mn>2</mn></mrow></msup>',
        ),
        (
            power(SUM, number(2)),
            f"{OPENING}{MI_A}<mo>−</mo>{MI_B}<msup>{CLOSING}<mn>2</mn></msup>",
        ),
        (
            power(DisplayFraction(A, B, TRAITS), number(2)),
            f"<msup><mrow><mo>(</mo><mfrac>{MI_A}{MI_B}</mfrac><mo>)</mo></mrow><mn>2</mn></msup>",
        ),
        (DisplayRoot(SUM, TRAITS), f"<msqrt>{MI_A}<mo>−</mo>{MI_B}</msqrt>"),
        (call("sin", A), f"<mi>sin</mi>{APPLIED}{THIN}{MI_A}"),
        (
            power(call("sin", SUM), number(2)),
            f"<msup><mi>sin</mi><mn>2</mn></msup>{APPLIED}{OPENING}{MI_A}<mo>−</mo>{MI_B}{CLOSING}",
        ),
        (
            call("atan2", A, B),
            f"<mi>atan2</mi>{APPLIED}{OPENING}{MI_A}<mo>,</mo>{MI_B}{CLOSING}",
        ),
        (call("asin", A), f"<mi>arcsin</mi>{APPLIED}{OPENING}{MI_A}{CLOSING}"),
        (call("exp", A), f'<msup><mi mathvariant="normal">e</mi>{MI_A}</msup>'),
        (
            power(call("abs", A), number(3)),
            f"<msup><mrow><mo>|</mo>{MI_A}<mo>|</mo></mrow><mn>3</mn></msup>",
        ),
        (
            call("V_s", A, order=2),
            f"<msubsup><mi>V</mi><mi>s</mi><mo>′′</mo></msubsup>{APPLIED}{OPENING}{MI_A}{CLOSING}",
        ),
        (
            series(A, RANGE),
            "<munderover><mo>∑</mo>"
            '<mrow><mi>i</mi><mo lspace="0em" rspace="0em">=</mo><mn>1</mn></mrow>'
            '<mrow><mi>n</mi><mo lspace="0em" rspace="0em">−</mo><mn>1</mn></mrow>'
            f"</munderover> {MI_A}",
        ),
        (
            series(A, DisplayRange("i", "1", "n"), DisplayRange("j", "2", "n", after="i")),
            "<munder><mo>∑</mo>"
            '<mrow><mi>i</mi><mo lspace="0em" rspace="0em">&lt;</mo><mi>j</mi></mrow></munder> '
            f"{MI_A}",
        ),
    ],
)
def test_nodes(node, text):
    assert MathmlPrinter().inline(node) == text
    assert_is_core(parsed(text))


def test_the_rate_of_a_quantity():
    upright = '<mi mathvariant="normal">d</mi>'
    (piece,) = MathmlPrinter().pieces(DisplayRate(A, TRAITS))
    assert piece.text == (
        f"<mfrac>{upright}<mrow>{upright}<mi>t</mi></mrow></mfrac> "
        f"<mrow><mo>(</mo>{MI_A}<mo>)</mo></mrow>"
    )


@pytest.mark.parametrize(
    ("name", "order", "text"),
    [
        ("x", 0, "<mi>x</mi>"),
        ("theta", 2, '<mover accent="true"><mi>θ</mi><mo>¨</mo></mover>'),
        ("Omega", 0, '<mi mathvariant="normal">Ω</mi>'),
        ("mass", 0, MI_MASS),
        ("é", 0, '<mi mathvariant="normal">é</mi>'),
        ("x_bob", 0, '<msub><mi>x</mi><mi mathvariant="normal">bob</mi></msub>'),
        ("x12", 0, "<msub><mi>x</mi><mn>12</mn></msub>"),
        ("p_theta1", 0, "<msub><mi>p</mi><msub><mi>θ</mi><mn>1</mn></msub></msub>"),
        (
            "x[1,2]",
            0,
            '<msub><mi>x</mi><mrow><mn>1</mn><mo lspace="0em" rspace="0em">,</mo><mn>2</mn></mrow>'
            "</msub>",
        ),
        (
            "u[i+1]",
            0,
            '<msub><mi>u</mi><mrow><mi>i</mi><mo lspace="0em" rspace="0em">+</mo><mn>1</mn></mrow>'
            "</msub>",
        ),
        ("lambda(rod)", 0, '<msub><mi>λ</mi><mi mathvariant="normal">rod</mi></msub>'),
    ],
)
def test_names(name, order, text):
    assert mathml_name(name, order) == text
    assert_is_core(parsed(text))


@pytest.mark.parametrize(
    ("latex", "text"),
    [
        (r"\alpha", "<mi>α</mi>"),
        (r"\theta_{12}", "<msub><mi>θ</mi><mn>12</mn></msub>"),
        (r"x_12", "<mrow><msub><mi>x</mi><mn>1</mn></msub><mn>2</mn></mrow>"),
        (r"1_2^3", "<msubsup><mn>1</mn><mn>2</mn><mn>3</mn></msubsup>"),
        (r"x'_1", "<msubsup><mi>x</mi><mn>1</mn><mo>′</mo></msubsup>"),
        (r"\hat{x}", '<mover accent="true"><mi>x</mi><mo stretchy="false">ˆ</mo></mover>'),
        (r"\widehat{x}", '<mover accent="true"><mi>x</mi><mo>ˆ</mo></mover>'),
        (r"\underline{x}", '<munder accentunder="true"><mi>x</mi><mo>_</mo></munder>'),
        (r"m_{\mathrm{rod}}", '<msub><mi>m</mi><mi mathvariant="normal">rod</mi></msub>'),
        (r"\mathcal{LA}", '<mi mathvariant="normal">ℒ𝒜</mi>'),
        (r"\mathbb R", '<mi mathvariant="normal">ℝ</mi>'),
        (r"\mathfrak C", '<mi mathvariant="normal">ℭ</mi>'),
        (r"\mathbf{\beta 1}", '<mi mathvariant="normal">𝛃𝟏</mi>'),
        (r"x\,y", '<mrow><mi>x</mi><mspace width="0.167em"/><mi>y</mi></mrow>'),
        (r"\,'", '<mrow><mspace width="0.167em"/><msup><mrow/><mo>′</mo></msup></mrow>'),
        (r"x_{}", "<msub><mi>x</mi><mrow/></msub>"),
    ],
)
def test_keys_of_latex(latex, text):
    assert check_latex(latex) is None
    assert mathml_of_latex(latex) == text
    assert_is_core(parsed(text))


INFIX, PREFIX = '<mo form="infix">{}</mo>', '<mo form="prefix">−</mo>'


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        (f"{MI_A} = {MI_B}", f"{MI_A}{INFIX.format('=')}{MI_B}"),
        (f"{MI_A} - {MI_B}", f"{MI_A}{INFIX.format('−')}{MI_B}"),
        (f"= -{MI_B} + 0", f"{INFIX.format('=')}{PREFIX}{MI_B}{INFIX.format('+')}<mn>0</mn>"),
        ("n-1", f"<mi>n</mi>{INFIX.format('−')}<mn>1</mn>"),
        (f"({MI_A}, 2.5)", f"{OPENING}{MI_A}<mo>,</mo><mn>2.5</mn>{CLOSING}"),
        ("theta_1 ≥ 0", "<msub><mi>θ</mi><mn>1</mn></msub><mo>≥</mo><mn>0</mn>"),
        ("<mtext>a - b &lt; 2</mtext>", "<mtext>a - b &lt; 2</mtext>"),
        (f"<mfrac>{MI_A}{MI_B}</mfrac>", f"<mfrac>{MI_A}{MI_B}</mfrac>"),
    ],
)
def test_signs_between_elements_are_elements(text, shown):
    assert mathml_signs(text) == shown
    assert mathml_signs(shown) == shown
    assert_is_core(parsed(shown))


KG, METRE, SECOND = (f'<mi mathvariant="normal">{unit}</mi>' for unit in ("kg", "m", "s"))
SLASH = '<mo lspace="0em" rspace="0em">/</mo>'
TIGHT = '<mo lspace="0em" rspace="0em" stretchy="false">'


@pytest.mark.parametrize(
    ("unit", "text"),
    [
        ("kg*m^2/s", f"{KG}{THIN}<msup>{METRE}<mn>2</mn></msup>{SLASH}{SECOND}"),
        ("kg m^-1", f"{KG}{THIN}<msup>{METRE}{{}}</msup>"),
        ("1/s^(1/2)", f"<mn>1</mn>{SLASH}<msup>{SECOND}{{}}</msup>"),
        ("1/(kg s)", f"<mn>1</mn>{SLASH}{TIGHT}(</mo>{KG}{THIN}{SECOND}{TIGHT})</mo>"),
        ("<b>", "<mtext>&lt;b&gt;</mtext>"),
        ("a, b", "<mtext>a, b</mtext>"),
    ],
)
def test_units(unit, text):
    minus = '<mrow><mo lspace="0em" rspace="0em">−</mo><mn>1</mn></mrow>'
    half = f"<mrow><mn>1</mn>{SLASH}<mn>2</mn></mrow>"
    assert mathml_unit(unit) == text.format(minus if "-" in unit else half)
    assert_is_core(parsed(mathml_unit(unit)))


def test_dots_stand_over_the_letter_of_a_key():
    dotted = '<mover accent="true"><mi>θ</mi><mo stretchy="false">˙</mo></mover>'
    assert mathml_name("q", 1, r"\theta_{1}") == f"<msub>{dotted}<mn>1</mn></msub>"


def test_every_macro_of_latex_keys_is_written():
    keys = [rf"\{name}" for name in sorted(SYMBOLS)]
    keys += [rf"\{name}{{x}}_{{1}}^*" for name in sorted(ACCENTS)]
    keys += [r"x\,y\:z\;w\!v\ u", "A-z0'()+*/=.,|"]
    assert len(keys) == len(SYMBOLS) + len(ACCENTS) + 2 > 90
    for key in keys:
        assert check_latex(key) is None
        (element,) = parsed(mathml_name("q", 1, key))
        assert_is_core(element)
        assert "\\" not in mathml_of_latex(key)


@pytest.mark.parametrize("text", ["a < b & c > d", "<script>x</script>", "\x00\x1b]\n'\"", "中文"])
def test_no_text_acts_as_markup(text):
    (element,) = parsed(mathml_text(text))
    assert element.text == "".join(c if c.isprintable() else " " for c in text)
    assert_is_core(element)


def test_numbers():
    ten = "<msup><mn>10</mn><mrow>{}<mn>31</mn></mrow></msup>".format(
        '<mo lspace="0em" rspace="0em">−</mo>'
    )
    assert mathml_number("9.81") == "<mn>9.81</mn>"
    assert mathml_number("1e-31") == ten
    assert mathml_number("6.67E-31") == f"<mrow><mn>6.67</mn><mo>×</mo>{ten}</mrow>"
    assert MathmlReader(mathml_number("6.67e-11"), {}).read() == pytest.approx(6.67e-11)


def test_lines_of_a_formula_are_rows_of_a_table():
    long = total(*(("+", product(letter(f"a_{i}"), SUM)) for i in range(6)))
    lines = break_lines(MathmlPrinter().pieces(long), 30, 26)
    assert len(lines) > 1
    assert all(line.text.startswith('<mo form="infix">+</mo>') for line in lines[1:])
    rows = [["<mi>T</mi><mo>=</mo>" if line is lines[0] else "", line.text] for line in lines]
    table = mathml(mathml_table(rows, ("right", "left")), block=True)
    assert table.startswith('<math xmlns="http://www.w3.org/1998/Math/MathML" display="block">')
    (math,) = parsed(table)
    assert math.tag.endswith("}math")
    assert [len(row) for row in math[0]] == [2] * len(lines)
    for line in lines:
        assert_is_core(parsed(line.text))
    values = {f"<msub><mi>a</mi><mn>{i}</mn></msub>": 1.0 + i for i in range(6)}
    values |= {MI_A: 5.0, MI_B: 3.0}
    body = mathml_table([[line.text] for line in lines], ["left"])
    assert MathmlReader(body, values).read() == 42


def test_a_wide_part_of_a_fraction_is_on_several_lines():
    long = total(*(("+", product(letter(f"a_{i}"), A, B)) for i in range(12)))
    text = MathmlPrinter(20).inline(DisplayFraction(number(1), long, TRAITS))
    assert "<mtable" in text
    assert_is_core(parsed(text))


def test_widths_are_those_of_what_is_seen():
    printer = MathmlPrinter()
    assert printer.columns('<mi mathvariant="normal">a&amp;b</mi><mo>&#x2062;</mo><mn>12</mn>') == 5
    (piece,) = printer.pieces(power(A, number(2)))
    assert piece.width == pytest.approx(2.0)


def test_the_reader():
    text = f"<mn>2</mn>{TIMES}{MI_A}<mo>−</mo><mfrac>{MI_B}<mn>4</mn></mfrac>"
    assert MathmlReader(text, {MI_A: 3.0, MI_B: 2.0}).read() == 5.5
    with pytest.raises(KeyError):
        assert_is_core(parsed("<mfenced><mi>a</mi></mfenced>"))
    for wrong in ("<mfrac><mi>a</mi></mfrac>", '<mi mathvariant="bold">a</mi>', "<mrow>a</mrow>"):
        with pytest.raises(AssertionError):
            assert_is_core(parsed(wrong))
