"""Shared objects by the text they are made of: from the cache, or compiled and kept there."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from lagrange_cli.cache import Cache, digest
from lagrange_cli.simulate.compiler import (
    ALWAYS,
    TUNED,
    Compilation,
    CompileError,
    Compiler,
    processor,
)

__all__ = ["Source", "load"]


@dataclass(frozen=True)
class Source:
    """Files of C, name → text, and the options to compile them with."""

    files: Mapping[str, str]
    options: tuple[str, ...] = ()


def load(compiler: Compiler, sources: Sequence[Source], cache: Cache) -> list[ctypes.CDLL]:
    """Load each source as a library; those not in the cache are compiled side by side.

    Raises
    ------
    CompileError
        One of them cannot be compiled or loaded.
    """
    keys = [_key(compiler, source) for source in sources]
    loaded = [_cached(cache, key) for key in keys]
    with ExitStack() as stack:
        waiting = {
            number: _start(stack, compiler, sources[number])
            for number, library in enumerate(loaded)
            if library is None
        }
        for number, compilation in waiting.items():
            loaded[number] = _fetched(stack, compilation, cache, keys[number])
    return [library for library in loaded if library is not None]


def _key(compiler: Compiler, source: Source) -> str:
    options = [*ALWAYS, *(option for tuned in TUNED for option in tuned), *source.options]
    texts = [part for item in sorted(source.files.items()) for part in item]
    return digest("object", processor(), compiler.identity, *options, "sources", *texts)


def _cached(cache: Cache, key: str) -> ctypes.CDLL | None:
    path = cache.path(key)
    return None if path is None else _opened(path)


def _opened(path: str) -> ctypes.CDLL | None:
    """The library in a file, None where the system refuses it (a folder without execution)."""
    try:
        return ctypes.CDLL(path)
    except OSError:
        return None


def _folder(stack: ExitStack) -> Path:
    """A private folder that is removed with the stack."""
    import tempfile

    try:
        return Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="lagrange-")))
    except OSError as error:
        raise CompileError(f"no temporary folder: {error.strerror}") from error


def _start(stack: ExitStack, compiler: Compiler, source: Source) -> Compilation:
    folder = _folder(stack)
    try:
        compilation = Compilation(compiler, folder, source.files, source.options)
        stack.callback(compilation.stop)
        return compilation
    except OSError as error:
        raise CompileError(f"'{folder}' cannot be written: {error.strerror}") from error


def _fetched(stack: ExitStack, compilation: Compilation, cache: Cache, key: str) -> ctypes.CDLL:
    """Keep what was compiled and load it, from the cache or from where it was made."""
    content = compilation.result()
    if cache.put(key, content, ".so"):
        library = _cached(cache, key)
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
    return library
