"""Labels in mathematics, looks of lines, room for legends, texts of marked places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lagrange_cli.pictures.drawing import drawn, picture_of
from lagrange_cli.pictures.mathematics import condition_label, reduction_axis
from lagrange_cli.pictures.picture import (
    NO_LABEL,
    Axis,
    Label,
    Line,
    MarkedPlace,
    Panel,
    Picture,
    axis_of,
)
from lagrange_cli.pictures.style import legend_corner, legend_lines, looks, text_sides
from lagrange_cli.simulate.model.labels import Labels
from lagrange_cli.simulate.model.requested_outputs import read_reduction

LABELS = Labels(
    latex={"phi": r"\varphi"},
    dimensions={"theta2": "rad", "dot(theta2)": "rad/s", "t": "s"},
    units={"theta2": "rad"},
)

X = Axis(Label("$x$", "x"))


def reduced(text: str) -> Label:
    return reduction_axis(read_reduction(text), None, LABELS).label


@pytest.mark.parametrize(
    ("text", "latex", "plain"),
    [
        ("max(abs(theta2))", r"$\max\,\left| \theta_{2} \right|$", "max |θ2|"),
        ("min(x + 2*y)", r"$\min\,\left( x + 2 y \right)$", "min (x + 2 y)"),
        ("mean(energy)", r"$\langle E\rangle$", "⟨E⟩"),
        (
            "first(abs(theta2) > pi)",
            r"first $t$ with $\left| \theta_{2} \right| > \pi$",
            "first t with |θ2| > π",
        ),
        ("max(abs(x - y))", r"$\max\,\left| x - y \right|$", "max |x - y|"),
        ("max(x[3]^2/sqrt(m))", r"$\max\,\frac{x_{3}^{2}}{\sqrt{m}}$", "max x[3]² / √(m)"),
    ],
)
def test_numbers_of_motions_are_mathematics(text, latex, plain):
    assert reduced(text) == Label(latex, plain)


def test_conditions_are_mathematics():
    said = condition_label("theta2 = 0, dot(theta2) > 0, phi <= 2*pi", LABELS)
    assert said.plain == "θ2 = 0, θ̇2 > 0, φ ≤ 2 π"
    assert said.latex == r"$\theta_{2} = 0$, $\dot{\theta}_{2} > 0$, ${\varphi} \le 2 \pi$"


def test_what_has_no_form_stands_as_it_was_written():
    said = condition_label("sum(x[i], i=1..n) = 0", LABELS)
    assert said.plain == "sum(x[i], i=1..n) = 0"
    assert r"\_" in condition_label("a_b ; c = 0", LABELS).latex


def test_rates_of_angles_have_a_unit_where_that_of_time_is_open():
    assert axis_of(LABELS, ["theta2"]).label.plain == "θ2 in rad"
    assert axis_of(LABELS, ["dot(theta2)"]).label.plain == "θ̇2 in rad per unit of time"
    known = replace(LABELS, units={"dot(theta2)": "rad/s"})
    assert axis_of(known, ["dot(theta2)"]).label.plain == "θ̇2 in rad/s"


def panel_of(*curves, places=(), **options):
    t = np.linspace(0, 1, 50)
    lines = (Line(Label(str(k), str(k)), t, curve(t)) for k, curve in enumerate(curves))
    return Panel(tuple(lines), X, X, places=places, **options)


@pytest.mark.parametrize(
    ("curves", "corner"),
    [
        ((lambda t: t, lambda t: t / 2), "upper left"),
        ((lambda t: -t, lambda t: -t / 2), "upper right"),
        ((lambda t: t**2, lambda t: (1 - t) ** 2), "upper center"),
        ((lambda t: np.sin(40 * t), lambda t: np.cos(40 * t)), None),
    ],
)
def test_a_legend_stands_where_it_covers_no_line(curves, corner):
    assert legend_corner(panel_of(*curves), 12.0, 4.0) == corner
    # Where the axes are small there is no room at all.
    assert legend_corner(panel_of(*curves), 1.2, 0.8) is None


def test_lines_of_two_points_have_points_between():
    """A long straight line crosses the corner between its two ends."""
    ends = np.array([0.0, 1.0])
    cross = tuple(Line(Label(k, k), ends, y) for k, y in (("a", ends), ("b", 1 - ends)))
    assert legend_corner(Panel(cross, X, X), 12.0, 4.0) in ("upper center", "lower center")


def test_a_logarithmic_axis_puts_lines_elsewhere():
    x = np.linspace(1e-6, 1, 2000)
    lines = tuple(Line(Label(k, k), x, x * c) for k, c in (("a", 1), ("b", 2)))
    steep = Panel(lines, X, replace(X, is_log=True))
    assert legend_corner(Panel(lines, X, X), 12.0, 4.0) == "upper left"
    assert legend_corner(steep, 12.0, 4.0) == "lower right"
    assert legend_corner(replace(steep, x=replace(X, is_reversed=True)), 12.0, 4.0) == "lower left"


def test_lines_differ_in_colours_and_dashes():
    lines = [look for _, look in looks(panel_of(*[lambda t: t] * 20))]
    assert len({(look.colour, look.dash) for look in lines}) == 20


def test_many_dots_have_no_legend():
    dotted = tuple(Line(Label(str(k), str(k)), np.ones(1), np.ones(1), "dots") for k in range(9))
    assert legend_lines(Panel(dotted, X, X)) == ()
    assert len(legend_lines(Panel(dotted[:3], X, X))) == 3


def test_texts_of_near_places_stand_apart():
    name = Label("name", "name")
    places = tuple(MarkedPlace(x, 0.0, name) for x in (0.1, 0.13, 1.0))
    flat = panel_of(lambda t: 0 * t - 1, lambda t: 0 * t + 1, places=places)
    assert text_sides(flat, 12.0, 4.0) == [(1, 1), (1, -1), (-1, 1)]
    # Above the second place there is a line.
    rising = panel_of(lambda t: t, lambda t: -t, places=(MarkedPlace(0.5, 0.5, name),))
    assert text_sides(rising, 12.0, 4.0) == [(-1, 1)]


def test_ends_are_marked_in_the_colour_of_their_line():
    line = Line(NO_LABEL, np.arange(3.0), np.arange(3.0) ** 2, has_ends=True)
    text = drawn(Picture("a", (Panel((line,), X, X),)), "tex").decode()
    assert text.count("only marks") == 2
    assert "mark options={fill=white}] coordinates {(0,0)}" in text
    assert "mark size=1.2pt] coordinates {(2,4)}" in text


def test_what_nothing_draws_is_told():
    with pytest.raises(TypeError, match="nothing draws a dict"):
        picture_of({})
