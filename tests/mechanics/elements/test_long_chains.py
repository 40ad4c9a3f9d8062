"""Spatial chains of bodies: long ones are derived in factored form, longer ones are refused."""

from __future__ import annotations

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive, reduce
from lagrange_cli.scene import read_text


def _chain(number: int, axes: str = "xy") -> str:
    lines = ["parameters: {m: 1.0, l: 0.5, g: 9.81}", "bodies:"]
    for k in range(number):
        on = f"on: b{k - 1}, at: [0, 0, -l], " if k else ""
        turn = f"turn: {{{axes[k % len(axes)]}: q{k}}}"
        lines.append(f"  b{k}: {{{on}{turn}, centre: [0, 0, -l/2], mass: m, inertia: {{rod: l}}}}")
    lines.append(f"coordinates: [{', '.join(f'q{k}' for k in range(number))}]")
    lines.append("potentials: {weight: {gravity: g}}")
    return "\n".join(lines)


def test_equations_of_ten_joints_in_space_are_certified_and_factored() -> None:
    derivation = derive(read_text(_chain(10))).derivation
    assert derivation.certificate.mismatch < 1e-20
    assert any("left unexpanded" in remark for remark in derivation.remarks)


def test_chains_that_are_too_long_are_refused_at_the_frame() -> None:
    with pytest.raises(InputError) as caught:
        reduce(read_text(_chain(30)))
    (problem,) = caught.value.problems
    assert "this chain of frames is too long" in problem.message
    assert problem.mark is not None
    assert problem.mark.line > 10


def test_joints_about_one_axis_are_not_refused() -> None:
    assert len(reduce(read_text(_chain(24, "x"))).coordinates) == 24
