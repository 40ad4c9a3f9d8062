"""What stands against a minimal form is the true reason, constraint by constraint."""

from __future__ import annotations

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text

pytestmark = pytest.mark.slow

P = "particles: {p: {mass: 1, position: [x, y, z]}}\n"
SLEIGH = (
    "particles: {p: {mass: 2, position: [x + cos(th), y + sin(th), 0]}}\n"
    "coordinates: [x, y, th]\nkinetic: {spin: dot(th)^2}\n"
    "constraints:\n  blade: dot(y)*cos(th) = dot(x)*sin(th)\n"
)
BRANCHES = "gives coordinates by others in several ways, none of which need hold all along"
WHEEL = (
    "parameters: {R: 0.5}\nparticles: {c: {mass: 1, position: [s, 0, 0]}}\n"
    "coordinates: [s, psi]\nkinetic: {spin: dot(psi)^2}\n"
)
SCENES = {
    "nonholonomic": (
        SLEIGH,
        "'blade' cannot be integrated: it restricts velocities and no positions",
    ),
    "a circle": (P + "plane: xz\nconstraints: {rod: x^2 + z^2 = 1}\n", f"'rod' {BRANCHES}"),
    "no closed form": (
        P + "plane: xz\nconstraints: {wire: z + sin(z) = x*exp(x)}\n",
        "'wire' has no solution in closed form",
    ),
    "a quotient": (
        P + "plane: xz\nconstraints: {ray: x*sin(3*t) = z*cos(3*t)}\n",
        "'ray' gives a coordinate by others only where what it is divided by does not vanish",
    ),
    "integrable": (
        "particles: {p: {mass: 1, position: [x, y, 0]}}\ncoordinates: [x, y]\n"
        "constraints: {c: dot(x)*exp(x*y)*(1 + x*y) = -dot(y)*(exp(x*y)*x^2 + y^2*sin(x*y))}\n",
        "'c' can be integrated, but no closed form of its integral was found",
    ),
    "a name that is not declared": (
        WHEEL.replace("[s, psi]", "[s]") + "constraints: {rolling: s = psi + psi^5}\n",
        "'rolling' gives 'psi' in no closed form",
    ),
    "forces on both": (
        WHEEL + "constraints: {rolling: dot(s) = R*dot(psi)}\n"
        "forces: {a: {on: s, force: 1}, b: {on: psi, force: 1}}\n",
        "'rolling' gives by others only coordinates that a force acts on",
    ),
    "a logarithm": (
        WHEEL + "constraints: {rolling: dot(s)*exp(s) = 2*dot(psi)*exp(psi)}\n"
        "initial: {s: 1, psi: 0.2}\n",
        "'rolling' gives a coordinate by others only where a root or inverse function is real",
    ),
    "two of which one is integrable": (
        SLEIGH.replace("th]", "th, u]").replace("kinetic: {", "kinetic: {u: dot(u)^2, ")
        + "  c: dot(u)*exp(x*u)*(1 + x*u) = -dot(x)*(exp(x*u)*u^2 + x^2*sin(x*u))\n",
        "'blade', 'c' cannot all be integrated: together they restrict velocities more than",
    ),
    "several": (
        SLEIGH.replace("constraints:", "constraints:\n  rod: x^2 + y^2 = 4"),
        f"'rod' {BRANCHES}; 'blade' ",
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_the_reason_is_that_of_the_constraint(name: str) -> None:
    scene, reason = SCENES[name]
    derived = derive(read_text("name: s\n" + scene))
    assert derived.system.closures
    with pytest.raises(InputError) as refused:
        derive(read_text("name: s\n" + scene), formulation="minimal")
    (problem,) = refused.value.problems
    assert problem.rule == "formulation"
    assert problem.message.startswith(f"there is no minimal form: {reason}")
    assert problem.mark is not None
    # What the hint says is so.
    assert "--formulation multiplier" in problem.hint
    assert derive(read_text("name: s\n" + scene), formulation="multiplier").system.closures


def test_a_constraint_of_velocities_is_not_said_to_lack_a_solution() -> None:
    """Of a nonholonomic constraint it was said that it cannot be solved in closed form."""
    with pytest.raises(InputError) as refused:
        derive(read_text("name: s\n" + SLEIGH), formulation="minimal")
    assert "closed form" not in str(refused.value)
