"""HTML: pages that HTML and XML read alike, formulas of MathML Core, texts that would be markup."""

import re

import pytest

from lagrange_cli import api
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.errors import InputError
from lagrange_cli.report.document_options import FORMS, SECTIONS
from lagrange_cli.report.phrases.language import LANGUAGES, language
from tests.campaign import slice_of, values_of
from tests.emit.emit_scenes import masses_through_hole
from tests.emit.html_page import formulas, found, parsed_page, text_of
from tests.emit.test_latex import strange
from tests.emit.test_prose import SCENE as PROSE
from tests.emit.test_typst import hostile_scene
from tests.systems.shipped import SCENES, SYSTEMS, derived

HOSTILE = [
    "<script>alert(1)</script>",
    "</title></style><img src=x onerror=alert(1)>",
    "<!-- gone --> <![CDATA[gone]]> <?gone?>",
    "&lt; &amp;amp; &#x3c;b> & &copy;",
    "$x$ $\\mathrm{x}$ $</math><b>$ `x` \\[x\\]",
    "\" ' onload=x ' \"",
    "two\nlines\n\n\u0000\u0008\u202e\ufffe",
    "Ωmega äöü ß 中文 🚀 ½ µm",
]

ALL = ",".join(s for s in SECTIONS if s not in ("sketch", "forces"))


def page_of(equations, **options):
    (text,) = EMITTERS["html"].emit(equations, options).values()
    return parsed_page(text)


def headings(root):
    return [text_of(heading) for heading in found(root, "h2")]


@pytest.mark.parametrize("name", slice_of(list(SCENES), 6))
def test_pages_of_scenes_are_valid(name):
    root = page_of(derived(name), sections=ALL)
    assert len(headings(root)) > 4
    assert formulas(root)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("form", "steps", "code"),
    values_of(FORMS, (None, "lagrange", "dalembert", "virtual-work"), LANGUAGES),
)
def test_pages_of_forms_steps_and_languages_are_valid(form, steps, code):
    scenes = {"routhian": "celestial/kepler", "euler": "bodies/spinning_top"}
    scene = scenes.get(form, "pendulums/coupled_pendulums")
    derivation = api.load(SYSTEMS / f"{scene}.yaml").derive(steps=steps, forces=True)
    (text,) = derivation.emit("html", form=form, language=code, sections=ALL).values()
    root = parsed_page(text)
    assert root.get("lang") == code
    assert language(code)("Certificate") in headings(root)


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["beads/bead_on_rotating_hoop", "oscillators/driven_spring"])
@pytest.mark.parametrize("code", LANGUAGES)
def test_pages_of_analyses_are_valid(scene, code):
    analysis = api.load(SYSTEMS / f"{scene}.yaml").derive().analyze()
    (text,) = analysis.emit("html", language=code).values()
    root = parsed_page(text)
    assert root.get("lang") == code
    assert len(headings(root)) > 1


def test_a_page_says_what_a_reader_asks():
    root = page_of(masses_through_hole())
    assert headings(root) == [
        *("System", "Degrees of freedom", "Lagrangian", "Equations of motion"),
        *("Conserved quantities", "Certificate"),
    ]
    assert text_of(found(root, "title")[0]) == text_of(found(root, "h1")[0])


def test_pages_need_nothing_beside_them():
    (text,) = EMITTERS["html"].emit(masses_through_hole(), {}).values()
    assert not re.search(r"\b(?:src|href|url|import|script)\b", text)
    assert set(re.findall(r"https?://[^\"]*", text)) == {
        "http://www.w3.org/1999/xhtml",
        "http://www.w3.org/1998/Math/MathML",
    }


def test_results_have_numbers_one_after_the_other():
    root = page_of(derived("double_pendulum"))
    numbers = [e for formula in formulas(root) for e in formula.iter("mtext") if e.get("id")]
    assert [e.text for e in numbers] == [f"({k})" for k in range(1, len(numbers) + 1)]
    assert [e.get("id") for e in numbers][:4] == [
        *("eq-energies-1", "eq-energies-2", "eq-energies-3"),
        "eq-equations-1",
    ]


def test_pages_have_the_lists_and_tables_of_markdown():
    equations = derived("double_pendulum")
    (text,) = EMITTERS["markdown"].emit(equations, {"sections": ALL}).values()
    root = page_of(equations, sections=ALL)
    assert len(found(root, "li")) == text.count("\n- ") > 2
    assert len(found(root, "tr")) == text.count("\n| ") - text.count("| --- |\n") > 4
    assert headings(root) == re.findall(r"^## (.*)$", text, re.MULTILINE)


def test_the_sketch_stands_on_the_page():
    root = page_of(derived("pendulum"), sections="system,sketch")
    (figure,) = found(root, "figure")
    assert figure[0].tag == "{http://www.w3.org/2000/svg}svg"
    with pytest.raises(InputError):
        page_of(derived("coupled_gears"), sections="sketch,forces")


def test_general_functions_and_fractions():
    assert formulas(page_of(strange()))


@pytest.mark.parametrize("text", HOSTILE)
def test_no_text_of_a_scene_acts(text):
    """Titles, descriptions, names and units come out as themselves."""
    root = page_of(hostile_scene(text))
    harmless = page_of(hostile_scene("harmless"))
    names = [e.tag for e in root.iter() if "Math" not in e.tag]
    assert names == [e.tag for e in harmless.iter() if "Math" not in e.tag]
    if "$" not in text:
        plain = "".join(c if c.isprintable() else " " for c in text)
        assert text_of(root).count(plain) >= 6


def test_allowed_formulas_of_titles_and_descriptions_are_typeset():
    (text,) = api.loads(PROSE).derive().emit("html").values()
    root = parsed_page(text)
    (heading,) = found(root, "h1")
    assert text_of(heading) == "Bead with ω02, 50 $ left"
    assert len(formulas(heading)) == 1
    assert "Not allowed: $\\frac{1}{2}$." in text_of(root)


def test_phrases_hold_no_markup():
    """Phrases stand on pages as they are."""
    for code in LANGUAGES:
        assert not [text for text in language(code).phrases.values() if set("<>&") & set(text)]
