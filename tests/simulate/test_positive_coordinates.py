"""Motions end where a coordinate that is declared positive reaches zero, by every route."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.simulation import simulate
from lagrange_cli.simulate.system.functions import interpreted
from tests.cli.terminal import lagrange
from tests.simulate.available import or_skip

#: Thrown against gravity on a line that ends at x = 0, which is reached with v = -2 at t = 1.
FALL = """
parameters: {m: 1.0, g: 2.0}
particles: {p: {mass: m, position: [x, y, z]}}
constraints: {line: [y = 0, z = 0]}
coordinates: {x: {positive: true}}
potentials: {weight: m*g*x}
initial: {x: 1, dot(x): 0}
simulate: {until: 3, samples: 301}
"""

#: Falls into the centre; the time is that of half an ellipse without width, pi/sqrt(8).
INTO_CENTRE = """
parameters: {m: 1, k: 1}
plane: xy
particles: {p: {mass: m, position: [x, y, z]}}
coordinates: {r: {positive: true}, theta: {}}
definitions: {x: r*cos(theta), y: r*sin(theta)}
potentials: {attraction: "-k*m/norm(x, y)"}
initial: {r: 1, theta: 0, dot(theta): 0}
simulate: {until: 3, samples: 301}
"""

#: On a table, tied through a hole to a weight, without a turn: the puck reaches the hole.
THROUGH_HOLE = """
parameters: {M: 2.0, m: 1.0, g: 9.81, l: 2.0}
particles: {puck: {mass: M, position: [x1, y1, z1]}, weight: {mass: m, position: [x2, y2, z2]}}
constraints: {table: z1 = 0, plumb: [x2 = 0, y2 = 0], rope: r - z2 = l}
coordinates: {r: {positive: true}, theta: {}}
definitions: {x1: r*cos(theta), y1: r*sin(theta)}
potentials: {weight: m*g*z2}
initial: {r: 1.0, theta: 0.0}
simulate: {until: 3.0, samples: 301}
"""

#: Beside a ball that bounces a particle reaches the end of its line at t = 1.
BOUNCING = """
parameters: {m: 1.0, g: 2.0}
particles: {p: {mass: m, position: [x, 0, 0]}, ball: {mass: m, position: [0, 0, z]}}
constraints: {floor: {unilateral: z >= 0, restitution: 0.9}}
coordinates: {x: {positive: true}, z: {}}
potentials: {weight: m*g*(x + z)}
initial: {x: 1, z: HEIGHT}
simulate: {until: 3, samples: 301}
"""


def end(trajectory: object, name: str, time: float, *, within: float = 1e-9) -> None:
    """What is kept ends before the time, with a reason that tells it and the name."""
    assert trajectory.status == "blow_up"  # type: ignore[attr-defined]
    assert f"'{name}' is declared positive" in trajectory.reason  # type: ignore[attr-defined]
    last = trajectory.t[-1]  # type: ignore[attr-defined]
    assert time - 0.011 < last <= time * (1 + within)
    assert (trajectory.columns[name] > 0).all()  # type: ignore[attr-defined]


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", [1e-4, 1e-10])
@pytest.mark.parametrize(
    ("scene", "name", "time"),
    [
        (FALL, "x", 1.0),
        (INTO_CENTRE, "r", math.pi / math.sqrt(8)),
        (THROUGH_HOLE, "r", math.sqrt(2 * 3 / 9.81)),
        (BOUNCING.replace("HEIGHT", "9"), "x", 1.0),
    ],
    ids=["fall", "centre", "hole", "beside-a-contact"],
)
def test_a_motion_ends_at_zero(scene: str, name: str, time: float, accuracy: float) -> None:
    trajectory = loads(scene).derive().simulate(accuracy=accuracy)
    end(trajectory, name, time)
    told = float(trajectory.reason.partition("t = ")[2].partition(":")[0])
    assert told == pytest.approx(time, rel=1e-6)
    assert trajectory.holds_until == trajectory.t[-1]


@pytest.mark.parametrize(
    "method", ["DOP853", "RK45", "Radau", "BDF", "LSODA", "Gauss16", "CVODE", "taylor"]
)
def test_a_chosen_method_ends_there_too(method: str) -> None:
    or_skip(method)
    end(loads(FALL).derive().simulate(method=method, rtol=1e-8), "x", 1.0)


@pytest.mark.parametrize("method", ["RK4", "Verlet", "Gauss4", "Gauss6"])
def test_a_method_of_fixed_steps_ends_there_too(method: str) -> None:
    end(loads(FALL).derive().simulate(method=method, step=0.007), "x", 1.0)


def test_interpreted_functions_end_there_too() -> None:
    model = loads(FALL).derive().model()
    end(simulate(model, functions=interpreted(model, "asked for")), "x", 1.0)


def test_a_contact_that_pushes_does_not_hide_it() -> None:
    scene = BOUNCING.replace("HEIGHT", "0").replace("restitution: 0.9", "restitution: 0")
    trajectory = loads(scene).derive().simulate()
    assert trajectory.status == "blow_up"
    assert "'x' is declared positive" in trajectory.reason
    assert 0.98 < trajectory.t[-1] <= 1


def test_without_the_declaration_the_sign_is_wrong() -> None:
    """The motive: nothing else stops a rope of negative length."""
    trajectory = loads(THROUGH_HOLE.replace("{positive: true}", "{}")).derive().simulate()
    assert trajectory.status == "ok"
    assert trajectory.columns["r"][-1] < -1


def test_a_motion_that_stays_above_zero_is_the_same() -> None:
    turning = THROUGH_HOLE.replace("theta: 0.0}", "theta: 0.0, dot(theta): 1.0}")
    positive = loads(turning).derive().simulate(accuracy=1e-10)
    real = loads(turning.replace("{positive: true}", "{}")).derive().simulate(accuracy=1e-10)
    assert positive.status == real.status == "ok"
    for name in ("r", "theta", "z2"):
        assert np.abs(positive.columns[name] - real.columns[name]).max() < 1e-9


def test_a_close_passage_is_no_end() -> None:
    """The momentum keeps the puck off the hole, by a part in 1e4 of its distance."""
    turning = THROUGH_HOLE.replace("theta: 0.0}", "theta: 0.0, dot(theta): 2.0e-4}")
    trajectory = loads(turning).derive().simulate(accuracy=1e-6)
    assert trajectory.status == "ok"
    assert 0 < trajectory.columns["r"].min() < 0.02


@pytest.mark.parametrize("value", ["0", "-1"])
def test_a_start_of_the_command_line_is_refused(tmp_path: Path, value: str) -> None:
    scene = tmp_path / "fall.yaml"
    scene.write_text(FALL, encoding="utf-8")
    done = lagrange("simulate", str(scene), "-i", f"x={value}")
    assert done.returncode == 2
    assert f"coordinate 'x' is declared positive, found {value}" in done.stderr


def test_members_that_start_beyond_zero_are_refused() -> None:
    ensemble = loads(FALL).derive().ensemble({"x": [1.0, -1.0, 0.25]})
    assert ensemble.status == ["blow_up", "refused", "blow_up"]
    assert "'x' is declared positive" in ensemble.figures["reason"][1]
    ends = ensemble.figures["holds_until"]
    assert (ends[0], ends[2]) == pytest.approx((0.99, 0.49))


def test_the_model_is_kept_with_what_is_positive() -> None:
    model = loads(FALL).derive().model()
    assert model.positive == ("x",)
    assert Model.from_json(model.to_json()) == model


def test_a_replaced_start_is_refused_before_it_is_integrated() -> None:
    model = dataclasses.replace(loads(FALL).derive().model(), initial=(-1.0, 0.0))
    with pytest.raises(InputError, match="'x' is declared positive, at the start it is -1"):
        simulate(model)


BOWL = """
parameters: {m: 1, g: 9.81, a: 0.5}
particles: {p: {mass: m, position: [x, y, z]}}
constraints: {bowl: z = a*(x^2 + y^2)}
coordinates: {r: {positive: true}, theta: {}}
definitions: {x: r*cos(theta), y: r*sin(theta)}
potentials: {weight: m*g*z}
initial: {r: 0.1, theta: 1, dot(r): 0, dot(theta): 0}
simulate: {until: 2, samples: 201}
"""


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["minimal", "multiplier", "auto"])
def test_coordinates_that_are_read_off_positions_end_there_too(formulation: str) -> None:
    """Through the lowest point of a bowl the positions go on, and r cannot."""
    quarter = math.pi / 2 / math.sqrt(2 * 9.81 * 0.5)
    scene = BOWL.replace("simulate: {", f"simulate: {{formulation: {formulation}, ")
    end(loads(scene).derive().simulate(), "r", quarter, within=0.02)
    signed = loads(scene.replace("{positive: true}", "{}")).derive().simulate()
    assert signed.columns["r"].min() < -0.09
