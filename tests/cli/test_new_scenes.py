"""``lagrange new`` and ``lagrange schema``: a scene to begin with, and what editors know."""

from __future__ import annotations

import json
import re
from pathlib import Path

import jsonschema
import pytest
import yaml

from lagrange_cli import InputError, loads
from lagrange_cli.scene.reader import SECTIONS
from lagrange_cli.scene.schema import scene_schema
from tests.cli.terminal import lagrange, succeed

SCENES = sorted(Path("systems").rglob("*.yaml"))
PAGE = re.findall(r"```yaml\n(.*?)```", Path("docs/scene-language.md").read_text(), re.DOTALL)
SCHEMA = scene_schema()
VALIDATOR = jsonschema.Draft7Validator(SCHEMA)


@pytest.mark.slow
def test_a_new_scene_is_derived_simulated_and_checked(tmp_path):
    said = succeed("new", "swing", cwd=tmp_path)
    assert said == "swing.yaml: lagrange derive swing.yaml\n"
    assert "θ   l θ̈ + g sin θ = 0" in succeed("derive", "swing.yaml", cwd=tmp_path)
    assert "1 pass" in succeed("check", "--strict", "swing.yaml", cwd=tmp_path)
    assert json.loads(succeed("simulate", "swing.yaml", "--json", cwd=tmp_path))["status"] == "ok"
    assert succeed("new", "swing", "-o", "-") == (tmp_path / "swing.yaml").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["2x"], "'2x' is no name of a scene"),
        (["../x"], "'../x' is no name of a scene"),
        (["there"], "'there.yaml' is there already"),
        (["x", "-o", "none/x.yaml"], "cannot write"),
    ],
)
def test_what_cannot_be_begun_is_refused(tmp_path, words, said):
    (tmp_path / "there.yaml").write_text("mine")
    done = lagrange("new", *words, cwd=tmp_path)
    assert done.returncode == 2
    assert said in done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["there.yaml"]
    assert (tmp_path / "there.yaml").read_text() == "mine"


def test_the_schema_is_one_and_is_written(tmp_path):
    jsonschema.Draft7Validator.check_schema(SCHEMA)
    assert json.loads(succeed("schema")) == SCHEMA
    succeed("schema", "-o", "scene.json", cwd=tmp_path)
    assert json.loads((tmp_path / "scene.json").read_text()) == SCHEMA
    assert set(SCHEMA["properties"]) == set(SECTIONS)


def content(text):
    """A scene as editors read it: no text is a date or a truth value but true and false."""

    class Loader(yaml.SafeLoader):
        pass

    kept = {"tag:yaml.org,2002:timestamp", "tag:yaml.org,2002:bool"}
    Loader.yaml_implicit_resolvers = {
        first: [(tag, form) for tag, form in pairs if tag not in kept]
        for first, pairs in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }
    Loader.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile("^(true|false)$"), "tf")
    return yaml.load(text, Loader)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_shipped_scenes_are_valid(path):
    assert [e.message for e in VALIDATOR.iter_errors(content(path.read_text()))] == []


@pytest.mark.parametrize("text", PAGE)
def test_scenes_of_the_language_page_are_valid(text):
    assert [e.message for e in VALIDATOR.iter_errors(content(text))] == []


def keys_of(schema):
    """Yield the mappings of a schema whose keys are fixed: where they stand, and their keys."""
    for alternative in schema.get("anyOf", ()):
        yield from keys_of(alternative)
    if schema.get("additionalProperties") is False:
        yield schema["properties"]
    for part in (*schema.get("properties", {}).values(), schema.get("items")):
        if isinstance(part, dict):
            yield from keys_of(part)
    if isinstance(schema.get("additionalProperties"), dict):
        yield from keys_of(schema["additionalProperties"])


