"""Drivers of languages: how emitted modules are built, called and run.

A driver builds one program that holds all modules that it is given. That program reads calls from
standard input, one a line: numbers of the module and of the function, then t, y, p and u, with
contacts the mode, and for ``reset`` the event (one more than a contact's number; 0 at a start) and
the bounce. It prints a line of results for each, with 17 digits: for ``project`` the state, for
``reset`` state and mode, NaN where nothing follows.
"""

from __future__ import annotations

import math
import os
import shutil
import subprocess
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import pytest

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.emit.languages.interface import Interface, interface_of
from lagrange_cli.mechanics.equations import Equations

#: Functions of contacts that are not lowered: routines, and what calls them.
AROUND = ("events", "project", "reset")

#: Functions that take a mode.
MODED = ("rhs", "multipliers", "constraints", *AROUND)


@dataclass(frozen=True)
class Module:
    """An emitted module.

    Attributes
    ----------
    equations, interface
        Those of the scene; no interface where the language needs none.
    files
        Its files, in a folder of their own.
    jacobian
        It has derivatives of the right-hand side.
    """

    equations: Equations
    interface: Interface | None
    files: tuple[Path, ...]
    jacobian: bool = False

    @property
    def folder(self) -> Path:
        return self.files[0].parent

    @property
    def functions(self) -> list[str]:
        """Names of its functions, in their order, those that take a mode last."""
        contacts = self.interface.contacts
        moded = [] if contacts is None else [*contacts.public, *AROUND]
        return [*(function.name for function, _ in self.interface.functions), *moded]


class Driver(ABC):
    """A language as tests use it.

    Attributes
    ----------
    language
        Its name as a format.
    programs
        Programs that it needs.
    options
        Options of the format, with which a script is written.
    has_solvers
        Its modules solve every system of equations, whatever routines are translated.
    is_slow
        Its scripts take seconds: some are run of those that the suite runs, or a campaign.
    holds_everything
        Scenes that have no interface of functions of a state are not refused.
    """

    language: ClassVar[str]
    programs: ClassVar[tuple[str, ...]] = ()
    options: ClassVar[dict[str, str | bool]] = {}
    has_solvers: ClassVar[bool] = False
    is_slow: ClassVar[bool] = False
    holds_everything: ClassVar[bool] = False

    @abstractmethod
    def build(self, folder: Path, modules: list[Module]) -> list[str]:
        """Return the command that reads calls of functions of the modules."""

    @abstractmethod
    def script(self, module: Module, words: list[str]) -> list[str]:
        """Return the command that runs the script of a module with arguments."""

    def require(self) -> None:
        """Skip the test where a program is missing; in CI it fails."""
        require(*self.programs)

    def emitted(self, equations: Equations, folder: Path, *, jacobian: bool = False) -> Module:
        """Write the files of a scene, on request with derivatives."""
        folder.mkdir(parents=True)
        options = self.options | ({"jacobian": True} if jacobian else {})
        files = EMITTERS[self.language].emit(equations, options)
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
        interface = None
        if not self.holds_everything:
            interface = interface_of(equations, frozenset(), jacobian=jacobian)
        return Module(equations, interface, tuple(folder / name for name in files), jacobian)

    def results(self, folder, modules, calls):
        """Return results of calls, a list of lists for each module."""
        lines = [
            " ".join(
                [
                    *(str(k), str(module.functions.index(call.function))),
                    *_numbers(call, len(module.equations.system.contacts)),
                ]
            )
            for k, module in enumerate(modules)
            for call in calls[k]
        ]
        printed = executed(self.build(folder, modules), "\n".join([*lines, ""]), folder)
        found = iter([[float(x) for x in line.split()] for line in printed.splitlines()])
        return [[next(found) for _ in calls[k]] for k, _ in enumerate(modules)]

    def rows(self, module, **arguments):
        """Run the script and return its table, without the heading."""
        words = [f"{name}={value!r}" for name, value in arguments.items()]
        printed = executed(self.script(module, words), "", module.folder).splitlines()
        assert printed[0] == ",".join(("t", *module.interface.state))
        return [[float(x) for x in line.split(",")] for line in printed[1:]]


def sizes_of(interface):
    """Function of a module → the number of its results, None for a number alone."""
    sizes = {f.name: math.prod(f.shape) if f.shape else None for f, _ in interface.functions}
    if interface.contacts is not None:
        public = interface.contacts.public.items()
        sizes |= {name: math.prod(f.shape) for name, f in public}
        sizes["events"] = interface.contacts.count
    return sizes


def require(*programs):
    """Skip the test where a program is missing; in CI it fails."""
    for program in programs:
        if shutil.which(program) is None:
            message = f"{program} is not installed"
            if os.environ.get("CI") == "true":
                pytest.fail(message)
            pytest.skip(message)


def _numbers(call, contacts):
    mode = call.mode or (0,) * contacts
    return [repr(float(x)) for x in (call.t, *call.y, *call.p, *call.u, *mode, *call.event)]


def executed(command, text, folder):
    """Run a command on an input and return what it prints; it must succeed."""
    words = [str(word) for word in command]
    done = subprocess.run(
        words, input=text, capture_output=True, text=True, timeout=300, cwd=folder, check=False
    )
    assert done.returncode == 0, f"{words[:6]}: {done.stderr[-3000:]}{done.stdout[-1000:]}"
    return done.stdout
