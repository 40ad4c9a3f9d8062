"""Every style of lines, axes and panels, in every format that writes it."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from lagrange_cli.pictures.drawing import drawn
from lagrange_cli.pictures.picture import (
    DEGREES,
    NO_LABEL,
    Axis,
    ColourBar,
    Label,
    Line,
    Look,
    MarkedPlace,
    Panel,
    Picture,
    Style,
)
from tests.pictures.test_motions import HOSTILE, compile_picture, require_tex_package

T = np.linspace(1, 2, 7)
X = Axis(Label("$x$", "x"), Label(r"\mathrm{m}", "m"))
ERROR = Axis(Label("error", "error"), is_log=True, is_reversed=True)


def every_style():
    """A panel with a line of each style, one with ends, and one with errors."""
    lines = [
        Line(Label(f"${k}$", str(k)), T, T + k, style) for k, style in enumerate(get_args(Style))
    ]
    lines += [Line(Label("ends", "ends"), T, -T, has_ends=True)]
    lines += [Line(Label("bars", "bars"), T, -2 * T, "bars", errors=T / 10)]
    return tuple(lines)


def pictures():
    place = MarkedPlace(1.5, 2.0, Label(r"$x_{\mathrm{min}} = 1.5\,\mathrm{m}$", "x_min = 1.5 m"))
    whole = Panel(every_style(), X, X, places=(place,))
    log = Panel(every_style()[:3], ERROR, replace(ERROR, is_reversed=False))
    levels = tuple(Line(NO_LABEL, T, T * k, level=k / 2) for k in range(3))
    leveled = Panel(levels, X, Axis(Label("phase", "phase"), DEGREES), is_tight=True)
    strokes = (Line(NO_LABEL, T, T, look=Look("#777777", 1.6, is_named=False)),)
    bare = Panel(strokes, X, X, title=Label(r"$\omega = 3$", "ω = 3"), box=(0, 3, 0, 2))
    caption = Label(r"$\theta_{2} = 0$, $\dot{\theta}_{2} > 0$", "θ2 = 0, θ̇2 > 0")
    return {
        "styles": Picture(HOSTILE, (whole, replace(whole, is_equal=True)), caption=caption),
        "log": Picture("log", (log, replace(log, height=0.5)), is_stacked=True),
        "bar": Picture("bar", (leveled,), is_stacked=True, bar=ColourBar(X, 1.0, 2.0)),
        "bare": Picture("bare", (bare,) * 5, most_columns=4),
        "empty": Picture("empty", (Panel((), X, X),)),
    }


@pytest.mark.parametrize("name", pictures())
def test_axes_and_lines_are_all_in_tex(name):
    picture = pictures()[name]
    text = drawn(picture, "tex").decode()
    assert text.count(r"\begin{axis}") == len(picture.panels)
    ends = sum(2 * line.has_ends for panel in picture.panels for line in panel.lines)
    assert text.count(r"\addplot") == sum(len(p.lines) for p in picture.panels) + ends


def test_logarithmic_axes_ascend_to_the_left():
    text = drawn(pictures()["log"], "tex").decode()
    assert text.count("x dir=reverse") == 2
    assert (text.count("xmode=log"), text.count("ymode=log")) == (2, 2)
    # The lower panel is half as high, and stands right below the other.
    heights = [float(h) for h in re.findall(r"height=([\d.]+)cm", text)]
    assert heights == [3.2, 1.6]


@pytest.mark.slow
@pytest.mark.parametrize("name", pictures())
@pytest.mark.parametrize("ending", ["png", "svg"])
def test_matplotlib_draws_them_the_same_every_time(name, ending):
    pytest.importorskip("matplotlib")
    picture = pictures()[name]
    assert drawn(picture, ending) == drawn(picture, ending)


@pytest.mark.slow
@pytest.mark.latex
@pytest.mark.parametrize("name", pictures())
@pytest.mark.parametrize(("ending", "package"), [("tex", "pgfplots"), ("pgf", "pgf")])
def test_tex_compiles(name, ending, package, tmp_path):
    require_tex_package(f"{package}.sty")
    (tmp_path / f"a.{ending}").write_bytes(drawn(pictures()[name], ending))
    compile_picture(tmp_path, package, f"a.{ending}")
