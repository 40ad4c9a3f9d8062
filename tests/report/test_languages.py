"""Languages of documents: complete catalogues, and no word of another language left."""

from __future__ import annotations

import ast
import pickle
import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from string import Formatter

import pytest
import yaml

import lagrange_cli.analysis
import lagrange_cli.pages
import lagrange_cli.report
import lagrange_cli.simulate
import lagrange_cli.studies
from lagrange_cli import load
from lagrange_cli.analysis.analyze import analyze
from lagrange_cli.analysis.result import Exponents
from lagrange_cli.api.analyzed import Analyzed
from lagrange_cli.api.formats import DERIVED, EMITTERS
from lagrange_cli.cli.main import run
from lagrange_cli.errors import InternalError
from lagrange_cli.phrases import Phrase, with_part
from lagrange_cli.report.contents.derivation.contents import derivation_text
from lagrange_cli.report.formats import ReportForm
from lagrange_cli.report.phrases.language import LANGUAGES, language
from lagrange_cli.report.registry import json_of
from tests.parts import changed

SYSTEMS = Path(__file__).resolve().parents[2] / "systems"
OTHERS = [code for code in LANGUAGES if code != "en"]
CATALOGUES = Path(lagrange_cli.report.__file__).parent / "phrases"


def repeated(node: yaml.Node | None) -> list[str]:
    """Keys that stand twice in a mapping of YAML, of which PyYAML keeps the last silently."""
    if not isinstance(node, yaml.MappingNode):
        return []
    keys = [key.value for key, _ in node.value]
    inner = [key for _, value in node.value for key in repeated(value)]
    return [key for key in dict.fromkeys(keys) if keys.count(key) > 1] + inner


def parts(phrase: str) -> list[str]:
    """Names in braces, in alphabetical order; a brace that is not closed raises ValueError."""
    return sorted(name for _, name, _, _ in Formatter().parse(phrase) if name is not None)


