"""What --json writes is valid by its schema, and schemas have no key that is never written."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from typing import Any

import jsonschema
import pytest

from lagrange_cli.api import REPORTS, report_schema
from lagrange_cli.errors import InputError
from lagrange_cli.report.document_options import FORMS
from lagrange_cli.report.values.derivation import derivation_report
from tests.cli.terminal import ROOT, lagrange
from tests.systems.shipped import SCENES, derived, sliced

PENDULUM = "systems/pendulums/pendulum.yaml"

#: Commands of each report in which all its keys occur.
COMMANDS: dict[str, tuple[str, ...]] = {
    "derive": (
        f"derive {PENDULUM} --forces --with latex",
        "derive systems/lecture/lever.yaml --by virtual-work",
        "derive systems/constraints/four_bar_linkage.yaml --form explicit --forces",
        "derive systems/contact/particle_leaving_sphere.yaml",
        "derive systems/oscillators/seismometer.yaml",
        "derive systems/rolling/chaplygin_sleigh.yaml --form first-order",
        "derive systems/actuators/dc_motor_pendulum.yaml --with latex",
        "derive systems/data/engine_on_a_brake.yaml",
        "derive systems/bodies/cart_pole.yaml",
        "derive systems/oscillators/henon_heiles.yaml --steps",
        "derive systems/bodies/quadrotor.yaml --by dalembert",
        "derive systems/bodies/dzhanibekov.yaml --by dalembert",
        "derive systems/oscillators/damped_oscillator.yaml --form small-oscillations",
        "derive systems/pendulums/double_pendulum.yaml --form small-oscillations --with latex",
        "derive systems/pendulums/spherical_pendulum.yaml --form routhian --by dalembert",
        f"derive {PENDULUM} --form hamiltonian --bracket theta,p_theta --with latex",
        "derive systems/chains/oscillator_ring.yaml --parameter n=65",
        "derive FOLDER/warned.yaml",
        "derive FOLDER/sampled.yaml --with latex",
        "derive systems/switching/hit_and_miss_engine.yaml",
    ),
    "check": (
        f"check {PENDULUM}",
        "check FOLDER/wrong.yaml FOLDER/spring.yaml -x",
        "check FOLDER/spring.yaml --timeout 0.01",
    ),
    "cache": ("cache", "cache --clear"),
    "analyze": (
        f"analyze {PENDULUM}",
        "analyze systems/beads/bead_on_rotating_hoop.yaml --parameter omega=1",
        "analyze systems/celestial/two_bodies.yaml",
        "analyze systems/beads/bead_on_rotating_hoop.yaml --branches omega=0..12",
        "analyze systems/pendulums/spherical_pendulum.yaml --steady",
        "analyze systems/contact/particle_leaving_sphere.yaml --contacts",
        "analyze systems/oscillators/driven_spring.yaml --response 0.1..10",
        "analyze systems/constraints/four_bar_linkage.yaml --along 0.01 --samples 2",
        f"analyze {PENDULUM} --lyapunov 5",
        "analyze FOLDER/sampled.yaml",
    ),
    "simulate": (
        "simulate systems/pendulums/spherical_pendulum.yaml --with conserved --until 1",
        "simulate systems/contact/bouncing_ball.yaml --until 2",
        "simulate systems/switching/stick_slip_belt.yaml",
        f"simulate {PENDULUM} --method RK4 --step 0.1 --until 1 --with energy",
    ),
    "ensemble": (
        f"simulate {PENDULUM} --vary theta=[0.1,0.2] --until 1 --reduce max(theta) -j 1",
        "simulate systems/celestial/kepler.yaml --vary r=[0,1] --until 1 -j 1",
    ),
    "section": (
        "simulate systems/oscillators/henon_heiles.yaml --section x=0 --until 10",
        "simulate systems/oscillators/henon_heiles.yaml --section x=0 --until 10 --method DOP853"
        " --rtol 1e-6",
    ),
    "path": (f"path {PENDULUM} --from theta=-1,t=0 --to theta=1,t=1.2 --samples 3 --starts 4",),
    "fit": ("fit FOLDER/spring.yaml FOLDER/data.csv --free k,x",),
    "tradeoff": (f"tradeoff {PENDULUM} --methods DOP853,RK4,auto --until 1 --repeat 1",),
    "stress": (f"stress {PENDULUM} --axes speed,units --until 1 -j 1",),
}

#: Scenes with closures of positions and velocities, contacts, and inputs of both kinds.
FORMED = ("four_bar_linkage", "chaplygin_sleigh", "dropped_rod", "driven_spring", "seismometer")

#: Keys of outcomes that no small command has.
UNSEEN = {"check": {"summary.crash"}, "tradeoff": {"left_out.[].method", "left_out.[].reason"}}

#: Seconds: all but these take longer than a quarter of one.
FAST = ("check", "cache")

SPRING = """\
name: spring
parameters: {m: 2, k: 3.5}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
initial: {x: 1, dot(x): 0}
simulate: {until: 5}
"""

SAMPLED = """\
name: sampled
parameters: {m: 2}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
inputs: [F]
forces: {motor: {on: x, force: F}}
controllers: {every: 0.1, hold: {F: -e - x}, memory: {e: e + x}}
initial: {x: 1, dot(x): 0, e: 0}
"""

every_report = pytest.mark.parametrize("name", list(REPORTS))
every_command = pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n in FAST else pytest.mark.slow) for n in COMMANDS]
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("fit")
    (made / "spring.yaml").write_text(SPRING)
    (made / "sampled.yaml").write_text(SAMPLED)
    (made / "warned.yaml").write_text(SPRING.replace("m: 2,", "m: 2, c: 1,"))
    (made / "wrong.yaml").write_text(SPRING.replace("k*x^2", "k*y^2"))
    rows = [f"{0.2 * k},{math.cos(math.sqrt(1.5) * 0.2 * k) + 1e-3 * (-1) ** k}" for k in range(20)]
    (made / "data.csv").write_text("t,x\n" + "\n".join(rows) + "\n")
    return made


@cache
def schema_of(name: str) -> dict[str, Any]:
    return report_schema(name)


@cache
def validator(name: str) -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(schema_of(name))


def parts(schema: Any, path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Every key of a schema with its own schema; ``[]`` stands for entries of lists."""
    for name, value in schema.get("properties", {}).items():
        yield f"{path}{name}", value
        yield from parts(value, f"{path}{name}.")
    for key, mark in (("items", "[]."), ("additionalProperties", "NAME.")):
        if isinstance(schema.get(key), dict):
            yield from parts(schema[key], path + mark)
    for choice in schema.get("anyOf", ()):
        yield from parts(choice, path)


