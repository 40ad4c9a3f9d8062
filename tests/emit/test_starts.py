"""Initial states of emitted programs: rounding is taken out, a violation is an error."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text
from tests.emit import emit_closures as closures
from tests.emit import emit_systems as systems
from tests.emit.emitted_c import WARNINGS, compiler, run, write
from tests.emit.python_programs import run_program
from tests.parts import changed

pytestmark = pytest.mark.slow

WHEEL = """
name: wheel
parameters: {m: 1.1, R: 0.8, J: 0.2, al: 0.4, g: 9.81}
particles: {c: {mass: m, position: [s*cos(al), 0, -s*sin(al)]}}
coordinates: [s, phi]
kinetic: {spin: J/2*dot(phi)^2}
constraints: {roll: dot(s) = R*dot(phi)}
potentials: {weight: -m*g*s*sin(al)}
initial: {s: 0.3, phi: 1.0, dot(phi): 0.5}
"""


@cache
def wheel():
    return derive(read_text(WHEEL))


def c_program(equations, folder, real="double"):
    source = write(equations, folder, real, main=True)
    run(compiler(), "-std=c99", *WARNINGS, "-O0", source, "-o", folder / "a.out", "-lm")
    return folder / "a.out"


def python_program(equations, folder):
    ((name, text),) = EMITTERS["python"].emit(equations).items()
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


PROGRAMS = {"c": (c_program, 2), "python": (python_program, 1)}


@pytest.fixture(params=list(PROGRAMS))
def build(request, tmp_path):
    """Equations to a function that runs their program: status, lines, lines of errors."""
    make, refused = PROGRAMS[request.param]

    def built(equations):
        program = make(equations, tmp_path)

        def started(*arguments):
            done = run_program(program, "until=0.01", "steps=1", *arguments)
            assert done.returncode in (0, refused)
            assert (done.stdout == "") == (done.returncode != 0)
            return done.returncode == 0, done.stdout.splitlines(), done.stderr.splitlines()

        return started

    return built


def first(rows):
    return [float(cell) for cell in rows[1].split(",")[1:]]


def nearest(errors):
    """The arguments that the last line of the message offers."""
    (line,) = [line for line in errors if line.startswith("nearest: ")]
    return line.removeprefix("nearest: ").split(" ")


@pytest.mark.compiler
def test_a_constant_of_integration_is_a_parameter(build):
    started = build(wheel())
    good, rows, _ = started()
    assert good
    assert first(rows) == [0.3, 1.0, 0.4, 0.5]
    good, _, errors = started("s=1.3")
    assert not good
    assert errors[0] == (
        "the initial state violates the constraints by 1 (roll: its constant is that of the "
        "start, s_0, phi_0)"
    )
    good, rows, _ = started("s=1.3", "s_0=1.3")
    assert good
    assert first(rows) == [1.3, 1.0, 0.4, 0.5]
    # A start with the same constant s - R phi runs, and is the one that was given.
    good, rows, _ = started("s=1.1", "phi=2")
    assert good
    assert first(rows) == [1.1, 2.0, 0.4, 0.5]
    # So does one with another radius: the constant is an expression in it.
    assert started("R=0.5", "dot(s)=0.25")[0]


def test_rates_by_names_of_velocities():
    """What is the integral of a rate is known of the derivation, not from its text."""
    named = "definitions: {u: dot(s), w: dot(phi)}\n"
    equations = derive(read_text(WHEEL.replace("dot(s) = R*dot(phi)", "u = R*w") + named))
    (roll,) = equations.system.closures
    assert (roll.kind, roll.text) == ("position", "u = R*w")
    for to in ("c", "python"):
        text = "".join(EMITTERS[to].emit(equations).values())
        assert "those of the start that the parameters s_0, phi_0 say: roll" in text


@pytest.mark.compiler
def test_velocities_that_violate_a_rate(build):
    good, _, errors = build(wheel())("dot(phi)=0.7")
    assert not good
    assert errors[0].endswith("by 0.16 (rate of roll)")


@pytest.mark.compiler
def test_the_nearest_state_is_a_start(build):
    started = build(closures.pendulum())
    good, _, errors = started("x=3", "dot(z)=1")
    assert not good
    assert errors[0].endswith("by 5 (rod)")
    offered = nearest(errors)
    assert offered[:2] in (["x=2", "z=0"], ["x=2.0", "z=0.0"])
    good, rows, _ = started(*offered)
    assert good
    assert first(rows) == [float(argument.split("=")[1]) for argument in offered]
    good, _, errors = started("x=3", "z=0.7")
    good, rows, _ = started(*nearest(errors))
    assert good
    assert np.hypot(*first(rows)[:2]) == pytest.approx(2.0, rel=1e-15)


@pytest.mark.compiler
def test_no_state_near(build):
    started = build(closures.pendulum())
    for arguments in (["x=0", "z=0"], ["l=5", "x=0", "z=0"]):
        good, _, errors = started(*arguments)
        assert not good
        assert errors[0].startswith("the initial state violates the constraints by ")
        assert errors[1] == "no state that obeys them was found near it"
    assert not started("x=nan")[0]
    assert not started("x=1e300")[0]


@pytest.mark.compiler
@pytest.mark.parametrize(("change", "good"), [(1e-12, True), (1e-10, True), (1e-7, False)])
def test_rounding_is_taken_out(build, change, good):
    found, rows, _ = build(closures.pendulum())(f"x={2 + change!r}")
    assert found == good
    if good:
        assert first(rows)[0] == 2.0


@pytest.mark.compiler
@pytest.mark.parametrize(("rate", "good"), [(1e-66, True), (1e-13, True), (1e-9, False)])
def test_velocities_that_move_nothing(build, rate, good):
    """At rest there is no velocity to compare with: 0.01 units of time move x by nothing."""
    found, rows, _ = build(closures.pendulum())(f"dot(x)={rate!r}")
    assert found == good
    if good:
        assert first(rows)[:2] == [2.0, 0.0]
        assert max(map(abs, first(rows)[2:])) < 1e-15 * rate


@pytest.mark.compiler
def test_a_parameter_that_the_start_depends_on(build):
    started = build(closures.pendulum())
    assert not started("l=3")[0]
    good, rows, _ = started("l=3", "x=3")
    assert good
    assert first(rows)[:2] == [3.0, 0.0]


@pytest.mark.compiler
def test_nonholonomic_constraints(build):
    started = build(closures.sleigh())
    assert started()[0]
    good, _, errors = started("dot(y)=0.1")
    assert not good
    assert errors[0].endswith("by 0.1 (blade)")


@pytest.mark.compiler
@pytest.mark.parametrize("real", ["float", "long-double"])
def test_other_number_types(real, tmp_path):
    program = c_program(wheel(), tmp_path, real)
    assert len(run(program, "until=0.1").splitlines()) == 502
    done = run_program(program, "s=1.3")
    assert done.returncode == 2
    assert "by 1 (roll" in done.stderr


@pytest.mark.compiler
def test_a_zero_with_rounding_in_float(tmp_path):
    initial = systems.InitialState((2.0, 1e-66), (0.0, -1e-66))
    program = c_program(changed(closures.pendulum(), initial=initial), tmp_path, "float")
    assert first(run(program, "until=0.1").splitlines()) == [2.0, 0.0, 0.0, 0.0]


def test_what_is_said_of_rates():
    for to in ("c", "python"):
        text = "".join(EMITTERS[to].emit(wheel()).values())
        assert "those of the start that the parameters s_0, phi_0 say: roll" in text
        for closed in (closures.sleigh(), closures.pendulum()):
            assert "those of the start" not in "".join(EMITTERS[to].emit(closed).values())


@pytest.mark.compiler
def test_nothing_moves(tmp_path):
    equations = systems.build("still", [], [], [], 0)
    for name in ("c", "cpp", "fortran", "rust"):
        with pytest.raises(InputError, match="nothing can move"):
            EMITTERS[name].emit(equations, {"main": True})
    source = write(equations, tmp_path)
    run(compiler(), "-std=c99", *WARNINGS, "-c", source, "-o", tmp_path / "object.o")
    assert "Positions: none" in source.with_suffix(".h").read_text()