def phrases(path: Path) -> Iterator[str]:
    """What a module says: the texts that it hands to ``say`` and its methods."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    texts: dict[str, set[str]] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign):
            for name, value in pairs(node.targets[0], node.value):
                texts.setdefault(name, set()).add(value)
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            for argument in [*said(node), *kept(node)]:
                if isinstance(argument, ast.Constant):
                    yield argument.value
                elif isinstance(argument, ast.Name):
                    yield from texts.get(argument.id, ())


def pairs(target: ast.expr, value: ast.expr) -> Iterator[tuple[str, str]]:
    """Names that are assigned texts."""
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        for one, other in zip(target.elts, value.elts, strict=True):
            yield from pairs(one, other)
    elif isinstance(target, ast.Name) and isinstance(value, ast.Constant):
        yield target.id, str(value.value)


def said(call: ast.Call) -> list[ast.expr]:
    """The arguments of a call that are phrases."""
    function = call.func
    name = getattr(function, "attr", getattr(function, "id", ""))
    if name == "say":
        return call.args[:1]
    of = getattr(function, "value", None)
    is_saying = getattr(of, "attr", getattr(of, "id", "")) == "say"
    return call.args[1:3] if is_saying and name in ("counted", "first") else []


def kept(call: ast.Call) -> list[ast.expr]:
    """The patterns of phrases that results keep, which formats say later."""
    return call.args[:1] if getattr(call.func, "id", "") in ("Phrase", "pattern") else []


@cache
def spoken() -> frozenset[str]:
    """All phrases of the rooms of formats and of results; steps of JSON say expressions."""
    rooms = [
        Path(room.__file__).parent
        for room in (
            *(lagrange_cli.report, lagrange_cli.analysis, lagrange_cli.pages),
            *(lagrange_cli.simulate, lagrange_cli.studies),
        )
    ]
    modules = [p for r in rooms for p in r.rglob("*.py") if p.parent.name != "values"]
    return frozenset(phrase for path in modules for phrase in phrases(path))


@pytest.mark.slow
def test_phrases_are_found():
    assert len(spoken()) > 190
    assert "{count} degrees of freedom" in spoken()
    assert "Constraint forces" in spoken()


@pytest.mark.slow
@pytest.mark.parametrize("code", OTHERS)
def test_a_catalogue_has_all_phrases_and_no_other(code):
    assert set(language(code).phrases) == spoken()


def test_languages_are_those_of_the_catalogues():
    assert {path.stem for path in CATALOGUES.glob("*.yaml")} == set(OTHERS)


@pytest.mark.parametrize("code", OTHERS)
def test_a_catalogue_has_no_phrase_twice(code):
    assert repeated(yaml.compose((CATALOGUES / f"{code}.yaml").read_text(encoding="utf-8"))) == []


def test_a_repeated_phrase_is_found():
    text = 'singular: [1]\nphrases:\n  "and": "und"\n  "or": "oder"\n  and: "sowie"\n'
    assert repeated(yaml.compose(text)) == ["and"]


@pytest.mark.parametrize("code", OTHERS)
def test_a_catalogue_holds_texts(code):
    say = language(code)
    texts = [say.thousands, *say.phrases, *say.phrases.values(), *say.spelling.values()]
    assert {type(text) for text in texts} == {str}
    assert all(text for text in texts)
    assert {type(count) for count in say.singular} == {int}


@pytest.mark.parametrize(
    ("code", "phrases"),
    [
        ("en", ["0 coordinates", "1 coordinate", "2 coordinates"]),
        ("de", ["0 Koordinaten", "1 Koordinate", "2 Koordinaten"]),
        ("fr", ["0 coordonnée", "1 coordonnée", "2 coordonnées"]),
    ],
)
def test_the_singular_is_that_of_the_language(code, phrases):
    one, many = "{count} coordinate", "{count} coordinates"
    assert [language(code).counted(count, one, many) for count in range(3)] == phrases


@pytest.mark.parametrize("code", OTHERS)
def test_a_phrase_has_the_same_parts_in_every_language(code):
    for english, other in language(code).phrases.items():
        assert parts(english) == parts(other), english
        if english.startswith((" ", ",", ";")):
            assert other.startswith((" ", "\u00a0", ",", ";")), english


def test_french_punctuation_is_not_parted_from_its_word():
    assert not [text for text in language("fr").phrases.values() if re.search(r" [:;!?]", text)]


def test_a_brace_that_is_not_closed_is_found():
    with pytest.raises(ValueError, match="expected '}'"):
        parts("{count coordinates")


def test_a_phrase_that_is_not_there_is_told():
    with pytest.raises(InternalError, match="no words of language 'de' for 'Entropy'"):
        language("de")("Entropy")


def words(text: str) -> set[str]:
    return set(re.findall(r"[^\W\d_]{2,}", text.lower()))


def foreign(code: str) -> set[str]:
    """Words of English phrases that the language does not have."""
    own = {w for text in language(code).phrases.values() for w in words(text)}
    english = {w for text in spoken() for w in words(re.sub(r"\{\w+\}", "", text))}
    return english - own


#: Scenes whose names of particles, constraints and so on are letters or no English words.
SCENES = [
    ("pendulums/pendulum", None),
    ("pendulums/damped_driven_pendulum", "lagrange"),
    ("rolling/wheel_down_incline", "lagrange"),
    ("rolling/rolling_disk", "dalembert"),
    ("contact/bouncing_ball", "lagrange"),
    ("sliding/block_on_wedge", "virtual-work"),
    ("beads/bead_on_rotating_hoop", "dalembert"),
    ("constraints/four_bar_linkage", None),
    ("celestial/arenstorf_orbit", None),
    ("chains/toda_ring", None),
]


@cache
def silent(scene: str, steps):
    """Equations of a scene without its own texts."""
    equations = load(SYSTEMS / f"{scene}.yaml").derive(forces=True, steps=steps).equations
    return changed(
        equations,
        title=None,
        description=None,
        parameters=tuple(
            replace(p, description=None, unit=None) for p in equations.system.parameters
        ),
        coordinates=tuple(
            replace(c, description=None, unit=None) for c in equations.system.coordinates
        ),
    )


def names(equations) -> set[str]:
    """Words of the names of a scene."""
    listed = [p.name for p in equations.system.particles]
    listed += [line.name for line in equations.derivation.account.lines]
    listed += [n for f in equations.system.forces for n in (f.name, f.on)]
    listed += [equations.presentation.name, *(c.name for c in equations.system.cartesian_names)]
    listed += [e for line in equations.derivation.account.lines for e in line.equations]
    if equations.derivation.steps is not None:
        listed += [
            t.name
            for t in (*equations.derivation.steps.kinetic, *equations.derivation.steps.potentials)
        ]
    if equations.derivation.constraint_forces is not None:
        listed += equations.derivation.constraint_forces.included
    return words(" ".join(listed).replace("_", " "))


@pytest.mark.slow
@pytest.mark.parametrize("code", OTHERS)
@pytest.mark.parametrize(("scene", "steps"), SCENES)
def test_no_english_word_is_left(code, scene, steps):
    equations = silent(scene, steps)
    everything = ",".join(o for o in DERIVED["text"][0].choices)
    options = {"sections": everything, "language": code}
    texts = [
        derivation_text(equations, **options),
        derivation_text(equations, form="explicit", **options),
    ]
    for to in ("latex", "markdown", "typst", "html"):
        texts += EMITTERS[to].emit(equations, options).values()
    for text in texts:
        body = _MARKUP.sub(" ", text.split(r"\begin{document}")[-1])
        assert not words(body) & foreign(code) - names(equations)


#: Scenes whose analyses differ in what they hold.
ANALYZED_SCENES = (
    "pendulums/furuta_pendulum",
    "oscillators/damped_oscillator",
    "beads/bead_on_rotating_hoop",
    "contact/bouncing_ball",
    "celestial/two_bodies",
)


@pytest.mark.slow
@pytest.mark.parametrize("code", OTHERS)
@pytest.mark.parametrize("scene", ANALYZED_SCENES)
def test_no_english_word_is_left_in_an_analysis(code, scene):
    equations = silent(scene, None)
    exponents = Exponents((1.0, -1.0), (0.1, 0.1), 1.0, 10.0)
    analysis = Analyzed.of(replace(analyze(equations), exponents=exponents))
    texts = [analysis.text(language=code)]
    for to in ("latex", "markdown", "typst", "html"):
        texts += analysis.emit(to, language=code).values()
    for text in texts:
        body = _MARKUP.sub(" ", text.split(r"\begin{document}")[-1])
        # boost_x is the name of a quantity.
        assert not words(body) & foreign(code) - names(equations) - {"boost"}
    assert analysis.text(ascii=True, language=code).isascii()


#: What is no word of a language: formulas, comments, commands.
_MARKUP = re.compile(
    r"\$[^$]*\$|^(?://|%|#set|#show|#let|  columns:|  align:).*$"
    r"|\\(?:label|begin|end)\{[^}]*\}|\\[a-zA-Z]+|#[a-z]+|<eq:.*?>"
    r"|<(mi|mo|style)\b[^$]*?</\1>|</?[a-z][^>]*>",
    re.M,
)


@pytest.mark.parametrize("code", OTHERS)
def test_plain_text_has_no_accents(code):
    text = derivation_text(silent("pendulums/pendulum", None), ascii=True, language=code)
    assert text.isascii()
    assert {"de": "groesste", "fr": "ecart"}[code] in text


def test_reasons_of_motions_are_said_in_every_language(capsys):
    scene = SYSTEMS / "contact" / "bouncing_ball.yaml"
    motion = load(scene).derive().simulate(until=6.0, accuracy=1e-9)
    said = {"en": "become infinitely many by", "de": "unendlich viele Sprünge", "fr": "les rebonds"}
    for code, words_of_it in said.items():
        assert words_of_it in str(ReportForm("markdown", code).written(motion))
        command = ["simulate", str(scene), "--until", "6", "--language", code, "--format", "text"]
        assert run(command) == 1
        assert words_of_it in capsys.readouterr().err
    assert pickle.loads(pickle.dumps(motion)).reason.parts["why"].parts["contact"] == "floor"
    assert json_of(motion)["reason"].startswith("accuracy 1e-09 holds until t = ")


def test_a_part_of_a_phrase_is_exchanged_wherever_it_stands():
    inner = Phrase("at {t}", t="2.5")
    text = Phrase("{why}, until {t}, not {other}", why=inner, t="2.5", other="12.5")
    assert with_part(text, "2.5", "2") == "at 2, until 2, not 12.5"
    assert with_part("until 2.5", "2.5", "2") == "until 2.5"
