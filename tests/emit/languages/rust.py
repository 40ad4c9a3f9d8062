"""Rust as ``rustc`` compiles it, all modules in one crate."""

from __future__ import annotations

from lagrange_cli.emit.languages.interface import interface_of
from lagrange_cli.emit.languages.rust import Rust as RustLanguage
from tests.emit.languages.drivers import Driver, executed

FLAGS = ("--edition", "2021", "-D", "warnings", "-C", "debuginfo=0")

_PROGRAM = """\
fn main() {
    for line in std::io::stdin().lines() {
        let line = line.unwrap();
        let (k, numbers) = line.split_once(' ').unwrap();
        let (f, numbers) = numbers.split_once(' ').unwrap();
        let mut numbers = numbers.split(' ').map(|x| x.parse::<f64>().unwrap());
        let mut next = || numbers.next().unwrap();
        let results: Vec<f64> = match (k, f) {
@CALLS@            _ => unreachable!(),
        };
        println!("{}", results.iter().map(|x| format!("{x:e}")).collect::<Vec<_>>().join(" "));
    }
}
"""


def _call(k, number, function, interface):
    """A branch that reads the arguments of a function and calls it."""
    named, n = f"m{k}::{function.name}", interface.layout.size
    fields = "".join(f"{p.identifier}: next(), " for p in interface.parameters)
    lines = [
        "let t = next();",
        f"let y: [f64; {n}] = std::array::from_fn(|_| next());",
        f"let p = m{k}::Params {{ {fields}}};",
    ]
    passed = "t, &y, "
    if interface.inputs and function.name != "inputs":
        lines.append(f"let u: [f64; {len(interface.inputs)}] = std::array::from_fn(|_| next());")
        passed += "&u, "
    if function.shape:
        size = 1
        for length in function.shape:
            size *= length
        lines.append(f"let mut out = [0.0; {size}];")
        lines += [f"{named}({passed}&p, &mut out).unwrap();", "out.to_vec()"]
    else:
        lines.append(f"vec![{named}({passed}&p).unwrap()]")
    return "\n".join([f'("{k}", "{number}") => {{', *lines, "}\n"])


class Rust(Driver):
    language = "rust"
    programs = ("rustc",)
    options = {"main": True}  # noqa: RUF012

    def build(self, folder, modules):
        calls, heads = [], []
        for k, module in enumerate(modules):
            heads.append(f'#[path = "{module.files[0]}"]\nmod m{k};\n')
            interface = interface_of(
                module.equations, "rust", RustLanguage.reserved, jacobian=module.jacobian
            )
            for number, (function, _) in enumerate(interface.functions):
                calls.append(_call(k, number, function, interface))
        program = folder / "calls.rs"
        program.write_text("".join(heads) + _PROGRAM.replace("@CALLS@", "".join(calls)))
        executed(["rustc", *FLAGS, program, "-o", folder / "calls"], "", folder)
        return [str(folder / "calls")]

    def script(self, module, words):
        program = module.files[0].with_suffix("")
        if not program.exists():
            executed(["rustc", *FLAGS, module.files[0], "-o", program], "", module.folder)
        return [str(program), *words]
