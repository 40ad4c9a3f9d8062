"""Units that do not fit together are told with both dimensions and the place."""

from __future__ import annotations

import re
from fractions import Fraction
from pathlib import Path

import pytest

from lagrange_cli.scene.reader import read_file, read_text
from lagrange_cli.scene.unit_table import UnknownUnitError, factor_of, unit_powers

SYSTEMS = Path(__file__).resolve().parents[2] / "systems"
SHIPPED = sorted(p for p in SYSTEMS.glob("*/*.yaml") if p.parent.name != "refused")

SCENE = """
parameters:
  m: {value: 1, unit: kg}
  l: {value: 1, unit: LENGTH, positive: true}
  g: {value: 9.81, unit: m/s^2}
  k: {value: 3, unit: N/m}
  q: {value: 1, unit: C}
  B: {value: 1, unit: T}
  n: 2
coordinates: {theta: {unit: ANGLE}}
definitions: {x: l*sin(theta), z: -l*cos(theta), y: 0, half: k*x/2}
particles: {bob: {mass: m, position: [x, y, z]}}
potentials: {weight: m*g*z}
"""


def messages(text):
    found = read_text(text).warnings
    return [f"{w.mark.line}:{w.mark.column} {w.message}" for w in found if w.rule == "unit"]


def scene(line="", length="m", angle="rad"):
    return SCENE.replace("LENGTH", length).replace("ANGLE", angle) + line


FITTING = [
    "kinetic: {spin: m*dot(x)^2/2}",
    "kinetic: {spin: m*l^2*dot(theta)^2/6}",
    "constraints: {circle: x^2 + z^2 = l^2}",
    "dissipation: {drag: q*B*dot(x)^2/2}",
    "forces: {push: {on: bob, force: [half, 0, 2*m*g]}, twist: {on: theta, force: k*l^2}}",
    "outputs: {swing: 'atan2(x, z)', size: 'norm(x, z) + max(x, l)', number: n + 3}",
    "inputs: {F: 'm*g*sin(sqrt(g/l)*t)'}",
]


@pytest.mark.parametrize("line", FITTING)
def test_units_that_fit(line):
    assert messages(scene(line)) == []


NOT_FITTING = {
    "potentials: {V: m*g*l^2}": (
        "'m*g*l^2' has the dimension kg m^3/s^2, but an energy has the dimension kg m^2/s^2"
    ),
    "kinetic: {T: m*dot(x)/2}": (
        "'m*dot(x)/2' has the dimension kg m/s, but an energy has the dimension kg m^2/s^2"
    ),
    "dissipation: {D: k*dot(x)^2/2}": (
        "'k*dot(x)^2/2' has the dimension kg m^2/s^4, but a power has the dimension kg m^2/s^3"
    ),
    "constraints: {c: x^2 + z = l^2}": (
        "'z' has the dimension m, but what stands before it has the dimension m^2"
    ),
    "forces: {F: {on: bob, force: [0, 0, k]}}": (
        "'k' has the dimension kg/s^2, but a force has the dimension kg m/s^2"
    ),
    "forces: {F: {on: theta, force: m*g}}": (
        "'m*g' has the dimension kg m/s^2, but an energy over 'theta' has the dimension kg m^2/s^2"
    ),
    "outputs: {o: sin(x)}": "'x' has the dimension m, but the argument of sin has no dimension",
    "outputs: {o: m + 3}": "'3' has no dimension, but what stands before it has the dimension kg",
    "outputs: {o: 2^x}": "'x' has the dimension m, but an exponent has no dimension",
    "outputs: {o: q*B*x + m}": (
        "'m' has the dimension kg, but what stands before it has the dimension kg m/s"
    ),
    "potentials: {V: k*(x + z)^2 + half}": (
        "'half' has the dimension kg m/s^2, but what stands before it has the dimension kg m^2/s^2"
    ),
}


@pytest.mark.parametrize("line", list(NOT_FITTING))
def test_units_that_do_not_fit(line):
    text = scene().replace("potentials: {weight: m*g*z}\n", "") + line
    (told,) = messages(text)
    place, _, message = told.partition(" ")
    assert message == NOT_FITTING[line]
    row, column = map(int, place.split(":"))
    quoted = re.match("'(.*?)'", message).group(1)
    assert text.splitlines()[row - 1][column - 1 :].startswith(quoted)


