"""Help stands in groups, fits two screens, and states every default that is a value."""

from __future__ import annotations

import re

import click
import pytest

from lagrange_cli.cli.main import COMMANDS, lagrange
from lagrange_cli.cli.terminal.command import Command, heading

#: Options that take a value, and without which nothing is done or changed: they have no default.
OFF = {
    "--answers",
    *("--initial", "--parameter", "--output", "--plot", "--json"),
    *("--with", "--bounds", "--bracket", "--junit", "--animate", "--loci"),
    *("--branches", "--lyapunov", "--along", "--response"),
    *("--budget", "--sensitivity", "--section", "--plot-of", "--checkpoint", "--resume"),
    *("--keyword", "--exclude", "--changed-since", "--timeout", "--memory"),
    *("--ensemble", "--vary", "--sample", "--members", "--reduce", "--map"),
}


def command(name: str) -> click.Command:
    declared = lagrange.get_command(click.Context(lagrange), name)
    assert declared is not None
    return declared


def shown(name: str) -> str:
    """The help of a subcommand as a window of 80 columns has it."""
    with click.Context(command(name), info_name=f"lagrange {name}", terminal_width=80) as context:
        return context.get_help() + "\n"


def groups(name: str) -> dict[str, list[str]]:
    """Title of each group of options → long names of its options."""
    parts = re.split(r"^(\S[^\n]*):\n(?=  -)", shown(name), flags=re.MULTILINE)[1:]
    titles, texts = parts[::2], parts[1::2]
    return {
        title: [
            name
            for names in re.findall(r"^  ((?:--?[a-z-]+, )*--[a-z-]+)", text, re.MULTILINE)
            for name in re.findall(r"--[a-z-]+", names)
        ]
        for title, text in zip(titles, texts, strict=True)
    }


@pytest.mark.parametrize("name", COMMANDS)
def test_help_fits_two_screens(name):
    lines = shown(name).splitlines()
    assert len(lines) <= 2 * 40
    assert max(map(len, lines)) <= 80


@pytest.mark.parametrize("name", COMMANDS)
def test_each_option_stands_in_one_group(name):
    listed = [option for options in groups(name).values() for option in options]
    declared = [o for p in command(name).params for o in p.opts if o.startswith("--")]
    assert sorted(listed) == sorted([*declared, "--help"])


@pytest.mark.parametrize("name", ["derive", "emit", "simulate", "analyze"])
def test_many_options_are_grouped(name):
    assert 4 <= len(groups(name)) <= 8
    assert max(map(len, groups(name).values())) <= 12
    assert groups(name)["Messages"][0] == "--strict"


@pytest.mark.parametrize("name", COMMANDS)
def test_every_default_that_is_a_value_is_stated(name):
    context = click.Context(command(name))
    for option in command(name).params:
        if isinstance(option, click.Option) and not option.is_flag:
            _, text = option.get_help_record(context) or ("", "")
            stated = re.findall(r"\[(?:default: |required)", text)
            assert stated or not OFF.isdisjoint(option.opts), option.opts
            assert not re.search(r"default: (none|off|as before)", text)


def test_headings_are_no_options():
    @click.command(cls=Command)
    @click.option("--alone")
    @heading("Second")
    @click.option("--other", help="Another one.")
    def two(alone: str | None, other: str | None) -> None:
        """Two options."""

    assert [p.name for p in two.params] == ["alone", "other"]
    help = two.get_help(click.Context(two))
    assert help.index("Options:\n  --alone") < help.index("Second:\n  --other")
    with pytest.raises(click.NoSuchOption):
        two.main(["--heading", "x"], standalone_mode=False)
