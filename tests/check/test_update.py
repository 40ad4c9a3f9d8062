"""Values that were found take the place of expected ones that fail, and nothing else changes."""

from __future__ import annotations

import os

import pytest

from lagrange_cli.check import check_scene, update_of
from lagrange_cli.errors import InputError
from tests.cli.terminal import lagrange

#: A pendulum and what it expects; the marks {…} are values that fail, with those that hold.
PENDULUM = """\
# A pendulum.
name: pendulum
parameters: {{m: 1, g: 9.81, l: 1}}
particles: {{bob: {{mass: m, position: [l*sin(theta), -l*cos(theta), 0]}}}}
coordinates: [theta]
potentials: {{weight: m*g*y_bob}}
initial: {{theta: 0.5, dot(theta): 0}}
expect:
  dof: {dof}   # as counted
  cyclic: {cyclic}
  frequencies: [{frequency}]  # small
  state: {{ t: 1.0, theta: {theta}, 'dot(theta)': "{speed}", within: 1e-6 }}
  equilibria:
    - {{theta: {lower}, stability: {stability}}}  # hanging
    - {{theta: pi, stability: unstable}}
"""
WRONG = {"dof": 2, "cyclic": "[ theta ]", "frequency": 3.1, "theta": 0.1, "speed": 1}
WRONG |= {"lower": 0, "stability": "unstable"}
RIGHT = {"dof": 1, "cyclic": "[]", "frequency": "sqrt(g/l)", "theta": 0, "speed": 0}
RIGHT |= {"lower": 0, "stability": "stable"}


@pytest.fixture
def scene(tmp_path, cache_folder):
    path = tmp_path / "p.yaml"
    path.write_text(PENDULUM.format_map(WRONG))
    return path


def test_all_values_are_replaced_and_the_rest_is_kept(scene, tmp_path):
    before = scene.read_text()
    shown = lagrange("check", "p.yaml", "--diff", cwd=tmp_path)
    assert (shown.returncode, scene.read_text()) == (1, before)
    done = lagrange("check", "p.yaml", "--update", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("--- p.yaml\n")
    assert "\n+  dof: 1   # as counted\n" in done.stdout
    assert shown.stdout.startswith(done.stdout.partition("pass     p.yaml")[0])
    after = scene.read_text()
    assert "frequencies: [3.132091952" in after
    state = after.split("state: ")[1].splitlines()[0]
    words = state.replace("'", "").replace('"', "").split()
    found = {"dof": 1, "cyclic": "[]", "stability": "stable", "lower": 0}
    found |= {"theta": words[4].rstrip(","), "speed": words[6].rstrip(",")}
    found["frequency"] = after.split("frequencies: [")[1].split("]")[0]
    assert after == PENDULUM.format_map(found)
    assert lagrange("check", "p.yaml", cwd=tmp_path).returncode == 0


def test_a_position_becomes_the_nearest_that_no_expectation_names(scene):
    scene.write_text(
        PENDULUM.format_map(RIGHT | {"lower": 3}).replace("pi, stability: un", "3, stability: un")
    )
    lines = check_scene(str(scene)).problems
    assert sum(problem.rule == "equilibria" for problem in lines) == 2
    one = PENDULUM.format_map(RIGHT | {"lower": 3}).partition("  state")[0]
    scene.write_text(one + "  equilibria: [{theta: 2.9, stability: unstable}, {theta: 0}]\n")
    assert (
        b"{theta: 3.141592653589793, stability: unstable}"
        in update_of(check_scene(str(scene))).after
    )


def test_line_ends_and_the_byte_order_mark_stay(scene):
    before = "\ufeff" + PENDULUM.format_map(RIGHT | {"dof": 3}).partition("  state")[0]
    scene.write_bytes(before.replace("\n", "\r\n").encode())
    after = update_of(check_scene(str(scene))).after
    assert after == before.replace("dof: 3", "dof: 1").replace("\n", "\r\n").encode()


@pytest.mark.parametrize(
    ("addition", "reason"),
    [
        ("  equations: [ddot(theta) = 0]\n", "no derived equation is a multiple of this one"),
        ("  drift: {energy: 1e-30}\n", "expected a drift"),
    ],
)
def test_a_failure_without_a_value_leaves_the_scene(scene, tmp_path, addition, reason):
    short = PENDULUM.format_map(WRONG).partition("  state")[0]
    short = short.replace("expect:", "simulate: {until: 0.1}\nexpect:")
    scene.write_text(short + addition)
    done = lagrange("check", "p.yaml", "--update", cwd=tmp_path)
    assert done.returncode == 1
    assert f"p.yaml: left as it is: {reason}" in done.stderr
    assert scene.read_text() == short + addition


def test_an_alias_of_another_section_is_not_replaced(scene):
    text = PENDULUM.format_map(RIGHT).partition("  state")[0]
    text = text.replace("sqrt(g/l)", "*w").replace("m: 1,", "m: 1, w: &w 3,")
    scene.write_text(text)
    with pytest.raises(InputError, match="other sections would change"):
        update_of(check_scene(str(scene)))


def test_one_value_of_several_is_not_replaced(scene):
    scene.write_text(
        "sizes: {n: 2}\nparticles:\n  b[i=1..n]: {mass: 1, position: ['x[i]', 0, 0]}\n"
        "initial:\n  x[i=1..n]: i\nexpect: {state: {t: 1, 'x[i=1..n]': 5, within: 1e-6}}\n"
    )
    with pytest.raises(InputError, match="several values stand here as one"):
        update_of(check_scene(str(scene)))


def test_a_file_that_changed_is_left(scene):
    report = check_scene(str(scene))
    scene.write_text("# new\n" + scene.read_text())
    with pytest.raises(InputError, match="the file is another since it was read"):
        update_of(report)


def test_times_of_events_are_replaced(scene):
    scene.write_text(
        "particles: {b: {mass: 1, position: [0, 0, z]}}\npotentials: {w: 9.81*z}\n"
        "constraints: {floor: z >= 0}\ninitial: {z: 1}\nsimulate: {until: 1}\n"
        "expect: {events: [{name: 'contact:floor', t: 0.4, within: 1e-6}]}\n"
    )
    assert b"t: 0.45152364," in update_of(check_scene(str(scene))).after


@pytest.mark.parametrize(
    "words",
    [("-", "--update"), ("p.yaml", "--update", "-p", "m=2"), ("p.yaml", "--diff", "--watch")],
)
def test_other_uses_are_refused(scene, tmp_path, words):
    assert lagrange("check", *words, cwd=tmp_path).returncode == 2


def test_a_read_only_file_is_refused_and_stays(scene, tmp_path, monkeypatch):
    before = scene.read_bytes()
    allowed = os.access  # which root's permissions would pass
    monkeypatch.setattr(os, "access", lambda path, mode: mode != os.W_OK and allowed(path, mode))
    done = lagrange("check", "p.yaml", "--update", cwd=tmp_path)
    assert done.returncode == 2
    assert "the file is read-only" in done.stderr
    assert scene.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir() if path.suffix == ".yaml"] == ["p.yaml"]
