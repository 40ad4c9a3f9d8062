"""The machine's C compiler: found where there is one, and asked for shared objects."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from subprocess import Popen

__all__ = ["Compilation", "CompileError", "Compiler", "find_compiler", "processor"]

#: Commands that are looked for, in this order, where ``CC`` names none.
COMMANDS = ("cc", "gcc", "clang")

#: Options of every compilation. ``-ffp-contract=off``: a product and a sum are
#: rounded as they are in any other language.
ALWAYS = ("-std=c99", "-shared", "-fPIC", "-fno-math-errno", "-ffp-contract=off")

#: Further options, tried in turn: not every compiler knows this machine by name.
TUNED = (("-march=native",), ())

#: Seconds after which a compilation is given up.
LONGEST = 120.0

#: Text of /proc/cpuinfo that holds the first processor.
CPUINFO = 8192


class CompileError(Exception):
    """The compiler failed; ``reason`` is a phrase for a person."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


@dataclass(frozen=True)
class Compiler:
    """A C compiler: its command with options, and what tells it from other ones."""

    command: tuple[str, ...]
    identity: str

    @property
    def name(self) -> str:
        return os.path.basename(self.command[0])


def find_compiler(environment: Mapping[str, str] = os.environ) -> Compiler | None:
    """The compiler that ``CC`` names, else the first of :data:`COMMANDS` on the path."""
    named = _words(environment["CC"]) if environment.get("CC") else []
    for command, *options in [named] if named else [[c] for c in COMMANDS]:
        path = _executable(command, environment.get("PATH", os.defpath))
        if path is not None:
            found = os.stat(path)
            identity = f"{os.path.realpath(path)} {found.st_size} {found.st_mtime_ns} {options}"
            return Compiler((path, *options), identity)
    return None


def _words(text: str) -> list[str]:
    """A command as a shell divides it; one that cannot be divided is no command."""
    import shlex

    try:
        return shlex.split(text)
    except ValueError:
        return [text]


def _executable(command: str, path: str) -> str | None:
    folders = [""] if os.sep in command else path.split(os.pathsep)
    for folder in folders:
        candidate = os.path.join(folder, command)
        if os.path.isfile(candidate) and os.access(candidate, os.X_OK):
            return os.path.abspath(candidate)
    return None


def processor() -> str:
    """What code made for this machine depends on: architecture and the processor's abilities."""
    machine = " ".join(os.uname()[i] for i in (0, 4)) if hasattr(os, "uname") else os.name
    try:
        with open("/proc/cpuinfo", encoding="ascii", errors="replace") as file:
            lines = file.read(CPUINFO).splitlines()
    except OSError:
        return machine
    wanted = ("model name", "flags", "Features", "isa", "cpu")
    return "\n".join([machine, *(line for line in lines if line.startswith(wanted))][:8])


class Compilation:
    """One shared object on its way: started at once, fetched by :meth:`result`.

    Parameters
    ----------
    folder
        An existing private folder for its files.
    sources
        Name → text of the C files; headers are found beside them.
    options
        Further options of the compiler.
    """

    def __init__(
        self,
        compiler: Compiler,
        folder: Path,
        sources: Mapping[str, str],
        options: Sequence[str] = (),
    ) -> None:
        self._compiler, self._folder, self._options = compiler, folder, tuple(options)
        self._files = [name for name in sources if name.endswith(".c")]
        for name, text in sources.items():
            (folder / name).write_text(text, encoding="ascii")
        self._process = self._start(TUNED[0])

    def result(self) -> bytes:
        """Wait for the shared object.

        Raises
        ------
        CompileError
            It could not be made.
        """
        for tuned in (*TUNED[1:], None):
            message = self._wait()
            if message is None:
                return self._object()
            if tuned is not None:
                self._process = self._start(tuned)
        raise CompileError(f"{self._compiler.name} failed: {message}")

    def _object(self) -> bytes:
        try:
            return (self._folder / "object.so").read_bytes()
        except OSError as error:
            raise CompileError(f"{self._compiler.name} failed: no object was made") from error

    def stop(self) -> None:
        """End the compiler if it still runs, as when the user interrupts."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.communicate()

    def _start(self, tuned: Sequence[str]) -> Popen[str]:
        import subprocess

        command = [*self._compiler.command, *ALWAYS, *tuned, *self._options]
        try:
            return subprocess.Popen(
                [*command, "-o", "object.so", *self._files, "-lm"],
                cwd=self._folder,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
                env={**os.environ, "LC_ALL": "C", "TMPDIR": str(self._folder)},
            )
        except OSError as error:
            raise CompileError(f"{self._compiler.name} cannot be run: {error.strerror}") from error

    def _wait(self) -> str | None:
        """The first line of what went wrong, None if all went well."""
        import subprocess

        try:
            _, errors = self._process.communicate(timeout=LONGEST)
        except subprocess.TimeoutExpired:
            raise CompileError(f"{self._compiler.name} took more than {LONGEST:g} s") from None
        if self._process.returncode == 0:
            return None
        return next(iter(errors.strip().splitlines()), f"exit status {self._process.returncode}")
