"""Output is the same byte by byte, whatever the hash seed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = sorted(p.name for p in (ROOT / "systems").iterdir() if p.is_dir())

#: Derives and emits every scene of some folders in one process and prints all of it.
PROGRAM = """
import gc, json, sys
from lagrange_cli import InputError, load
from lagrange_cli.check.walk import scenes_in
from lagrange_cli.cli.main import COLLECTION
from lagrange_cli.emit.registry import EMITTERS

gc.set_threshold(*COLLECTION)
for folder in sys.argv[1:]:
    print("## systems/" + folder)
    for path in scenes_in(["systems/" + folder]):
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
        print(derivation.equations.warnings, derivation.equations.remarks)
"""


@cache
def printed(seed: str) -> dict[str, bytes]:
    """What a process with this seed prints, by folder."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *FOLDERS],
        cwd=ROOT,
        env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONIOENCODING": "utf-8"},
        capture_output=True,
        timeout=600,
        check=True,
    )
    sections = re.split(rb"^## systems/(\w+)\n", done.stdout, flags=re.MULTILINE)[1:]
    return {name.decode(): text for name, text in zip(sections[::2], sections[1::2], strict=True)}


@pytest.mark.parametrize("folder", FOLDERS)
def test_hash_seed_changes_nothing(folder):
    first = printed("1")[folder]
    assert first.startswith(b"# systems/" + folder.encode())
    assert first == printed("2")[folder]
