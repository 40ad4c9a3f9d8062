"""The language of docs/languages.md, as a reader runs it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.emit.languages.drivers import executed, require
from tests.emit.languages.reference import calls
from tests.emit.languages.test_languages import TOLERANCE
from tests.systems.shipped import SCENES, derived

PAGE = Path(__file__).parents[3] / "docs" / "languages.md"

_PROGRAM = """\
local M = dofile('scene.lua')
for line in io.lines() do
  local name, numbers = line:match('^(%S+)'), {}
  for x in line:gmatch('%S+') do numbers[#numbers + 1] = tonumber(x) end
  local function taken(first, count)
    local part = {}
    for k = 0, count - 1 do part[k] = numbers[first + k] end
    return part
  end
  local out = M[name](numbers[1], taken(2, @STATES@), taken(2 + @STATES@, @COUNT@))
  local texts = {}
  for k = 0, @MOST@ do if out[k] then texts[#texts + 1] = string.format('%.17g', out[k]) end end
  print(table.concat(texts, ' '))
end
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", ["double_pendulum", "four_bar_linkage"])
def test_a_language_of_ones_own(name, tmp_path):
    require("lua5.4")
    (source,) = re.findall(r"```python\n(.*?class Lua.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    (tmp_path / "lua.py").write_text(source)
    command = [sys.executable, tmp_path / "lua.py", SCENES[name]]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    (tmp_path / "scene.lua").write_text(done.stdout)
    rows = calls(derived(name))
    system = derived(name).system
    n, count = 2 * len(system.coordinates), len(system.parameters)
    program = _PROGRAM.replace("@STATES@", str(n)).replace("@COUNT@", str(count))
    (tmp_path / "calls.lua").write_text(program.replace("@MOST@", str(n * n)))
    lines = [" ".join(map(repr, (c.t, *c.y, *c.p))) for c in rows]
    text = "".join(f"{c.function} {line}\n" for c, line in zip(rows, lines, strict=True))
    printed = executed(["lua5.4", "calls.lua"], text, tmp_path).splitlines()
    for call, line in zip(rows, printed, strict=True):
        assert call.wrong([float(x) for x in line.split()], TOLERANCE) is None
