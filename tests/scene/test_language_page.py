"""The page on the scene language says what is so."""

import re
from pathlib import Path

import pytest

from lagrange_cli.files import MAX_BYTES
from lagrange_cli.mechanics.diagnosis.errors import LARGEST_SYSTEM
from lagrange_cli.mechanics.symbols.convert import LONGEST_ROOT
from lagrange_cli.scene import read_text
from lagrange_cli.scene.language.bounds import MAX_POWER
from lagrange_cli.scene.language.expression import FUNCTIONS
from lagrange_cli.scene.language.families import MAX_FAMILY, MAX_TERMS
from lagrange_cli.scene.language.grammar import MAX_LENGTH
from lagrange_cli.scene.language.parser import MAX_NESTING
from lagrange_cli.scene.language.tokens import MAX_DIGITS, MAX_EXPONENT
from lagrange_cli.scene.reader import SECTIONS
from lagrange_cli.scene.reading.source import MAX_ALIASED, MAX_DEPTH

PAGE = (Path(__file__).parents[2] / "docs" / "scene-language.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("text", EXAMPLES)
def test_examples_are_read_without_warnings(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Tables are read with their scene, in the working folder.
    (tmp_path / "torque.csv").write_text("speed,torque\n0,80\n300,190\n600,0\n")
    monkeypatch.chdir(tmp_path)
    assert read_text(text).warnings == ()


def test_there_are_examples() -> None:
    assert len(EXAMPLES) >= 4


def test_every_section_is_described_and_no_other() -> None:
    table = PAGE.split("## Sections")[1].split("### ")[0]
    rows = re.findall(r"^\| (`.*?`) \|", table, re.MULTILINE)
    described = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    assert sorted(described) == sorted(SECTIONS)


def test_every_function_is_named() -> None:
    listed = re.search(r"Functions: `(.*?)`", PAGE, re.DOTALL)
    assert listed is not None
    assert set(listed[1].split()) | {"dot", "ddot"} == set(FUNCTIONS)


def test_limits() -> None:
    table = PAGE.split("| limit | |")[1]
    numbers = [int(n) for n in re.findall(r"^\| .* \| (\d+)[^|]*\|$", table, re.MULTILINE)]
    limits = [MAX_BYTES // 2**20, MAX_DEPTH, MAX_ALIASED, MAX_LENGTH, MAX_NESTING]
    limits += [MAX_EXPONENT, MAX_DIGITS, LONGEST_ROOT, LARGEST_SYSTEM, MAX_POWER, MAX_FAMILY]
    limits += [MAX_TERMS]
    assert numbers == limits
