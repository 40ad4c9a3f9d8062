"""Output is the same byte by byte, whatever the hash seed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.systems.shipped import REFUSED, SCENES, SLICE

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
ALL = sorted(path.relative_to(ROOT) for path in (*SCENES.values(), *REFUSED))

#: Derives and emits scenes in one process and prints all of it.
PROGRAM = """
import gc, json, sys
from lagrange_cli import InputError, load
from lagrange_cli.cli.main import COLLECTION
from lagrange_cli.api.emitters import EMITTERS

gc.set_threshold(*COLLECTION)
for path in sys.argv[1:]:
    print("#", path)
    try:
        derivation = load(path).derive()
    except InputError as refusal:
        print(refusal)
        continue
    print(derivation)
    for form in ("lagrange", "explicit"):
        print(json.dumps(derivation.report(form=form)))
    for name in EMITTERS:
        try:
            print(derivation.emit(name))
        except InputError as refusal:
            print(refusal)
    print(derivation.equations.derivation.warnings, derivation.equations.derivation.remarks)
"""


def printed(seed: str, scenes: list[Path]) -> dict[bytes, bytes]:
    """What a process with this seed prints, by scene."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *map(str, scenes)],
        cwd=ROOT,
        env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONIOENCODING": "utf-8"},
        capture_output=True,
        timeout=600,
        check=True,
    )
    sections = re.split(rb"^# (systems/\S+)\n", done.stdout, flags=re.MULTILINE)[1:]
    return dict(zip(sections[::2], sections[1::2], strict=True))


@pytest.mark.parametrize(
    "scenes",
    [
        pytest.param([path for path in ALL if path.stem in SLICE][::3], id="slice"),
        pytest.param(ALL, id="all", marks=pytest.mark.campaign),
    ],
)
def test_hash_seed_changes_nothing(scenes):
    first, second = (printed(seed, scenes) for seed in "12")
    assert [*first] == [str(path).encode() for path in scenes]
    assert all(first.values())
    assert [path for path in first if first[path] != second[path]] == []
