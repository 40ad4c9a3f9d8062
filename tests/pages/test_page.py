"""Pages on which systems move, driven in a browser without a window."""

from __future__ import annotations

import itertools
import json
import math
import re
import shutil
import subprocess
from importlib import resources
from pathlib import Path
from typing import Any

import pytest

from lagrange_cli import load, loads
from lagrange_cli.cli.main import run
from tests.simulate.test_sampled_control import PID

ROOT = Path(__file__).resolve().parents[2]
SYSTEMS = ROOT / "systems"
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser")

#: A scene whose texts would run, or end a tag, wherever they reached a page as they are.
HOSTILE = """
name: hostile
title: "</script><script>globalThis.pwned = 1</script> <img src=x onerror='globalThis.pwned1 = 1'>"
description: >-
  <!-- <script> --> ]]> " ' ` ${globalThis.pwned2 = 1} </title><b>
  <a href='javascript:globalThis.pwned9 = 1'>
parameters:
  m: {value: 1, description: "</script><script>globalThis.pwned3 = 1</script>"}
  l: {value: 1, unit: "</script><script>globalThis.pwned6 = 1</script>",
      description: "*/ globalThis.pwned4 = 1 /* \\u2028globalThis.pwned7 = 1"}
particles:
  bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}
coordinates: {theta: {description: "<svg onload='globalThis.pwned5 = 1'>"}}
potentials: {weight: {gravity: 9.81}}
initial: {theta: 1}
simulate: {until: 2}
"""


#: A ball that bounces while an input pushes it.
PUSHED = """
name: pushed_ball
parameters: {m: 1, g: 9.81, a: 3}
inputs: {F: a*sin(2*t)}
plane: xz
particles: {ball: {mass: m, position: [x, y, z]}}
constraints: {floor: {unilateral: z >= 0, restitution: 0.7}}
potentials: {weight: {gravity: g}}
forces: {wind: {on: x, force: F}}
initial: {x: 0, z: 1, dot(x): 0, dot(z): 0}
simulate: {until: 2}
"""

WRITTEN = {"hostile": HOSTILE, "pushed_ball": PUSHED}


def written(derivation: Any, path: Path, language: str = "en") -> Path:
    path.write_text(derivation.page(language=language), encoding="utf-8")
    return path


