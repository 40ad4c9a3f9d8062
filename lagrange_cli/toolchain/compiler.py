"""The machine's C compiler: find it, and have it make shared objects."""

from __future__ import annotations

import math
import os
import signal
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.errors import escape_controls
from lagrange_cli.stages import announce, is_to_end, uninterrupted

if TYPE_CHECKING:
    from pathlib import Path
    from subprocess import Popen

#: Commands that are looked for, in this order, where ``CC`` names none.
_COMPILER_COMMANDS = ("cc", "gcc", "clang")

#: Variables that tell a compiler cache, which may stand for the command, its compiler.
_CACHE_VARIABLES = ("CCACHE_COMPILER", "CCACHE_CC", "CCACHE_PATH")

#: Options of every compilation. ``-ffp-contract=off``: a product and a sum are
#: rounded as they are in any other language.
COMMON_OPTIONS = ("-std=c99", "-shared", "-fPIC", "-fno-math-errno", "-ffp-contract=off")

#: Further options, tried in turn: not every compiler knows this machine by name.
PROCESSOR_OPTIONS = (("-march=native",), ())

#: Options that GCC alone knows. They spare time and change no number; other compilers refuse them
#: and are called without.
REGISTERS_BY_PRIORITY, PEELED_LOOPS = "-fira-algorithm=priority", "-fpeel-loops"
_GCC_OPTIONS = (REGISTERS_BY_PRIORITY, PEELED_LOOPS)

#: First letters of the names of compilers that are known not to be GCC.
_OTHER_COMPILERS = ("clang", "zig")

#: Options of the compiler in the package ``ziglang``. ``-nostdlib``: the library of its runtime
#: would be built first, in seven seconds, and nothing in it is called. ``-s``: symbols for a
#: debugger would be two thirds of an object. Unlike others it would add checks for undefined
#: behaviour where nothing is optimized.
_ZIG_OPTIONS = ("cc", "-nostdlib", "-lc", "-s", "-fno-sanitize=undefined")

#: What the names of programs end in.
_ENDINGS = ("", ".exe") if os.name == "nt" else ("",)

#: Seconds after which a compilation is given up.
LONGEST_COMPILATION = 120.0

#: Seconds between two looks at whether somebody has asked for an end.
_GLANCE = 0.1

#: Characters of a reason; compilers can say much.
_LONGEST_REASON = 200

#: Text of /proc/cpuinfo that holds the first processor.
_CPUINFO_SIZE = 8192


class CompileError(Exception):
    """There is no compiler or it failed; ``reason`` is a phrase for a person, safe to print."""

    def __init__(self, reason: str) -> None:
        shown = escape_controls(reason[: _LONGEST_REASON + 1])
        if len(shown) > _LONGEST_REASON:
            shown = shown[: _LONGEST_REASON - 3] + "..."
        super().__init__(shown)
        self.reason = shown


@dataclass(frozen=True)
class Compiler:
    """A C compiler: its command with options, and what tells it from other ones.

    ``packaged``: it comes from the package ``ziglang``, not from the machine.
    """

    command: tuple[str, ...]
    identity: str
    packaged: bool = False

    @property
    def name(self) -> str:
        return os.path.basename(self.command[0])

    def environment(self, folder: str, kept_folder: str | None) -> dict[str, str]:
        """Return the variables to call it with: its temporary files are in ``folder``.

        ``kept_folder``: where it may keep what it needs again, if there is such a folder.
        """
        places = dict.fromkeys(("TMPDIR", "TMP", "TEMP"), folder)
        variables = {**os.environ, "LC_ALL": "C", **places}
        if self.packaged:
            variables["ZIG_GLOBAL_CACHE_DIR"] = kept_folder or folder
            variables["ZIG_LOCAL_CACHE_DIR"] = folder
        return variables


def find_compiler(environment: Mapping[str, str] = os.environ) -> Compiler:
    """Find the compiler that ``CC`` names, else the first of :data:`_COMPILER_COMMANDS` there is,
    else the one that the package ``ziglang`` brings.

    Raises
    ------
    CompileError
        There is none. Nothing stands in for what ``CC`` names.
    """
    folders = environment.get("PATH", os.defpath)
    named = _words(environment.get("CC", ""))
    for command, *options in [named] if named else [[c] for c in _COMPILER_COMMANDS]:
        path = _executable(command, folders)
        if path is not None:
            # A word after the first can be the compiler that the first one calls.
            called = [_executable(option, folders) for option in options]
            executables = [path, *_behind(path, folders), *called]
            files = [_file(file) for file in executables if file is not None]
            chosen = [environment.get(name, "") for name in _CACHE_VARIABLES]
            return Compiler((path, *options), " ".join([*files, str(options), *chosen]))
    if named:
        raise CompileError(f"CC names '{named[0]}', which was not found")
    packaged = _packaged_compiler()
    if packaged is None:
        raise CompileError("no C compiler was found")
    return packaged


def _packaged_compiler() -> Compiler | None:
    """Return the compiler of the package ``ziglang``, None where that is not installed."""
    from importlib.util import find_spec

    package = find_spec("ziglang")
    for folder in (package and package.submodule_search_locations) or ():
        path = _executable(os.path.join(folder, "zig"), "")
        if path is not None:
            identity = f"{_file(path)} {_ZIG_OPTIONS}"
            return Compiler((path, *_ZIG_OPTIONS), identity, packaged=True)
    return None


def _words(text: str) -> list[str]:
    """Divide a command as a shell does."""
    if not text:
        return []
    import shlex

    try:
        return shlex.split(text)
    except ValueError as error:
        raise CompileError(f"CC cannot be read: {str(error).lower()}") from error