def test_factors_of_numbers():
    """Centimetres beside metres: dimensions agree, and motions would be wrong."""
    assert messages(scene(length="cm")) == []  # the first length tells the unit of all
    (told,) = messages(scene("kinetic: {T: m*g*x + k*x^2}", length="cm"))
    assert "'k*x^2' is in a unit 0.01 times that of what stands before it" in told
    sine, cosine = messages(scene(angle="deg"))
    assert "'theta' is in a unit 0.0174533 times that of the argument of sin" in sine
    assert "'theta' is in a unit 0.0174533 times that of the argument of cos" in cosine


def test_a_scene_without_units_stays_silent():
    bare = re.sub(r"\{value: ([\d.]+), unit: [^,}]*(, positive: true)?\}", r"\1", scene())
    bare = bare.replace("coordinates: {theta: {unit: rad}}", "coordinates: [theta]")
    assert "unit" not in bare
    assert messages(bare + "outputs: {o: sin(x) + m + 3}") == []
    # Angles alone are declared in scaled units, too.
    radians = bare.replace("coordinates: [theta]", "coordinates: {theta: {unit: rad}}")
    assert messages(radians + "outputs: {o: sin(x) + m + 3}") == []


def test_an_unknown_unit():
    (told,) = (w for w in read_text(scene(length="meterz")).warnings if w.rule == "unit")
    assert told.message == "the unit 'meterz' of 'l' is not known: it is printed, not checked"
    assert "meter" in told.hint


@pytest.mark.parametrize("path", SHIPPED, ids=lambda p: p.stem)
def test_shipped_scenes_fit(path):
    assert [w.message for w in read_file(str(path)).warnings if w.rule == "unit"] == []


WRONG = {"kg": "m", "m": "s", "m/s^2": "m/s", "N/m": "N", "kg*m^2": "kg*m", "kg m^2": "kg m"}


@pytest.mark.slow
def test_wrong_units_of_shipped_scenes_are_noticed():
    """One declared unit of each scene is replaced by another one."""
    changed = noticed = 0
    for path in SHIPPED:
        text = path.read_text()
        for match in list(re.finditer(r"unit: ([^,}]+)", text)):
            wrong = WRONG.get(match.group(1))
            if wrong is None:
                continue
            changed += 1
            altered = f"{text[: match.start(1)]}{wrong}{text[match.end(1) :]}"
            found = read_text(altered, str(path)).warnings
            noticed += any(w.rule == "unit" for w in found)
    assert changed > 250
    assert noticed > 0.8 * changed


UNITS = {
    "kg m^2/s": ({"kg": 1, "m": 2, "s": -1}, 1.0),
    "kg·m²·s⁻¹": ({"kg": 1, "m": 2, "s": -1}, 1.0),
    "m^3/(kg*s**2)": ({"kg": -1, "m": 3, "s": -2}, 1.0),
    "N": ({"kg": 1, "m": 1, "s": -2}, 1.0),
    "newton": ({"kg": 1, "m": 1, "s": -2}, 1.0),
    "T m": ({"kg": 1, "m": 1, "s": -2, "A": -1}, 1.0),
    "m^(1/2)": ({"m": Fraction(1, 2)}, 1.0),
    "cm": ({"m": 1}, 0.01),
    "mg": ({"kg": 1}, 1e-6),
    "min": ({"s": 1}, 60.0),
    "km/h": ({"m": 1, "s": -1}, 1 / 3.6),
    "rpm": ({"s": -1}, 0.10471975511965977),
    "deg": ({}, 0.017453292519943295),
    "1": ({}, 1.0),
    "1/s": ({"s": -1}, 1.0),
}


@pytest.mark.parametrize("text", list(UNITS))
def test_units_are_read(text):
    powers = unit_powers(text)
    bases, factor = UNITS[text]
    assert {key: power for key, power in powers.items() if key in bases} == bases
    others = {key: power for key, power in powers.items() if key not in bases}
    assert factor_of(others) == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    "text",
    ["", "kgg", "m^", "2 m", "m s-1", "m + s", "(m", "m)", "m^x", "%", "m^(1/0)", "(" * 3000],
)
def test_texts_that_are_no_units(text):
    with pytest.raises(UnknownUnitError):
        unit_powers(text)
