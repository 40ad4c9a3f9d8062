"""JavaScript as Node.js runs it."""

from __future__ import annotations

import json

from tests.emit.languages.drivers import Driver

_PROGRAM = """\
import { readFileSync } from 'node:fs';

const calls = readFileSync(0, 'utf8').trim().split('\\n').map((line) => line.split(' '));
console.log(calls.map(([m, f, ...numbers]) => {
  const [module, names] = MODULES[m];
  const [t, ...rest] = numbers.map(Number);
  const y = rest.splice(0, 2 * module.COORDINATES.length + (module.STATES ?? []).length);
  const p = rest.splice(0, module.PARAMETERS.length);
  const more = module.INPUTS.length ? [rest.splice(0, module.INPUTS.length)] : [];
  if (module.CONTACTS) more.push(rest.splice(0, module.CONTACTS.length));
  let results = module[names[f]](t, y, p, ...more, ...(rest.length ? [rest[0] - 1, rest[1]] : []));
  if (names[f] === 'reset') {
    results = results ? [...results.y, ...results.mode] : [...y, ...more.at(-1)].fill(NaN);
  }
  return [].concat(...[results].map((x) => x.length ? [...x] : x)).join(' ');
}).join('\\n'));
"""


class JavaScript(Driver):
    language = "javascript"
    programs = ("node",)

    def build(self, folder, modules):
        lines = [
            f"import * as m{k} from {json.dumps(str(m.files[0]))};" for k, m in enumerate(modules)
        ]
        named = ", ".join(f"[m{k}, {json.dumps(m.functions)}]" for k, m in enumerate(modules))
        program = folder / "calls.mjs"
        program.write_text("\n".join([*lines, f"const MODULES = [{named}];", _PROGRAM]))
        return ["node", str(program)]

    def script(self, module, words):
        return ["node", str(module.files[0]), *words]
