"""Common slips in scenes: what a derivation says of them is the line to write."""

from __future__ import annotations

from tests.mechanics.mechanics_support import derived, refusal

PENDULUM = """
parameters: {{l: 1}}
plane: xz
particles: {{b: {{mass: 1, position: {position}}}}}
{relations}
coordinates: [theta]
initial: {{theta: {start}}}
"""
DEFINED = "[l*sin(theta), 0, -l*cos(theta)]"


def test_an_angle_in_degrees_has_a_remark() -> None:
    for start in ("60", "180"):
        text = PENDULUM.format(position=DEFINED, relations="", start=start)
        (remark,) = derived(text).derivation.remarks
        assert f"theta: {start}*pi/180" in remark
    for start in ("0.5", "5", "60*pi/180", "61", "100000000"):
        text = PENDULUM.format(position=DEFINED, relations="", start=start)
        assert not derived(text).derivation.remarks


def test_a_pendulum_without_definitions_is_told_them() -> None:
    rod = "constraints: {rod: x^2 + z^2 = l^2}"
    problem = refusal(PENDULUM.format(position="[x, y, z]", relations=rod, start=0.1))
    assert problem.rule == "too-few-coordinates"
    assert problem.hint == "definitions: {x: l*sin(theta), z: -l*cos(theta)}"
    text = PENDULUM.format(position="[x, y, z]", relations=f"{rod}\n{problem.hint}", start=0.1)
    assert derived(text).derivation.account.dof == 1
