"""Exact texts of refusals: each scene in ``cases/`` beside what is reported for it.

``LAGRANGE_UPDATE_ERRORS=1 pytest tests/errors`` rewrites the expected texts; look
at the difference before committing it.
"""

import os
from pathlib import Path

import pytest

from lagrange_cli.errors import InputError, render
from lagrange_cli.scene import read_file

CASES = Path(__file__).parent / "cases"
SCENES = sorted(path.name for path in CASES.glob("*.yaml"))


def reported(name: str) -> str:
    try:
        problems = read_file(name).warnings
    except InputError as error:
        problems = error.problems
    return "".join(render(problem) + "\n" for problem in problems)


@pytest.mark.parametrize("name", SCENES)
def test_error_text(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(CASES)
    found = reported(name)
    expected = CASES / f"{Path(name).stem}.stderr"
    if os.environ.get("LAGRANGE_UPDATE_ERRORS"):
        expected.write_text(found, encoding="utf-8")
    assert found == expected.read_text(encoding="utf-8")
    assert found


def test_every_expectation_has_its_scene() -> None:
    assert len(SCENES) > 50
    assert {Path(name).stem for name in SCENES} == {p.stem for p in CASES.glob("*.stderr")}
