"""The wing nut that turns over, by a quaternion, against Jacobi's elliptic functions."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.special import ellipj, ellipk

from lagrange_cli import load
from lagrange_cli.analysis.symmetries.linear_symmetries import linear_symmetries
from lagrange_cli.cache import open_cache
from lagrange_cli.simulate import Trajectory
from tests.systems.shipped import APART

MOMENTS = np.array([1.0, 2.0, 3.0])
MIDDLE, LAST = 1.0, 0.01

#: m and n of Jacobi's functions, from 2T and the square of the angular momentum.
_ENERGY = MOMENTS @ np.array([0, MIDDLE, LAST]) ** 2
_SQUARE = MOMENTS**2 @ np.array([0, MIDDLE, LAST]) ** 2
_ABOVE, _BELOW = _SQUARE - _ENERGY * MOMENTS[0], _ENERGY * MOMENTS[2] - _SQUARE
MODULUS = _BELOW / _ABOVE
RATE = np.sqrt(_ABOVE / 6)


@pytest.fixture(scope="module")
def motion() -> Trajectory:
    return load(APART["dzhanibekov"]).derive(cache=open_cache()).simulate()


def test_angular_velocities_are_elliptic_functions(motion: Trajectory) -> None:
    sn, cn, dn, _ = ellipj(RATE * motion.t, MODULUS)
    first = -np.sqrt(_BELOW / 2 * (1 - MODULUS))
    for name, expected in (
        ("omega1", first * sn / dn),
        ("omega2", MIDDLE * cn / dn),
        ("omega3", LAST / dn),
    ):
        assert motion.columns[name] == pytest.approx(expected, abs=3e-9)


def test_it_turns_over_after_half_a_period(motion: Trajectory) -> None:
    flip = 2 * ellipk(MODULUS) / RATE
    assert flip == pytest.approx(18.8510357937, abs=1e-9)
    signs = np.sign(motion.columns["omega2"])
    turned = motion.t[1:][signs[1:] != signs[:-1]]
    assert turned == pytest.approx(flip * (np.arange(4) + 0.5), abs=motion.t[1])


def test_angular_momentum_in_space_and_length_stay(motion: Trajectory) -> None:
    parts = np.column_stack([motion.columns[f"q{k}"] for k in range(4)])
    assert np.abs((parts**2).sum(axis=1) - 1).max() < 1e-15
    spins = np.column_stack([motion.columns[f"omega{k}"] for k in (1, 2, 3)])
    scalar, vector, along = parts[:, :1], parts[:, 1:], spins * MOMENTS
    crossed = np.cross(vector, along)
    in_space = along + 2 * (scalar * crossed + np.cross(vector, crossed))
    assert in_space == pytest.approx(np.tile(in_space[0], (len(in_space), 1)), abs=1e-8)


def test_components_of_the_angular_momentum_are_found() -> None:
    equations = load(APART["dzhanibekov"]).derive(cache=open_cache()).equations
    found = linear_symmetries(equations).proven
    assert [symmetry.name for symmetry in found] == ["L_x", "L_y", "L_z"]
    (body,) = equations.system.particles
    for symmetry, component in zip(found, body.angular_momentum, strict=True):
        assert sp.expand(symmetry.expression - component) == 0
