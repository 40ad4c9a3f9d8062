"""Films of motions: places by formulas of the test, files that can be read."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError
from lagrange_cli.pictures.moving import animated, motion_pictures
from lagrange_cli.pictures.sketch.displaced import RestingSketch
from tests.cli.terminal import lagrange, succeed
from tests.systems.shipped import SYSTEMS

PENDULUM = str(SYSTEMS / "pendulums" / "pendulum.yaml")


#: Two particles beside each other, and one apart.
ROW = """
name: row
parameters: {m: 1}
particles:
  a: {mass: m, position: [x, 0, 0]}
  b: {mass: m, position: [x + APART, 0, 0]}
  c: {mass: m, position: [x, 0, 1]}
coordinates: [x]
initial: {x: 0}
"""

#: A rod that turns evenly.
ROTOR = """
name: rotor
parameters: {m: 1, l: 1}
particles: {bob: {mass: m, position: [l*cos(phi), l*sin(phi), 0]}}
coordinates: [phi]
initial: {phi: 0, dot(phi): RATE}
simulate: {until: 2}
"""


@pytest.fixture(scope="module")
def swing():
    derivation = load(PENDULUM).derive()
    return derivation.equations, [("", derivation.simulate(until=2.0))]


def test_frames_show_the_motion(swing):
    """Each frame has the bob at its angle from the pivot, on a rod of one length."""
    equations, motions = swing
    ((_, trajectory),) = motions
    pictures = motion_pictures(equations, motions)
    (panel,) = pictures.panels
    assert pictures.seconds == 2.0
    assert pictures.frames == 50
    rods = np.array([dict(drawn.strokes)["rod"] for drawn in panel.sketch.moved])
    along = rods[:, 1] - rods[:, 0]
    times = np.arange(50) * 0.04
    angles = np.interp(times, trajectory.t, trajectory.columns["theta"])
    np.testing.assert_allclose(np.arctan2(along[:, 0], -along[:, 1]), angles, atol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), np.linalg.norm(along[0]), rtol=1e-9)


def test_curves_go_as_far_as_the_motion():
    """The floor lies below the whole path of the ball, the slope below that of the wheel."""
    for place, kind, until in (
        ("contact/bouncing_ball", "curve", None),
        ("rolling/wheel_down_incline", "ground", 1.5),
    ):
        derivation = load(SYSTEMS / f"{place}.yaml").derive()
        motions = [("", derivation.simulate(until=until))]
        (panel,) = motion_pictures(derivation.equations, motions).panels
        x = np.concatenate([drawn.bodies[:, 0] for drawn in panel.sketch.moved])
        lines = np.concatenate([line[:, 0] for k, line in panel.sketch.still if k == kind])
        assert lines.min() <= x.min()
        assert lines.max() >= x.max()


def test_a_system_that_goes_far_is_followed():
    """The wheel is in the middle, marks of the slope go by as fast as its rim turns."""
    derivation = load(SYSTEMS / "rolling/wheel_down_incline.yaml").derive()
    trajectory = derivation.simulate()
    (panel,) = motion_pictures(derivation.equations, [("", trajectory)]).panels
    moved = panel.sketch.moved
    spokes = np.array([dict(drawn.strokes)["wheel"] for drawn in moved])
    assert np.ptp(spokes[:, 0], axis=0).max() < 1e-9
    radius = np.linalg.norm(spokes[0, 1] - spokes[0, 0])
    travelled = np.interp(0.04 * np.arange(len(moved)), trajectory.t, trajectory.columns["s"])
    first, *_, last = rows = _marks(moved[0])
    apart = np.linalg.norm(last - first) / 6
    along = (last - first) / (6 * apart)
    for drawn, way in zip(moved, travelled / 0.5 * radius, strict=True):
        marks_gone = ((_marks(drawn)[0] - rows[0]) @ along + way) / apart
        assert abs(marks_gone - round(marks_gone)) < 5e-3


def _marks(drawn):
    """Middles of the marks of a floor, whose line comes first."""
    return [line.mean(axis=0) for kind, line in drawn.strokes if kind == "ground"][1:]


def test_particles_that_are_close_are_drawn_small():
    for apart, least, most in ((0.5, 0.1, 0.1), (0.1, 0.05, 0.09), (1e-3, 0.035, 0.035)):
        equations = loads(ROW.replace("APART", str(apart))).derive().equations
        radius = RestingSketch(equations, np.zeros(1)).displaced([]).radius
        assert least <= radius <= most


def test_lines_that_turn_far_between_frames_jump():
    """A rotor of 20 turns a second would shrink where its places are interpolated."""
    for rate, mode in ((2, "linear"), (125, "discrete")):
        derivation = loads(ROTOR.replace("RATE", str(rate))).derive()
        pictures = motion_pictures(derivation.equations, [("", derivation.simulate())])
        assert f'calcMode="{mode}"' in animated(pictures, "svg").decode()


@pytest.mark.parametrize(("speed", "seconds"), [(None, 2.0), (4.0, 0.5), (0.1, 20.0)])
def test_a_speed_makes_a_film_shorter_or_longer(swing, speed, seconds):
    assert motion_pictures(*swing, speed).seconds == pytest.approx(seconds)


def test_a_motion_of_months_lasts_ten_seconds():
    derivation = load(SYSTEMS / "celestial" / "kepler.yaml").derive()
    assert motion_pictures(derivation.equations, [("", derivation.simulate())]).seconds == 10.0


@pytest.mark.parametrize(("speed", "says"), [(0.0, "positive"), (1e-6, "more than an hour")])
def test_an_impossible_speed_is_refused(swing, speed, says):
    with pytest.raises(InputError, match=says):
        motion_pictures(*swing, speed)


def test_a_film_is_an_svg_a_gif_or_an_mp4(swing, tmp_path):
    image = pytest.importorskip("PIL.Image")
    pictures = motion_pictures(*swing, 4.0)
    text = animated(pictures, "svg").decode()
    assert ET.fromstring(text).tag.endswith("svg")
    assert "script" not in text
    assert image.open(io.BytesIO(animated(pictures, "gif"))).n_frames == pictures.frames
    if shutil.which("ffmpeg") is None:
        with pytest.raises(InputError, match="needs ffmpeg"):
            animated(pictures, "mp4")
        return
    (tmp_path / "film.mp4").write_bytes(animated(pictures, "mp4"))
    asked = [
        "-v",
        "error",
        "-count_frames",
        "-show_entries",
        "stream=nb_read_frames",
        "-of",
        "csv=p=0",
    ]
    read = ["ffprobe", *asked, str(tmp_path / "film.mp4")]
    done = subprocess.run(read, capture_output=True, text=True, check=True)
    assert int(done.stdout.strip().rstrip(",")) == pictures.frames


def test_the_command_writes_a_film(tmp_path):
    film, page = tmp_path / "film.svg", tmp_path / "page.html"
    succeed("simulate", PENDULUM, "--until", "1", "--animate", str(film), "--speed", "2")
    assert "0.5s" in film.read_text()
    succeed("simulate", PENDULUM, "--animate", str(page))
    assert page.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--animate", "a.png"), "does not end in .svg or .gif or .mp4 or .html"),
        (("--speed", "2"), "--speed needs --animate FILE"),
        (("--animate", "a.svg", "--vary", "l=[1,2]"), "--animate shows one motion"),
        (("--animate", "a.svg", "--section", "theta=0"), "--animate shows one motion"),
    ],
)
def test_what_is_no_film_is_refused(words, says, tmp_path):
    done = lagrange("simulate", PENDULUM, *words, cwd=tmp_path)
    assert done.returncode == 2
    assert says in done.stderr


def test_paths_are_filmed_beside_each_other(tmp_path):
    film = tmp_path / "paths.svg"
    words = ("--from", "theta=0, t=0", "--to", "theta=1, t=2", "--animate", str(film))
    done = lagrange("path", PENDULUM, *words, "--starts", "8", "--json")
    kinds = [one["kind"] for one in json.loads(done.stdout)["solutions"]]
    text = film.read_text(encoding="utf-8")
    assert [f"{k}: {kind}" in text for k, kind in enumerate(kinds, 1)] == [True] * len(kinds)


def test_a_motion_plays_in_notebooks(tmp_path):
    derivation = load(PENDULUM).derive()
    film = derivation.simulate(until=1).animate(speed=2)
    assert film._repr_html_().startswith("<svg")
    assert derivation.animate(speed=2)._repr_html_().startswith("<svg")
    film.write(tmp_path / "swing.svg")
    assert "0.5s" in (tmp_path / "swing.svg").read_text(encoding="utf-8")
    with pytest.raises(InputError, match="its own parameters"):
        derivation.simulate(until=1, parameters={"l": 2}).animate()


def test_a_disk_on_a_plane_turns_with_its_heading():
    equations = load(SYSTEMS / "rolling/rolling_disk.yaml").derive().equations
    times = np.linspace(0, 2, 51)
    turn, radius = 0.7 * times, 1.5 / 0.7
    q = np.stack([radius * np.sin(turn), radius * (1 - np.cos(turn)), turn, 3 * times], axis=1)
    drawn = RestingSketch(equations, q[0]).followed(q, times)
    # Aslant from above: y to the right, x towards the viewer.
    shown = np.array([[-0.38, 1.0], [-0.30, 0.0]])
    for number in (10, 25, 40):
        rim = next(line for kind, line in drawn.moved[number].strokes if kind == "wheel")
        ahead = shown @ np.array([np.cos(turn[number]), np.sin(turn[number])])
        x, y = rim[len(rim) // 4] - rim[3 * (len(rim) // 4)]
        assert x * ahead[1] - y * ahead[0] == pytest.approx(0, abs=1e-9)
