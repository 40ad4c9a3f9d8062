"""The pages of this folder as PDF, the same bytes wherever the same LaTeX runs.

    python docs/steps/typeset.py

Each page of README.md that names a PDF is written by ``emit --to latex --steps`` and typeset by
pdfLaTeX, without dates and without the identifiers that pdfLaTeX makes up. The subject of a PDF is
the SHA-256 of its LaTeX, by which a test tells that it is the page of today.
"""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import tempfile
from pathlib import Path

from lagrange_cli import load

HERE = Path(__file__).resolve().parent
SYSTEMS = HERE.parents[1] / "systems"

_LISTED = re.compile(r"\]\((\w+)\.pdf\).*?\]\(\.\./\.\./systems/([\w/]+\.yaml)\)")

_OPENING = (
    r"\pdftrailerid{}\pdfsuppressptexinfo=-1\pdfinfoomitdate=1\pdfinfo{/Subject (%s)}\input{page}"
)


def listed() -> dict[str, Path]:
    """The PDFs that README.md names, each with its scene."""
    found = _LISTED.findall((HERE / "README.md").read_text(encoding="utf-8"))
    return {name: SYSTEMS / scene for name, scene in found}


def source(scene: Path) -> str:
    """The LaTeX of a page."""
    (text,) = load(scene).derive(steps="lagrange").emit("latex").values()
    return text


def digest(text: str) -> str:
    """The subject of a PDF."""
    return hashlib.sha256(text.encode()).hexdigest()


def typeset(text: str, target: Path) -> None:
    """Compile a page.

    Raises
    ------
    subprocess.CalledProcessError
        pdfLaTeX refuses it.
    """
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "page.tex").write_text(text, encoding="utf-8")
        words = ["pdflatex", "-interaction=batchmode", "-halt-on-error", "-no-shell-escape"]
        dates = {"SOURCE_DATE_EPOCH": "0", "FORCE_SOURCE_DATE": "1"}
        subprocess.run(
            [*words, "-jobname=page", _OPENING % digest(text)],
            cwd=folder,
            env=os.environ | dates,
            check=True,
            stdout=subprocess.DEVNULL,
        )
        target.write_bytes((Path(folder) / "page.pdf").read_bytes())


if __name__ == "__main__":
    for name, scene in listed().items():
        typeset(source(scene), HERE / f"{name}.pdf")
        print(f"docs/steps/{name}.pdf")
