"""Hooks, the action, the job and the Makefile do what docs/pipelines says, without a network."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

ROOT = Path(__file__).parents[1]
PIPELINES = ROOT / "docs" / "pipelines"

BEAD = """\
particles: {bead: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
expect: {dof: DOF}
"""


@pytest.fixture
def folder(tmp_path):
    """A folder with a scene that passes and one that fails, and ``lagrange`` on the path."""
    (tmp_path / "scenes").mkdir()
    for name, dof in (("good", 1), ("bad", 2)):
        (tmp_path / "scenes" / f"{name}.yaml").write_text(BEAD.replace("DOF", str(dof)))
    program = tmp_path / "bin" / "lagrange"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m lagrange_cli "$@"\n')
    program.chmod(0o755)
    return tmp_path


def run(folder: Path, words: str, **variables: str) -> subprocess.CompletedProcess[str]:
    path = f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PATH": path, **variables}
    return subprocess.run(
        ["bash", "-ec", words], cwd=folder, env=environment, capture_output=True, text=True
    )


@pytest.mark.slow
def test_hooks(folder):
    hooks = {h["id"]: h for h in yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())}
    assert all(re.search(hook["files"], "systems/a/b.yaml") for hook in hooks.values())
    both = "scenes/good.yaml scenes/bad.yaml"
    done = run(folder, f"{hooks['lagrange-check']['entry']} {both}")
    assert (done.returncode, "good.yaml" in done.stdout) == (1, False)
    assert run(folder, f"{hooks['lagrange-fmt']['entry']} {both} --check").returncode == 0


@pytest.mark.slow
def test_action(folder):
    action = yaml.safe_load((ROOT / ".github" / "actions" / "check" / "action.yml").read_text())
    (step,) = [s for s in action["runs"]["steps"] if s["name"] == "Check scenes"]
    options = action["inputs"]["options"]["default"]
    done = run(folder, step["run"], PATHS="scenes", OPTIONS=f"{options} --timeout 60")
    assert done.returncode == 1
    assert done.stdout.startswith("::error file=scenes/bad.yaml,line=3,col=15,title=fail%3A dof::")


@pytest.mark.slow
def test_job_of_gitlab(folder):
    job = yaml.safe_load((PIPELINES / "gitlab.yml").read_text())["lagrange"]
    prepare = job["before_script"][1]
    done = run(folder, "\n".join([prepare, *job["script"]]), SCENES=job["variables"]["SCENES"])
    assert done.returncode == 1
    reports = job["artifacts"]["reports"]
    (problem,) = json.loads((folder / reports["codequality"]).read_text())
    assert problem["location"] == {"path": "scenes/bad.yaml", "lines": {"begin": 3}}
    suite = ElementTree.parse(folder / reports["junit"]).getroot()[0]
    assert (suite.get("tests"), suite.get("failures")) == ("2", "1")


@pytest.mark.latex
@pytest.mark.slow
@pytest.mark.skipif(not (shutil.which("make") and shutil.which("pdflatex")), reason="no make")
def test_makefile(folder):
    command = f"make -f {PIPELINES / 'Makefile'} PDFS=out"
    done = run(folder, command)
    assert done.returncode == 0, done.stdout + done.stderr
    assert sorted(path.name for path in (folder / "out").glob("*.pdf")) == ["bad.pdf", "good.pdf"]
    assert "Nothing to be done" in run(folder, command).stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion(folder, shell):
    page = (PIPELINES / "README.md").read_text()
    assert f"_LAGRANGE_COMPLETE={shell}_source lagrange" in page
    source = run(folder, f"_LAGRANGE_COMPLETE={shell}_source lagrange").stdout
    if shutil.which(shell):
        subprocess.run([shell, "-n"], input=source, text=True, check=True)
    for words, expected in (("lagrange che", "check"), ("lagrange check --si", "--simulate")):
        number = str(len(words.split()) - 1)
        place = words.split()[-1] if shell == "fish" else number
        variables = {"COMP_WORDS": words, "COMP_CWORD": place}
        completed = run(folder, "lagrange", _LAGRANGE_COMPLETE=f"{shell}_complete", **variables)
        assert expected in completed.stdout
