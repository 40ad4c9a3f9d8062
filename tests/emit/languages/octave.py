"""Octave without a window; MATLAB is not tried."""

from __future__ import annotations

from typing import ClassVar

from tests.emit.languages.drivers import Driver

_OCTAVE = ["octave-cli", "--norc", "--no-history", "--eval"]

_PROGRAM = """\
warning('error', 'Octave:undefined-function');
lines = strsplit(strtrim(fread(stdin, Inf, 'char=>char').'), "\\n");
for line = lines
  v = sscanf(line{1}, '%f');
  f = modules{v(1) + 1};
  at = 4;
  k = 0; if isfield(f, 'states'), k = numel(f.states); end
  y = v(at:at + 2*numel(f.coordinates) + k - 1); at = at + numel(y);
  count = numel(f.parameters);
  p = cell2struct(num2cell(v(at:at + count - 1)), fieldnames(f.defaults), 1); at = at + count;
  more = {}; count = numel(f.input_names);
  if count > 0, more = {v(at:at + count - 1)}; at = at + count; end
  name = names{v(1) + 1}{v(2) + 1};
  if strcmp(name, 'inputs') && ~isfield(f, 'recorded'), more = {}; end
  if isfield(f, 'contacts')
    count = numel(f.contacts); mode = v(at:at + count - 1); at = at + count;
    if any(strcmp(name, {'rhs', 'multipliers', 'constraints', 'events', 'project', 'reset'}))
      more{end + 1} = mode;
    end
  end
  if strcmp(name, 'reset')
    [y, mode] = f.reset(v(3), y, p, more{:}, v(at), v(at + 1));
    out = [y; mode];
  else
    out = f.(name)(v(3), y, p, more{:});
  end
  assert(isreal(out));
  fprintf('%s\\n', sprintf('%.17g ', out.'));
end
"""


class Octave(Driver):
    language = "octave"
    programs = ("octave-cli",)
    has_solvers: ClassVar = True
    is_slow: ClassVar = True

    def build(self, folder, modules):
        lines = []
        for k, module in enumerate(modules):
            names = ", ".join(f"'{name}'" for name in module.functions)
            lines.append(f"addpath('{module.folder}');")
            lines.append(f"modules{{{k + 1}}} = {module.files[0].stem}();")
            lines.append(f"names{{{k + 1}}} = {{{names}}};")
        program = folder / "calls.m"
        program.write_text("\n".join([*lines, _PROGRAM]))
        return [*_OCTAVE, f"source('{program}')"]

    def script(self, module, words):
        given = ", ".join(f"'{word}'" for word in words)
        return [*_OCTAVE, f"{module.files[0].stem}({given})"]