def _behind(path: str, folders: str) -> list[str]:
    """List executables of the same name further on: a link to ccache calls the first of them."""
    name = os.path.basename(path)
    paths = (_executable(name, folder) for folder in folders.split(os.pathsep))
    return [candidate for candidate in paths if candidate is not None and candidate != path]


def _file(path: str) -> str:
    """Identify a file: its real path, size and time of change."""
    status = os.stat(path)
    return f"{os.path.realpath(path)} {status.st_size} {status.st_mtime_ns}"


def _executable(command: str, path: str) -> str | None:
    folders = [""] if os.sep in command else path.split(os.pathsep)
    for folder in folders:
        for ending in _ENDINGS:
            candidate = os.path.join(folder, command + ending)
            if os.path.isfile(candidate) and os.access(candidate, os.X_OK):
                return os.path.abspath(candidate)
    return None


def processor() -> str:
    """Name what compiled code depends on: the architecture and the processor's abilities."""
    machine = " ".join(os.uname()[i] for i in (0, 4)) if hasattr(os, "uname") else os.name
    try:
        with open("/proc/cpuinfo", encoding="ascii", errors="replace") as file:
            lines = file.read(_CPUINFO_SIZE).splitlines()
    except OSError:
        return machine
    wanted = ("model name", "flags", "Features", "isa", "cpu")
    return "\n".join([machine, *(line for line in lines if line.startswith(wanted))][:8])


def _choices_of_options(
    compiler: Compiler, options: Sequence[str], *, is_portable: bool
) -> Sequence[tuple[str, ...]]:
    """List the options beside the common ones to try in turn: first those that give most speed."""
    portable = tuple(option for option in options if option not in _GCC_OPTIONS)
    is_other = compiler.name.startswith(_OTHER_COMPILERS)
    kinds = (portable,) if is_other else dict.fromkeys((tuple(options), portable))
    processors = PROCESSOR_OPTIONS[-1:] if is_portable else PROCESSOR_OPTIONS
    return [(*tuned, *kind) for kind in kinds for tuned in processors]


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
    kept_folder
        As in :meth:`Compiler.environment`.
    is_portable
        The object is for any processor of this machine's kind.
    """

    def __init__(
        self,
        compiler: Compiler,
        folder: Path,
        sources: Mapping[str, str],
        options: Sequence[str] = (),
        kept_folder: str | None = None,
        *,
        is_portable: bool = False,
    ) -> None:
        self._started = time.perf_counter()
        self._deadline = self._started + LONGEST_COMPILATION
        self._compiler, self._folder, self._kept_folder = compiler, folder, kept_folder
        self._files = [name for name in sources if name.endswith(".c")]
        for name, text in sources.items():
            (folder / name).write_text(text, encoding="utf-8")
        self._choices = iter(_choices_of_options(compiler, options, is_portable=is_portable))
        self._process = self._start(next(self._choices))

    def result(self, deadline: float = math.inf) -> bytes:
        """Wait for the shared object.

        ``deadline``: when to give up, in seconds of :func:`time.perf_counter`; at most
        :data:`LONGEST_COMPILATION` after the start.

        Raises
        ------
        CompileError
            It could not be made.
        """
        self._deadline = min(self._deadline, deadline)
        message = self._wait()
        for options in self._choices:
            if message is None:
                break
            self._process = self._start(options)
            message = self._wait()
        if message is None:
            return self._object()
        raise CompileError(f"{self._compiler.name} failed: {message}")

    def _object(self) -> bytes:
        try:
            return (self._folder / "object.so").read_bytes()
        except OSError as error:
            raise CompileError(f"{self._compiler.name} failed: no object was made") from error

    def stop(self) -> None:
        """End the compiler and all that it started, as when the user interrupts."""
        # Not waited for yet: its number, which is that of its group, is no other's.
        if self._process.returncode is None:
            with self._process:
                if hasattr(os, "killpg"):
                    os.killpg(self._process.pid, signal.SIGKILL)
                else:
                    self._process.kill()

    def _go_on(self, left: float) -> None:
        """Give up a compilation that takes too long, or that nobody waits for any more."""
        if is_to_end():
            raise CompileError(f"{self._compiler.name} was interrupted")
        if left <= _GLANCE:
            longest = max(0.0, self._deadline - self._started)
            raise CompileError(f"{self._compiler.name} took more than {longest:.1f} s")

    @uninterrupted
    def _start(self, options: Sequence[str]) -> Popen[str]:
        import subprocess

        command = [*self._compiler.command, *COMMON_OPTIONS, *options]
        try:
            return subprocess.Popen(
                [*command, "-o", "object.so", *self._files, "-lm"],
                cwd=self._folder,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
                env=self._compiler.environment(str(self._folder), self._kept_folder),
                start_new_session=True,
            )
        except OSError as error:
            raise CompileError(f"{self._compiler.name} cannot be run: {error.strerror}") from error

    def _wait(self) -> str | None:
        """Wait for the compiler; return the line that says what went wrong, None if nothing did."""
        import subprocess

        announce("compiling")
        while True:
            left = self._deadline - time.perf_counter()
            try:
                _, errors = self._process.communicate(timeout=min(left, _GLANCE))
                break
            except subprocess.TimeoutExpired:
                self._go_on(left)
        if self._process.returncode == 0:
            return None
        lines = errors.strip().splitlines()
        lines = [line for line in lines if "error" in line.lower()] or lines
        return next(iter(lines), f"exit status {self._process.returncode}")
