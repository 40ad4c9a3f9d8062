"""Emitted programs of a contact beside a state of first order."""

from __future__ import annotations

import shutil
import subprocess
import sys

import pytest

from lagrange_cli import loads
from tests.emit import contact_systems as contacts
from tests.emit.emitted_c import compiler, run, write

pytestmark = pytest.mark.slow

BALL = """
name: ball_with_motor
parameters: {m: 1, g: 9.81, T: 0.4, k: 3}
particles:
  ball: {mass: m, position: [0, 0, z]}
coordinates: [z]
constraints: {floor: {unilateral: 'z >= 0', restitution: 0.7}}
potentials: {weight: {gravity: g}}
states:
  s: (dot(z) - s)/T
forces: {drive: {on: z, force: -k*s}}
initial: {z: 1, dot(z): 0, s: 0}
simulate: {until: 1.2}
"""


def last_row(*command, folder):
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    return [float(x) for x in done.stdout.splitlines()[-1].split(",")]


@pytest.mark.compiler
def test_programs_bounce_as_the_simulation_does(tmp_path):
    derivation = loads(BALL).derive()
    motion = derivation.simulate(accuracy=1e-10)
    expected = [1.2, *(motion.columns[name][-1] for name in ("z", "dot(z)", "s"))]
    for to, options in (("python", {}), ("c", {"main": True})):
        for name, text in derivation.emit(to, **options).items():
            (tmp_path / name).write_text(text, encoding="utf-8")
    by_python = last_row(sys.executable, "ball_with_motor.py", folder=tmp_path)
    assert by_python == pytest.approx(expected, abs=1e-9)
    cc = shutil.which("cc")
    if cc is None:
        pytest.skip("no C compiler is installed")
    words = [cc, "-O1", "-Wall", "-Werror", "ball_with_motor.c", "-o", "ball", "-lm"]
    subprocess.run(words, cwd=tmp_path, check=True)
    assert last_row("./ball", folder=tmp_path) == pytest.approx(expected, abs=1e-9)


@pytest.mark.compiler
@pytest.mark.parametrize("name", list(contacts.IN_AIR))
def test_impacts_stay_within_their_arrays(name, tmp_path):
    source = write(contacts.IN_AIR[name](), tmp_path, main=True)
    sanitize = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    run(compiler(), "-std=c99", "-g", *sanitize, source, "-o", tmp_path / "a.out", "-lm")
    done = subprocess.run([tmp_path / "a.out"], capture_output=True, text=True, check=True)
    assert "contact:" in done.stderr
