"""Maps of a number of members over the plane of two names that they vary."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest

from lagrange_cli import InputError
from lagrange_cli.pictures.by_matplotlib import draw_map
from lagrange_cli.pictures.drawn.maps import Plane
from lagrange_cli.simulate.ensemble.plan.plan import Selection
from lagrange_cli.simulate.ensemble.plan.sampling import sampled
from lagrange_cli.simulate.ensemble.plan.sources import grid
from lagrange_cli.simulate.model.requested_outputs import read_reduction
from tests.simulate.ensemble.test_ensemble import PENDULUM, plan_of

SPAN = np.array([0.0, 2.0])
KEPT = Selection((), True, (read_reduction("first(theta < 0)"),))


@pytest.fixture(scope="module")
def plan():
    scene = PENDULUM.replace("  m: 1\n", "  m: {value: 1, unit: kg}\n")
    return plan_of(scene, ["theta", "m"], ["0.1", "1"], selection=KEPT)


def drawn(plan, members, names, value):
    """The map of a function of both numbers, as if it were what became of members."""
    plane = Plane.of_axes(members, names)
    rows = np.array([[float(text) for text in row] for row in members.rows()])
    given = {name: rows[:, k] for k, name in enumerate(members.names)}
    arrays = {f"given/{name}": values for name, values in given.items()}
    arrays["reduced/first(theta < 0)"] = value(given["theta"], given["m"])
    return plane.map_of(arrays, plane.drawn(plan, None), plan, SPAN)


@pytest.mark.parametrize(
    "specs",
    [
        ("theta=[0.1,0.2,0.4]", "m=[1,3]"),
        ("m=[1,3]", "theta=[0.1,0.2,0.4]"),
        ("m=[3,1]", "l=[2]", "theta=[0.4,0.1,0.2]"),
    ],
)
def test_values_stand_where_their_members_are(plan, specs):
    """Whatever varies first, and in which order its values are given."""
    found = drawn(plan, grid(specs), ("theta", "m"), lambda theta, m: 10 * theta + m)
    assert found.x.tolist() == [0.1, 0.2, 0.4]
    assert found.y.tolist() == [1.0, 3.0]
    assert np.allclose(found.values, [[2, 3, 5], [4, 5, 7]])
    assert not found.is_even
    turned = drawn(plan, grid(specs), ("m", "theta"), lambda theta, m: 10 * theta + m)
    assert np.allclose(turned.values, found.values.T)
    assert found.bar.label.plain == "first t in s with θ < 0"
    assert found.bar.label.latex == r"first $t$ in $\mathrm{s}$ with $\theta < 0$"
    assert (found.x_axis.label.plain, found.y_axis.label.plain) == ("θ(0) in rad", "m in kg")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spec", "endings"),
    [("linspace(0.1,0.4,4)", ("png", "pdf", "svg")), ("[0.1,0.2,0.4,0.8]", ("png",))],
    ids=["even", "not"],
)
def test_the_same_map_has_the_same_bytes(plan, spec, endings):
    """And what has no value has a colour of its own, that the bar does not have."""
    from matplotlib.image import imread

    members = grid([f"theta={spec}", "m=linspace(1,2,5)"])
    whole = drawn(plan, members, ("theta", "m"), lambda theta, m: theta * m)
    holes = replace(whole, values=np.where(whole.values > 0.3, np.nan, whole.values))
    part = np.isnan(holes.values).mean()
    assert 0.2 < part < 0.8
    pictures = {ending: draw_map(holes, ending) for ending in endings}
    assert all(draw_map(holes, ending) == picture for ending, picture in pictures.items())
    grey = [
        (np.abs(imread(io.BytesIO(picture))[..., :3] - 0.8) < 0.01).all(axis=2).mean()
        for picture in (draw_map(whole, "png"), pictures["png"])
    ]
    assert grey[0] < 0.01
    assert grey[1] - grey[0] > 0.4 * part


@pytest.mark.parametrize("ending", ["tex", "pgf"])
def test_an_image_is_not_written_for_tex(plan, ending):
    found = drawn(plan, grid(["theta=[1,2]", "m=[1,2]"]), ("theta", "m"), lambda theta, m: m)
    with pytest.raises(InputError, match="a map is an image"):
        draw_map(found, ending)


def test_what_can_be_drawn(plan):
    plane = Plane.of_axes(grid(["theta=[1,2]", "m=[1,2]"]), ("theta", "m"))
    assert plane.drawn(plan, None) == plane.drawn(plan, "first(theta < 0)")
    assert plane.drawn(plan, "dot(theta)") == "final/dot(theta)"
    with pytest.raises(InputError, match="'thata' is no reduction") as refusal:
        plane.drawn(plan, "thata")
    assert "theta" in refusal.value.problems[0].hint
    nothing = replace(plan, selection=Selection(()))
    with pytest.raises(InputError, match="what is the map of"):
        plane.drawn(nothing, None)
    with pytest.raises(InputError, match="'theta' is no reduction") as refusal:
        plane.drawn(nothing, "theta")
    assert "--final" in refusal.value.problems[0].hint


@pytest.mark.parametrize(
    ("members", "names", "said"),
    [
        (grid(["theta=[1,2]", "m=[1,2]"]), ("theta", "l"), "'l' is not varied"),
        (grid(["theta=[1,2]", "m=[1,2]"]), ("theta",), "over two names"),
        (grid(["theta=[1,2]", "m=[1,2]"]), ("theta", "theta"), "over two names"),
        (grid(["theta=[1,2]", "m=[1]"]), ("theta", "m"), "'m' has one value"),
        (grid(["theta=[1,2]", "m=[1,2]", "l=[1,2]"]), ("theta", "m"), "'l' varies beside"),
        (sampled(["m ~ uniform(1,2)"], 9, 0), ("theta", "m"), "members that are varied"),
    ],
)
def test_what_is_no_plane(members, names, said):
    with pytest.raises(InputError, match=said):
        Plane.of_axes(members, names)


def test_a_value_that_no_member_has(plan):
    """An expression whose number is known of members alone, all of which are refused."""
    members = grid(["theta=[1,2]", "m=[1,2]"])
    plane = Plane.of_axes(members, ("theta", "m"))
    values = np.ones(4)
    arrays = {"given/theta": np.array([1, 1, np.nan, np.nan]), "given/m": np.array([1, 2, 1, 2.0])}
    with pytest.raises(InputError, match="some value of 'theta'"):
        plane.map_of({**arrays, "final/theta": values}, "final/theta", plan, SPAN)
