"""C++ as ``g++`` compiles it, all headers in one program."""

from __future__ import annotations

from lagrange_cli.emit.languages.cpp import Cpp as CppLanguage
from lagrange_cli.emit.languages.interface import interface_of
from tests.emit.languages.drivers import MODED, Driver, executed

FLAGS = ("-std=c++17", "-Wall", "-Wextra", "-pedantic", "-Werror")

_PROGRAM = """\
#include <cstdio>

static double next()
{
    double x = 0;
    return std::scanf("%lf", &x) == 1 ? x : NAN;
}

template <std::size_t N>
static std::array<double, N> several()
{
    std::array<double, N> numbers{};
    for (double& x : numbers) {
        x = next();
    }
    return numbers;
}

static void print(double x)
{
    std::printf("%.17g ", x);
}

template <std::size_t N>
static void print(const std::array<double, N>& numbers)
{
    for (const double x : numbers) {
        print(x);
    }
}

int main()
{
    int k, f;
    while (std::scanf("%d %d", &k, &f) == 2) {
        const double t = next();
@CALLS@        std::printf("\\n");
    }
}
"""


def _call(k, number, function, interface):
    """A branch that reads the arguments of a function and calls it."""
    space, n = f"m{k}", interface.layout.size
    passed = "t, y, "
    lines = [f"const auto y = several<{n}>();", f"{space}::Params<double> p;"]
    lines += [f"p.{p.identifier} = next();" for p in interface.parameters]
    if interface.inputs:
        lines.append(f"const auto u = several<{len(interface.inputs)}>();")
        given = function != "inputs" or interface.recorded
        passed += "u, p" if given else "(void(u), p)"
    else:
        passed += "p"
    if interface.contacts is not None:
        lines.append(f"{space}::Mode mode{{}};")
        lines.append("for (auto& flag : mode) { flag = next() > 0; }")
        passed += ", mode" if function in MODED else ""
    if function == "reset":
        lines.append("const int event = next();")
        passed += f", event > 0 ? event - 1 : {interface.contacts.count}, next()"
        lines.append(f"const auto behind = {space}::reset({passed});")
        lines.append("for (auto x : behind.y) { print(behind.moves ? x : NAN); }")
        lines.append("for (auto k : behind.mode) { print(behind.moves ? double(k) : NAN); }")
    else:
        lines.append(f"print({space}::{function}({passed}));")
    return "\n".join([f"if (k == {k} && f == {number}) {{", *lines, "}\n"])


class Cpp(Driver):
    language = "cpp"
    programs = ("g++",)
    options = {"main": True}  # noqa: RUF012

    def build(self, folder, modules):
        calls, heads = [], []
        for k, module in enumerate(modules):
            interface = interface_of(
                module.equations, CppLanguage.reserved, jacobian=module.jacobian
            )
            header = module.files[0]
            heads.append(f'#define main main_{k}\n#include "{header}"\n#undef main\n')
            heads.append(f"namespace m{k} = {interface.name};\n")
            for number, function in enumerate(module.functions):
                calls.append(_call(k, number, function, interface))
        program = folder / "calls.cpp"
        program.write_text("".join(heads) + _PROGRAM.replace("@CALLS@", "".join(calls)))
        executed(["g++", *FLAGS, program, "-o", folder / "calls"], "", folder)
        return [str(folder / "calls")]

    def script(self, module, words):
        program = module.files[0].with_suffix("")
        if not program.exists():
            executed(
                ["g++", *FLAGS, "-x", "c++", module.files[0], "-o", program], "", module.folder
            )
        return [str(program), *words]
