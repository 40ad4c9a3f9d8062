"""Emitted C and Python with contacts: the interface, and programs that follow the motion."""

from __future__ import annotations

import ctypes
import math
import re
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from lagrange_cli import load
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.mechanics.system import InitialState, Input
from tests.emit import contact_systems as contacts
from tests.emit import emit_closures as closures
from tests.emit.emit_systems import T
from tests.emit.emitted_c import TYPES, WARNINGS, Compiled, compiler, run, write
from tests.emit.python_programs import run_program
from tests.emit.test_python_closures import loaded
from tests.parts import changed
from tests.systems.shipped import sliced


class Moded(Compiled):
    """Compiled functions that take a mode."""

    def _arrays(self, y, p):
        # What lies behind the workspace must not be touched.
        work = np.full(self.macro("WORK") + 1, np.nan, self.type)
        return np.array(y, self.type), np.array(p, self.type), work

    def _call(self, function, t, arrays, mode, *more):
        y, p, work, *out = (ctypes.c_void_p(a.ctypes.data) for a in arrays)
        kind = {np.float32: ctypes.c_float, np.float64: ctypes.c_double}
        real = kind.get(self.type, ctypes.c_longdouble)
        more = [real(x) if isinstance(x, float) else x for x in more]
        given = None if mode is None else ctypes.c_void_p(mode.ctypes.data)
        of = getattr(self.library, f"{self.prefix}_{function}")
        status = of(real(t), y, None, p, given, *more, work, *out)
        assert np.isnan(arrays[2][-1])
        return status

    def moded(self, function, t, y, p, mode, size):
        out = np.full(size, np.nan, self.type)
        mode = None if mode is None else np.array(mode, np.intc)
        return self._call(function, t, (*self._arrays(y, p), out), mode), out

    def project(self, t, y, p, mode):
        arrays = self._arrays(y, p)
        return self._call("project", t, arrays, np.array(mode, np.intc)), arrays[0]

    def reset(self, t, y, p, mode, event, bounce=1.0):
        arrays, mode = self._arrays(y, p), np.array(mode, np.intc)
        status = self._call("reset", t, arrays, mode, ctypes.c_int(event), bounce)
        return status, arrays[0], mode


def python_of(equations):
    (text,) = EMITTERS["python"].emit(equations).values()
    return loaded(text)


def states(equations, count=2):
    generator = np.random.default_rng(11)
    for _ in range(count):
        y = generator.uniform(-1.5, 1.5, equations.system.layout.size)
        p = np.float32(generator.uniform(0.5, 2, len(equations.system.parameters))).astype(float)
        yield generator.uniform(0, 2), y, p


#: System whose matrices have conditions of up to 1e6 → bound of what LAPACK rounds otherwise.
ILL_CONDITIONED = {"pendulum_at_wall": 1e-10, "moving_walls": 1e-11}

SMALL = [name for name in contacts.CASES if name != "chain_over_floor"]


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("name", [*SMALL, *contacts.IN_AIR])
def test_both_languages_are_the_code_of_the_simulation(name, tmp_path):
    equations = {**contacts.CASES, **contacts.IN_AIR}[name]()
    compiled, module = Moded(equations, tmp_path), python_of(equations)
    simulated = contacts.Interpreted(equations)
    size_of_state, u = equations.system.layout.size, len(equations.system.contacts)
    positions = sum(k.kind == "position" for k in equations.system.closures)
    assert compiled.macro("CONTACTS") == u == len(module.CONTACTS)
    m = compiled.macro("MULTIPLIERS")
    assert m == len(equations.system.multipliers) == len(module.MULTIPLIERS)
    sizes = {"rhs": size_of_state, "multipliers": m, "events": u}
    sizes["constraints"] = compiled.macro("CONSTRAINTS")
    assert sizes["constraints"] == positions + u + m == len(module.RESIDUALS)
    for t, y, p in states(equations):
        for mode in product((0, 1), repeat=u):
            flags = [float(k) for k in mode]
            for function, size in sizes.items():
                own = function if function == "events" else f"contact_{function}"
                expected = simulated(own, t, y, p, flags)
                status, found = compiled.moded(function, t, y, p, mode, size)
                if expected is None:
                    assert status == 1
                    with np.errstate(all="ignore"):
                        assert np.isnan(getattr(module, function)(t, y, p, mode=mode)).any()
                    continue
                tolerance = {"rel": 1e-12, "abs": 1e-12 * np.abs(expected).max()}
                assert status == 0
                assert found == pytest.approx(expected, **tolerance)
                found = getattr(module, function)(t, y, p, mode=mode)
                within = ILL_CONDITIONED.get(name, 1e-12)
                assert np.abs(found - expected).max() <= within * np.abs(expected).max()
        assert compiled.moded("rhs", t, y, p, None, size_of_state)[0] == 0
        flight = simulated("rhs", t, y, p, [0.0] * u)
        assert module.rhs(t, y, p) == pytest.approx(flight, rel=1e-12, abs=1e-12)


