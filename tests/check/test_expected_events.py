"""Expected events are compared with those that a simulation finds, in order."""

from __future__ import annotations

from pathlib import Path

import pytest

from lagrange_cli.check import check_scene
from lagrange_cli.check.motions import ExpectedEvent, missing_events
from lagrange_cli.errors import Mark
from lagrange_cli.simulate.results.trajectory import Event

MARK = Mark("scene.yaml", 1, 1, "")

FOUND = [
    Event(0.5, "contact:floor"),
    Event(1.0, "contact:floor"),
    Event(1.25, "release:floor"),
    Event(1.5, "contact:floor"),
    Event(2.0, "zeno:floor"),
]


def missing(*wanted: tuple[str, float | None], within: float = 1e-6) -> list[str]:
    asked = [ExpectedEvent(name, time, within, MARK) for name, time in wanted]
    return [problem.message for problem in missing_events(asked, FOUND)]


@pytest.mark.parametrize(
    "wanted",
    [
        [],
        [("contact:floor", None)],
        [("contact:floor", 0.5), ("contact:floor", 1.5)],
        [("contact:floor", 1.0000001)],
        [("contact:floor", None)] * 3 + [("zeno:floor", 2.0)],
        [("contact:floor", 1.0), ("release:floor", None), ("contact:floor", None)],
    ],
)
def test_what_happens_in_this_order(wanted: list[tuple[str, float | None]]) -> None:
    assert missing(*wanted) == []


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ([("contact:wall", None)], "expected contact:wall; it does not happen"),
        ([("contact:floor", None)] * 4, "expected contact:floor; it does not happen"),
        (
            [("contact:floor", 0.6)],
            "expected contact:floor at t = 0.6 within 1e-06, found it at 0.5",
        ),
        (
            [("contact:floor", 1.4)],
            "expected contact:floor at t = 1.4 within 1e-06, found it at 1.5",
        ),
        (
            [("release:floor", None), ("contact:floor", 0.5)],
            "expected contact:floor at t = 0.5 within 1e-06, found it at 1.5",
        ),
        (
            [("zeno:floor", 2.0), ("release:floor", 1.25)],
            "expected release:floor at t = 1.25 within 1e-06; it does not happen",
        ),
    ],
)
def test_what_does_not(wanted: list[tuple[str, float | None]], message: str) -> None:
    assert missing(*wanted) == [message]


def test_one_that_is_missing_does_not_hide_the_next() -> None:
    assert len(missing(("contact:wall", None), ("release:floor", 1.25), ("zeno:floor", 9))) == 2


def test_the_events_that_there_are_stand_in_the_hint() -> None:
    (problem,) = missing_events([ExpectedEvent("zeno:wall", None, 0, MARK)], FOUND * 2)
    assert problem.hint.splitlines()[1] == "  contact:floor at t = 0.5"
    assert problem.hint.splitlines()[-1] == "  and 2 more"
    (problem,) = missing_events([ExpectedEvent("zeno:wall", None, 0, MARK)], [])
    assert problem.hint == "found no events"
    assert problem.rule == "events"


BALL = """\
name: ball
parameters: {m: 1.0, g: 9.81, h: 1.0, r: 0.5}
particles:
  ball: {mass: m, position: [x, y, z]}
constraints:
  plane: [x = 0, y = 0]
  floor: {unilateral: z >= 0, restitution: r}
potentials:
  weight: {gravity: g}
initial: {z: h}
simulate: {until: 1.2, accuracy: 1e-6}
expect:
  dof: 1
  equations: ['m*ddot(z) + m*g = lambda_floor']
  conserved: [energy]
  events: EVENTS
"""

FIRST = "{name: contact:floor, t: sqrt(2*h/g), within: 1e-10}"
SECOND = "{name: contact:floor, t: (1 + 2*r)*sqrt(2*h/g)}"


def outcome(folder: Path, events: str):
    path = folder / "ball.yaml"
    path.write_text(BALL.replace("EVENTS", events), encoding="utf-8")
    return check_scene(str(path))


@pytest.mark.slow
@pytest.mark.parametrize(
    "events", ["[]", f"[{FIRST}]", f"[{FIRST}, {SECOND}]", "[{name: contact:floor}]"]
)
def test_scenes_that_hold(tmp_path: Path, events: str) -> None:
    assert outcome(tmp_path, events).outcome == "pass"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("events", "message"),
    [
        (f"[{SECOND}, {FIRST}]", "expected contact:floor at t = 0.45"),
        ("[{name: contact:floor, t: 0.5}]", "expected contact:floor at t = 0.5 within 1.2e-06"),
        ("[{name: release:floor}]", "expected release:floor; it does not happen"),
    ],
)
def test_scenes_that_do_not(tmp_path: Path, events: str, message: str) -> None:
    result = outcome(tmp_path, events)
    assert result.outcome == "fail"
    (problem,) = result.problems
    assert problem.message.startswith(message)
    assert problem.mark.line == 16


def test_an_equation_without_its_multiplier_is_another(tmp_path: Path) -> None:
    path = tmp_path / "ball.yaml"
    text = BALL.replace("EVENTS", "[]").replace(" = lambda_floor", " = 0")
    path.write_text(text, encoding="utf-8")
    assert check_scene(str(path)).outcome == "fail"


@pytest.mark.parametrize("until", ["0", "-1"])
def test_events_of_a_run_without_a_span_are_refused_at_its_place(
    until: str, tmp_path: Path
) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(
        "particles: {p: {mass: 1, position: [0, 0, z]}}\ncoordinates: [z]\n"
        "constraints: {floor: {unilateral: z >= 0}}\ninitial: {z: 1}\n"
        f"simulate: {{until: {until}}}\n"
        "expect: {events: [{name: contact:floor, t: 0.5, within: 1e-8}]}\n"
    )
    report = check_scene(str(path))
    assert report.outcome == "fail"
    assert report.problems[0].mark is not None
