"""Rust as ``rustc`` compiles it, all modules in one crate."""

from __future__ import annotations

from lagrange_cli.emit.languages.interface import interface_of
from lagrange_cli.emit.languages.rust import Rust as RustLanguage
from tests.emit.languages.drivers import MODED, Driver, executed, sizes_of

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


def _call(k, number, name, interface, sizes):
    """A branch that reads the arguments of a function and calls it."""
    named, n, contacts = f"m{k}::{name}", interface.layout.size, interface.contacts
    fields = "".join(f"{p.identifier}: next(), " for p in interface.parameters)
    changed = "mut " if name in ("project", "reset") else ""
    lines = [
        "let t = next();",
        f"let {changed}y: [f64; {n}] = std::array::from_fn(|_| next());",
        f"let p = m{k}::Params {{ {fields}}};",
    ]
    passed = f"t, &{changed}y, "
    if interface.inputs and (name != "inputs" or interface.recorded):
        lines.append(f"let u: [f64; {len(interface.inputs)}] = std::array::from_fn(|_| next());")
        passed += "&u, "
    passed += "&p"
    if name in MODED and contacts is not None:
        mut = "mut " if name == "reset" else ""
        array = f"[usize; {contacts.count}]"
        lines.append(f"let {mut}mode: {array} = std::array::from_fn(|_| next() as usize);")
        passed += f", &{mut}mode"
    if name == "reset":
        lines.append("let event = next() as usize;")
        lines.append(f"let event = if event > 0 {{ event - 1 }} else {{ {contacts.count} }};")
        lines.append(f"let moves = {named}({passed}, event, next()).is_ok();")
        lines.append("let all = y.iter().copied().chain(mode.map(|k| k as f64));")
        lines.append("all.map(|x| if moves { x } else { f64::NAN }).collect()")
    elif name == "project":
        lines += [f"{named}({passed}).unwrap();", "y.to_vec()"]
    elif sizes[name] is not None:
        lines.append(f"let mut out = [0.0; {sizes[name]}];")
        lines += [f"{named}({passed}, &mut out).unwrap();", "out.to_vec()"]
    else:
        lines.append(f"vec![{named}({passed}).unwrap()]")
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
                module.equations, RustLanguage.reserved, jacobian=module.jacobian
            )
            sizes = sizes_of(interface)
            for number, name in enumerate(module.functions):
                calls.append(_call(k, number, name, interface, sizes))
        program = folder / "calls.rs"
        program.write_text("".join(heads) + _PROGRAM.replace("@CALLS@", "".join(calls)))
        executed(["rustc", *FLAGS, program, "-o", folder / "calls"], "", folder)
        return [str(folder / "calls")]

    def script(self, module, words):
        program = module.files[0].with_suffix("")
        if not program.exists():
            executed(["rustc", *FLAGS, module.files[0], "-o", program], "", module.folder)
        return [str(program), *words]