def test_wrong_modes_are_refused():
    module = python_of(contacts.ladder())
    for mode in ((1,), (1, 0, 0)):
        for function in (module.events, module.reset):
            with pytest.raises(ValueError, match=f"as CONTACTS, 2, not {len(mode)}"):
                function(0.0, np.ones(6), mode=mode)


def test_events_of_many_states_are_those_of_each():
    module = python_of(contacts.ladder())
    columns = np.random.default_rng(5).uniform(-1, 1, (6, 4))
    columns[0, 1] = np.nan
    for mode in product((0, 1), repeat=2):
        found = module.events(0.3, columns, mode=mode)
        each = [module.events(0.3, y, mode=mode) for y in columns.T]
        assert np.isnan(found).all(axis=0).tolist() == [False, True, False, False]
        assert found == pytest.approx(np.transpose(each), rel=1e-12, nan_ok=True)


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("real", list(TYPES))
def test_reset_and_projection_in_c(real, tmp_path):
    equations = contacts.ladder()
    compiled, module = Moded(equations, tmp_path, real), python_of(equations)
    tolerance = {"float": 2e-6, "double": 1e-14, "long-double": 1e-14}[real]
    p = contacts.defaults(equations)
    theta = math.atan2(3, 4)
    y = [0.48, 0.64, theta, -1.0, -2.0, 0.3]
    status, after, mode = compiled.reset(0.0, y, p, [0, 0], 0)
    assert status == 0
    assert list(mode) == [1, 1]
    expected, closed = module.reset(0.0, y, p, event=0)
    assert closed == (1, 1)
    assert after.astype(float) == pytest.approx(expected, abs=tolerance)
    # Both ends stay on their lines: at this angle the velocity is (0.64 w, -0.48 w, w).
    assert expected[3:] == pytest.approx(np.array([0.64, -0.48, 1]) * expected[5])
    off = np.array(expected) + 1e-3
    status, found = compiled.project(0.0, off, p, [1, 0])
    assert status == 0
    floor = found[1] - 0.8 * np.cos(found[2]), found[4] + 0.8 * np.sin(found[2]) * found[5]
    assert np.abs(np.array(floor, float)).max() < tolerance
    assert module.project(0.0, off, p, (1, 0)) == pytest.approx(found.astype(float), abs=tolerance)
    assert (module.project(0.0, off, p) == off).all()


@pytest.mark.slow
@pytest.mark.compiler
def test_impossible_impacts_have_a_status(tmp_path):
    squeezed = contacts.corner(lambda x, z, t: x - t, lambda x, z, t: -x - t / 2)
    compiled, module = Moded(squeezed, tmp_path), python_of(squeezed)
    assert compiled.reset(0.0, [0, 1, 0, 0], [2, 9.81, 0.5], [0, 0], 0)[0] == 4
    assert module.reset(0.0, [0, 1, 0, 0], event=0) is None


#: Cases whose ``main`` is compiled for its motions, without a warning.
RUN = {"bouncing_ball", "particle_on_sphere", "ladder"}


