"""Formulas between dollars in titles and descriptions: typeset if allowed, text otherwise."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli import loads
from lagrange_cli.latex_allowlist import check_latex, with_formulas
from lagrange_cli.notation.symbols import latex_prose

SCENE = r"""
name: bead
title: "Bead with $\\omega_0^2$, 50 $ left"
description: "It costs $5 and $6; $\\Omega$ turns. Not allowed: $\\frac{1}{2}$."
parameters:
  m: {value: 1, description: "mass $m_0$"}
  k: {value: 2}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: {x: {description: "way from $\\bar{x}$"}}
potentials: {spring: k*x^2/2}
"""


@pytest.mark.parametrize(
    ("target", "told"),
    [
        (
            "latex",
            (r"with $\omega_0^2$, 50 \$ left", r"costs \$5 and \$6; $\Omega$ turns", "mass $m_0$"),
        ),
        (
            "markdown",
            (r"# Bead with $\omega_0^2$, 50 \$ left", r"\$5 and \$6; $\Omega$ turns", "mass $m_0$"),
        ),
        ("typst", (r"scripts(omega_0^2)$, 50 \$ left", r"\$5 and \$6; $Omega$ turns")),
    ],
)
def test_allowed_formulas_are_typeset(target, told):
    options = {"sections": "system,account"} if target != "latex" else {"sections": "system"}
    (text,) = loads(SCENE).derive().emit(target, **options).values()
    for part in told:
        assert part in text
    assert r"\frac" not in text.partition("Not allowed")[2].partition("\n")[0].replace(r"\\", "")


def test_what_is_not_allowed_is_told_and_prints_as_text():
    derivation = loads(SCENE).derive()
    (warning,) = [w for w in derivation.equations.derivation.warnings if w.rule == "latex"]
    assert "cannot hold the macro '\\frac'" in warning.message
    (text,) = derivation.emit("latex").values()
    assert r"\$\textbackslash{}frac\{1\}\{2\}\$" in text


@given(st.text(alphabet="$\\{}ab_^ 1#%&\n", max_size=30))
def test_nothing_but_allowed_formulas_reaches_latex(text):
    formulas: list[str] = []

    def kept(formula: str) -> str:
        formulas.append(formula)
        return ""

    remaining = with_formulas(text, lambda words: words.replace("$", r"\$"), kept)
    assert all(check_latex(formula) is None for formula in formulas)
    assert remaining.count("$") == remaining.count(r"\$")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a $b$ c", "a $b$ c"),
        ("$b$", "$b$"),
        ("($b_1$), $c$.", "($b_1$), $c$."),
        ("$5 and $6", r"\$5 and \$6"),
        ("$a $b$", r"\$a $b$"),
        ("a $b$2", r"a \$b\$2"),
        ("$$a$$", r"\$$a$\$"),
        ("  a\n$b$ ", " a $b$ "),
    ],
)
def test_blanks_and_dollars(text, told):
    assert latex_prose(text) == told
