"""Emitted programs of a contact beside a state of first order."""

from __future__ import annotations

import shutil
import subprocess
import sys

import pytest

from lagrange_cli import InputError, loads
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


RELAY = """
name: relay
coordinates: [x]
kinetic: {block: dot(x)^2/2}
states:
  s: (x - s)/2
  r: {on: x <= -0.3, off: x + s >= 0.5}
forces: {push: {on: x, force: 3*r - x}}
initial: {x: 0, dot(x): 1, s: 0.2, r: 0}
"""

ASKED = """\
#include "relay.h"
#include <stdio.h>
#include <string.h>

int main(void)
{
    relay_params p;
    double y[4] = {0.7, 2.0, 0.4, 0.0}, work[relay_WORK], out[relay_SWITCHES], dydt[4];
    double changed[4];
    relay_defaults(&p);
    for (; y[3] < 2.0; y[3] += 1.0) {
        int status = relay_switches(0.0, y, 0, &p, work, out);
        status += relay_rhs(0.0, y, 0, &p, work, dydt);
        memcpy(changed, y, sizeof y);
        status += relay_change(0.0, changed, 0, &p, -1, work);
        printf("%d,%g,%g,%g,%g\\n", status, out[0], dydt[1], dydt[3], changed[3]);
    }
    return 0;
}
"""


@pytest.mark.compiler
def test_c_tells_when_a_state_changes_between_its_two_values(tmp_path):
    for name, text in loads(RELAY).derive().emit("c").items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "asked.c").write_text(ASKED, encoding="utf-8")
    cc = shutil.which("cc")
    if cc is None:
        pytest.skip("no C compiler is installed")
    words = [cc, "-O1", "-Wall", "-Werror", "relay.c", "asked.c", "-o", "asked", "-lm"]
    subprocess.run(words, cwd=tmp_path, check=True)
    done = subprocess.run("./asked", cwd=tmp_path, capture_output=True, text=True, check=True)
    # Off: x is 1 above where it would be turned on; on: x + s is 0.6 above where it is turned off.
    # At a start it stays off, and is turned off.
    assert done.stdout.splitlines() == ["0,1,-0.7,0,0", "0,-0.6,2.3,0,0"]


def test_a_unit_that_would_not_change_such_a_state_is_refused():
    with pytest.raises(InputError, match="does not find where the state 'r' changes its value"):
        loads(RELAY).derive().emit("fmu")
