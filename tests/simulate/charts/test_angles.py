"""Angles that are read off quaternions, beside those that the quaternions are made of."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from lagrange_cli.simulate.charts.angles import angles_of_turn
from lagrange_cli.simulate.charts.continuation import ContinuedCoordinates, KnownMotion

Array = NDArray[np.float64]

SEQUENCES = [
    "".join(axes) for axes in product("xyz", repeat=3) if axes[0] != axes[1] and axes[1] != axes[2]
]
ERROR = 1e-13


def composed(p: Array, q: Array) -> Array:
    """Products of quaternions, shape (m, 4)."""
    scalar = p[:, 0] * q[:, 0] - (p[:, 1:] * q[:, 1:]).sum(axis=1)
    vector = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    return np.column_stack([scalar, vector])


def read_off(axes: str, t: Array, q: Array, v: Array) -> ContinuedCoordinates:
    """Angles off the quaternions of angles and rates, shape (m, 3) each."""
    factors, slopes = np.zeros((3, len(t), 4)), np.zeros((3, len(t), 4))
    for k, axis in enumerate(axes):
        number = 1 + "xyz".index(axis)
        factors[k, :, 0], factors[k, :, number] = np.cos(q[:, k] / 2), np.sin(q[:, k] / 2)
        slopes[k, :, 0] = -factors[k, :, number] * v[:, k] / 2
        slopes[k, :, number] = factors[k, :, 0] * v[:, k] / 2
    parts = composed(composed(factors[0], factors[1]), factors[2])
    rates = sum(
        composed(composed(*(slopes[i] if i == k else factors[i] for i in (0, 1))), last)
        for k in range(3)
        for last in [slopes[2] if k == 2 else factors[2]]
    )
    samples = KnownMotion(t, parts, np.asarray(rates), np.full(4, ERROR))
    return angles_of_turn(samples, axes, np.append(q[0], v[0]))


@pytest.mark.parametrize("axes", SEQUENCES)
def test_angles_go_on_smoothly_through_gimbal_lock(axes: str) -> None:
    """The second angle goes through five places where it locks, and comes back through them."""
    t = np.linspace(0, 1, 401)
    q = np.column_stack(
        [1 + 3 * t + 0.3 * np.sin(5 * t), 5 * np.sin(4 * t) + 0.2, 8 * t**2 - 2 * t]
    )
    v = np.column_stack([3 + 1.5 * np.cos(5 * t), 20 * np.cos(4 * t), 16 * t - 2])
    read = read_off(axes, t, q, v)
    assert len(read.lost) >= 4
    assert read.q == pytest.approx(q, abs=1e-12)
    known = read.amplification.max(axis=1) < 1e-9
    assert known.sum() > 390
    assert read.v[known] == pytest.approx(v[known], abs=1e-8)
    assert (np.abs(read.q - q) <= 10 * read.amplification + 1e-14).all()


@pytest.mark.parametrize("axes", ["zxz", "xyz"])
@pytest.mark.parametrize("miss", [1e-2, 1e-6, 1e-10])
def test_angles_turn_as_the_motion_does_that_comes_near(axes: str, miss: float) -> None:
    """A body passes lock at a distance: the outer angles make half a turn, each in its sense."""
    t = np.linspace(-1, 1, 202)
    lock = 0.0 if axes == "zxz" else np.pi / 2
    for sense in (1, -1):
        turn = sense * np.arctan2(t, miss)
        turning = sense * miss / (t**2 + miss**2)
        apart, size = np.hypot(t, miss), t / np.hypot(t, miss)
        q = np.column_stack([turn + t, lock + apart, t - turn])
        v = np.column_stack([turning + 1, size, 1 - turning])
        read = read_off(axes, t, q, v)
        assert not read.lost
        assert read.q == pytest.approx(q, abs=1e-9)


def test_angles_that_come_back_from_lock_are_those_before() -> None:
    """A body that stops at lock and turns back has a second angle of the same sign there."""
    t = np.linspace(-1, 1, 201)
    q = np.column_stack([0.3 + 0 * t, t**2, 0.1 + t])
    v = np.column_stack([0 * t, 2 * t, 1 + 0 * t])
    read = read_off("zxz", t, q, v)
    known = np.isfinite(read.amplification).all(axis=1)
    assert np.flatnonzero(~known).tolist() == [100]
    assert read.q[known] == pytest.approx(q[known], abs=1e-12)


def test_angles_at_rest_in_lock_are_not_known() -> None:
    t = np.linspace(0, 1, 51)
    q = np.column_stack([t, 0 * t, 2 * t])
    v = np.column_stack([1 + 0 * t, 0 * t, 2 + 0 * t])
    read = read_off("zxz", t, q, v)
    assert read.lost[0] == (0.0, pytest.approx(0.02))
    assert read.q[:, 1] == pytest.approx(0, abs=1e-15)
    assert read.q[:, 0] + read.q[:, 2] == pytest.approx(3 * t, abs=1e-14)
    assert (read.amplification[1:, [0, 2]] > 1).all()
    assert (read.amplification[:, 1] < 1e-12).all()
