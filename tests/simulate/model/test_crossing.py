"""Motion across kinks of abs, sign, min and max against closed forms, compiled and interpreted."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lagrange_cli import loads
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.simulate.system.functions import RightHandSide, interpreted
from tests.campaign import pairs_of, slice_of
from tests.simulate.compiling import compiled_or_skip

BODY = """
particles: {b: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
"""

Functions = Callable[[Model], RightHandSide]

PATHS = ["compiled", "interpreted"]

#: For motions of many steps, which take seconds where Python interprets them.
mostly_compiled = pytest.mark.parametrize(
    "functions", slice_of(PATHS, 0, lambda path: path == "compiled"), indirect=True
)


@pytest.fixture(params=PATHS)
def functions(request: pytest.FixtureRequest) -> Functions:
    if request.param == "compiled":
        return compiled_or_skip
    return lambda model: interpreted(model, "as the test asks")


@cache
def model_without_energy(text: str) -> Model:
    return replace(model_of(loads(text).derive().equations), conserved=())


def moved(functions: Functions, text: str, **options: float) -> Trajectory:
    """The simulated motion of a scene, without the help of a conserved energy."""
    model = model_without_energy(text)
    return simulate(model, functions=functions(model), **options)


def body(section: str, start: str, until: float, parameters: str = "k: 1") -> str:
    initial = f"initial: {{{start}}}\nsimulate: {{until: {until}}}\n"
    return f"parameters: {{{parameters}}}{BODY}{section}\n{initial}"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("functions", "width", "force_and_work"),
    pairs_of(
        PATHS,
        (1e-2, 1e-5, 1e-9),
        (
            ("(sign(x - c + w) - sign(x - c - w))/2", 2.0),
            ("max(0, 1 - abs((x - c)/w))", 1.0),
            ("max(0, 1 - ((x - c)/w)^2)", 4 / 3),
            ("min(max(x - c + w, 0), max(c + w - x, 0))/w", 1.0),
        ),
    ),
    indirect=["functions"],
)
def test_a_narrow_force_of_position_is_not_missed(functions, width, force_and_work):
    force, work = force_and_work
    scene = body(
        f'forces: {{f: {{on: x, force: "A/w*{force}"}}}}',
        "x: 0, dot(x): 1",
        1,
        f"w: {width}, c: 0.537, A: 0.1",
    )
    found = moved(functions, scene, accuracy=1e-6)
    speed = math.sqrt(1 + 2 * 0.1 * work)
    assert found.status == "ok", found.reason
    assert found.state["dot(x)"] == pytest.approx(speed, abs=1e-6 * speed)
    assert abs(found.state["dot(x)"] - speed) <= found.estimated * speed


@pytest.mark.slow
@pytest.mark.parametrize("width", [1e-3, 1e-7])
@mostly_compiled
def test_a_narrow_force_of_time_is_not_missed(functions, width):
    force = '"A/w*max(0, 1 - abs((t - c)/w))"'
    scene = body(
        f"forces: {{f: {{on: x, force: {force}}}}}",
        "x: 0, dot(x): 1",
        1,
        f"w: {width}, c: 0.537, A: 0.1",
    )
    found = moved(functions, scene, accuracy=1e-6)
    assert found.status == "ok", found.reason
    assert found.state["dot(x)"] == pytest.approx(1.1, abs=1e-6)


@pytest.mark.slow
def test_a_stop_with_a_spring(functions):
    """x'' = −k max(0, x − 3): half a period in the spring, then back."""
    scene = body('potentials: {v: "k/2*max(0, x - 3)^2"}', "x: 0, dot(x): 1", 5, "k: 100")
    found = moved(functions, scene, accuracy=1e-9)
    assert found.status == "ok"
    assert found.state["x"] == pytest.approx(3 - (5 - 3 - math.pi / 10), abs=1e-8)


@pytest.mark.slow
def test_a_force_of_constant_size_towards_the_origin(functions):
    """V = |x|: parabolas between the passages, period 4 √2."""
    scene = body('potentials: {v: "abs(x)"}', "x: 1, dot(x): 0", 12)
    found = moved(functions, scene, accuracy=1e-9)
    quarter = math.sqrt(2.0)
    for t, x in zip(found.t, found.columns["x"], strict=True):
        phase = math.fmod(t, 4 * quarter)
        side, since = (1, phase) if phase < quarter else (-1, phase - 2 * quarter)
        side, since = (1, phase - 4 * quarter) if phase > 3 * quarter else (side, since)
        assert x == pytest.approx(side * (1 - since * since / 2), abs=3e-9)


@pytest.mark.slow
@mostly_compiled
def test_dry_friction_holds_a_body(functions):
    """x'' = −x − μ sign x': centres ±μ by turns, at rest where |x| < μ at last."""
    scene = body(
        'forces: {f: {on: x, force: "-0.3*sign(dot(x))"}}\npotentials: {v: x^2/2}',
        "x: 1, dot(x): 0",
        20,
    )
    found = moved(functions, scene, accuracy=1e-8)
    assert found.status == "ok", found.reason
    t, x = np.asarray(found.t), found.columns["x"]
    first = t < math.pi
    second = (t > math.pi) & (t < 2 * math.pi)
    last = t > 2 * math.pi
    assert np.abs(x[first] - (0.3 + 0.7 * np.cos(t[first]))).max() < 1e-8
    assert np.abs(x[second] - (-0.3 + 0.1 * np.cos(t[second]))).max() < 1e-8
    assert np.abs(x[last] + 0.2).max() < 1e-8
    assert np.abs(found.columns["dot(x)"][last]).max() < 1e-12


@pytest.mark.slow
@mostly_compiled
def test_a_block_on_a_belt_sticks_and_slips(functions):
    """It goes with the belt until the spring overcomes the friction, again and again."""
    friction = "-(0.3 + 0.2*exp(-5*abs(dot(x) - u)))*sign(dot(x) - u)"
    scene = body(
        f'forces: {{f: {{on: x, force: "{friction}"}}}}\npotentials: {{v: x^2/2}}',
        "x: 0, dot(x): 0.1",
        20,
        "u: 0.1",
    )
    found = moved(functions, scene, accuracy=1e-6)
    assert found.status == "ok", found.reason
    t, x = np.asarray(found.t), found.columns["x"]
    assert np.abs(x[t < 5] - 0.1 * t[t < 5]).max() < 1e-6
    # Stick and slip repeat; without friction's fall they would not.
    assert x[t > 10].max() > 0.5
    assert (np.abs(found.columns["dot(x)"][t > 10] - 0.1) < 1e-9).mean() > 0.2


@pytest.mark.slow
@mostly_compiled
def test_friction_under_a_contact_and_on_a_rod(functions):
    """The block stops after v²/(2 μ g); the pendulum of two coordinates comes to rest."""
    block = """
plane: xz
particles: {b: {mass: 1, position: [x, y, z]}}
constraints: {floor: {unilateral: z >= 0}}
potentials: {w: {gravity: 9.81}}
forces: {f: {on: x, force: "-2*sign(dot(x))"}}
initial: {x: 0, z: 0, dot(x): 3}
simulate: {until: 3}
"""
    found = moved(functions, block, accuracy=1e-6)
    assert found.status == "ok", found.reason
    assert found.state["x"] == pytest.approx(9 / 4, abs=1e-6)
    pendulum = """
plane: xz
particles: {b: {mass: 1, position: [x, y, z]}}
constraints: {rod: x^2 + z^2 = 1}
potentials: {w: {gravity: 9.81}}
forces: {f: {on: b, force: ["-2*sign(dot(x))", 0, 0]}}
initial: {x: 0.6, z: -0.8}
simulate: {until: 5}
"""
    found = moved(functions, pendulum, accuracy=1e-6)
    assert found.status == "ok", found.reason
    assert math.hypot(found.state["x"], found.state["z"]) == pytest.approx(1, abs=1e-12)
    # At rest, where 9.81 |x| is less than the friction along the circle, 2 |z|.
    assert abs(found.state["dot(x)"]) < 1e-12
    assert 9.81 * abs(found.state["x"]) < 2 * abs(found.state["z"])


@pytest.mark.slow
@pytest.mark.parametrize(
    "section",
    [
        'potentials: {v: "-abs(x)"}',
        'forces: {f: {on: x, force: "sign(x)"}}',
        'forces: {f: {on: x, force: "(1 + sign(x))/2"}}',
    ],
)
def test_a_start_with_several_motions_is_told(functions, section):
    found = moved(functions, body(section, "x: 0, dot(x): 0", 2))
    assert found.status == "blow_up"
    assert "not unique" in found.reason
    assert len(found.t) == 1


def sign(x: float) -> float:
    return math.copysign(1.0, x) if x else 0.0


#: Forces whose steps at t = 1 and 2 move other kinks at that instant, or put the motion on one.
STEPS = {
    "max(-2, min(2, 10*(1 + sign(t - 1) - sign(t - 2) - x) - 3*v))": lambda t, x, v: max(
        -2, min(2, 10 * (1 + sign(t - 1) - sign(t - 2) - x) - 3 * v)
    ),
    "max(-10, min(10, 5*(1 + sign(t - 1)) - 10*x - 3*v))": lambda t, x, v: max(
        -10, min(10, 5 * (1 + sign(t - 1)) - 10 * x - 3 * v)
    ),
    "abs(sign(t - 1) - x)": lambda t, x, v: abs(sign(t - 1) - x),
    "max(0, abs(3*sign(t - 1) - x) - 1)*sign(3*sign(t - 1) - x)": lambda t, x, v: (
        max(0, abs(3 * sign(t - 1) - x) - 1) * sign(3 * sign(t - 1) - x)
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("force", STEPS)
@mostly_compiled
def test_a_step_moves_other_kinks_at_once(functions, force):
    written = force.replace("v", "dot(x)")
    scene = body(f'forces: {{f: {{on: x, force: "{written}"}}}}', "x: 0, dot(x): 0", 3)
    found = moved(functions, scene, accuracy=1e-8)
    assert found.status == "ok", found.reason
    law, state = STEPS[force], np.zeros(2)
    for piece in ((0, 1), (1, 2), (2, 3)):
        # Inside its piece, where signs of time are constant.
        inside = np.clip(np.array(piece), np.nextafter(piece[0], 4), np.nextafter(piece[1], 0))
        state = solve_ivp(
            lambda t, y: [y[1], law(t, *y)], inside, state, rtol=1e-11, atol=1e-12, max_step=0.01
        ).y[:, -1]
    assert [found.state["x"], found.state["dot(x)"]] == pytest.approx(state, abs=3e-8)


#: Forces with bounds on their friction, the time until which it holds, and v behind that.
BOUNDED_FRICTION = [
    # The sign alone would balance the load until it is 2, the bound lets it do so until 1.
    ("max(-1, min(1, -2*sign(dot(x)))) + 0.5 + t/2", 1.0, lambda t: (t - 1) ** 2 / 4),
    # Here the bound is met on one side first, while the body rests.
    (
        "max(-1, min(1, -0.4*sign(dot(x)) - 0.57 - 0.3*t)) + 0.855 + 0.45*t",
        0.145 / 0.45,
        lambda t: 0.225 * (t - 0.145 / 0.45) ** 2,
    ),
]


@pytest.mark.slow
@pytest.mark.parametrize(("force", "held_until", "speed"), BOUNDED_FRICTION)
@mostly_compiled
def test_a_body_is_held_as_far_as_the_bounds_of_its_friction(functions, force, held_until, speed):
    """Filippov combines what the force is on both sides, where its bounds count as well."""
    scene = body(f'forces: {{f: {{on: x, force: "{force}"}}}}', "x: 0.5, dot(x): -0.03", 2)
    found = moved(functions, scene, accuracy=1e-6)
    assert found.status == "ok", found.reason
    rests = (found.t > 0.1) & (found.t < held_until)
    assert not found.columns["dot(x)"][rests].any()
    later = found.t > held_until
    exact = speed(found.t[later])
    assert np.abs(found.columns["dot(x)"][later] - exact).max() < 1e-6


def two(force_x: str, force_y: str, start: str) -> str:
    """A particle in a plane with a force."""
    return f"""
particles: {{b: {{mass: 1, position: [x, y, 0]}}}}
coordinates: [x, y]
forces: {{f: {{on: b, force: ["{force_x}", "{force_y}", 0]}}}}
initial: {{{start}}}
simulate: {{until: 1}}
"""


@pytest.mark.slow
@mostly_compiled
def test_two_surfaces_hold_a_motion_together(functions):
    """It slides along one, meets the other there, and rests; the parts are 0."""
    first, second = "-2*sign(dot(x)) - sign(dot(y))", "sign(dot(x)) - 2*sign(dot(y))"
    found = moved(
        functions, two(first, second, "x: 0, y: 0, dot(x): 0.3, dot(y): 0.5"), accuracy=1e-6
    )
    assert found.status == "ok", found.reason
    # x stops at 0.1, where y has 0.5 − 0.1; then half of sign(dot(x)) balances sign(dot(y)).
    assert found.state["x"] == pytest.approx(0.015, abs=1e-9)
    assert found.state["y"] == pytest.approx(0.045 + 0.4**2 / (2 * 2.5), abs=1e-9)
    assert found.state["dot(x)"] == found.state["dot(y)"] == 0


@pytest.mark.parametrize(
    ("force_x", "force_y", "start", "words"),
    [
        # Every region leads back to the origin, and yet motions spiral out of it.
        ("sign(dot(x)) - 2*sign(dot(y))", "2*sign(dot(x)) + sign(dot(y))", "x: 0, y: 0", "spiral"),
        (
            "-sign(dot(x))*(2 + sign(dot(y)))",
            "-sign(dot(y))",
            "x: 0, y: 0, dot(x): 0.3, dot(y): 0.5",
            "which combination",
        ),
        (
            " - ".join(["0", *(f"sign(dot(x) + {k}*dot(y))" for k in range(1, 6))]),
            " - ".join(["0", *(f"sign(dot(y) - {k}*dot(x))" for k in range(1, 6))]),
            "x: 0, y: 0",
            "more kinks",
        ),
    ],
    ids=["spiral", "product", "many"],
)
def test_what_is_not_determined_at_an_intersection_is_told(force_x, force_y, start, words):
    found = moved(compiled_or_skip, two(force_x, force_y, start), accuracy=1e-4)
    assert found.status == "blow_up"
    assert words in found.reason


@mostly_compiled
def test_a_surface_that_is_written_twice_is_one(functions):
    scene = body(
        'forces: {f: {on: x, force: "-sign(dot(x)) - sign(2*dot(x) + dot(x)^3) + t"}}',
        "x: 0, dot(x): 0.1",
        3,
    )
    found = moved(functions, scene, accuracy=1e-6)
    assert found.status == "ok", found.reason
    assert found.state["dot(x)"] == pytest.approx(0.5, abs=1e-6)


@mostly_compiled
def test_a_motion_stays_on_the_surface_it_slides_along(functions):
    scene = body('forces: {f: {on: x, force: "sin(t) - 2*sign(dot(x) + x)"}}', "x: 1, dot(x): 0", 6)
    found = moved(functions, scene, accuracy=1e-6)
    assert found.status == "ok", found.reason
    x, v = found.columns["x"], found.columns["dot(x)"]
    late = found.t > 1
    assert (np.abs(x + v)[late] <= 4 * np.finfo(float).eps * (np.abs(x) + np.abs(v))[late]).all()


@mostly_compiled
def test_slides_are_told(functions):
    """x' = sin t (t/4 − 0.7) until it stops; the load exceeds the friction again by π."""
    scene = body(
        'forces: {f: {on: x, force: "-x - 0.3*sign(dot(x)) + 0.5*sin(t)"}}',
        "x: 1, dot(x): 0",
        4,
    )
    (slide,) = moved(functions, scene, accuracy=1e-6).slides
    assert slide.on == "dot(x)"
    assert slide.start == pytest.approx(2.8, abs=1e-9)
    assert slide.end == pytest.approx(math.pi - math.asin(math.sin(2.8) / 2), abs=1e-9)


@mostly_compiled
def test_a_slide_under_a_contact_goes_on_past_the_events_of_others(functions):
    """The block rests on the floor while the ball beside it bounces."""
    scene = """
plane: xz
particles:
  b: {mass: 1, position: [x, y, 0]}
  c: {mass: 1, position: [3, y, z]}
constraints: {floor: {unilateral: z >= 0, restitution: 1}}
potentials: {w: {gravity: 2}}
forces: {f: {on: x, force: "-2*sign(dot(x))"}}
initial: {x: 0, z: 1, dot(x): 1, dot(z): 0}
simulate: {until: 3.5}
"""
    found = moved(functions, scene, accuracy=1e-6)
    assert found.status == "ok", found.reason
    (slide,) = found.slides
    assert slide.start == pytest.approx(0.5, abs=1e-9)
    assert slide.end is None


@pytest.mark.slow
@pytest.mark.parametrize("section", ['potentials: {v: "abs(x)"}', 'potentials: {v: "max(0, x)^2"}'])
def test_rest_at_a_kink_that_pushes_back_is_rest(functions, section):
    found = moved(functions, body(section, "x: 0, dot(x): 0", 2))
    assert found.status == "ok", found.reason
    assert not found.columns["x"].any()


@pytest.mark.slow
def test_a_start_on_a_kink_with_a_speed_passes_it(functions):
    found = moved(functions, body('potentials: {v: "abs(x)"}', "x: 0, dot(x): 1", 3), accuracy=1e-9)
    assert found.status == "ok", found.reason
    assert found.state["x"] == pytest.approx(-(1 - 0.5), abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(
    "section",
    [
        'potentials: {v: "sign(x)"}',
        'kinetic: {k: "(2 + sign(x))*dot(x)^2"}',
        'potentials: {v: "5*x", u: "(x + 2)*abs(dot(x) - 2)"}',
    ],
)
def test_a_jump_of_energy_or_momentum_is_refused(functions, section):
    found = moved(functions, body(section, "x: -1, dot(x): 3", 2))
    assert found.status == "blow_up"
    assert "impulse" in found.reason
    assert found.holds_until < 0.4


@pytest.mark.slow
@mostly_compiled
def test_crossings_without_end_are_told(functions):
    """x'' = −sign x − μ sign x' comes to rest after infinitely many passages."""
    scene = body(
        'forces: {f: {on: x, force: "-sign(x) - 0.3*sign(dot(x))"}}', "x: 1, dot(x): 0", 40
    )
    found = moved(functions, scene, accuracy=1e-6)
    assert found.status != "ok"
    assert found.holds_until < 10


@pytest.mark.slow
def test_a_kink_under_a_root_is_located_and_no_edge(functions):
    """Hertz's contact, where the law has no value past its kink: half the motion is free."""
    scene = body('potentials: {v: "100*max(0, x - 1)^(5/2)"}', "x: 0, dot(x): 1", 4)
    found = moved(functions, scene, accuracy=1e-6)
    assert found.status == "ok", found.reason
    assert found.state["dot(x)"] == pytest.approx(-1, abs=1e-6)


@pytest.mark.slow
def test_checkpoints_go_on_across_kinks(tmp_path, functions):
    from lagrange_cli.simulate.integrators import INTEGRATORS, Control, start_integrator

    text = body(
        'forces: {f: {on: x, force: "-0.3*sign(dot(x))"}}\npotentials: {v: x^2/2}',
        "x: 1, dot(x): 0",
        20,
    )
    model = model_of(loads(text).derive().equations)
    rhs = functions(model).rhs
    control = Control(np.full(2, 1e-9), np.full(2, 1e-12), 1e-3, 0.5)
    times = np.linspace(0, 20, 41)

    def begun():
        return start_integrator(
            INTEGRATORS["DOP853"], rhs, 0.0, np.array([1.0, 0.0]), 20.0, control
        )

    whole, states = begun(), np.empty((41, 2))
    whole.advance(times, states, most_steps=10**6, most_evaluations=math.inf)
    first, parts = begun(), np.empty((41, 2))
    done = first.advance(times, parts, most_steps=20, most_evaluations=math.inf)
    second = begun()
    second.restore(first.state())
    rest = second.advance(
        times[done.filled :], parts[done.filled :], most_steps=10**6, most_evaluations=math.inf
    )
    assert done.filled + rest.filled == 41
    assert 0 < done.filled < 41
    assert np.array_equal(states, parts)
