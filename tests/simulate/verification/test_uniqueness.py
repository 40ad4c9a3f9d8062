"""Starts and rests from which more than one motion follows are told; others are not refused."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.errors import InputError

SCENE = """
name: steep
parameters: {p: 1.5, c: 0}
particles: {b: {mass: 1, position: [x, y, 0]}}
coordinates: [x, y]
LAW
initial: {x: @X@, y: 0, dot(x): @V@, dot(y): 0}
simulate: {until: 4, accuracy: 1e-6, samples: @N@}
"""


def scene(law, x="0", v="0", samples="41"):
    text = SCENE.replace("LAW", law).replace("@X@", x).replace("@V@", v)
    return loads(text.replace("@N@", samples))


def force(law):
    return f'forces: {{f: {{on: x, force: "{law}"}}}}'


def potential(law):
    return f'potentials: {{V: "{law}"}}'


#: Laws, starts and velocities from which several motions follow.
SEVERAL = [
    (potential("-abs(x)^(3/2)"), "0", "0"),
    (potential("-abs(x)^p"), "0", "0"),
    (potential("-abs(x)^(4/3) + y^2"), "0", "0"),
    (potential("-abs(x - 1)^(3/2)"), "1", "0"),
    (force("sqrt(x)"), "0", "0"),
    (force("sqrt(abs(x)) - 2*x"), "0", "0"),
    (force("abs(x)^(9/10)*sign(x)"), "0", "0"),
    (force("sign(dot(x))*sqrt(abs(dot(x)))"), "3", "0"),
    (force("sqrt(abs(x)) + sqrt(abs(y))"), "0", "0"),
]

#: Those from which one follows: wells, drag, transversal passages, forces that start at once,
#: powers above 1, roots of what does not vanish.
ONE = [
    (potential("abs(x)^(3/2)"), "0", "0"),
    (potential("abs(x)^(3/2)"), "1", "0"),
    (potential("-max(0, x)^(5/2)"), "0", "0"),
    (potential("-abs(x)^(3/2)"), "0", "1"),
    (potential("-abs(x)^(3/2) - x"), "0", "0"),
    (potential("-(1 + x^2)^(1/2)"), "0", "0"),
    (force("-sign(dot(x))*sqrt(abs(dot(x)))"), "0", "0"),
    (force("-sign(dot(x))*sqrt(abs(dot(x)))"), "0", "1"),
    (force("x*sqrt(abs(x))"), "0", "0"),
    (force("1 + sqrt(abs(x))"), "0", "0"),
    (force("-sqrt(abs(x))*sign(x)"), "0", "0"),
    (force("sqrt(x + 1)"), "0", "0"),
    (force("sqrt(abs(x))*c"), "0", "0"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("law", "x", "v"), SEVERAL)
def test_a_start_from_which_several_motions_follow_is_refused(law, x, v):
    system = scene(law, x, v).derive()
    with pytest.raises(InputError) as caught:
        system.simulate()
    (problem,) = caught.value.problems
    assert problem.rule == "not-unique"
    assert "is not unique: where" in problem.message
    assert "infinite slope" in problem.message


@pytest.mark.slow
@pytest.mark.parametrize(("law", "x", "v"), ONE)
def test_a_start_from_which_one_motion_follows_is_not(law, x, v):
    assert scene(law, x, v).derive().simulate().status == "ok"


@pytest.mark.slow
@pytest.mark.parametrize("samples", ["5", "401"])
@pytest.mark.parametrize("accuracy", [1e-2, 1e-6, 1e-9])
def test_a_motion_that_comes_to_rest_there_ends(accuracy, samples):
    """x = (1 − t/T)⁴ reaches the top of −x^(3/2) with no speed: it may stay, go on or fall back."""
    top = scene(potential("-abs(x)^(3/2)"), "1", "-sqrt(2)", samples).derive()
    run = top.simulate(accuracy=accuracy)
    end = 4 / np.sqrt(2)
    assert run.status == "accuracy_not_reached"
    assert run.t[-1] < end
    assert "comes to rest where x = 0" in run.reason
    exact = (1 - run.t / end) ** 4
    assert np.abs(run.columns["x"] - exact).max() <= accuracy


@pytest.mark.parametrize("v", ["-1.5", "-1.3", "-1.41421356"])
def test_a_motion_that_turns_or_goes_over_does_not(v):
    run = scene(potential("-abs(x)^(3/2)"), "1", v).derive().simulate()
    assert run.status == "ok"
    energy = run.columns["dot(x)"] ** 2 / 2 - np.abs(run.columns["x"]) ** 1.5
    assert np.abs(energy - energy[0]).max() < 1e-4
