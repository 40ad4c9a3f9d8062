"""Output is the same byte by byte, whatever the hash seed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = sorted(p.name for p in (ROOT / "systems").iterdir() if p.is_dir())

#: Derives and emits every scene of a folder in one process and prints all of it.
PROGRAM = """
import json, sys
from lagrange_cli import InputError, load
from lagrange_cli.check.walk import scenes_in
from lagrange_cli.emit.registry import EMITTERS

for path in scenes_in([sys.argv[1]]):
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
        print(derivation.emit(name))
    print(derivation.equations.warnings, derivation.equations.remarks)
"""


def printed(folder: str, seed: str) -> bytes:
    return subprocess.run(
        [sys.executable, "-c", PROGRAM, f"systems/{folder}"],
        cwd=ROOT,
        env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONIOENCODING": "utf-8"},
        capture_output=True,
        timeout=600,
        check=True,
    ).stdout


@pytest.mark.parametrize("folder", FOLDERS)
def test_hash_seed_changes_nothing(folder):
    first = printed(folder, "1")
    assert first.startswith(b"# systems/")
    assert first == printed(folder, "2")
