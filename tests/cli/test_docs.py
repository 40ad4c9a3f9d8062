"""docs/command-line.md names every command and option that there is, and no other."""

from __future__ import annotations

import re
from pathlib import Path

import click
import pytest

from lagrange_cli.cli.main import lagrange

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "command-line.md").read_text(
    encoding="utf-8"
)
SECTIONS = re.split(r"^## ", PAGE, flags=re.MULTILINE)[1:]
COMMON = SECTIONS[0]


def options(command: click.Command) -> set[str]:
    declared = {name for option in command.params for name in option.opts if name.startswith("--")}
    return declared | {"--help"}


def section(name: str) -> str:
    (found,) = [s for s in SECTIONS if s.startswith(f"`lagrange {name}")]
    return found


@pytest.mark.parametrize("name", lagrange.commands)
def test_every_option_is_documented(name):
    text = COMMON + section(name)
    missing = [o for o in options(lagrange.commands[name]) if not re.search(f"{o}\\b", text)]
    assert missing == []


@pytest.mark.parametrize("name", lagrange.commands)
def test_no_other_option_is_documented(name):
    mentioned = set(re.findall(r"^\| `(?:-\w`, `)?(--[a-z-]+)", section(name), re.MULTILINE))
    assert mentioned
    assert mentioned - options(lagrange.commands[name]) == set()


def test_common_options_are_those_of_every_command():
    mentioned = set(re.findall(r"^\| `(?:-\w`, `)?(--[a-z-]+)", COMMON, re.MULTILINE))
    shared = set.intersection(*(options(c) for c in lagrange.commands.values()))
    assert mentioned == shared - {"--json"}