@pytest.mark.slow
@pytest.mark.compiler
@sliced(contacts.CASES, set(contacts.CASES) - RUN)
def test_source_with_main_is_clean_c_and_cxx(name, tmp_path):
    equations = contacts.CASES[name]()
    gcc = compiler()
    for real in TYPES if name == "sleigh_at_wall" else ["double"]:
        source = write(equations, tmp_path, real=real, main=True)
        run(gcc, "-std=c99", "-O1", *WARNINGS, source, "-o", tmp_path / "main", "-lm")
    run(compiler("g++"), "-x", "c++", "-std=c++11", *WARNINGS, "-c", source, "-o", tmp_path / "x.o")


# Programs.


class Program:
    """The emitted ``main`` in one of both languages."""

    def __init__(self, equations, folder, language):
        if language == "Python":
            (text,) = EMITTERS["python"].emit(equations).values()
            self.path = folder / "motion.py"
            self.path.write_text(text, encoding="utf-8")
        else:
            source = write(equations, folder, main=True)
            self.path = folder / "motion"
            run(compiler(), "-std=c99", "-O0", *WARNINGS, source, "-o", self.path, "-lm")

    def run(self, *arguments):
        return run_program(self.path, *arguments)

    def __call__(self, *arguments):
        """Rows of numbers, and (time, event) of each event."""
        done = self.run(*arguments)
        assert done.returncode == 0, done.stderr
        rows = np.array([list(map(float, x.split(","))) for x in done.stdout.splitlines()[1:]])
        found = re.findall(r"^t = (\S+): (.*)$", done.stderr, re.MULTILINE)
        return rows, [(float(t), what) for t, what in found]


LANGUAGES = ["C", "Python"]


@pytest.fixture(params=LANGUAGES)
def program_of(request, tmp_path):
    return lambda equations: Program(equations, tmp_path, request.param)


@pytest.mark.slow
@pytest.mark.compiler
def test_a_bouncing_ball(program_of):
    program = program_of(contacts.bouncing_ball())
    rows, events = program("until=2.5", "steps=1")
    fall = math.sqrt(2 / 9.81)
    times, total = [], fall
    for k in range(1, 10):
        times.append(total)
        total += 2 * fall * 0.8**k
    times = [t for t in times if t < 2.5]
    assert len(times) == 4
    assert [what for _, what in events] == ["contact:floor"] * 4
    assert [t for t, _ in events] == pytest.approx(times, abs=1e-12)
    last = rows[-1]
    speed = 9.81 * fall * 0.8**4
    after = 2.5 - times[-1]
    assert last == pytest.approx(
        [2.5, 1.25, speed * after - 9.81 * after**2 / 2, 0.5, speed - 9.81 * after], abs=1e-11
    )
    assert rows[:, 2].min() > -1e-12


@pytest.mark.slow
@pytest.mark.compiler
def test_infinitely_many_bounces_end(program_of):
    rows, events = program_of(contacts.bouncing_ball())("until=5", "steps=1", "e=0.5")
    end = math.sqrt(2 / 9.81) * 3
    assert events[-1][1] == "ever shorter bounces end here"
    assert events[-1][0] == pytest.approx(end, abs=2e-5)
    assert len(events) < 80
    late = rows[rows[:, 0] > end + 0.02]
    assert (late[:, [2, 4]] == 0).all()
    assert late[-1, 1] == pytest.approx(2.5)


@pytest.mark.slow
@pytest.mark.compiler
def test_a_particle_leaves_the_sphere(program_of):
    rows, events = program_of(contacts.particle_on_sphere())("steps=1")
    ((t, what),) = events
    assert what == "release:sphere"
    height = 2 / 3 * math.cos(0.3)
    # By the energy, it falls from there with speed² = g R cos θ along the tangent.
    angle, speed = math.acos(height), math.sqrt(9.81 * 1.5 * height)
    since = 1 - t
    assert rows[-1, 1] == pytest.approx(1.5 * math.sin(angle) + speed * height * since, abs=1e-9)
    drop = -speed * math.sin(angle) * since - 9.81 * since**2 / 2
    assert rows[-1, 2] == pytest.approx(1.5 * height + drop, abs=1e-9)
    assert (np.hypot(rows[:, 1], rows[:, 2]) > 1.5 - 1e-14).all()


