"""Constraints on velocities that say what others say, or the opposite."""

from __future__ import annotations

import pytest

from tests.mechanics.mechanics_support import derived, refusal

P = "particles: {p: {mass: 1, position: [x, y, z]}}\n"
WHEEL = (
    "parameters: {R: 0.3, w: 2}\n" + P + "coordinates: [x, phi, y, z]\n"
    "kinetic: {spin: dot(phi)^2/2}\n"
)
ARM = (
    "parameters: {l: 1}\n" + P + ("coordinates: [s, y]\ndefinitions: {x: l*sin(s), z: -l*cos(s)}\n")
)


@pytest.mark.parametrize(
    ("constraints", "message"),
    [
        (
            "a: dot(x) = 1, c: x = 2*t",
            "constraints 'c', 'a' contradict each other: the rate of 'c' is dot(x) = 2,"
            " and together they give 0 = 1",
        ),
        (
            "a: dot(x) = 0, b: x = 3, c: dot(x) = 1",
            "constraints 'b', 'c' contradict each other: the rate of 'b' is dot(x) = 0,"
            " and together they give 0 = 1",
        ),
        (
            "a: dot(x) = 1, b: dot(x) = 2",
            "constraints 'a', 'b' contradict each other: together they give 0 = 1",
        ),
        (
            "ring: x^2 + y^2 = 4, d: x*dot(x) + y*dot(y) = 1, e: dot(z) = 0",
            "constraints 'ring', 'd' contradict each other: the rate of 'ring' is"
            " 2*dot(x)*x + 2*dot(y)*y = 0, and together they give 0 = 1",
        ),
        (
            "a: dot(x) = y, b: y = 3, c: dot(x) = 4",
            "constraints 'a', 'c', 'b' contradict each other: together they give 0 = 1",
        ),
        (
            "a: dot(x) = dot(y), b: dot(y) = dot(z), c: dot(x) = dot(z) + 1",
            "constraints 'a', 'b', 'c' contradict each other: together they give 0 = 1",
        ),
        (
            "a: x + y = 1, b: dot(x) - dot(y) = 1, c: dot(x) = 2, d: dot(z) = 0",
            "constraints 'a', 'b', 'c' contradict each other: the rate of 'a' is"
            " dot(x) + dot(y) = 0, and together they give 0 = 3",
        ),
        (
            "a: x = sin(t), b: dot(x) = sin(t)",
            "constraints 'a', 'b' contradict each other: the rate of 'a' is dot(x) = cos(t),"
            " and together they give -sin(t) + cos(t) = 0, which does not hold all the time",
        ),
        (
            "a: y*dot(x) - x*dot(y) = dot(z), b: y*dot(x) - x*dot(y) = dot(z) + 1",
            "constraints 'a', 'b' contradict each other: together they give 0 = 1",
        ),
        ("a: dot(x) = dot(x) + 1", "constraint 'a' cannot hold: it gives 0 = 1"),
        ("roll: [dot(x) = 1, dot(x) = 2]", "constraint 'roll' cannot hold: it gives 0 = 1"),
    ],
)
def test_contradictions_are_named_with_their_reason(constraints: str, message: str) -> None:
    problem = refusal(P + f"constraints: {{{constraints}}}\n")
    assert problem.rule == "inconsistent"
    assert problem.message == message


def test_a_belt_that_slips() -> None:
    """ẋ = R φ̇ at φ̇ = w is R w; at R = 1 the belt would agree."""
    constraints = (
        "constraints: {roll: dot(x) = R*dot(phi), motor: dot(phi) = w, belt: dot(x) = w}\n"
    )
    message = refusal(WHEEL + constraints).message
    assert message.startswith("constraints 'roll', 'motor', 'belt' contradict each other")
    assert message.endswith("R*w - w = 0, which the parameters do not satisfy")
    found = derived((WHEEL + constraints).replace("R: 0.3", "R: 1"))
    assert [x.status for x in found.derivation.account.lines] == [
        "independent",
        "independent",
        "redundant",
    ]


@pytest.mark.parametrize(
    ("constraints", "name", "by", "counted"),
    [
        ("a: dot(x) = 2, c: x = 2*t", "a", ("c",), 1),
        ("ring: x^2 + y^2 = 4, d: x*dot(x) + y*dot(y) = 0", "d", ("ring",), 1),
        ("a: x = sin(t), b: dot(x) = cos(t)", "b", ("a",), 1),
        ("a: dot(x) = y, b: y = 3, c: dot(x) = 3", "c", ("a", "b"), 2),
        ("a: dot(x) = dot(y), b: dot(y) = dot(z), c: dot(x) = dot(z)", "c", ("a", "b"), 2),
        ("a: y*dot(x) - x*dot(y) = dot(z), b: 2*y*dot(x) = 2*dot(z) + 2*x*dot(y)", "b", ("a",), 0),
    ],
)
def test_what_others_imply_is_not_counted(
    constraints: str, name: str, by: tuple[str, ...], counted: int
) -> None:
    found = derived(P + f"constraints: {{{constraints}}}\n")
    (line,) = (x for x in found.derivation.account.lines if x.status == "redundant")
    assert (line.name, line.implied_by) == (name, by)
    assert (found.derivation.account.constraints, found.derivation.account.dof) == (
        counted,
        3 - counted,
    )
    listed = ", ".join(f"'{n}'" for n in by)
    (warned,) = (w for w in found.derivation.warnings if w.rule == "redundant")
    assert warned.message == f"constraint '{name}' is redundant: implied by {listed}"


def test_what_definitions_imply() -> None:
    found = derived(ARM + "constraints: {rod: x*dot(x) + z*dot(z) = 0}\n")
    assert found.derivation.account.dof == 2
    (warned,) = (w for w in found.derivation.warnings if w.rule == "redundant")
    assert warned.message == "constraint 'rod' is redundant: implied by the definitions"
    problem = refusal(ARM + "constraints: {rod: x*dot(x) + z*dot(z) = 1}\n")
    assert problem.message == "constraint 'rod' cannot hold: it gives 0 = 1"


def test_where_they_hold_together_is_a_constraint_of_its_own() -> None:
    problem = refusal(P + "constraints: {a: dot(x) = y, b: dot(x) = z}\n")
    assert "'a', 'b' hold together only where y - z = 0" in problem.message
    assert problem.hint == "b: y - z = 0"
    found = derived(P + "constraints: {a: dot(x) = y, b: y - z = 0}\n")
    assert (found.derivation.account.constraints, found.derivation.account.nonholonomic) == (1, 1)


@pytest.mark.slow
def test_a_constant_of_integration_that_nothing_gives_is_none_to_fail_by() -> None:
    """x = 0 would leave no y with x + y² = −1; of y² = y₀² only y = y₀ holds at the start."""
    found = derived(P + "constraints: {a: dot(x) = 0, b: x + y^2 = -1}\n")
    assert (found.derivation.account.constraints, found.derivation.account.dof) == (2, 1)
    assert [str(c.q) for c in found.system.coordinates] == ["z"]