#: A scene with a mapping of each kind, each with a key that there is not.
WRONG = """
sizes: {n: 2}
parameters: {m: {value: 1, zzz: 1}}
inputs: {u: {file: a.csv, column: b, zzz: 1}}
states:
  i: {rate: 1, zzz: 1}
  r: {on: x > 1, off: x < 0, zzz: 1}
controllers:
  one: {every: 1, hold: {u: 1}, zzz: 1}
  two: {every: 1, hold: {u: 1}, memory: {w: {next: 1, zzz: 1}}}
functions:
  V: {of: r, zzz: 1}
  T: {of: r, file: a.csv, column: b, zzz: 1}
particles: {a: {mass: m, zzz: 1}}
frames:
  d1: {at: [0, 0, 1], zzz: 1}
  d2: {turn: {z: x, zzz: 1}}
bodies:
  e0: {mass: 1, inertia: [1, 1, 1], zzz: 1}
  e1: {mass: 1, inertia: {rod: 1, zzz: 1}}
  e2: {mass: 1, inertia: {disk: 1, zzz: 1}}
  e3: {mass: 1, inertia: {sphere: 1, zzz: 1}}
  e4: {mass: 1, inertia: {cylinder: [1, 1], zzz: 1}}
  e5: {mass: 1, inertia: {box: [1, 1, 1], zzz: 1}}
  e6: {mass: 1, inertia: {about: origin, moments: [1, 1, 1], zzz: 1}}
points:
  b: {position: [0, 0, 0], zzz: 1}
  d: {on: d1, at: [0, 0, 0], zzz: 1}
coordinates: {x: {zzz: 1}}
definitions: {h: {equals: x, zzz: 1}}
constraints:
  c1: {distance: [a, b], equals: 1, zzz: 1}
  c2: {unilateral: x >= 0, zzz: 1}
  c3: {equation: x = 0, zzz: 1}
  c4: {pin: [a, b], zzz: 1}
  c5: {parallel: [x, [y, e1]], zzz: 1}
  c6: {weld: [d1, e1], zzz: 1}
  c7: {touch: e1, radius: 1, on: d1, zzz: 1}
  c8: {roll: e1, radius: 1, on: d1, zzz: 1}
  c9: {roll: e1, radius: 1, on: {normal: z, zzz: 1}}
  ca: {roll: e1, radius: 1, on: {sphere: 2, zzz: 1}}
  cb: {roll: e1, radius: 1, on: {cylinder: 2, axis: y, zzz: 1}}
potentials:
  p1: {gravity: g, zzz: 1}
  p2: {spring: [a, b], stiffness: 1, zzz: 1}
  p3: {newton: 1, zzz: 1}
  p4: {coulomb: 1, charges: {a: 1, b: 1}, zzz: 1}
forces:
  f1: {on: a, force: [1, 0, 0], zzz: 1}
  f2: {drag: 1, on: a, zzz: 1}
  f3: {damper: [a, b], coefficient: 1, zzz: 1}
  f4: {on: e1, torque: [0, 0, 0], zzz: 1}
simulate: {zzz: 1}
expect: {zzz: 1, events: [{name: "contact:c", zzz: 1}], error: {zzz: 1}}
"""


def test_keys_are_those_that_the_reader_takes():
    """The reader lists what it knows beside each key that it does not."""
    read = set()
    right = WRONG.replace(", zzz: 1", "").replace("zzz: 1, ", "").replace("{zzz: 1}", "{}")
    for wrong, line in zip(WRONG.splitlines(), right.splitlines(), strict=True):
        if wrong == line:
            continue
        # One mistake a scene: after one, what others refer to is not looked at.
        with pytest.raises(InputError) as refusal:
            loads(right.replace(line, wrong))
        for problem in refusal.value.problems:
            if problem.message.startswith("unknown key 'zzz'"):
                read.add(frozenset(problem.hint.removeprefix("known are ").split(", ")))
    schema = {frozenset(keys) for keys in keys_of(SCHEMA)} - {frozenset(SECTIONS)}
    assert read == schema
