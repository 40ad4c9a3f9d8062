"""Outputs of eight scenes byte for byte, as they were last read and approved.

``test_reports`` has the documents of four of them.

``pytest tests/goldens --update-goldens`` writes them anew; read the difference before you
commit it. The version of the program stands as VERSION in them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import pytest

from lagrange_cli import __version__
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.cli.main import run

HERE = Path(__file__).resolve().parent
OUTPUTS = HERE / "outputs"
SYSTEMS = HERE.parents[1] / "systems"


@dataclass(frozen=True)
class Golden:
    """A scene with the options of the commands whose outputs are kept.

    Attributes
    ----------
    scene
        The path below ``systems``.
    derive
        Options of ``derive``, for text and JSON alike.
    emit
        Options of ``emit``, for all formats.
    formats
        Further options of ``emit``, by format.
    documents
        False for code alone: ``test_reports`` has the documents.
    languages
        Languages besides C and Python.
    """

    scene: str
    derive: tuple[str, ...] = ()
    emit: tuple[str, ...] = ()
    formats: tuple[tuple[str, tuple[str, ...]], ...] = ()
    documents: bool = True
    languages: tuple[str, ...] = ()

    def commands(self) -> dict[str, list[str]]:
        """What is run, by the name of the file that takes standard output; "" takes none."""
        scene = str(SYSTEMS / self.scene)
        derivations = {
            f"derive.{suffix}": ["derive", scene, "--format", format_, *self.derive]
            for suffix, format_ in (("txt", "text"), ("json", "json"))
        }
        further = dict(self.formats)
        documents = ("latex", "typst", "html") if self.documents else ()
        emissions = {
            f"({to})": ["emit", scene, "--to", to, "-o", ".", *self.emit, *further.get(to, ())]
            for to in ("c", "python", *self.languages, *documents)
        }
        return derivations | emissions if self.documents else emissions


GOLDENS = {
    "pendulum": Golden("pendulums/pendulum.yaml", documents=False),
    "pendulum_with_multipliers": Golden(
        "pendulums/pendulum.yaml",
        derive=("--form", "multiplier", "--forces"),
        emit=("--formulation", "multiplier"),
        formats=(("fortran", ("--main",)),),
        languages=("cpp", "fortran", "javascript", "octave", "rust"),
    ),
    "double_pendulum": Golden(
        "pendulums/double_pendulum.yaml",
        derive=("--form", "explicit"),
        formats=(("c", ("--main",)), ("latex", ("--form", "explicit", "--style", "snippet"))),
    ),
    "prescribed_motion": Golden("lecture/pendulum_driven_support.yaml", documents=False),
    "dissipation": Golden(
        "pendulums/damped_driven_pendulum.yaml", formats=(("c", ("--real", "float")),)
    ),
    "nonholonomic": Golden("rolling/knife_edge_on_incline.yaml", documents=False),
    "contact": Golden("contact/bouncing_ball.yaml", documents=False),
    "family": Golden("chains/toda_ring.yaml", derive=("-p", "n=5"), emit=("-p", "n=5")),
}


def written(golden: Golden, folder: Path, capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    """Run the commands in a folder, where all their results are files then."""
    for name, words in golden.commands().items():
        assert run([*words, "-q"]) == 0
        printed = capsysbinary.readouterr()
        assert printed.err == b""
        if printed.out:
            (folder / name).write_bytes(printed.out)
    for path in files(folder):
        text = path.read_text(encoding="utf-8").replace(
            f"lagrange {__version__}", "lagrange VERSION"
        )
        text = re.sub("<style>.*</style>", "<style>STYLE</style>", text, flags=re.DOTALL)
        path.write_text(text, encoding="utf-8")


def files(folder: Path) -> list[Path]:
    """The files of a folder, in which compiling all of ``tests`` leaves a folder of bytecode."""
    return sorted(path for path in folder.iterdir() if path.is_file())


def texts(folder: Path) -> dict[str, str]:
    return {path.name: path.read_bytes().decode() for path in files(folder)}


@pytest.mark.slow
@pytest.mark.parametrize("name", GOLDENS)
def test_outputs_are_those_that_were_approved(
    name: str,
    updates: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsysbinary: pytest.CaptureFixture[bytes],
) -> None:
    monkeypatch.chdir(tmp_path)
    written(GOLDENS[name], tmp_path, capsysbinary)
    folder = OUTPUTS / name
    if updates:
        folder.mkdir(parents=True, exist_ok=True)
        for path in files(folder):
            path.unlink()
        for path in tmp_path.iterdir():
            (folder / path.name).write_bytes(path.read_bytes())
    assert texts(tmp_path) == texts(folder)


def test_every_folder_of_outputs_has_its_scene_and_all_formats() -> None:
    assert {path.name for path in OUTPUTS.iterdir()} == set(GOLDENS)
    for folder in OUTPUTS.iterdir():
        golden = GOLDENS[folder.name]
        code = [e for to in ("c", "python", *golden.languages) for e in EMITTERS[to].extensions]
        documents = [".html", ".json", ".tex", ".txt", ".typ"] if golden.documents else []
        assert sorted(path.suffix for path in files(folder)) == sorted([*code, *documents])
