"""Exact texts of refusals: each scene in ``cases/`` beside what is reported for it.

``pytest tests/errors --update-goldens`` writes the expected texts anew; read the
difference before you commit it.
"""

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
def test_error_text(name: str, updates: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(CASES)
    found = reported(name)
    expected = CASES / f"{Path(name).stem}.stderr"
    if updates:
        expected.write_text(found, encoding="utf-8")
    assert found == expected.read_text(encoding="utf-8")
    assert found


def test_every_expectation_has_its_scene() -> None:
    assert len(SCENES) > 50
    assert {Path(name).stem for name in SCENES} == {p.stem for p in CASES.glob("*.stderr")}
