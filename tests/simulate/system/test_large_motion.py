"""A net whose multipliers need sparse elimination: from its scene to a trajectory that holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text
from lagrange_cli.simulate import simulate

SYSTEMS = Path(__file__).parents[3] / "systems"

ROWS = COLUMNS = 10
KNOTS = ROWS * COLUMNS
LENGTH, GRAVITY, SPEED = 0.5, 9.81, 1.0


def threads():
    """Ends of the threads: numbers of knots, or the place of a fixed point first."""
    found = []
    for i in range(ROWS):
        for j in range(COLUMNS):
            above = i * COLUMNS + j - COLUMNS if i else (LENGTH * (j + 1), 0.0, 0.0)
            found.append((above, i * COLUMNS + j))
            if j < COLUMNS - 1:
                found.append((i * COLUMNS + j, i * COLUMNS + j + 1))
    return found


ENDS = threads()
EACH = np.arange(len(ENDS))
#: The knot at the end of each thread; the one at its beginning, of those that begin at a knot.
LAST = np.array([b for _, b in ENDS])
TIED = np.array([not isinstance(a, tuple) for a, _ in ENDS])
FIRST = np.array([0 if isinstance(a, tuple) else a for a, _ in ENDS])
FIXED = np.array([a if isinstance(a, tuple) else (0.0, 0.0, 0.0) for a, _ in ENDS])


def slopes(t, y):
    """Newton's law with the tensions of the threads, by a dense solution."""
    q, v = y.reshape(2, KNOTS, 3)
    tied = TIED[:, np.newaxis]
    apart = q[LAST] - np.where(tied, q[FIRST], FIXED)
    rate = v[LAST] - np.where(tied, v[FIRST], 0.0)
    gradient = np.zeros((len(ENDS), KNOTS, 3))
    gradient[EACH, LAST] = apart
    gradient[EACH[TIED], FIRST[TIED]] = -apart[TIED]
    matrix = gradient.reshape(len(ENDS), -1)
    free = np.tile([0.0, 0.0, -GRAVITY], KNOTS)
    tension = np.linalg.solve(matrix @ matrix.T, -(rate**2).sum(axis=1) - matrix @ free)
    return np.concatenate([v.ravel(), free + matrix.T @ tension])


@pytest.fixture(scope="module")
def run():
    text = (SYSTEMS / "chains" / "hanging_net.yaml").read_text(encoding="utf-8")
    text = text.replace("sizes: {m: 3, n: 3}", f"sizes: {{m: {ROWS}, n: {COLUMNS}}}")
    text = text[: text.index("expect:")]
    return simulate(derive(read_text(text), points=1), until=0.5, samples=6, accuracy=1e-7)


@pytest.mark.slow
def test_a_net_moves_as_newton_has_it(run):
    at = np.array([[LENGTH * (j + 1), 0, -LENGTH * (i + 1)] for i, j in np.ndindex(ROWS, COLUMNS)])
    across = [
        SPEED * (i + 1) / ROWS * np.cos(np.pi * (j + 1) / COLUMNS)
        for i, j in np.ndindex(ROWS, COLUMNS)
    ]
    v = np.stack([np.zeros(KNOTS), across, np.zeros(KNOTS)], axis=1)
    start = np.concatenate([at.ravel(), v.ravel()])
    end = solve_ivp(slopes, (0, 0.5), start, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    table = run.table()
    assert run.status == "ok"
    for k, (i, j) in enumerate(np.ndindex(ROWS, COLUMNS)):
        for axis, name in enumerate("xyz"):
            found = table[f"{name}[{i + 1},{j + 1}]"][-1]
            assert found == pytest.approx(end[3 * k + axis], abs=1e-8)


@pytest.mark.slow
def test_threads_keep_their_length_and_the_net_its_energy(run):
    assert run.constraint_drift < 1e-11
    assert run.energy_drift < 1e-11
    assert run.implementation == "compiled C"
