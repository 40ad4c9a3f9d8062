"""Bodies whose three turns meet an orientation without angles, and the same by a quaternion."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.errors import InputError

#: A top that swings through its lowest place: its angular momentum about the vertical, upwards, is
#: minus that about its axis.
TOP = """
parameters: {g: 9.81, p: 1, A: 1.5, C: 0.8, tilt: 2, w: -p*(1 + cos(tilt))/(A*sin(tilt)^2),
             s: p/C - w*cos(tilt)}
bodies:
  top: {turn: TURN, mass: 1, centre: [0, 0, 1], inertia: {about: origin, moments: [A, A, C]}}
coordinates: [ANGLES]
potentials: {weight: {gravity: g}}
initial: {START}
simulate: {until: 1, accuracy: 1e-3, samples: 11}
"""
BY_ANGLES = (
    TOP.replace("TURN", "[z: phi, x: theta, z: psi]")
    .replace("ANGLES", "phi, theta, psi")
    .replace("START", "phi: 0, theta: tilt, psi: 0, dot(phi): w, dot(theta): 0, dot(psi): s")
)
BY_QUATERNION = (
    TOP.replace("TURN", "{quaternion: [q0, q1, q2, q3]}")
    .replace("ANGLES", "q0, q1, q2, q3")
    .replace(
        "START",
        "q0: cos(tilt/2), q1: sin(tilt/2), q2: 0, q3: 0, dot(q0): 0, dot(q1): 0,"
        " dot(q2): sin(tilt/2)*(w - s)/2, dot(q3): cos(tilt/2)*(w + s)/2",
    )
)
HINT = "turn: {quaternion: [q0, q1, q2, q3]} has no such place"


def test_a_quaternion_goes_on_where_angles_end() -> None:
    ended = loads(BY_ANGLES).derive().simulate()
    assert ended.exit_code == 1
    assert str(ended.reason).endswith(HINT)
    motion = loads(BY_QUATERNION).derive().simulate()
    assert motion.status == "ok"
    common = len(ended.t) - 1
    assert 5 < common < 10
    for name in ("x_top", "z_top"):
        before = slice(0, common)
        assert motion.columns[name][before] == pytest.approx(ended.columns[name][before], abs=2e-3)
    assert motion.columns["z_top"].min() < -0.9
    squares = sum(motion.columns[f"q{k}"] ** 2 for k in range(4))
    assert np.abs(squares - 1).max() < 1e-15


def test_a_start_without_angles_is_refused_with_the_turn_that_has_one() -> None:
    text = BY_ANGLES.replace("theta: tilt", "theta: 0")
    with pytest.raises(InputError) as caught:
        loads(text).derive().simulate()
    hints = caught.value.problems[0].hint.splitlines()
    assert "singular where sin(theta) = 0" in hints[0]
    assert hints[-1] == HINT
