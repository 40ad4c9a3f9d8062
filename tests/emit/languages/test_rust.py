"""Rust needs nothing but core and libm where there is no std."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.emit.languages.rust_program import string_literal
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from tests.emit.languages.cases import built
from tests.emit.languages.drivers import executed
from tests.emit.languages.rust import FLAGS, Rust
from tests.systems.shipped import SLICE, derived

#: Functions of the crate libm, by their names there.
_LIBM = """
sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp log sqrt fabs atan2 pow
"""


def emitted(equations, folder):
    ((name, text),) = EMITTERS["rust"].emit(equations).items()
    (folder / name).write_text(text, encoding="utf-8")
    return name


@pytest.mark.slow
def test_modules_compile_without_std(tmp_path):
    """A crate without std holds them, beside a libm of which only the names are real."""
    Rust().require()
    equations = [
        *map(derived, SLICE),
        *map(derived, ("bouncing_ball", "seismometer")),
        built("functions"),
        built("tree"),
        built("band"),
    ]
    functions = [
        f"pub fn {name}(x: f64{', _: f64' * (name in ('atan2', 'pow'))}) -> f64 {{ x }}"
        for name in _LIBM.split()
    ]
    (tmp_path / "libm.rs").write_text("\n".join(["#![no_std]", *functions]))
    lines = [f'#[path = "{emitted(e, tmp_path)}"]\npub mod m{k};' for k, e in enumerate(equations)]
    (tmp_path / "crate.rs").write_text("\n".join(["#![no_std]", *lines]))
    library = ("rustc", *FLAGS, "--crate-type", "rlib")
    executed([*library, "libm.rs"], "", tmp_path)
    options = ("--cfg", 'feature="libm"', "--extern", "libm=liblibm.rlib")
    executed([*library, *options, "crate.rs"], "", tmp_path)


def test_literals_hold_quotes_backslashes_and_letters_beyond_ascii():
    assert string_literal('a ~"\\\n\u03b8') == r'"a ~\u{22}\u{5c}\u{a}\u{3b8}"'


def test_every_function_of_programs_has_a_counterpart():
    own = {"min", "max", "sign"}
    assert {"abs" if name == "fabs" else name for name in _LIBM.split()} | own == set(
        PROGRAM_FUNCTIONS
    )


@pytest.mark.slow
def test_the_page_shows_a_program(tmp_path):
    Rust().require()
    page = (Path(__file__).parents[3] / "docs" / "languages.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```rust\n(.*?)```", page, re.DOTALL)
    emitted(derived("bead_on_parabola"), tmp_path)
    (tmp_path / "main.rs").write_text(block)
    executed(["rustc", *FLAGS, "main.rs", "-o", "main"], "", tmp_path)
    # a = -2 k g x/(1 + 4 k^2 x^2) with z = k x^2 and k = 1/4, at x = 1
    assert executed([tmp_path / "main"], "", tmp_path) == f"{-0.5 * 9.81 / 1.25:.6f}\n"
