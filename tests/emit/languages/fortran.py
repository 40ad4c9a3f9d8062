"""Fortran as gfortran compiles it, where every warning is an error."""

from __future__ import annotations

from typing import ClassVar

from tests.emit.languages.drivers import MODED, Driver, executed, sizes_of

COMPILE = ["gfortran", "-std=f2018", "-Wall", "-Wextra", "-pedantic", "-Werror"]

_PROGRAM = """\
program calls
  use, intrinsic :: iso_fortran_env, only: real64, iostat_end
  implicit none
  integer :: scene, number, status
  character(len=100000) :: line
  do
    read (*, '(a)', iostat=status) line
    if (status == iostat_end) exit
    read (line, *) scene, number
    select case (scene)
@CASES@
    end select
  end do
contains
@SCENES@
  subroutine show(out, status)
    real(real64), intent(in) :: out(:)
    integer, intent(in) :: status
    if (status /= 0) then
      print '(*(a, :, " "))', spread('nan', 1, size(out))
    else
      print '(*(g0, :, " "))', out
    end if
  end subroutine show
end program calls
"""

_SCENE = """\
  subroutine scene@K@(line, number)
    @USED@
    character(len=*), intent(in) :: line
    integer, intent(in) :: number
    type(parameters) :: p
    real(real64) :: t, y(@STATES@), numbers(@PARAMETERS@), u(@INPUTS@)
    real(real64), allocatable :: out(:)
    integer :: ignored(2), status, event, mode(@CONTACTS@)
    real(real64) :: bounce, happening, flags(@CONTACTS@)
    allocate (out(@LARGEST@))
    read (line, *) ignored, t, y, numbers, u, flags
    mode = nint(flags)
    event = 0
    bounce = 1
    happening = 0
    p = parameters(@VALUES@)
    select case (number)
@CALLS@
    end select
  end subroutine scene@K@
"""


class Fortran(Driver):
    language = "fortran"
    programs = ("gfortran",)
    options: ClassVar = {"main": True}

    def emitted(self, equations, folder, *, jacobian=False):
        module = super().emitted(equations, folder, jacobian=jacobian)
        (path,) = module.files
        text = path.read_text(encoding="utf-8")
        assert max(map(len, text.splitlines())) <= 132
        (folder / "module.f90").write_text(text[: text.index("\n!> Integrates")])
        return module

    def build(self, folder, modules):
        paths = [module.folder / "module.f90" for module in modules]
        cases = [
            f"    case ({k})\n      call scene{k}(line, number)" for k, _ in enumerate(modules)
        ]
        scenes = [_scene(k, module) for k, module in enumerate(modules)]
        program = folder / "calls.f90"
        text = _PROGRAM.replace("@CASES@", "\n".join(cases))
        program.write_text(text.replace("@SCENES@", "\n".join(scenes)))
        words = [*COMPILE, "-O0", *paths, program, "-o", folder / "calls"]
        executed(words, "", folder)
        return [str(folder / "calls")]

    def script(self, module, words):
        program = module.folder / "main"
        if not program.exists():
            executed([*COMPILE, "-O1", *module.files, "-o", program], "", module.folder)
        return [str(program), *words]


def _scene(k, module):
    interface = module.interface
    count, sizes = len(interface.parameters), sizes_of(interface)
    calls = []
    for number, name in enumerate(module.functions):
        calls.append(f"    case ({number})")
        calls += [f"      {line}" for line in _call(name, interface, sizes)]
    name = next(
        line.split()[1] for line in (module.folder / "module.f90").read_text().splitlines()
        if line.startswith("module ")
    )  # fmt: skip
    used = [f"use {name}, only: parameters", *module.functions]
    replacements = {
        "@K@": str(k),
        "@USED@": ", &\n      ".join(used),
        "@STATES@": str(interface.layout.size),
        "@PARAMETERS@": str(count),
        "@INPUTS@": str(len(interface.inputs)),
        "@CONTACTS@": str(_contacts(interface)),
        "@LARGEST@": str(max(1, *(size or 0 for size in sizes.values()))),
        "@VALUES@": ", &\n      ".join(
            ", ".join(f"numbers({i + 1})" for i in range(start, min(start + 6, count)))
            for start in range(0, count, 6)
        ),
        "@CALLS@": "\n".join(calls),
    }
    text = _SCENE
    for token, value in replacements.items():
        text = text.replace(token, value)
    return text


def _contacts(interface):
    return 0 if interface.contacts is None else interface.contacts.count


def _call(name, interface, sizes):
    """Return the lines that call a function and print its results."""
    driven = interface.inputs and (name != "inputs" or interface.recorded)
    passed = f"t, y, {'u, ' if driven else ''}p"
    passed += ", mode" if interface.contacts is not None and name in MODED else ""
    if name == "reset":
        # With a mode, so many flags are read before the event.
        return [
            "read (line, *) ignored, t, y, numbers, u, flags, happening, bounce",
            "event = nint(happening)",
            f"call reset({passed}, event, bounce, status)",
            "call show([y, real(mode, real64)], status)",
        ]
    if name == "project":
        return [f"call project({passed}, status)", "call show(y, status)"]
    size = sizes[name]
    out, shown = ("out", f"out(:{size})") if size is not None else ("out(1)", "out(:1)")
    return [f"call {name}({passed}, {out}, status)", f"call show({shown}, status)"]
