"""Hostile scenes: each is refused at its place, at once, and nothing in it runs."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from tests.cli.terminal import lagrange

pytestmark = pytest.mark.slow

SCENE = """\
name: hostile
parameters: {{m: 1, l: 1, g: 9.81}}
particles:
  bob: {{mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta]
potentials:
  weight: {}
initial: {{theta: 0.1}}
simulate: {{until: 1}}
"""

BOMB = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]\n" for n in range(1, 10)
)

HOSTILE = {
    "import": SCENE.format("""'__import__("os").system("touch owned")'"""),
    "attribute": SCENE.format("'().__class__.__bases__[0].__subclasses__()'"),
    "format string": SCENE.format("'{theta.__class__}'"),
    "lambda": SCENE.format('\'(lambda: open("owned", "w"))()\''),
    "tag": "!!python/object/apply:os.system ['touch owned']\n",
    "tag in a section": SCENE.format("!!python/object/apply:os.system ['touch owned']"),
    "parentheses": SCENE.format("(" * 10_000 + "theta" + ")" * 10_000),
    "minus signs": SCENE.format("'" + "-" * 10_000 + "theta'"),
    "nested calls": SCENE.format("sin(" * 4_000 + "theta" + ")" * 4_000),
    "tower": SCENE.format("9^9^9^9"),
    "tower of stars": SCENE.format("9**9**9**9"),
    "exponent": SCENE.format("theta*1e999999999"),
    "power": SCENE.format("(theta + 1)^1000000000"),
    "bomb": BOMB,
    "flow depth": "[" * 100_000,
    "block depth": "".join(" " * n + "a:\n" for n in range(2_000)),
    "empty": "",
    "spaces": "  \n\n",
    "comment": "# nothing here\n",
    "list": "- 1\n- 2\n",
    "tab": "name: hostile\nparameters:\n\tm: 1\n",
    "binary": bytes(range(256)) * 64,
    "zeros": b"\0" * 4096,
    "latin": "name: h\xf6stile\n".encode("latin-1"),
    "escapes": SCENE.format("'\x1b[2Jtheta'").encode(),
    "long": SCENE.format("+".join(["theta"] * 10_000)),
    "large": "name: " + "x" * 5 * 2**20,
    "billion digits": SCENE.format("1" * 30_000),
    "duplicate": "name: a\nname: b\n",
    "path for a name": SCENE.format("m").replace("hostile", "../../owned"),
    "command for a name": SCENE.format("m").replace("hostile", "'$(touch owned)'"),
}


def run_in(folder, *words: str, input: bytes | None = None):
    return subprocess.run(
        [sys.executable, "-m", "lagrange_cli", *words],
        cwd=folder,
        capture_output=True,
        timeout=20,
        input=input,
    )


@pytest.mark.parametrize("name", HOSTILE)
def test_refused_at_its_place_and_nothing_runs(name, tmp_path):
    content = HOSTILE[name]
    path = tmp_path / "scene.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    done = lagrange("derive", "scene.yaml", cwd=tmp_path)
    message = done.stderr
    assert done.returncode == 2, message
    assert done.stdout == ""
    assert message.startswith("scene.yaml:"), message
    line, column = message.split(":")[1:3]
    assert int(line) >= 1
    assert int(column) >= 1
    assert "Traceback" not in message
    assert "internal error" not in message
    assert len(message) < 4_000
    assert os.listdir(tmp_path) == ["scene.yaml"]
    assert all(c >= " " or c == "\n" for c in message), "control characters are escaped"


def test_from_standard_input(tmp_path):
    done = run_in(tmp_path, "derive", "-", input=b"\0\1\2")
    assert done.returncode == 2
    assert done.stderr.startswith(b"<stdin>:1:1: ")


@pytest.mark.parametrize("path", ["missing.yaml", ".", "/dev/zero", "a\nb", "x" * 5000])
def test_path_that_is_no_scene(path, tmp_path):
    done = run_in(tmp_path, "derive", path)
    message = done.stderr.decode()
    assert done.returncode == 2, message
    assert "Traceback" not in message
    assert len(message.splitlines()) <= 2
