"""Typst: documents that compile with every display between the margins, hostile scenes."""

import importlib
import re
from dataclasses import replace
from pathlib import Path

import pytest
import sympy

from lagrange_cli import api
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.mechanics.findings import ConstraintLine
from tests.emit.emit_scenes import (
    build,
    chain_pendulum,
    coordinates,
    damped_driven,
    masses_through_hole,
    parameters,
)
from tests.emit.test_latex import strange
from tests.notation.test_typst import HOSTILE, printed
from tests.parts import changed
from tests.typst_compiler import pages, text_of, typst

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def displays_too_wide(monkeypatch):
    """What the campaign over all scenes finds too wide."""
    typst()
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    return importlib.import_module("documents").displays_too_wide


def emit(equations, **options):
    (text,) = EMITTERS["typst"].emit(equations, options).values()
    return text


def test_a_document_says_what_a_reader_asks():
    text = emit(masses_through_hole())
    headings = re.findall(r"^= (.*)$", text, re.MULTILINE)
    assert headings == [
        *("System", "Degrees of freedom", "Lagrangian", "Equations of motion"),
        *("Conserved quantities", "Certificate"),
    ]
    assert "$ theta: quad & M r^2 dot.double(theta) + 2 M r dot(r) dot(theta) = 0 $" in text
    assert "$p_theta$ is conserved" in text


@pytest.mark.slow
@pytest.mark.parametrize(
    "make",
    [
        lambda: chain_pendulum(6),
        damped_driven,
        strange,
        lambda: build("fixed", (), (), sympy.S(0), sympy.S(0)),
    ],
    ids=["pendulum_6", "damped_driven", "strange", "fixed"],
)
@pytest.mark.parametrize("form", ["lagrange", "explicit"])
def test_documents_compile_and_stay_on_the_page(make, form, displays_too_wide):
    assert displays_too_wide(emit(make(), form=form)) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "steps"),
    [
        ("contact/bouncing_ball", None),
        ("oscillators/driven_spring", "lagrange"),
        ("oscillators/calogero_moser", "dalembert"),
        ("rolling/knife_edge_on_incline", "dalembert"),
        ("constraints/four_bar_linkage", None),
        ("pulleys/double_atwood", "lagrange"),
    ],
)
def test_documents_of_scenes_compile(scene, steps, displays_too_wide):
    derivation = api.load(ROOT / "systems" / f"{scene}.yaml").derive(steps=steps, forces=True)
    for form in ("lagrange", "explicit"):
        (text,) = derivation.emit("typst", form=form).values()
        assert displays_too_wide(text) == []


def test_a_line_that_is_too_long_is_found(displays_too_wide):
    """The test above can fail."""
    text = emit(masses_through_hole())
    long = text.replace("+ 2 M r", "+ 2 " + "M r " * 60)
    assert long != text
    (points,) = displays_too_wide(long)
    assert 500 < points < 2000


@pytest.mark.slow
def test_formulas_are_numbered_once_each_and_can_be_referred_to():
    text = emit(chain_pendulum(6))
    labels = re.findall(r"<(eq:[\w:]+)>", text)
    assert len(labels) == len(set(labels)) == text.count("#numbered[") > 8
    long = re.findall(r"#long\[[^$]*\$[^$]*\$ <(eq:[\w:]+)>\]\]", text)
    assert 0 < len(long) < len(labels)
    number = 1 + labels.index(long[0])
    assert f"Equation {number}." in text_of(f"{text}\nSee @{long[0]}.").split("See")[1]


def test_a_long_table_runs_over_pages():
    many = build(
        "many",
        parameters(**{f"c{i}": 1.5 for i in range(80)}),
        coordinates("x"),
        coordinates("x")[0].v ** 2,
        sympy.Integer(0),
    )
    text = emit(many)
    assert text.count("[$1.5$],") == 80
    assert len(pages(text)) == 3


def hostile_scene(text):
    masses = masses_through_hole()
    first, *others = masses.system.parameters
    one, *more = masses.system.coordinates
    puck, *rest = masses.system.particles
    line = ConstraintLine(text, (text,), "redundant", (text,))
    return changed(
        masses,
        title=text,
        description=text,
        parameters=(replace(first, description=text, unit=text), *others),
        coordinates=(replace(one, description=text, unit=text), *more),
        particles=(replace(puck, name=text), *rest),
        account=replace(masses.derivation.account, lines=(line,)),
        conserved=tuple(replace(c, reason=text) for c in masses.derivation.conserved),
    )


@pytest.mark.parametrize("text", HOSTILE)
def test_no_text_of_a_scene_acts(text):
    """Titles, descriptions, names and units come out as themselves."""
    document = emit(hostile_scene(text))
    shown, plain = text_of(document), printed(text)
    assert len(re.findall("^= ", document, re.MULTILINE)) == 6
    # Title, description, meaning of a parameter and of a coordinate, particle, constraint at least.
    assert shown.count(plain) >= 6
