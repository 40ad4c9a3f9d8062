"""Pages of docs/reports are what their commands write."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import pytest

from lagrange_cli.cli.main import run
from tests.test_readme import settled

ROOT = Path(__file__).resolve().parents[2]
PAGES = ROOT / "docs" / "reports"

#: Page → the words of its command.
LISTED = {
    name: command.split()
    for name, command in re.findall(
        r"^\| \[(.+?)\]\(.+?\) \| `lagrange (.+?)` \|$",
        (PAGES / "README.md").read_text(encoding="utf-8"),
        re.MULTILINE,
    )
}


def page(words: list[str]) -> str:
    """What a command prints, from the root of the clone."""
    printed = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with contextlib.chdir(ROOT), contextlib.redirect_stdout(printed):
        assert run([*words, "-q"]) == 0
        printed.flush()
    return printed.buffer.getvalue().decode()


def kept(text: str) -> str:
    """A page without what differs between machines: mismatches, errors, drift."""
    measured = r"<math[^>]*>(?:<mrow>)?(?:<mn>[\d.]+</mn><mo>×</mo>)?<msup><mn>10</mn>.*?</math>"
    return settled(re.sub(measured, "MEASURED", text))


def test_all_pages_are_listed() -> None:
    assert {path.name for path in PAGES.glob("*.html")} == set(LISTED)


@pytest.mark.parametrize("name", [name for name in LISTED if name != "tradeoff.html"])
def test_a_page_is_what_its_command_writes(name: str) -> None:
    assert kept(page(LISTED[name])) == kept((PAGES / name).read_text(encoding="utf-8"))


@pytest.mark.slow
def test_a_page_of_measured_times_has_the_parts_of_today() -> None:
    today, shown = (
        re.findall(r"<(?:h2|th|dt)\b.*?</", text)
        for text in (
            page(LISTED["tradeoff.html"]),
            (PAGES / "tradeoff.html").read_text(encoding="utf-8"),
        )
    )
    assert list(dict.fromkeys(today)) == list(dict.fromkeys(shown))


if __name__ == "__main__":
    for name_, words_ in LISTED.items():
        (PAGES / name_).write_text(page(words_), encoding="utf-8")
