"""Frequency responses beside closed forms, SciPy and python-control; undamped poles are told."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy import signal

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from tests.cli.terminal import lagrange, succeed
from tests.systems.shipped import SYSTEMS

OSCILLATOR = """
name: oscillator
parameters: {{m: 2, k: {k}, c: {c}}}
inputs: [F]
particles: {{p: {{mass: m, position: [x, 0, 0]}}}}
coordinates: [x]
potentials: {{V: k/2*x^2}}
dissipation: {{drag: c/2*dot(x)^2}}
forces: {{push: {{on: x, force: F}}}}
outputs: {{place: x, speed: dot(x)}}
initial: {{x: 0.1}}
"""

CART = """
name: cart
parameters: {M: 1.5, m: 0.4, l: 0.7, g: 9.81, c: 0.05}
inputs: [F]
particles:
  cart: {mass: M, position: [x, 0, 0]}
  bob: {mass: m, position: ["x + l*sin(theta)", 0, "-l*cos(theta)"]}
coordinates: [x, theta]
potentials: {V: -m*g*l*cos(theta)}
dissipation: {drag: c/2*dot(theta)^2}
forces: {push: {on: x, force: F}}
outputs: {angle: theta, place: x}
initial: {x: 0, theta: 0.1}
"""

#: Two equal masses on springs, of which one force pushes both alike: the other mode stays at rest.
PAIR = """
name: pair
parameters: {m: 1, k: 4, s: 3}
inputs: [F]
particles: {a: {mass: m, position: [x, 0, 0]}, b: {mass: m, position: [5 + y, 0, 0]}}
coordinates: [x, y]
potentials: {V: k/2*x^2 + k/2*y^2 + s/2*(x - y)^2}
forces: {one: {on: x, force: F}, other: {on: y, force: F}}
outputs: {both: x + y, difference: x - y}
initial: {x: 0.1, y: 0}
"""


def responses(text, low=0.01, high=100.0, **options):
    return loads(text).derive().frequency_response(low, high, **options)


def test_a_damped_oscillator_has_its_closed_form():
    """ω_r = ω₀ √(1 − 2ζ²), |G| = 1/(2 k ζ √(1 − ζ²)) there; of the speed ω₀ and 1/c."""
    found = responses(OSCILLATOR.format(k=8, c=0.4))
    place, speed = found.channels
    damping = 0.4 / (2 * 2 * 2)
    assert place.static == pytest.approx(1 / 8, rel=1e-14)
    assert speed.static == pytest.approx(0, abs=1e-14)
    (peak,) = place.peaks
    assert peak.frequency == pytest.approx(2 * math.sqrt(1 - 2 * damping**2), rel=1e-7)
    assert peak.gain == pytest.approx(1 / (16 * damping * math.sqrt(1 - damping**2)), rel=1e-13)
    (peak,) = speed.peaks
    assert peak.frequency == pytest.approx(2, rel=1e-7)
    assert peak.gain == pytest.approx(1 / 0.4, rel=1e-13)
    w = found.frequencies
    exact = 1 / (8 - 2 * w**2 + 0.4j * w)
    assert np.abs(found.gains[:, 0, 0] / exact - 1).max() < 1e-12 + found.error
    assert (found.settles, found.error < 1e-12) == ("yes", True)


#: A body on a spring and a damper above a road, seen from the road: an input with two rates.
ROAD = """
name: road
parameters: {m: 2, k: 8, c: 0.4}
inputs: [w]
particles: {p: {mass: m, position: [0, 0, w + z]}}
coordinates: [z]
potentials: {V: k/2*z^2}
dissipation: {drag: c/2*dot(z)^2}
outputs: {above: z, height: z + w, speed: dot(z + w)}
initial: {z: 0}
"""


def test_rates_of_an_input_count_with_it():
    """m z̈ + c ż + k z = −m ẅ, so that Z = m ω² W/(k − m ω² + i c ω)."""
    found = responses(ROAD)
    assert found.inputs == ("w",)
    assert [channel.source for channel in found.channels] == ["w"] * 3
    assert [channel.static for channel in found.channels] == pytest.approx([0, 1, 0], abs=1e-14)
    w = found.frequencies
    above = 2 * w**2 / (8 - 2 * w**2 + 0.4j * w)
    exact = np.stack([above, 1 + above, 1j * w * (1 + above)], axis=1)
    assert found.gains[:, :, 0] == pytest.approx(exact, rel=1e-12 + found.error)


def test_a_narrow_resonance_is_not_stepped_over():
    found = responses(OSCILLATOR.format(k=8, c=4e-6), 1.0, 1000.0)
    assert found.channels[0].peaks[0].gain == pytest.approx(1 / (4e-6 * 2), rel=1e-6)


def test_an_undamped_resonance_is_infinite():
    found = responses(OSCILLATOR.format(k=8, c=0))
    assert found.settles == "undamped"
    for channel in found.channels:
        (peak,) = channel.peaks
        assert (peak.gain, peak.phase) == (None, None)
        assert peak.frequency == pytest.approx(2, rel=1e-12)
    at_pole = np.isclose(found.frequencies, 2, rtol=1e-12)
    assert np.isnan(found.gains[at_pole]).all()


def test_without_a_spring_the_static_gain_is_infinite():
    found = responses(OSCILLATOR.format(k=0, c=0.4))
    assert found.channels[0].static is None
    assert found.channels[1].static == pytest.approx(1 / 0.4, rel=1e-12)


def test_masses_without_springs_integrate_what_pushes_them():
    """A has no pole but 0: ẋ = u/(iω), a static gain that is infinite; y is not moved."""
    found = responses(
        "coordinates: [x, y]\nkinetic: {k: (dot(x)^2 + dot(y)^2)/2}\ninputs: {u: 0}\n"
        "forces: {push: {on: x, force: u}}\noutputs: {a: dot(x), b: dot(y)}\n"
    )
    assert [(channel.output, channel.static) for channel in found.channels] == [("a", None)]
    pushed, other = found.gains[:, :, 0].T
    assert pushed == pytest.approx(1 / (1j * found.frequencies), rel=1e-12)
    assert not other.any()


@pytest.mark.filterwarnings("ignore::scipy.signal.BadCoefficients")
@pytest.mark.parametrize("at", ["0", "pi"])
def test_a_cart_agrees_with_scipy_and_python_control(at):
    control = pytest.importorskip("control")
    derivation = loads(CART).derive()
    found = derivation.frequency_response(0.1, 100, at={"theta": at})
    space = derivation.analyze("linearization", at={"theta": at}).linearization.state_space
    ours = found.gains[:, :, 0].T
    theirs = control.ss(space.a, space.b, space.c, space.d)(1j * found.frequencies)[:, 0]
    assert np.abs(ours / theirs - 1).max() < 1e-11
    for k in range(2):
        system = signal.StateSpace(space.a, space.b, space.c[k : k + 1], space.d[k : k + 1])
        _, theirs = signal.freqresp(system, found.frequencies)
        assert np.abs(ours[k] / theirs - 1).max() < 1e-8
    angle, place = found.channels
    # A constant force leans the pendulum while the cart runs away.
    assert angle.static == pytest.approx(-1 / (1.9 * 9.81), rel=1e-9)
    assert place.static is None
    assert found.settles == ("undamped" if at == "0" else "unstable")


def test_a_mode_that_no_input_moves_is_no_resonance():
    found = responses(PAIR)
    (channel,) = found.channels
    assert channel.output == "both"
    assert [p.frequency for p in channel.peaks] == [pytest.approx(2, rel=1e-9)]
    assert channel.static == pytest.approx(2 / 4, rel=1e-9)


def test_a_mode_that_an_input_hardly_moves_is_a_resonance():
    weak = "other: {on: y, force: F + F/10^11}"
    found = responses(PAIR.replace("other: {on: y, force: F}", weak))
    both, difference = found.channels
    assert [p.gain for p in (*both.peaks, *difference.peaks)] == [None, None]
    assert [p.frequency for p in both.peaks] == [pytest.approx(2, rel=1e-9)]
    frequencies = [pytest.approx(math.sqrt(10), rel=1e-9)]
    assert [p.frequency for p in difference.peaks] == frequencies


@pytest.mark.slow
def test_the_command_reports_and_draws(tmp_path):
    scene, arrays = tmp_path / "o.yaml", tmp_path / "o.npz"
    scene.write_text(OSCILLATOR.format(k=8, c=0.4))
    options = "analyze", str(scene), "--response", "0.1..10"
    shown = succeed(*options, "-o", str(arrays), "--plot", str(tmp_path / "bode.svg"))
    assert "Frequency response   Angular frequencies from 0.1 to 10." in shown
    assert (tmp_path / "bode.svg").read_text().startswith("<?xml")
    report = json.loads(succeed(*options, "--json"))["response"]
    saved = np.load(arrays)
    assert saved["response"].shape == (len(report["omega"]), 2, 1)
    exact = 1 / (8 - 2 * saved["omega"] ** 2 + 0.4j * saved["omega"])
    np.testing.assert_allclose(saved["response"][:, 0, 0], exact, rtol=1e-12)
    latex = succeed(*options, "--format", "latex", "--style", "snippet")
    assert "Frequency response" in latex


@pytest.mark.parametrize("text", ["1", "0..3", "3..1", "a..b", "1..inf", "nan..2", "1..2..3"])
def test_ranges_are_positive_and_ascend(text):
    scene = str(SYSTEMS / "oscillators" / "driven_spring.yaml")
    done = lagrange("analyze", scene, "--response", text)
    assert done.returncode == 2
    assert "range of positive frequencies" in done.stderr


def test_scenes_without_inputs_are_refused():
    text = OSCILLATOR.format(k=8, c=0.4).replace("inputs: [F]\n", "")
    with pytest.raises(InputError, match="the scene has no inputs"):
        responses(text.replace("force: F", "force: -x"))
