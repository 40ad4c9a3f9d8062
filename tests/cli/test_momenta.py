"""``simulate --with momenta``: conserved ones stay, all follow from the printed definitions."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from lagrange_cli import load
from tests.analysis.form_motions import numbers, read_back
from tests.cli.terminal import lagrange, succeed
from tests.systems.shipped import SYSTEMS


def columns(path):
    with open(path, encoding="utf-8") as file:
        names = file.readline().strip().split(",")
        return dict(zip(names, np.loadtxt(file, delimiter=",").T, strict=True))


@pytest.mark.slow
def test_momenta_are_those_of_the_hamiltonian_form(tmp_path):
    scene, file = str(SYSTEMS / "pendulums" / "pendulum_on_cart.yaml"), tmp_path / "m.csv"
    succeed("simulate", scene, "--until", "3", "--with", "momenta,energy", "-o", str(file))
    table = columns(file)
    derivation = load(scene).derive()
    known = {sp.Symbol(p): x for p, x in numbers(derivation).items()}
    names = [c.name for c in derivation.equations.system.coordinates]
    state = [*names, *(f"dot_{name}" for name in names)]
    for symbol in state:
        known.pop(sp.Symbol(symbol), None)
    values = [table[name.replace("dot_", "dot(") + ")" * ("dot_" in name)] for name in state]
    for row in derivation.report(form="hamiltonian")["canonical"]:
        momentum = sp.lambdify(
            list(map(sp.Symbol, state)), read_back(row["definition"]).subs(known)
        )
        np.testing.assert_allclose(table[row["momentum"]], momentum(*values), atol=1e-12)


def test_a_conserved_momentum_is_constant_and_shown(tmp_path):
    scene = str(SYSTEMS / "lecture" / "masses_through_hole.yaml")
    shown = succeed("simulate", scene, "--until", "5", "--with", "momenta", "--accuracy", "1e-9")
    assert "p_theta                 6" in shown


def test_it_is_of_one_motion():
    scene = str(SYSTEMS / "lecture" / "masses_through_hole.yaml")
    for words in (("--sensitivity", "m"), ("--vary", "m=1..2:3")):
        done = lagrange("simulate", scene, "--with", "momenta", *words)
        assert done.returncode == 2
        assert "--with momenta is of one motion" in done.stderr