def driven(files: list[Path]) -> list[dict[str, Any]]:
    """What a browser finds on pages (:file:`drive.mjs`)."""
    node = shutil.which("node")
    if BROWSER is None or node is None or not (ROOT / "node_modules/puppeteer-core").is_dir():
        pytest.skip("no chromium, or no puppeteer-core (npm install --no-save puppeteer-core)")
    playing = "400"
    command = [node, str(Path(__file__).with_name("drive.mjs")), BROWSER, playing]
    command += map(str, files)
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def of_drawing(ask: str) -> Any:
    """What code of JavaScript prints that follows the page's drawing (:file:`drawing.js`)."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("no node")
    script = resources.files("lagrange_cli.pages") / "player/drawing.js"
    text = script.read_text(encoding="utf-8") + ask
    done = subprocess.run([node, "-e", text], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def pages(tmp_path_factory) -> dict[str, dict[str, Any]]:
    """Name → what the browser found on the page of a scene."""
    folder = tmp_path_factory.mktemp("pages")
    scenes = {
        name: load(SYSTEMS / f"{path}.yaml").derive()
        for name, path in {
            "double_pendulum": "pendulums/double_pendulum",
            "slider_crank": "constraints/slider_crank",
            "net_of_springs": "chains/net_of_springs",
            "schwarzschild_orbit": "celestial/schwarzschild_orbit",
            "dc_motor_pendulum": "actuators/dc_motor_pendulum",
            "bouncing_ball": "contact/bouncing_ball",
            "slack_rope": "contact/slack_rope",
            "rolling_disk": "rolling/rolling_disk",
            "seismometer": "oscillators/seismometer",
            "slider_with_play": "switching/slider_with_play",
            "stick_slip_belt": "switching/stick_slip_belt",
            "sampled_cart_pole": "actuators/sampled_cart_pole",
        }.items()
    }
    scenes |= {name: loads(text).derive() for name, text in WRITTEN.items()}
    scenes["sampled_pid"] = loads(PID).derive()
    files = [written(derivation, folder / f"{name}.html") for name, derivation in scenes.items()]
    (folder / "used.html").write_bytes((folder / "slider_crank.html").read_bytes())
    rows = driven([*files, Path("--use"), folder / "used.html"])
    return dict(zip([*scenes, "used"], rows, strict=True))


@pytest.mark.parametrize(
    "name",
    [
        *("double_pendulum", "slider_crank", "net_of_springs", "schwarzschild_orbit"),
        *("dc_motor_pendulum", "bouncing_ball", "slack_rope", "rolling_disk", "seismometer"),
        *("slider_with_play", "pushed_ball", "sampled_cart_pole", "sampled_pid"),
    ],
)
def test_a_page_moves_as_the_simulation_does(pages, name):
    page = pages[name]
    assert page["messages"] == []
    assert page["usual"]["status"] == "done"
    assert page["usual"]["largest"] < 1e-6
    assert page["played"]["t"] > 0.2
    is_drawn = name not in ("schwarzschild_orbit", "slider_with_play")
    assert (page["canvases"]["drawing"] > 100) is is_drawn
    assert min(page["canvases"][id_] for id_ in ("series", "phase", "drift")) > 100


def test_a_slider_changes_the_motion_and_the_address(pages):
    page = pages["double_pendulum"]
    assert page["moved"]["end"] != page["usual"]["end"]
    assert page["moved"]["largest"] < 1e-6
    assert "a hundredth of the tolerance" in page["moved"]["difference"]
    assert re.fullmatch(r"#y\.theta1=0\.314159\d*", page["address"])


def test_a_moved_start_obeys_the_constraints(pages):
    """The crank is turned: the page leads the piston to its place."""
    page = pages["slider_crank"]
    assert page["moved"]["status"] == "done"
    assert page["moved"]["largest"] < 1e-6


def test_the_energy_drift_is_that_of_the_equations(pages):
    size = re.search(r"≤ (\S+)·10(\S+)", pages["double_pendulum"]["shown"]["drift"])
    digits = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    assert float(size[1]) * 10 ** int(size[2].translate(digits)) < 1e-7


def test_the_energy_falls_at_impacts_alone(pages):
    """Behind each bounce the ball has the square of the restitution of what it had."""
    points = pages["bouncing_ball"]["drift"]
    steps = [
        (after - before, t == behind) for (t, before), (behind, after) in itertools.pairwise(points)
    ]
    assert max(abs(change) for change, is_impact in steps if not is_impact) < 1e-8
    losses = [change for change, is_impact in steps if is_impact]
    assert losses[0] == pytest.approx(-9.81 * (1 - 0.8**2), rel=1e-6)
    assert losses[1] == pytest.approx(0.8**2 * losses[0], rel=1e-6)


def test_what_sticks_goes_on_as_it_was_simulated(pages):
    """The block sticks to the belt from t = 0.38 on; the page shows the motion up to its end."""
    page = pages["stick_slip_belt"]
    assert page["messages"] == []
    assert (page["usual"]["status"], page["usual"]["reached"]) == ("slow", 20)
    assert "up to t = 0.3:" in page["shown"]["difference"]
    assert page["usual"]["end"] == pytest.approx([0.153899735927069, 0.5], abs=1e-7)


def test_each_control_has_a_name_and_its_unit(pages):
    read = pages["used"]["use"]["read"]
    assert all(name for _, name, _ in read)
    names = {role: [n for r, n, _ in read if r == role] for role, _, _ in read}
    assert len(set(names["slider"])) == len(names["slider"]) == 9
    assert {"length of the crank, r, m", "rate of θ, rad/s"} <= {*names["slider"]} & {
        *names["spinbutton"]
    }
    (keys,) = (told for role, _, told in read if role == "image" and told)
    assert "Space plays and pauses" in keys


def test_a_page_is_used_by_keys_alone(pages):
    """Nothing moves before it is told to; Tab leads through the controls in their order."""
    use = pages["used"]["use"]
    keys = use["keys"]
    assert keys["atRest"] == keys["home"] == 0
    assert 0 < keys["played"] < keys["stepped"]
    assert use["tabs"][:5] == ["drawing", "play", "step", "reset", "time"]


def test_what_is_read_aloud_changes_seldom(pages):
    spoken = pages["used"]["use"]["spoken"]
    assert spoken["counted"] <= 2
    assert re.fullmatch(r"Distance of the twins: \S+", spoken["apart"])


def test_a_body_is_dragged_to_a_start_that_satisfies_the_constraints(pages):
    mouse = pages["used"]["use"]["mouse"]
    start = mouse["after"]["y"]
    assert abs(start[0] - mouse["before"][0]) > 1e-3
    assert start[2:] == [0, 0]
    theta, x = start[:2]
    rod = math.hypot(x - 0.1 * math.cos(theta), 0.1 * math.sin(theta))
    assert rod == pytest.approx(0.25, abs=1e-12)


def test_the_address_holds_all_settings(pages):
    """Another tab has the start that was dragged to, and the twin."""
    address = pages["used"]["use"]["address"]
    assert address["both"][0] == address["both"][1]
    assert address["twins"] == [True, True]


def test_a_system_that_is_enlarged_stays_in_the_drawing(pages):
    assert pages["used"]["use"]["beyond"] < 0


def test_a_longer_motion_is_compared_with_a_finer_run(pages):
    assert "a hundredth of the tolerance" in pages["used"]["use"]["longer"]


@pytest.mark.parametrize(
    ("rod", "corner"), [([0, 100], [9, -9]), ([154, -91], [9, 19]), ([60, -140], [9, 19])]
)
def test_a_name_stands_beside_a_rod(rod, corner):
    """A rod that goes up to the right leaves the name the place below it."""
    ask = """
    let at;
    const painter = { widthOf: () => 38, text: (words, place) => { at = place; } };
    const stage = { bodies: [{ name: 'upper' }, {}], links: [{ ends: [0, 1] }] };
    drawNames(painter, stage, [[0, 0], ROD], 'black');
    console.log(JSON.stringify(at));
    """
    assert of_drawing(ask.replace("ROD", json.dumps(rod))) == corner


@pytest.mark.parametrize(("kind", "leading"), [("mass", [1]), ("joint", [0, 1])])
def test_points_have_traces_where_there_are_no_particles(kind, leading):
    """The tip of a top whose kinetic energy is given draws its nutation."""
    bodies = [{"kind": "joint", "name": "tip"}, {"kind": kind, "name": "rim"}]
    bodies.append({"kind": "origin", "name": ""})
    stage = json.dumps({"bodies": bodies})
    assert of_drawing(f"console.log(JSON.stringify(new Stage({stage}, []).leading));") == leading


def test_a_page_prints_without_controls_and_distortion(pages):
    paper = pages["used"]["use"]["paper"]
    assert len(paper["shapes"]) == 4
    assert all(shown == pytest.approx(drawn, rel=0.01) for shown, drawn in paper["shapes"])
    assert (paper["ranges"], paper["numbers"]) == (0, 8)
    assert paper["pages"] > 10_000


def test_no_text_of_a_scene_runs(pages):
    page = pages["hostile"]
    assert page["messages"] == []
    assert page["foreign"] == []
    assert page["usual"]["status"] == "done"


def test_a_policy_stands_in_the_page():
    text = load(SYSTEMS / "pendulums/pendulum.yaml").derive().page()
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', text)[1]
    assert "default-src 'none'" in policy
    assert "unsafe-eval" not in policy
    assert "unsafe-inline" not in policy.replace("style-src-attr 'unsafe-inline'", "")
    assert not re.search(r'(?:src|href)="', text)


def test_each_slider_of_a_parameter_acts():
    """Height and speed of the throw are the start's: its own sliders have them."""
    text = load(SYSTEMS / "contact/bouncing_ball.yaml").derive().page()
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1])
    acting = {parameter["name"]: parameter["isRead"] for parameter in data["parameters"]}
    assert acting == {"m": True, "g": True, "h": False, "u": False, "e": True}


