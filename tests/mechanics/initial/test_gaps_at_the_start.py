"""Initial states and gaps: what touches, what approaches, what is violated."""

from __future__ import annotations

import mpmath
import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.scene import read_text
from tests.mechanics.mechanics_support import derived

SPHERE = """
parameters: {m: 2, g: 9.81, R: 3}
plane: xz
particles: {bead: {mass: m, position: [x, y, z]}}
constraints: {sphere: x^2 + z^2 >= R^2}
coordinates: [x, z]
potentials: {weight: {gravity: g}}
"""

BALL = """
parameters: {m: 1, g: 9.81, h: 1}
plane: xz
particles: {ball: {mass: m, position: [x, y, z]}}
constraints: {floor: z >= 0}
potentials: {weight: {gravity: g}}
initial: {x: 0, z: h}
"""


def started(initial: str, text: str = SPHERE) -> Equations:
    return derive(read_text("name: started\n" + text + f"initial: {initial}\n"))


def test_touching_is_exact() -> None:
    """sqrt(2) to eleven digits: 3 sin 45° is missed by 1e-11."""
    e = started("{x: 2.12132034356, z: 2.12132034356, dot(x): 1, dot(z): -1}")
    x, z = e.system.initial.positions
    assert abs(x * x + z * z - 9) <= 4e-15
    assert 1e-13 < e.system.initial.projected < 1e-10
    assert any("changed by up to" in remark for remark in e.derivation.remarks)


def test_velocities_that_leave_stay() -> None:
    e = started("{x: 0, z: 3, dot(x): 1, dot(z): 1e-6}")
    assert e.system.initial.velocities == (1.0, 1e-6)
    along_it = started("{x: 2.4, z: 1.8, dot(x): 3, dot(z): 1e-10 - 4}")
    across = 4 * along_it.system.initial.velocities[0] + 3 * along_it.system.initial.velocities[1]
    assert abs(across) < 1e-14


def test_approach_at_the_start_stays() -> None:
    """An impact at once, which the simulation has to see."""
    assert started("{x: 0, z: 3, dot(z): -2}").system.initial.velocities == (0.0, -2.0)


def test_in_the_open_nothing_is_changed() -> None:
    e = started("{x: 0.1, z: 3.0000001, dot(x): 0.3}")
    assert e.system.initial.positions == (0.1, 3.0000001)
    assert e.system.initial.projected == 0


def test_violated_start_is_refused() -> None:
    with pytest.raises(InputError) as refused:
        started("{x: 1, z: 2.5}")
    (problem,) = refused.value.problems
    assert "violate the one-sided constraint 'sphere': x^2 + z^2 >= R^2 is missed by 1.75" in (
        problem.message
    )
    assert problem.mark.text[problem.mark.column - 1] == "x"


ON_A_CIRCLE = """
parameters: {R: 2}
particles: {bead: {mass: 1, position: [R*sin(q), 0, R*cos(q)]}}
coordinates: [q]
constraints: {above: z_bead >= LOWEST}
"""


@pytest.mark.slow
def test_gaps_choose_among_configurations() -> None:
    """x = 1 is at z = √3 and at z = −√3."""
    with pytest.raises(InputError, match="several configurations"):
        started("{x_bead: 1}", ON_A_CIRCLE.replace("LOWEST", "-2"))
    upper = started("{x_bead: 1}", ON_A_CIRCLE.replace("LOWEST", "-1"))
    assert upper.system.initial.positions == pytest.approx([float(mpmath.pi) / 6], abs=1e-15)
    lower = started("{x_bead: 1}", ON_A_CIRCLE.replace(">= LOWEST", "<= -1"))
    assert lower.system.initial.positions == pytest.approx([5 * float(mpmath.pi) / 6], abs=1e-15)
    with pytest.raises(InputError, match="violate the one-sided constraint 'above'"):
        started("{x_bead: 1}", ON_A_CIRCLE.replace("LOWEST", "1.9"))


def test_corner() -> None:
    text = BALL.replace("{floor: z >= 0}", "{floor: z >= 0, wall: x >= 0, again: 2*z >= 0}")
    e = derived(text.replace("z: h", "z: 0"))
    assert e.system.initial.positions == (0.0, 0.0)
    assert [w for w in e.derivation.warnings if w.rule == "singular"] == []


def test_gap_without_a_gradient_at_the_start() -> None:
    with pytest.raises(InputError) as refused:
        started("{x: 0, z: 0}", SPHERE.replace("x^2 + z^2 >= R^2", "'norm(x, z) <= R'"))
    assert "no gradient at the initial configuration" in refused.value.problems[0].message


def test_gap_that_is_flat_where_it_closes() -> None:
    e = derived(BALL.replace("z >= 0", "z^3 >= 0").replace("z: h", "z: 0"))
    (warning,) = (w for w in e.derivation.warnings if w.rule == "singular")
    assert "'floor' is singular at the initial configuration: its gradient vanishes" in (
        warning.message
    )
