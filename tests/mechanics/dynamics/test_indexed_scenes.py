"""Scenes of indexed families against the same systems written by hand."""

from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.scene import read_file, read_text

SYSTEMS = Path(__file__).parents[3] / "systems"


def family(name: str, **sizes: int) -> Equations:
    given = {key: str(value) for key, value in sizes.items()}
    return derive(read_file(str(SYSTEMS / "chains" / f"{name}.yaml"), parameters=given))


def dynamics(e: Equations, base: str) -> tuple[sp.Matrix, sp.Matrix]:
    """M and f over symbols that are named alike in both ways of writing: a1, dot(a1), ..."""
    alike: dict[sp.Symbol, sp.Symbol] = {p.symbol: sp.Symbol(p.name) for p in e.system.parameters}
    for k, c in enumerate(e.system.coordinates, start=1):
        assert c.name in (f"{base}[{k}]", f"{base}{k}")
        alike |= {c.q: sp.Symbol(f"a{k}"), c.v: sp.Symbol(f"dot(a{k})")}
    return sp.Matrix(e.system.mass_matrix).xreplace(alike), sp.Matrix(e.system.forcing).xreplace(
        alike
    )


def numbers(matrices: tuple[sp.Matrix, ...]) -> list[np.ndarray]:
    symbols = sorted({s for m in matrices for s in m.free_symbols}, key=str)
    values = {s: sp.Float(0.3 + 0.17 * k, 30) for k, s in enumerate(symbols)}
    return [np.array(m.evalf(30, subs=values).tolist(), dtype=float) for m in matrices]


@pytest.mark.parametrize(
    ("name", "size", "base", "by_hand"),
    [
        ("pendulum_chain", 3, "theta", "pendulums/triple_pendulum"),
        ("toda_ring", 3, "q", "oscillators/toda_lattice"),
    ],
)
def test_same_as_written_by_hand(name: str, size: int, base: str, by_hand: str) -> None:
    found = dynamics(family(name, n=size), base)
    expected = dynamics(derive(read_file(str(SYSTEMS / f"{by_hand}.yaml"))), base)
    for a, b in zip(numbers(found), numbers(expected), strict=True):
        assert np.allclose(a, b, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("n", [1, 5])
def test_chain_of_pendulums(n: int) -> None:
    """M_ij = (n + 1 − max(i, j)) m l² cos(θ_i − θ_j)."""
    e = family("pendulum_chain", n=n)
    mass, _ = dynamics(e, "theta")
    m, length = sp.symbols("m l")
    angles = sp.symbols(f"a1:{n + 1}")
    expected = sp.Matrix(
        n,
        n,
        lambda i, j: (n - max(i, j)) * m * length**2 * sp.cos(angles[i] - angles[j]),
    )
    found, wanted = numbers((mass, expected))
    assert np.allclose(found, wanted, rtol=1e-13)


def test_line_of_oscillators_has_its_normal_frequencies() -> None:
    """ω_k = 2 √(K/m) sin(πk/(2n + 2)) between walls, 2 √(K/m) sin(πk/n) on a ring."""
    line = derive(
        read_text("""
sizes: {n: 8}
particles: {"p[i=1..n]": {mass: 2, position: ["i + x[i]", 0, 0]}}
points: {"p[0]": [0, 0, 0], "p[n+1]": [n + 1, 0, 0]}
coordinates: ["x[i=1..n]"]
potentials:
  spring[i=0..n]: {spring: ["p[i]", "p[i+1]"], stiffness: 3}
""")
    )
    for e, angles in (
        (line, [np.pi * k / 18 for k in range(1, 9)]),
        (family("oscillator_ring", n=8), [np.pi * k / 8 for k in range(8)]),
    ):
        values = {p.symbol: p.value for p in e.system.parameters}
        mass = sp.Matrix(e.system.mass_matrix).subs(values)
        stiffness = (
            -sp.Matrix(e.system.forcing).subs(values).jacobian([c.q for c in e.system.coordinates])
        )
        ratio = 3 / 2 if e is line else 4
        found = np.linalg.eigvals(np.array(mass.LUsolve(stiffness), dtype=float))
        expected = [4 * ratio * np.sin(angle) ** 2 for angle in angles]
        assert np.allclose(sorted(found.real), sorted(expected), atol=1e-12)


def test_chain_with_definitions_that_build_on_one_another() -> None:
    """Positions from the neighbour's, rods satisfied by them, agree with positions as sums."""
    text = """
sizes: {n: 4}
parameters: {m: 1, l: {value: 0.5, positive: true}, g: 9.81}
plane: xz
points: {"p[0]": [0, 0, 0]}
particles:
  p[i=1..n]: {mass: m, position: ["x[i]", "y[i]", "z[i]"]}
coordinates: ["theta[i=1..n]"]
definitions:
  x[0]: 0
  z[0]: 0
  x[i=1..n]: x[i-1] + l*sin(theta[i])
  z[i=1..n]: z[i-1] - l*cos(theta[i])
constraints:
  rod[i=1..n]: {distance: ["p[i-1]", "p[i]"], equals: l}
potentials:
  weight: {gravity: g}
"""
    e = derive(read_text(text))
    assert (e.derivation.account.dof, len(e.system.coordinates)) == (4, 4)
    found = numbers(dynamics(e, "theta"))
    for a, b in zip(found, numbers(dynamics(family("pendulum_chain", n=4), "theta")), strict=True):
        assert np.allclose(a, b, rtol=1e-13, atol=1e-14)