@pytest.mark.slow
@pytest.mark.compiler
def test_a_ladder_leaves_the_wall(program_of):
    start = 0.3
    state = [0.8 * math.sin(start), 0.8 * math.cos(start), start]
    given = [f"{name}={value!r}" for name, value in zip(("x", "z", "theta"), state, strict=True)]
    given += ["dot(x)=0", "dot(z)=0", "dot(theta)=0", "until=0.9"]
    rows, events = program_of(contacts.ladder())(*given, "steps=1")
    assert [what for _, what in events] == ["release:wall"]
    before = rows[rows[:, 0] < events[0][0]]
    after = rows[rows[:, 0] > events[0][0]]
    # The top comes down to two thirds of its height at first; then the centre moves on evenly.
    released = math.acos(2 / 3 * math.cos(start))
    assert before[-1, 3] < released < after[0, 3]
    w = math.sqrt(2 * 1.2 * 9.81 * 0.8 * math.cos(start) / 3 / (1.2 * 0.64 + 0.3))
    assert after[:, 4] == pytest.approx(0.8 * math.cos(released) * w, abs=1e-9)
    assert np.abs(rows[:, 2] - 0.8 * np.cos(rows[:, 3])).max() < 1e-14


@pytest.mark.slow
@pytest.mark.compiler
def test_a_pendulum_between_rod_and_wall(program_of):
    rows, events = program_of(contacts.pendulum_at_wall())("x=-2", "z=0", "until=3", "steps=1")
    assert [what for _, what in events] == ["contact:wall"] * 2
    energy = 0.5 * (rows[:, 3] ** 2 + rows[:, 4] ** 2) + 9.81 * rows[:, 2]
    parts = np.split(energy, np.searchsorted(rows[:, 0], [t for t, _ in events]))
    assert [np.ptp(part) < 1e-7 for part in parts] == [True] * 3
    # At the wall, at a height of -sqrt(15)/2, e² of the kinetic energy is left.
    kinetic = [part[0] + 9.81 * math.sqrt(3.75) for part in parts]
    assert kinetic[1:] == pytest.approx([0.49 * k for k in kinetic[:-1]], abs=1e-6)
    assert np.abs(np.hypot(rows[:, 1], rows[:, 2]) - 2).max() < 1e-15 * 4


@pytest.mark.slow
@pytest.mark.compiler
def test_what_only_touches_has_no_events(program_of):
    """Without restitution a wall stops it; then nothing presses it on to the wall."""
    room = contacts.corner(lambda x, z, t: z, lambda x, z, t: 1 - x)
    room = changed(room, initial=InitialState((0.0, 0.0), (0.3, 0.0)))
    rows, events = program_of(room)("until=5", "steps=1")
    assert events == [(pytest.approx(1 / 0.3, abs=1e-11), "contact:g1")]
    assert rows[-1] == pytest.approx([5, 1, 0, 0, 0], abs=1e-12)


@pytest.mark.slow
@pytest.mark.compiler
def test_a_lift_throws_what_it_carries(program_of):
    """z ≥ sin(3 t)/4: it pushes until the particle would have to fall faster than g."""
    lift = contacts.corner(lambda x, z, t: z - sp.sin(3 * t) / 4)
    lift = changed(lift, initial=InitialState((0.0, 0.0), (0.0, 0.75)))
    _, events = program_of(lift)("g=1.5", "until=1.5", "steps=1")
    released = math.asin(1.5 / 2.25) / 3
    assert events[0] == (pytest.approx(released, abs=1e-11), "release:g0")
    assert events[1][1] == "contact:g0"
    flight = events[1][0] - released
    height = 1.5 / 9 + 0.75 * math.cos(3 * released) * flight - 0.75 * flight**2
    assert height == pytest.approx(math.sin(3 * events[1][0]) / 4, abs=1e-11)
    # From rest on it, where it moves up, there is an impact first.
    still = program_of(lift)("dot(z)=0", "until=0.1", "steps=1")
    assert still[0][0, 4] == 0.75


