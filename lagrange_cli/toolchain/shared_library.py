"""Shared objects by the text they are made of: from the cache, or compiled and kept there."""

from __future__ import annotations

import ctypes
import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.cache import Cache, digest, open_cache
from lagrange_cli.files import remove_abandoned_folders, temporary_folder
from lagrange_cli.stages import uninterrupted
from lagrange_cli.toolchain.compiler import (
    COMMON_OPTIONS,
    PROCESSOR_OPTIONS,
    Compilation,
    CompileError,
    Compiler,
    find_compiler,
    processor,
)

if TYPE_CHECKING:
    from pathlib import Path

#: The head of a function that others can call.
_FUNCTION = re.compile(r"^[a-z]\w* (\w+)\(", re.MULTILINE | re.ASCII)


@dataclass(frozen=True)
class CSource:
    """Files of C, name → text, and the options to compile them with."""

    files: Mapping[str, str]
    options: tuple[str, ...] = ()

    @property
    def functions(self) -> list[str]:
        """Names that a library made of it has."""
        texts = [text for name, text in self.files.items() if name.endswith(".c")]
        return [name for text in texts for name in _FUNCTION.findall(text)]


class _Ahead:
    """Compilations that nobody has asked for yet, by key; they end with the stack."""

    def __init__(self, stack: ExitStack) -> None:
        self.stack = stack
        self.compilations: dict[str, Compilation] = {}


_ahead: ContextVar[_Ahead | None] = ContextVar("ahead", default=None)


@contextmanager
def compilations_ahead() -> Iterator[None]:
    """Let libraries be compiled while other work is done; stop those that are not needed."""
    with ExitStack() as stack:
        token = _ahead.set(_Ahead(stack))
        stack.callback(_ahead.reset, token)
        yield


def compile_ahead(source: CSource, cache: Cache) -> None:
    """Begin to compile a source that will be loaded, within :func:`compilations_ahead`.

    Nothing is done where it is in the cache, or cannot be compiled: loading says why.
    """
    ahead = _ahead.get()
    if ahead is None:
        return
    with suppress(CompileError):
        compiler = find_compiler()
        key = _key(compiler, source)
        if key not in ahead.compilations and cache.path(key) is None:
            ahead.compilations[key] = _start(ahead.stack, compiler, source, cache)


def load_libraries(
    compiler: Compiler, sources: Sequence[CSource], cache: Cache, deadline: float = math.inf
) -> list[ctypes.CDLL]:
    """Load each source as a library; those not in the cache are compiled side by side.

    ``deadline``: when compilations are given up, in seconds of :func:`time.perf_counter`.

    Raises
    ------
    CompileError
        One of them cannot be compiled or loaded, or lacks functions.
    """
    # Here also where nothing is to be compiled: the next run removes what a killed one left.
    remove_abandoned_folders()
    keys = [_key(compiler, source) for source in sources]
    loaded = [_cached(cache, key, source) for key, source in zip(keys, sources, strict=True)]
    with ExitStack() as stack:
        waiting = {
            number: _begun(stack, keys[number]) or _start(stack, compiler, sources[number], cache)
            for number, library in enumerate(loaded)
            if library is None
        }
        for number, compilation in waiting.items():
            content = compilation.result(deadline)
            loaded[number] = _fetched(stack, content, cache, keys[number], sources[number])
    return [library for library in loaded if library is not None]


def portable_object(compiler: Compiler, source: CSource) -> bytes:
    """Compile a source for any processor of this machine's kind; nothing is kept.

    Raises
    ------
    CompileError
        It cannot be compiled.
    """
    with ExitStack() as stack:
        return _start(stack, compiler, source, open_cache(), is_portable=True).result()


def _key(compiler: Compiler, source: CSource) -> str:
    options = [
        *COMMON_OPTIONS,
        *(option for tuned in PROCESSOR_OPTIONS for option in tuned),
        *source.options,
    ]
    texts = [part for item in sorted(source.files.items()) for part in item]
    return digest("object", processor(), compiler.identity, *options, "sources", *texts)


def _cached(cache: Cache, key: str, source: CSource) -> ctypes.CDLL | None:
    """Load the library of a source from the cache; one that lacks functions is removed."""
    path = cache.path(key)
    library = None if path is None else _opened(path)
    if path is None or library is None or not _missing(library, source):
        return library
    with suppress(OSError):
        os.unlink(path)
    return None


def _opened(path: str) -> ctypes.CDLL | None:
    """Load the library in a file, None if the system refuses it (a folder without execution)."""
    try:
        return ctypes.CDLL(path)
    except (OSError, UnicodeDecodeError):  # the latter: the path in its message is no text
        return None


def _missing(library: ctypes.CDLL, source: CSource) -> str:
    """Return the first function of a source that its library lacks, or ""."""
    for name in source.functions:
        try:
            library[name]
        except (AttributeError, UnicodeDecodeError):  # the latter as above
            return name
    return ""


def _folder(stack: ExitStack) -> Path:
    """Make a private folder that is removed with the stack."""
    from pathlib import Path  # needed only to compile

    try:
        return Path(stack.enter_context(temporary_folder()))
    except OSError as error:
        raise CompileError(f"no temporary folder: {error.strerror}") from error


def _begun(stack: ExitStack, key: str) -> Compilation | None:
    """Return the compilation under a key that was begun ahead, None if there is none."""
    ahead = _ahead.get()
    compilation = None if ahead is None else ahead.compilations.pop(key, None)
    if compilation is not None:
        stack.callback(compilation.stop)
    return compilation


@uninterrupted
def _start(
    stack: ExitStack,
    compiler: Compiler,
    source: CSource,
    cache: Cache,
    *,
    is_portable: bool = False,
) -> Compilation:
    folder = _folder(stack)
    try:
        compilation = Compilation(
            compiler,
            folder,
            source.files,
            source.options,
            cache.compiler_folder,
            is_portable=is_portable,
        )
        stack.callback(compilation.stop)
        return compilation
    except OSError as error:
        raise CompileError(f"'{folder}' cannot be written: {error.strerror}") from error


def _fetched(
    stack: ExitStack, content: bytes, cache: Cache, key: str, source: CSource
) -> ctypes.CDLL:
    """Keep what was compiled and load it, from the cache or from a temporary file."""
    if cache.put(key, content, ".so"):
        library = _cached(cache, key, source)
        if library is not None:
            return library
    # Once loaded the file is not needed any more.
    path = _folder(stack) / "object.so"
    try:
        path.write_bytes(content)
    except OSError as error:
        raise CompileError(f"'{path}' cannot be written: {error.strerror}") from error
    library = _opened(str(path))
    if library is None:
        raise CompileError("the compiled code cannot be loaded")
    missing = _missing(library, source)
    if missing:
        raise CompileError(f"the compiled code lacks '{missing}'")
    return library
