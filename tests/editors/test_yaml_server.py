"""The JSON Schema of scenes in yaml-language-server, as editors have it without our own server."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

from lagrange_cli.scene.schema import scene_schema
from tests.editors.session import Session
from tests.systems.shipped import SCENES

pytestmark = pytest.mark.slow

MODELINE = "# yaml-language-server: $schema=scene.schema.json\n"

#: Scenes with helpers, families, bodies and expectations.
CHOSEN = ("pendulum_chain", "heavy_top", "bouncing_ball", "kepler")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("yaml")
    (path / "scene.schema.json").write_text(json.dumps(scene_schema()))
    return path


@pytest.fixture
def session(folder):
    installed = Path(__file__).parents[2] / "node_modules" / ".bin"
    server = shutil.which(
        "yaml-language-server", path=f"{installed}{os.pathsep}{os.environ['PATH']}"
    )
    if server is None:
        pytest.skip("npm install --no-save yaml-language-server brings the server")
    opened = Session(folder, command=[server, "--stdio"])
    yield opened
    opened.process.kill()
    opened.process.wait()


@pytest.mark.parametrize("name", CHOSEN)
def test_shipped_scenes_follow_it(session, name):
    session.open(MODELINE + Path(SCENES[name]).read_text(encoding="utf-8"))
    assert session.problems() == []


def test_unknown_keys_are_marked_and_known_ones_completed(session):
    session.open(MODELINE + "particles: {b: {mass: 1, place: [x, 0, 0]}}\n")
    assert "place" in [session.marked(problem["range"]) for problem in session.problems()]
    session.open(MODELINE + "particles:\n  b:\n    mass: 1\n    \n")
    answer = session.about("completion", "mass: 1\n    ")
    assert "position" in {item["label"] for item in answer["items"]}
    assert "mass" in session.about("hover", "    ma")["contents"]["value"].lower()
