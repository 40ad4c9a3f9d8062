"""Pictures of modes: places by formulas of the test, lengths of rods, files that can be read."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError
from lagrange_cli.pictures.drawing import drawn, picture_of
from lagrange_cli.pictures.drawn.modes import mode_pictures
from lagrange_cli.pictures.moving import animated
from lagrange_cli.pictures.sketch.composition import sketch_of
from lagrange_cli.pictures.sketch.svg import svg_text
from tests.cli.terminal import lagrange, succeed
from tests.systems.shipped import SYSTEMS, derived

CHAIN = """
name: chain
parameters: {m: 1, k: 10, a: 1}
sizes: {n: 4}
particles:
  b[i=1..n]: {mass: m, position: ["i*a + x[i]", 0, 0]}
points: {"b[0]": [0, 0, 0], "b[n+1]": ["(n+1)*a", 0, 0]}
coordinates: ["x[i=1..n]"]
potentials:
  V[i=0..n]: {spring: ["b[i]", "b[i+1]"], stiffness: k, length: a}
initial: {"x[i=1..n]": 0.1}
"""


def equations(*place):
    return load(SYSTEMS.joinpath(*place)).derive().equations


def test_states_of_first_order_are_no_places():
    text = """
    particles: {b: {mass: 1, position: [x, 0, 0]}}
    coordinates: [x]
    potentials: {spring: 2*x^2}
    states: {s: -s}
    initial: {x: 0, s: 1}
    """
    found = mode_pictures(loads(text).derive().equations, moving=False)
    moved = [panel.sketch.moved[0].bodies - panel.sketch.at_rest.bodies for panel in found.panels]
    assert sorted(bool(np.abs(places).max() > 0) for places in moved) == [False, True]


@pytest.mark.slow
def test_a_chain_is_displaced_as_sines():
    """x_i is proportional to sin(π r i/(n + 1)) in mode r, and has five springs."""
    found = mode_pictures(loads(CHAIN).derive().equations, moving=False)
    for r, panel in enumerate(found.panels, 1):
        moved = panel.sketch.moved[0].bodies - panel.sketch.at_rest.bodies
        sines = np.sin(np.pi * r * np.arange(1, 5) / 5)
        scale = moved[:, 0] @ sines / (sines @ sines)
        np.testing.assert_allclose(moved[:, 0], scale * sines, atol=1e-9)
        assert abs(scale) > 0.05
        assert sum(kind == "spring" for kind, _ in panel.sketch.at_rest.strokes) == 5
        squared = 2 * np.sqrt(10) * np.sin(np.pi * r / 10)
        assert panel.title.plain == f"ω = {squared:.4g}"


def test_a_sketch_has_no_springs_but_those_of_the_scene():
    """The potential of the spring at one wall looks like one to the other wall."""
    sketch = sketch_of(loads(CHAIN).derive().equations)
    assert sum(stroke.kind == "spring" for stroke in sketch.strokes) == 5
    assert svg_text(sketch).startswith("<svg")


@pytest.mark.slow
@pytest.mark.parametrize(
    "place", [("pendulums", "triple_pendulum.yaml"), ("constraints", "four_bar_linkage.yaml")]
)
def test_rods_keep_their_lengths_along_a_period(place):
    found = mode_pictures(equations(*place), moving=True)
    for panel in found.panels:
        rods = [
            [np.linalg.norm(line[1] - line[0]) for kind, line in d.strokes if kind == "rod"]
            for d in (panel.sketch.at_rest, *panel.sketch.moved)
        ]
        assert len(rods[0]) == 3
        np.testing.assert_allclose(rods, np.broadcast_to(rods[0], np.shape(rods)), rtol=1e-9)
        apart = [np.abs(d.bodies - panel.sketch.at_rest.bodies).max() for d in panel.sketch.moved]
        assert max(apart) > 0.2
        assert apart[6] < 1e-6 * max(apart) + 1e-9  # a quarter of the period


@pytest.mark.slow
def test_the_moving_svg_is_a_loop_without_scripts():
    found = mode_pictures(equations("pendulums", "coupled_pendulums.yaml"), moving=True)
    text = animated(found, "svg").decode()
    root = ET.fromstring(text)
    moving = [e for e in root.iter() if e.tag.endswith("animate")]
    assert len(moving) == 2 * (3 + 4)  # of each mode: rods and spring, x and y of two bodies
    for element in moving:
        values = element.get("values").split(";")
        assert len(values) == 25
        assert values[0] == values[-1]
    assert "script" not in text
    assert animated(found, "svg").decode() == text


@pytest.mark.slow
def test_the_gif_has_the_pictures_of_a_period():
    image = pytest.importorskip("PIL.Image")
    found = mode_pictures(equations("oscillators", "damped_oscillator.yaml"), moving=True)
    assert found.panels[0].title.plain == "s = −0.6 ± 6.296 i"
    data = animated(found, "gif")
    assert image.open(io.BytesIO(data)).n_frames == 24
    assert drawn(picture_of(found), "png").startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_command_writes_both(tmp_path):
    scene = str(SYSTEMS / "pendulums" / "coupled_pendulums.yaml")
    still, moving = tmp_path / "modes.svg", tmp_path / "moving.svg"
    shown = succeed("analyze", scene, "--modes", "--plot", str(still), "--animate", str(moving))
    assert "Modes" in shown
    for file in (still, moving):
        assert ET.parse(file).getroot().tag.endswith("svg")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--equilibria", "--plot", "a.svg"), "add --modes"),
        (("--modes", "--animate", "a.png"), "does not end in .svg or .gif"),
        (("--modes", "--steady", "--plot", "a.svg"), "not those of steady motions"),
    ],
)
def test_what_cannot_be_drawn_is_refused(words, says):
    done = lagrange("analyze", str(SYSTEMS / "pendulums" / "coupled_pendulums.yaml"), *words)
    assert done.returncode == 2
    assert says in done.stderr


def test_scenes_without_particles_have_no_picture():
    with pytest.raises(InputError, match="no particles"):
        mode_pictures(derived("relativistic_oscillator"), moving=False)
