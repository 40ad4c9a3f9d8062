"""Turning points of V_eff: closed forms, extremes of simulated motions, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError
from lagrange_cli.pictures import picture_of
from lagrange_cli.studies.effective_potential import effective_potential
from tests.cli.terminal import lagrange, succeed
from tests.systems.shipped import SYSTEMS

KEPLER = """
name: kepler
parameters: {m: 2, k: 3}
particles: {b: {mass: m, position: [r*cos(phi), r*sin(phi), 0]}}
coordinates: {r: {positive: true}, phi: {}}
potentials: {V: -k/r}
initial: {r: 1, phi: 0, dot(r): 0.4, dot(phi): 1.1}
simulate: {until: 40}
"""


def found_of(derivation):
    return effective_potential(derivation.equations)


def test_keplers_apsides():
    """The roots of E r² + k r − p²/2m = 0."""
    found = found_of(loads(KEPLER).derive())
    p = 2 * 1.1
    energy = 0.4**2 + p**2 / 4 - 3
    assert found.energy == pytest.approx(energy, rel=1e-14)
    roots = np.sort(np.roots([energy, 3, -(p**2) / 4]).real)
    np.testing.assert_allclose(found.turning, roots, rtol=1e-12)
    assert found.q[0] < roots[0] < roots[1] < found.q[-1]
    np.testing.assert_allclose(found.values, p**2 / (4 * found.q**2) - 3 / found.q, rtol=1e-12)
    assert found.values.max() <= energy + 0.8 * (energy - found.values.min()) * (1 + 1e-9)
    (panel,) = picture_of(found).panels
    np.testing.assert_allclose([(p.x, p.y) for p in panel.places], [(r, energy) for r in roots])
    assert [p.label.plain for p in panel.places] == [
        f"r_min = {roots[0]:.6g}",
        f"r_max = {roots[1]:.6g}",
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "name", "until"),
    [
        ("lecture/masses_through_hole", "r", 10),
        ("pendulums/spherical_pendulum", "theta", 20),
        ("rigid/heavy_top", "theta", 2),
    ],
)
def test_motions_turn_there(scene, name, until):
    derivation = load(SYSTEMS / f"{scene}.yaml").derive()
    low, high = found_of(derivation).turning
    motion = derivation.simulate(until=until, accuracy=1e-9, samples=20001)
    assert motion.columns[name].min() == pytest.approx(low, abs=1e-5)
    assert motion.columns[name].max() == pytest.approx(high, abs=1e-5)


def test_a_motion_that_escapes_turns_once():
    found = found_of(loads(KEPLER.replace("dot(phi): 1.1", "dot(phi): 3")).derive())
    low, high = found.turning
    assert high is None
    p = 6
    energy = 0.4**2 + p**2 / 4 - 3
    assert low == pytest.approx(max(np.roots([energy, 3, -(p**2) / 4])), rel=1e-12)
    assert found.q[-1] > 1


def test_a_circular_motion_stays():
    circular = KEPLER.replace("dot(r): 0.4", "dot(r): 0").replace(
        "dot(phi): 1.1", "dot(phi): sqrt(k/m)"
    )
    found = found_of(loads(circular).derive())
    np.testing.assert_allclose(found.turning, [1, 1], atol=1e-6)
    assert found.q[0] < 0.9
    assert found.q[-1] > 1.1
    assert np.ptp(found.values) > 0


def test_friction_leaves_no_turning_points():
    text = KEPLER + "dissipation: {d: 0.01*dot(r)^2}\n"
    found = found_of(loads(text).derive())
    assert found.turning is None
    assert "no turning points" in found.phrase
    (panel,) = picture_of(found).panels
    assert (len(panel.lines), panel.places) == (2, ())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (KEPLER.replace("-k/r", "-k/r + cos(t)*r"), "depends on t"),
        (KEPLER.replace("V: -k/r", "V: -k/r + phi"), "there is no Routhian"),
        (
            KEPLER.replace("r*sin(phi), 0", "r*sin(phi), z")
            .replace("phi: {}", "phi: {}, z: {}")
            .replace("phi: 0,", "phi: 0, z: 0, dot(z): 1,")
            .replace("-k/r", "-k/r + z^2"),
            "needs one coordinate, and 'r', 'z' are left",
        ),
    ],
)
def test_refusals(text, message, tmp_path):
    with pytest.raises(InputError, match=message):
        found_of(loads(text).derive())
    scene = tmp_path / "s.yaml"
    scene.write_text(text)
    picture = str(tmp_path / "v.tex")
    done = lagrange("derive", str(scene), "--form", "routhian", "--plot", picture)
    assert done.returncode == 2
    assert "s.yaml:1:1" in done.stderr


@pytest.mark.slow
def test_command(tmp_path):
    scene, file = str(SYSTEMS / "lecture" / "masses_through_hole.yaml"), tmp_path / "v.tex"
    shown = lagrange("derive", scene, "--form", "routhian", "--plot", str(file))
    assert "V_eff = p_θ² / (2 M r²)" in shown.stdout
    assert "r turns at 1 and" in shown.stderr
    text = file.read_text()
    assert r"V_{\mathrm{eff}}" in text
    assert r"r_{\mathrm{min}} = 1$" in text
    pytest.importorskip("matplotlib")
    succeed("derive", scene, "--form", "routhian", "--plot", str(tmp_path / "v.svg"))
    assert (tmp_path / "v.svg").stat().st_size > 1000
    done = lagrange("derive", scene, "--plot", str(file))
    assert done.returncode == 2
    assert "--form routhian has one" in done.stderr
