"""The usual layout of scenes: its rules, one text each, and that meaning and comments stay."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.scene import laid_out
from lagrange_cli.scene.layout_lines import ORDER
from lagrange_cli.scene.reader import SECTIONS
from tests.cli.terminal import lagrange

ROOT = Path(__file__).parents[2]

RULES = {
    "sections": (
        "# of all\n\npotentials: {v: x^2}\n# of x\ncoordinates: [x]  # one\nname: a\n",
        "# of all\n\nname: a\n# of x\ncoordinates: [x]  # one\npotentials: {v: x^2}\n",
    ),
    "blank lines between sections": (
        "potentials: {v: x^2}\n\n\ncoordinates: [x]\n\nname: a\n\n\n",
        "name: a\n\ncoordinates: [x]\n\npotentials: {v: x^2}\n",
    ),
    "an unknown section stays after the one before it": (
        "initial: {x: 1}\nnote: it\nname: a\n",
        "name: a\ninitial: {x: 1}\nnote: it\n",
    ),
    "anchors keep the order": (
        "potentials: {v: &v x^2}\noutputs: {o: *v}\nname: a\n",
        "potentials: {v: &v x^2}\noutputs: {o: *v}\nname: a\n",
    ),
    "indentation": (
        "expect:\n      equations:\n      - x = 0\n      -   y = 0\n      dof: 1\n",
        "expect:\n  equations:\n    - x = 0\n    - y = 0\n  dof: 1\n",
    ),
    "comments move with their entries": (
        "points:\n     # above\n     a: [0, 0, 0]\n     # below\n# margin\nexpect: {}\n",
        "points:\n  # above\n  a: [0, 0, 0]\n  # below\n# margin\nexpect: {}\n",
    ),
    "spaces in brackets": (
        "points: { a:   [0 ,0,  0 ],b: [ 1, 2,3] }   # c\n",
        "points: {a: [0, 0, 0], b: [1, 2, 3]}  # c\n",
    ),
    "lines below brackets": (
        "points:   {a: [0, 0, 0],\n           b: [1, 2, 3],\n  c: [1, 2, 3]}\n",
        "points: {a: [0, 0, 0],\n         b: [1, 2, 3],\n  c: [1, 2, 3]}\n",
    ),
    "quotes": (
        "definitions: {'a': 'x + y', b: 'f(x, y)', c: \"2\", d: 'yes', e: '\\alpha'}\n",
        'definitions: {a: x + y, b: "f(x, y)", c: "2", d: "yes", e: \'\\alpha\'}\n',
    ),
    "aligned maps": (
        "points:\n  a:    [0, 0, 0]\n  long: [0, 0, 0]\n  of:   [0, 0, 0]\n",
        "points:\n  a:    [0, 0, 0]\n  long: [0, 0, 0]\n  of:   [0, 0, 0]\n",
    ),
    "maps aligned by half": (
        "points:\n  a:    [0, 0, 0]\n  long: [0, 0, 0]\n  of: [0, 0, 0]\n",
        "points:\n  a:    [0, 0, 0]\n  long: [0, 0, 0]\n  of:   [0, 0, 0]\n",
    ),
    "maps that are not": (
        "points:\n  a:  [0, 0, 0]\n  long: [0, 0, 0]\n",
        "points:\n  a: [0, 0, 0]\n  long: [0, 0, 0]\n",
    ),
    "comments below each other": (
        "points:\n  a: [0, 0, 0]       # one\n  long: [0, 0, 0]    # two\n  b: [0, 0, 0] # three\n",
        "points:\n  a: [0, 0, 0]     # one\n  long: [0, 0, 0]  # two\n  b: [0, 0, 0]  # three\n",
    ),
    "texts of several lines": (
        "expect:\n    equations:\n    - >-\n      x +\n        y = 0\n\n    - |2\n      x = 0\n",
        "expect:\n  equations:\n    - >-\n      x +\n        y = 0\n\n    - |2\n      x = 0\n",
    ),
    "texts without marks": (
        "description: one\n    two\n\n    three   \nname: a\n",
        "name: a\ndescription: one\n    two\n\n    three\n",
    ),
    "hashes in texts": (
        "description: |\n   # no comment\n   a\n# a comment\nname: a\n",
        "# a comment\nname: a\ndescription: |\n  # no comment\n  a\n",
    ),
    "comments below texts": (
        "expect:\n  a:\n    b: 1\n  c: |\n        d\n    # e\n",
        "expect:\n  a:\n    b: 1\n  c: |\n    d\n  # e\n",
    ),
    "line ends of Windows": ("name: a\r\ndescription: b\r\n", "name: a\ndescription: b\n"),
    "marks of documents": ("---\ndof: 1\nname: a\n...\n", "---\ndof: 1\nname: a\n...\n"),
}


@pytest.mark.parametrize("rule", RULES)
def test_rules(rule):
    before, after = RULES[rule]
    assert laid_out(before.encode(), "a.yaml") == after
    assert laid_out(after.encode(), "a.yaml") == after


def test_every_section_has_its_place():
    assert sorted(ORDER) == sorted(SECTIONS)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: [1", "not valid YAML"),
        ("- a\n", "this is no scene"),
        ("name: a\n\u2028b: c\n", "U\\+2028"),
        ("name: a\nname: b\n", "is given twice"),
    ],
)
def test_what_is_no_scene_is_refused_with_its_place(text, message):
    with pytest.raises(InputError, match=message) as refusal:
        laid_out(text.encode(), "a.yaml")
    assert refusal.value.problems[0].mark is not None


@pytest.mark.slow
def test_layouts_that_are_drawn(monkeypatch):
    """A slice of docs/quality/layouts.md; the campaign would see a comment that is lost."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    layouts = importlib.import_module("layouts")
    row = layouts.Row()
    for number in range(0, 2000, 100):
        row.add(*layouts.drawn_scene(number, 1))
    assert (row.number, row.stable, row.other, row.lost) == (20, 20, 0, 0)
    assert row.comments > 50
    monkeypatch.setattr(layouts, "laid_out", lambda data, file: re.sub("#.*", "", data.decode()))
    text, comments = layouts.drawn_scene(1, 1)
    row.add(text, comments)
    assert row.lost == comments.total()


def test_the_command(tmp_path):
    (tmp_path / "good.yaml").write_text("name: a\n")
    (tmp_path / "bad.yaml").write_text("points: {a: [0,0,0]}\nname: a\n")
    (tmp_path / "wrong.yaml").write_text("name: [\n")
    scenes = ("good.yaml", "bad.yaml")
    done = lagrange("fmt", *scenes, "--check", cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "bad.yaml: another layout\n")
    done = lagrange("fmt", *scenes, "--diff", cwd=tmp_path)
    assert done.returncode == 1
    assert done.stdout.splitlines()[3:] == [
        "-points: {a: [0,0,0]}",
        " name: a",
        "+points: {a: [0, 0, 0]}",
    ]
    done = lagrange("fmt", ".", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "wrong.yaml:2:1: not valid YAML" in done.stderr
    assert (tmp_path / "bad.yaml").read_text() == "name: a\npoints: {a: [0, 0, 0]}\n"
    assert lagrange("fmt", ".", "--check", "--exclude", "wrong*", cwd=tmp_path).returncode == 0
    done = lagrange("fmt", "-", input="points: {}\nname: a\n")
    assert (done.returncode, done.stdout) == (0, "name: a\npoints: {}\n")
    done = lagrange("fmt", "-", "--check", input="points: {}\nname: a\n")
    assert (done.returncode, done.stdout) == (1, "")
