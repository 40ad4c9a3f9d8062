"""Expressions too long to be read: their count in their place, and all of them on request."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
import sympy

from lagrange_cli import load, loads
from lagrange_cli.cli.main import run
from lagrange_cli.notation.vocabulary import MOST_OPERATIONS, Omission, operations
from lagrange_cli.report.contents.derivation.contents import derivation_text

SYSTEMS = Path(__file__).resolve().parents[2] / "systems"

#: Terms of a potential a cos(x/k): it is too long, as is its slope.
TERMS = 760

SCENE = f"""
title: A bead on a bumpy wire
parameters: {{m: 1, a: 1}}
particles: {{bead: {{mass: m, position: [x, 0, 0]}}}}
coordinates: [x]
potentials: {{bumps: "{" + ".join(f"a*cos(x/{k})" for k in range(1, TERMS))}"}}
"""

x = sympy.Symbol("x", real=True)


@cache
def derived():
    return loads(SCENE, file="bumps.yaml").derive()


def written(to: str, derivation=None, **options) -> str:
    derivation = derivation or derived()
    if to == "text":
        return derivation_text(derivation.equations, **options)
    (text,) = derivation.emit(to, **options).values()
    return text


@pytest.mark.slow
@pytest.mark.parametrize("to", ["text", "latex", "markdown", "typst"])
def test_long_expressions_are_left_out_and_printed_on_request(to):
    short, whole = (written(to, written_out=w) for w in (False, True))
    assert len(short) < 12_000
    assert len(whole) > 30_000
    assert "operations)" in short
    assert "operations" not in whole


@pytest.mark.parametrize("way", ["lagrange", "dalembert"])
def test_steps_leave_out_long_lines_too(way, monkeypatch):
    """With few operations as the most; steps of long equations are refused."""
    monkeypatch.setattr("lagrange_cli.notation.vocabulary.MOST_OPERATIONS", 20)
    derivation = load(SYSTEMS / "pendulums" / "double_pendulum.yaml").derive(steps=way)
    for to in ("text", "latex"):
        short, whole = (written(to, derivation, written_out=w) for w in (False, True))
        assert short.count("operations)") > 3
        assert "operations)" not in whole
        assert len(short) < len(whole)


@pytest.mark.parametrize(
    ("options", "count", "sentence"),
    [
        ({}, "(4,553 operations)", "of more than 3,000 operations are left out; --written-out"),
        ({"language": "de"}, "(4.553 Rechenoperationen)", "mehr als 3.000 Rechenoperationen sind"),
        (
            {"language": "fr"},
            "(4\u00a0553 opérations)",
            "plus de 3\u00a0000 opérations sont omises",
        ),
        ({"language": "fr", "ascii": True}, "(4 553 operations)", "plus de 3 000 operations sont"),
    ],
)
def test_each_language_says_what_is_left_out(options, count, sentence):
    page = derivation_text(derived().equations, width=200, **options)
    assert count in page
    assert sentence in page


@pytest.mark.slow
@pytest.mark.parametrize(
    ("to", "options", "typed"),
    [
        ("latex", {}, r"\texttt{{-}{-}written{-}out}"),
        ("latex", {"style": "beamer"}, r"\texttt{{-}{-}written{-}out}"),
        ("latex", {"style": "snippet"}, r"\texttt{{-}{-}written{-}out}"),
        ("markdown", {}, "`--written-out`"),
        ("typst", {}, '#raw("--written-out")'),
        ("html", {}, "<code>--written-out</code>"),
    ],
)
def test_a_page_says_once_how_to_see_all(to, options, typed):
    assert written(to, **options).count(typed) == 1


@pytest.mark.slow
def test_json_and_code_have_everything():
    report = derived().report(latex=True)
    assert report["equations"][0]["residual"].count("sin") == TERMS - 1
    assert report["latex"]["potential"].count(r"\cos") == TERMS - 1
    assert "operations)" not in str(report)
    assert "".join(derived().emit("c").values()).count("sin(") > TERMS / 2


@pytest.mark.slow
def test_the_option_is_one_of_derive_and_emit(tmp_path, capsys):
    scene = tmp_path / "bumps.yaml"
    scene.write_text(SCENE, encoding="utf-8")
    for command, *options in (["derive"], ["emit", "--to", "markdown"]):
        assert run([command, str(scene), *options, "--written-out", "-q"]) == 0
        assert len(capsys.readouterr().out) > 30_000


@pytest.mark.parametrize(
    ("expression", "count"),
    [(x, 0), (x + 1, 1), (2 * x**3, 2), (sympy.sin(x) + x, 2), (-x, 1), (x / 2, 1)],
)
def test_operations_are_counted(expression, count):
    assert operations([expression]) == count
    assert operations([expression, x]) == count + 1


@pytest.mark.parametrize("count", [MOST_OPERATIONS, MOST_OPERATIONS + 1])
def test_one_operation_more_than_the_most_is_left_out(count):
    total = sympy.Add(*sympy.symbols(f"x:{count + 1}"))
    assert operations([total]) == count
    omission = Omission(str)
    instead = omission.instead([total])
    assert (instead is None) == (count == MOST_OPERATIONS)
    assert omission.counts == ([] if instead is None else [count])
