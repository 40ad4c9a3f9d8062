"""docs/command-line.md names every command and option that there is, and no other."""

from __future__ import annotations

import re
from pathlib import Path

import click
import pytest

from lagrange_cli.cli.main import COMMANDS, lagrange

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "command-line.md").read_text(
    encoding="utf-8"
)
SECTIONS = re.split(r"^## ", PAGE, flags=re.MULTILINE)[1:]
COMMON = SECTIONS[0]
WITHOUT_SCENE = ("cache", "config", "fmt", "import", "lsp", "new", "schema")
OF_SCENES = [name for name in COMMANDS if name not in WITHOUT_SCENE]


def command(name: str) -> click.Command:
    found = lagrange.get_command(click.Context(lagrange), name)
    assert found is not None
    return found


def options(name: str) -> set[str]:
    declared = {
        name for option in command(name).params for name in option.opts if name.startswith("--")
    }
    return declared | {"--help"}


def section(name: str) -> str:
    (found,) = [s for s in SECTIONS if s.startswith(f"`lagrange {name}")]
    return found


def rows(text: str) -> set[str]:
    """Long names of the options that rows of its tables begin with."""
    firsts = re.findall(r"^\| ((?:`[^`]*`, )*`[^`]*`)", text, re.MULTILINE)
    return {name for first in firsts for name in re.findall(r"(?<=`)--[a-z-]+", first)}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_is_documented(name):
    text = COMMON + section(name) if name in OF_SCENES else section(name) + "--help"
    missing = [o for o in options(name) if not re.search(f"{o}\\b", text)]
    assert missing == []


@pytest.mark.parametrize("name", COMMANDS)
def test_no_other_option_is_documented(name):
    mentioned = rows(section(name))
    assert mentioned
    assert mentioned - options(name) == set()


def test_common_options_are_those_of_every_command_that_reads_scenes():
    shared = set.intersection(*(options(name) for name in OF_SCENES))
    assert rows(COMMON) == shared - {"--json"}