def written(value: Any, schema: Any, path: str = "") -> Iterator[str]:
    """The keys of a schema that a value has."""
    if isinstance(value, dict):
        for name, part in value.items():
            known = schema.get("properties", {})
            if name in known:
                yield f"{path}{name}"
                yield from written(part, known[name], f"{path}{name}.")
            elif isinstance(schema.get("additionalProperties"), dict):
                yield from written(part, schema["additionalProperties"], f"{path}NAME.")
    if isinstance(value, list) and isinstance(schema.get("items"), dict):
        for part in value:
            yield from written(part, schema["items"], f"{path}[].")
    for choice in schema.get("anyOf", ()):
        yield from written(value, choice, path)


def printed(words: str, folder: Any) -> Any:
    done = lagrange(*words.replace("FOLDER", str(folder)).split(), "--json", cwd=ROOT)
    assert done.stdout, done.stderr
    return json.loads(done.stdout)


@every_report
def test_every_key_has_a_type_and_a_sentence(name):
    schema = schema_of(name)
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["additionalProperties"] is False
    for path, part in parts(schema):
        assert part.keys() & {"type", "anyOf"}, path
        assert part["description"].endswith("."), path
        if "properties" in part:
            assert "additionalProperties" in part, path


@every_command
def test_what_is_printed_is_valid_and_every_key_occurs(name, folder, request):
    if name == "cache":
        request.getfixturevalue("cache_folder")
    schema, seen = schema_of(name), set()
    for words in COMMANDS[name]:
        value = printed(words, folder)
        validator(name).validate(value)
        seen |= set(written(value, schema))
        for key in value:
            refuses_without(key, name, value)
    # What `latex` has once more occurs somewhere, in LaTeX or not.
    missing = {path for path, _ in parts(schema)} - seen
    assert {p for p in missing if p.removeprefix("latex.") not in seen} == UNSEEN.get(name, set())


@pytest.mark.slow
@sliced(SCENES, FORMED)
def test_derivations_in_every_form_are_valid(name):
    equations = derived(name, forces=True)
    for form in FORMS:
        with suppress(InputError):  # Some have no such form.
            validator("derive").validate(derivation_report(equations, form, latex=True))


def refuses_without(key: str, name: str, value: Any) -> None:
    """A key that is written and that a schema lacks is refused, and so is one that is missing."""
    others = {k: part for k, part in schema_of(name)["properties"].items() if k != key}
    schema = schema_of(name) | {"properties": others}
    assert not jsonschema.Draft202012Validator(schema).is_valid(value)
    if key in schema["required"]:
        assert not validator(name).is_valid({k: v for k, v in value.items() if k != key})