def driven_block():
    """A block on the floor, pulled up by an input."""
    ball = contacts.bouncing_ball()
    pull = sp.Symbol("F", real=True)
    force = Input("F", pull, 5 * T)
    return changed(
        ball,
        name="driven_block",
        inputs=(force,),
        forcing=(ball.system.forcing[0], ball.system.forcing[1] + pull),
        initial=InitialState((0.0, 0.0), (0.5, 0.0)),
    )


@pytest.mark.slow
@pytest.mark.compiler
def test_inputs_lift_off(program_of):
    rows, events = program_of(driven_block())("m=1", "until=3", "steps=1")
    assert events == [(pytest.approx(9.81 / 5, abs=1e-12), "release:floor")]
    since = 3 - 9.81 / 5
    assert rows[-1, 2] == pytest.approx(5 * since**3 / 6, abs=1e-12)


def test_inputs_are_passed_on(tmp_path):
    module = python_of(driven_block())
    high = {"u": lambda t, y, p: [100.0]}
    assert module.reset(0.0, [0, 0, 0, 0], mode=(1,))[1] == (1,)
    assert module.reset(0.0, [0, 0, 0, 0], mode=(1,), **high)[1] == (0,)
    assert module.events(0.0, np.zeros(4), mode=(1,), **high) == pytest.approx([2 * 9.81 - 100])


@pytest.mark.slow
@pytest.mark.compiler
def test_starts_that_are_refused(program_of):
    program = program_of(contacts.bouncing_ball())
    done = program.run("z=-0.5")
    assert done.returncode != 0
    assert "the initial state violates floor by 0.5" in done.stderr
    assert done.stdout == ""
    assert "back in time" in program.run("until=-1").stderr
    # Less than rounding below the floor is on it.
    rows, events = program("z=-1e-13", "x=1", "until=0.1", "steps=1", "dot(x)=0")
    assert events == []
    assert (rows[1:, [2, 4]] == 0).all()


@pytest.mark.slow
@pytest.mark.compiler
def test_a_start_on_a_rod_is_checked_too(program_of):
    program = program_of(contacts.pendulum_at_wall())
    done = program.run("x=-1")
    assert "violates the constraints" in done.stderr
    assert "(rod)" in done.stderr
    assert "violates wall by 1.5" in program.run("x=2", "z=0").stderr


@pytest.mark.compiler
def test_the_integrator_of_the_documentation(tmp_path):
    root = Path(__file__).parents[2]
    page = (root / "docs" / "emitted-code.md").read_text(encoding="utf-8")
    (example,) = [x for x in re.findall(r"```c\n(.*?)```", page, re.DOTALL) if "_reset(" in x]
    scene = root / "systems" / "contact" / "bouncing_ball.yaml"
    source = write(load(scene).derive().equations, tmp_path)
    (tmp_path / "example.c").write_text(example, encoding="utf-8")
    files = [tmp_path / "example.c", source]
    run(compiler(), "-std=c99", *WARNINGS, *files, "-o", tmp_path / "example", "-lm")
    times = [float(line) for line in run(tmp_path / "example").splitlines()]
    fall = math.sqrt(2 / 9.81)
    assert times == pytest.approx([fall, fall * 2.6, fall * 3.88], abs=2e-6)


def test_scenes_without_contacts_have_nothing_of_them():
    for name in ("c", "python"):
        for equations in (closures.pendulum(), contacts.systems.bead_on_parabola()):
            text = "".join(EMITTERS[name].emit(equations).values())
            assert not re.search("contact|mode\\b|bounce|gap", text, re.IGNORECASE)


@pytest.mark.compiler
def test_names_of_contacts_end_no_comment(tmp_path):
    hostile = contacts.bouncing_ball()
    floor = hostile.system.contacts[0]
    text = '*/ "; """ # \\ z >= 0'
    floor = replace(floor, closure=replace(floor.closure, text=text))
    hostile = changed(hostile, contacts=(floor,))
    source = write(hostile, tmp_path, main=True)
    run(compiler(), "-std=c99", *WARNINGS, "-c", source, "-o", tmp_path / "x.o")
    python_of(hostile)
