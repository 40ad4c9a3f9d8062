"""Printed forms of textbooks, character by character: textbook_forms.yaml holds them."""

import re
from pathlib import Path

import pytest
import yaml

from lagrange_cli import api
from lagrange_cli.report.contents.derivation.contents import derivation_text

HERE = Path(__file__).resolve().parent
SYSTEMS = HERE.parents[1] / "systems"
CASES = yaml.safe_load((HERE / "textbook_forms.yaml").read_text(encoding="utf-8"))


def _derived(case):
    scene = case["scene"]
    loaded = api.loads(scene) if "\n" in scene else api.load(SYSTEMS / scene)
    return loaded.derive(steps=case.get("steps"), forces=case.get("forces", False))


def _unwrapped(text):
    """The lines of a text, each with the lines that go on with it, and single spaces."""
    lines = []
    for line in text.splitlines():
        if lines and re.match(r"\s{4,}([-+·/] |\(|[ij](, [ij])* = )", line):
            lines[-1] += " " + line.strip()
        else:
            lines.append(line)
    return [" ".join(line.split()) for line in lines]


def _latex(derivation, form):
    (document,) = derivation.emit("latex", style="document", form=form).values()
    joined = re.sub(r" \\nonumber \\\\\n|(?<=\S) \\\\\n(?=  &\\hspace)", "\n", document)
    return re.sub(r"\n  &\\hspace\{[^}]*\} \{\}", "", joined)


def _parameters():
    for case in CASES:
        marks = [pytest.mark.xfail(reason=case["open"], strict=True)] if "open" in case else []
        yield pytest.param(case, id=case["case"], marks=marks)


@pytest.mark.slow
@pytest.mark.parametrize("case", _parameters())
def test_printed_form(case):
    derivation = _derived(case)
    form = case.get("form", "lagrange")
    written_out = case.get("written_out", False)
    text = derivation_text(derivation.equations, form=form, written_out=written_out)
    lines = _unwrapped(text)
    for expected in case.get("text", ()):
        assert expected in lines or any(expected in line.split("   ") for line in text.splitlines())
    for expected in case.get("contains", ()):
        assert expected in "\n".join(lines)
    document = _latex(derivation, form) if "latex" in case else ""
    for expected in case.get("latex", ()):
        assert expected in document
