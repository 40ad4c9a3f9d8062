"""The energy that is shown is that of the Lagrangian, to the digits of the certificate."""

from __future__ import annotations

from pathlib import Path

import pytest
import sympy as sp

from lagrange_cli.errors import InternalError
from lagrange_cli.mechanics import derive_uncertified, reduce
from lagrange_cli.mechanics.certify.certificate import certify
from lagrange_cli.mechanics.certify.printed import certify_energy
from lagrange_cli.mechanics.structure import total_energy
from lagrange_cli.scene import read_file

SYSTEMS = Path(__file__).parents[3] / "systems"
SCENES = ["pendulums/double_pendulum", "beads/bead_on_rotating_hoop", "rigid/heavy_top"]


@pytest.mark.parametrize("scene", SCENES)
def test_a_wrong_energy_is_found(scene):
    derivation = derive_uncertified(reduce(read_file(str(SYSTEMS / f"{scene}.yaml"))))
    evidence = certify(derivation, 30, 2)
    energy = sp.Add(*total_energy(derivation, evidence))
    certify_energy(evidence, energy)
    first, *others = sp.Add.make_args(sp.expand(energy))
    little = sp.Rational(1, 10**18)
    for wrong in (-energy, energy * (1 + little), sp.Add(first * (1 + little), *others)):
        with pytest.raises(InternalError, match="the energy shown is not that derived"):
            certify_energy(evidence, wrong)
