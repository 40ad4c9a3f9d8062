"""The settings of docs/editors.md in the editors that are installed: a mistake, its end, hovering.

Helix and the client of VS Code are in no package registry; their settings are read alone.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]

SCENE = """\
parameters: {m: 1, l: 2, g: 9.81}
plane: xz
particles:
  bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}
coordinates: [theta]
potentials: {weight: m*g*z_bb}
"""

#: Seconds after which an editor is ended that goes on.
PATIENCE = 240

#: What an editor does after it was started with the settings of the page.
EMACS = """
(find-file "scene.yaml")
(yaml-mode)
(let ((eglot-sync-connect t)) (call-interactively 'eglot))
(defun problems () (mapcar #'flymake-diagnostic-text (flymake-diagnostics)))
(defun await (test) (while (not (funcall test)) (accept-process-output nil 0.05)))
(await (lambda () (problems)))
(defvar first-problems (problems))
(search-forward "z_bb")
(replace-match "z_bob")
(eglot--signal-textDocument/didChange)
(await (lambda () (not (problems))))
(goto-char (point-min))
(search-forward "coordinates: [the")
(defvar hover (jsonrpc-request (eglot-current-server) :textDocument/hover
                               (eglot--TextDocumentPositionParams)))
(defvar shown (plist-get (plist-get hover :contents) :value))
(with-temp-file "answers.json"
  (insert (json-encode `((problems . ,(vconcat first-problems)) (hover . ,shown)))))
"""
NEOVIM = """
local function await(test) assert(vim.wait(120000, test, 50)) end
vim.cmd("edit scene.yaml")
await(function() return #vim.diagnostic.get(0) > 0 end)
local problems = vim.tbl_map(function(d) return d.message end, vim.diagnostic.get(0))
vim.cmd("%s/z_bb/z_bob/")
await(function() return #vim.diagnostic.get(0) == 0 end)
vim.fn.search("coordinates: \\\\[the", "e")
local place = vim.lsp.util.make_position_params(0, "utf-16")
local answers = vim.lsp.buf_request_sync(0, "textDocument/hover", place, 60000)
local _, answer = next(answers)
local shown = { problems = problems, hover = answer.result.contents.value }
vim.fn.writefile({ vim.fn.json_encode(shown) }, "answers.json")
"""


def settings(editor: str) -> list[str]:
    """Return the blocks below the heading of an editor."""
    page = (ROOT / "docs" / "editors.md").read_text(encoding="utf-8")
    _, _, section = page.partition(f"\n## {editor}\n")
    return re.findall(r"```\w+\n(.*?)```", section.partition("\n## ")[0], re.DOTALL)


def edited(folder: Path, command: list[str]) -> dict[str, Any]:
    """Let an editor that is alone with the program and a home of its own edit a scene."""
    (folder / "scene.yaml").write_text(SCENE)
    program = folder / "bin" / "lagrange"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m lagrange_cli "$@"\n')
    program.chmod(0o755)
    environment = {
        **os.environ,
        "HOME": str(folder),
        "PATH": f"{program.parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]),
    }
    done = subprocess.run(
        command,
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    answers = folder / "answers.json"
    assert answers.exists(), done.stderr + done.stdout
    told: dict[str, Any] = json.loads(answers.read_text(encoding="utf-8"))
    return told


def require_answers(told: dict[str, Any]) -> None:
    (problem,) = told["problems"]
    assert "unknown name 'z_bb' in potential 'weight'" in problem
    assert "**theta**: generalized coordinate" in told["hover"]


def test_emacs(tmp_path: Path) -> None:
    emacs = shutil.which("emacs")
    if emacs is None:
        pytest.skip("apt-get install emacs-nox elpa-yaml-mode elpa-eglot brings Emacs")
    start = [emacs, "--batch", "--eval", "(progn (require 'package) (package-initialize))"]
    needed = "(unless (and (require 'eglot nil t) (require 'yaml-mode nil t)) (kill-emacs 1))"
    if subprocess.run([*start, "--eval", needed], capture_output=True, check=False).returncode:
        pytest.skip("Emacs lacks eglot or yaml-mode")
    (block,) = settings("Emacs")
    (tmp_path / "init.el").write_text(f"(require 'json)\n{block}\n(require 'eglot)\n{EMACS}")
    require_answers(edited(tmp_path, [*start, "-l", "init.el"]))


def test_neovim(tmp_path: Path) -> None:
    nvim = shutil.which("nvim")
    if nvim is None:
        pytest.skip("apt-get install neovim brings Neovim")
    has_configurations = subprocess.run(
        [nvim, "--headless", "-u", "NONE", "+lua os.exit(vim.lsp.config and 0 or 1)"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
    )
    present, earlier = settings("Neovim")
    chosen = earlier if has_configurations.returncode else present
    (tmp_path / "init.lua").write_text(chosen)
    (tmp_path / "drive.lua").write_text(f"pcall(function()\n{NEOVIM}\nend)\nvim.cmd('qa!')\n")
    command = [nvim, "--headless", "-u", "init.lua", "-c", "luafile drive.lua"]
    require_answers(edited(tmp_path, command))


def test_helix_and_the_client_of_vs_code_start_the_server() -> None:
    (block,) = settings("Helix")
    languages = tomllib.loads(block)
    assert languages["language-server"]["lagrange"] == {"command": "lagrange", "args": ["lsp"]}
    assert languages["language"] == [{"name": "yaml", "language-servers": ["lagrange"]}]
    (block,) = settings("VS Code")
    assert json.loads(block) == {
        "glspc.server.command": "lagrange",
        "glspc.server.commandArguments": ["lsp"],
        "glspc.server.languageId": ["yaml"],
    }