def test_a_page_is_small():
    """The double pendulum's is below 300 kB, equations and trajectory included."""
    text = load(SYSTEMS / "pendulums/double_pendulum.yaml").derive().page()
    assert len(text.encode("utf-8")) < 300_000


@pytest.mark.parametrize(("language", "word"), [("de", "Abspielen"), ("fr", "Lecture")])
def test_a_page_speaks_other_languages(language, word):
    text = load(SYSTEMS / "pendulums/pendulum.yaml").derive().page(language=language)
    assert f'<html lang="{language}">' in text
    assert f'"play":"{word}"' in text


def test_the_command_writes_one_file(tmp_path, capsys):
    scene, page = SYSTEMS / "pendulums/pendulum.yaml", tmp_path / "page.html"
    assert run(["show", str(scene), "-i", "theta=0.5", "-o", str(page)]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]
    assert "const INITIAL = [0.5, 0.0]" in page.read_text(encoding="utf-8")
    assert capsys.readouterr().err == f"wrote {page}\n"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "name the file of the page, as in -o page.html"),
        (["-o", "page.txt"], "'page.txt' does not end in .html or .htm"),
    ],
)
def test_a_page_goes_to_a_file_of_html(arguments, said, capsys):
    assert run(["show", str(SYSTEMS / "pendulums/pendulum.yaml"), *arguments]) == 2
    assert said in capsys.readouterr().err


def test_a_scene_without_a_start_is_refused(capsys, tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text("coordinates: [x]\nparticles: {p: {mass: 1, position: [x, 0, 0]}}\n")
    assert run(["show", str(scene), "-o", str(tmp_path / "page.html")]) == 2
    assert "a page shows a motion, and no start is known" in capsys.readouterr().err
    assert not (tmp_path / "page.html").exists()
