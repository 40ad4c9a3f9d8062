"""A scripted session with the language server: open, mistype, mend, hover, complete, rename."""

from __future__ import annotations

import asyncio

import pytest

from lagrange_cli.scene import read_text
from tests.editors.session import PATIENCE, Session

pytest.importorskip("pygls", reason="the language server needs pygls")

pytestmark = pytest.mark.slow

SCENE = """\
title: A swing 𝜃, with a character of two units
parameters:
  l: {value: 1.5, unit: m, description: length}
  m: 2
  g: 9.81
particles:
  bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}
coordinates: [theta]
potentials:
  weight: m*g*z_bob
initial: {theta: 0.5}
"""


@pytest.fixture
def session(tmp_path, cache_folder):
    opened = Session(tmp_path)
    yield opened
    opened.process.kill()
    opened.process.wait()


def labels(answer):
    return {item["label"]: item for item in answer["items"]}


def test_a_session_from_opening_to_renaming(session):
    session.open(SCENE)
    assert session.problems() == []
    session.replace("z_bob", "z_bop")
    (problem,) = session.problems()
    assert session.marked(problem["range"]) == "z_bop"
    assert problem["message"].startswith("unknown name 'z_bop' in potential 'weight'")
    assert "did you mean 'z_bob'?" in problem["message"]
    assert (problem["severity"], problem["code"], problem["source"]) == (
        1,
        "unknown-name",
        "lagrange",
    )
    session.replace("z_bop", "z_bob")
    assert session.problems() == []
    # The next ones come once it is derived, and its equations are known.
    assert session.problems() == []
    hover = session.about("hover", "coordinates: [the")["contents"]["value"]
    assert "generalized coordinate" in hover
    assert "At the start theta = 0.5." in hover
    assert "l*ddot(theta) + g*sin(theta) = 0" in hover
    assert "l θ̈ + g sin θ = 0" in session.about("hover", "coordi")["contents"]["value"]
    value = session.about("hover", "position: [l")
    assert session.marked(value["range"]) == "l"
    assert "value: 1.5\nunit: m\ndescription: length" in value["contents"]["value"]
    known = labels(session.about("completion", "weight: m*g*z"))
    assert {"z_bob", "l", "theta", "sin", "sum", "pi"} <= known.keys()
    place = session.about("definition", "weight: m*g*z_bo")["range"]
    assert (session.marked(place), place["start"]["line"]) == ("bob", 6)
    edits = session.about("rename", "weight: m*g*z_bo", newName="ball")["changes"][session.uri]
    renamed = session.applied(edits)
    assert renamed == SCENE.replace("bob", "ball")
    assert read_text(renamed).particles[0].name == "ball"
    assert session.leave() == 0


def test_sections_keys_helpers_and_units_are_completed(session):
    session.open(SCENE + "for")
    assert {"forces", "near", "expect"} <= labels(session.about("completion", "\nfor")).keys()
    assert "particles" not in labels(session.about("completion", "\nfor"))
    session.replace("}\nfor", "}\nforces:\n  wind: {on: ")
    known = labels(session.about("completion", "wind: {on: "))
    assert {"bob", "theta", "origin"} <= known.keys()
    session.replace("wind: {on: ", "wind: ")
    helpers = labels(session.about("completion", "wind: "))
    assert helpers["{drag}"]["insertText"] == "{drag: , on: }"
    session.replace("unit: m,", "unit: k")
    assert {"kg", "N"} <= labels(session.about("completion", "unit: ")).keys()


def test_renaming_is_refused_with_a_reason(session):
    session.open(SCENE)
    for name, reason in (("g", "stands in the scene already"), ("2x", "cannot be a name")):
        assert session.about("rename", "position: [l", newName=name) is None
        said = session.await_message(lambda m: m.get("method") == "window/showMessage")
        assert reason in said["params"]["message"]


def test_what_derivation_refuses_is_a_problem_too(session):
    session.open(SCENE.replace("coordinates: [theta]", "coordinates: [theta, phi]"))
    found = session.problems() or session.problems()
    assert found
    assert all(problem["message"] for problem in found)


def test_hostile_texts_leave_the_server_answering(session):
    session.open(SCENE)
    texts = ["{" * 5000, "\x00\ud7ff\u2028: [", "a: &a [*a, *a]", "- " * 70000, "l: " + "(" * 20000]
    for text in texts:
        session.replace(session.text, text)
        session.about("completion", text[:3])
        session.about("hover", text[:1])
        session.about("rename", text[:1], newName="other")
    session.replace(session.text, SCENE)
    assert session.about("hover", "position: [l") is not None
    assert session.leave() == 0


def test_what_is_closed_has_no_problems(session):
    session.open("particles: 3\n")
    assert session.problems() != []
    session.tell("textDocument/didClose", textDocument={"uri": session.uri})
    assert session.problems() == []
    assert session.leave() == 0


def test_processes_that_take_too_long_are_ended_and_started_again():
    from lagrange_cli.editors.server import Helper, LateError

    async def questions():
        helper = Helper()
        hover = {"text": SCENE, "file": "f", "line": 3, "column": 3, "derived": None}
        with pytest.raises(LateError):
            await helper.ask(0.001, ask="problems", text=SCENE, file="f")
        assert await helper.ask(PATIENCE, ask="problems", text=SCENE, file="f") == []
        # The answer to what is cancelled is passed over.
        cancelled = asyncio.create_task(helper.ask(PATIENCE, ask="problems", text=SCENE, file="f"))
        await asyncio.sleep(0)
        cancelled.cancel()
        answer = await helper.ask(PATIENCE, ask="hover", **hover)
        assert answer["text"].startswith("**l**")
        with pytest.raises(RuntimeError, match="KeyError"):
            await helper.ask(PATIENCE, ask="something else")
        await helper.end()

    asyncio.run(questions())


def test_other_yaml_has_no_problems(session):
    session.open("name: CI\non: [push]\njobs: {build: {steps: []}}\n")
    assert session.problems() == []
