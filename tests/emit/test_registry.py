"""The registry of formats: complete options, refusals, nothing loaded early."""

import subprocess
import sys

import pytest

from lagrange_cli.api.emitters import EMITTERS, emitter
from lagrange_cli.emit.base import Emitter, Option
from lagrange_cli.errors import InputError


def _echo(equations, options):
    return {f"{equations}.txt": repr(sorted(options.items()))}


ECHO = Emitter(
    "echo",
    "prints its options",
    (".txt",),
    True,
    _echo,
    (Option("style", "how", ("short", "long"), "short"), Option("main", "with main")),
)


def test_defaults_complete_the_options():
    assert ECHO.emit("s") == {"s.txt": "[('main', False), ('style', 'short')]"}
    assert ECHO.emit("s", {"main": True}) == {"s.txt": "[('main', True), ('style', 'short')]"}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"stile": "long"}, "format 'echo' has no option 'stile'"),
        ({"style": "lon"}, "option 'style' of format 'echo' cannot be 'lon'; it takes short, long"),
        ({"main": "yes"}, "option 'main' of format 'echo' cannot be 'yes'; it takes true or false"),
    ],
)
def test_wrong_options_are_refused(options, message):
    with pytest.raises(InputError) as caught:
        ECHO.emit("s", options)
    assert caught.value.problems[0].message == message


def test_near_names_are_suggested():
    with pytest.raises(InputError) as caught:
        emitter("latx")
    assert caught.value.problems[0].hint == "did you mean 'latex'?"
    assert emitter("latex") is EMITTERS["latex"]


@pytest.mark.parametrize("name", sorted(EMITTERS))
def test_entries_are_consistent(name):
    entry = EMITTERS[name]
    assert entry.name == name
    assert entry.extensions
    assert all(extension.startswith(".") for extension in entry.extensions)
    assert entry.single_file == (len(entry.extensions) == 1 and entry.pack is None)
    for option in entry.options:
        assert option.wrong(option.default) is None
        assert option.help


def test_registry_loads_no_format_and_no_sympy():
    code = (
        "import sys, lagrange_cli.api.emitters\n"
        "heavy = {'sympy', 'numpy', 'lagrange_cli.report.writers.latex.document'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    out = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    assert out.stdout.strip() == "[]"
