"""Reports of values in every format and language: approved texts, compiled documents, escapes."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from lagrange_cli.errors import escape_controls
from lagrange_cli.report.formats import FORMATS, ReportForm
from lagrange_cli.report.phrases.language import LANGUAGES
from lagrange_cli.report.registry import contents_of, json_of
from tests.emit.test_latex import HOSTILE, compiled
from tests.goldens.in_formats import EVERY, compared, in_formats
from tests.report.reported_values import VALUES
from tests.report.test_languages import foreign, words
from tests.typst_compiler import pages

GOLDENS = Path(__file__).resolve().parent / "approved"

#: Texts of a scene that would act in some format.
EVIL = [*HOSTILE, "`a|b` [x](y) *c* _d_ <script>e</script> #f #[g] @h ```", "$", "\\end{verbatim}"]


def written(value: object, format_: str, language: str = "en") -> str:
    return str(ReportForm(format_, language).written(value))


@pytest.mark.parametrize("name", VALUES)
def test_reports_are_those_that_were_approved(name, updates):
    """Of values with all that a report may say, and that no scene has together."""
    value, of_values = VALUES[name]("pendulum"), [one for one in EVERY if one[0] != "json"]
    text = in_formats(lambda format_, code: written(value, format_, code), of_values)
    compared(text, GOLDENS / f"{name}.txt", updates)


@pytest.mark.parametrize("format_", [f for f in FORMATS if f != "json"])
@pytest.mark.parametrize("name", VALUES)
def test_every_report_has_every_format(name, format_):
    assert written(VALUES[name]("z"), format_).endswith("\n")


@pytest.mark.parametrize("language", [code for code in LANGUAGES if code != "en"])
@pytest.mark.parametrize("name", VALUES)
def test_no_english_word_is_left(name, language):
    text = written(VALUES[name]("z"), "markdown", language)
    # Statuses, names of columns, the code that ran, reasons of refusals.
    same = words(
        "compiled ok column error differences reference holds refused wrong energy point long"
        " doubles in fits as well first last until set blow up step conserved random speed"
        " contact max mean pass fail yaml"
    )
    left = words(re.sub(r"`[^`]*`", "", text)) & foreign(language) - same
    assert not left


def test_text_is_plain_where_an_encoding_has_no_more():
    shown = str(ReportForm("text", "fr").written(VALUES["motion"]("pendulé"), "ascii"))
    assert shown.isascii()
    assert "Precision" in shown
    assert "pendul\\xe9" in shown


@pytest.mark.parametrize("evil", EVIL)
@pytest.mark.parametrize("name", VALUES)
def test_no_text_of_a_scene_acts(name, evil):
    value = VALUES[name](evil)
    text = written(value, "text").replace("\n", "")
    assert escape_controls(text) == text
    page = written(value, "html")
    assert {e.tag.rpartition("}")[2] for e in ElementTree.fromstring(page).iter()} < {
        *("html", "head", "meta", "title", "style", "body", "main", "section", "h1", "h2", "p"),
        *("div", "table", "thead", "tbody", "tr", "th", "td", "ul", "li", "dl", "dt", "dd", "pre"),
        *(
            "code",
            "math",
            "mrow",
            "mn",
            "mo",
            "mi",
            "mover",
            "msub",
            "msup",
            "mtext",
            "mspace",
            "script",
        ),
    } - {"script"}
    for line in re.sub(r"^(`{3,}).*?^\1$", "", written(value, "markdown"), flags=re.M | re.S).split(
        "\n"
    ):
        assert not re.search(r"(?<!\\)<|(?<!\\)\[[^\]]*\]\(", re.sub(r"`[^`]*`", "", line))


def test_no_line_ends_a_diagram_of_letters():
    latex = written(VALUES["checked"]("\\end{verbatim}\\input{x}"), "latex")
    assert latex.count("\\end{verbatim}") == 1
    assert latex.index("\\input{x}", latex.index("\\begin{verbatim}")) < latex.index("\\end{verb")
    assert written(VALUES["checked"]("````"), "markdown").count("\n`````") == 2


@pytest.mark.slow
@pytest.mark.parametrize("evil", EVIL)
def test_documents_compile_whatever_texts_hold(tmp_path, evil):
    """A value of each report for another text, so that all meet each other cheaply."""
    names = list(VALUES)
    name = names[EVIL.index(evil) % len(names)]
    value = VALUES[name](evil)
    compiled(tmp_path, written(value, "latex", "de"))
    assert not list(tmp_path.glob("*owned*"))
    assert pages(written(value, "typst", "fr"))


@pytest.mark.slow
@pytest.mark.parametrize("name", VALUES)
def test_documents_compile(tmp_path, name):
    log = compiled(tmp_path, written(VALUES[name]("pendulum"), "latex", "fr"))
    assert not re.findall(r"Overfull \\hbox \((?:[2-9]\d|\d{3,})", log)
    assert pages(written(VALUES[name]("pendulum"), "typst"))


def test_what_nobody_reports_is_refused():
    with pytest.raises(TypeError, match="nothing reports a tuple"):
        contents_of(())
    with pytest.raises(TypeError, match="nothing reports a tuple"):
        json_of(())
