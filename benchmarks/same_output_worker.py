"""Commands of one checkout, run within one process per scene: the worker of same_output.py.

    python same_output_worker.py CHECKOUT

Each line of standard input is a JSON object: ``commands``, lists of words after ``lagrange``,
and ``folder``, where they run. What came of them is written to ``results.json`` there, and a
line to standard output says so. Everything is imported once; each scene then has a process of
its own, so that no result depends on which scenes were run before it.

A command starts where the command line of the checkout does. One thing is shared between the
commands of a scene: the function ``lagrange_cli.mechanics.derive`` is called once for the
same scene and options. Without such a function the commands derive each by itself, which takes
some ten times longer.
"""

from __future__ import annotations

import gc
import importlib
import io
import json
import os
import pkgutil
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

PACKAGE = "lagrange_cli"
STDOUT, STDERR = 1, 2

#: Files in the folder of a scene that are not outputs.
RESULTS, PRINTED, TOLD = "results.json", ".stdout", ".stderr"


def load(checkout: Path) -> Callable[[], None]:
    """Import a checkout, all of it, and return the entry point of its command line."""
    sys.path[:] = [str(checkout), *(p for p in sys.path if Path(p) != Path(__file__).parent)]
    package = importlib.import_module(PACKAGE)
    places = [Path(place).resolve() for place in package.__path__]
    if places != [checkout.resolve() / PACKAGE]:
        raise SystemExit(f"{PACKAGE} comes from {places[0]} and not from {checkout}")
    for module in pkgutil.walk_packages(package.__path__, f"{PACKAGE}."):
        importlib.import_module(module.name)
    main: Callable[[], None] = importlib.import_module(f"{PACKAGE}.__main__").main
    return main


def _derivation() -> Callable[..., Any] | None:
    """The function that derives a scene, if the checkout has it where it is expected."""
    face = getattr(importlib.import_module(f"{PACKAGE}.mechanics"), "derive", None)
    if isinstance(face, ModuleType):
        face = getattr(face, "derive", None)
    return face if callable(face) else None


def share_derivations() -> None:
    """Let every module of the package call a ``derive`` that remembers what it returned."""
    derive = _derivation()
    if derive is None:
        print(f"{PACKAGE}.mechanics has no derive: every command derives", file=sys.stderr)
        return
    remembered: list[tuple[Any, Any, Callable[[], Any]]] = []

    def once(*arguments: Any, **options: Any) -> Any:
        for before, chosen, result in remembered:
            if (before, chosen) == (arguments, options):
                return result()
        try:
            equations = derive(*arguments, **options)
        except Exception as refusal:
            remembered.append((arguments, options, _raiser(refusal)))
            raise
        remembered.append((arguments, options, lambda: equations))
        return equations

    for name, module in list(sys.modules.items()):
        if name.startswith(PACKAGE):
            for attribute, value in list(vars(module).items()):
                if value is derive:
                    setattr(module, attribute, once)


def _raiser(refusal: Exception) -> Callable[[], Any]:
    def refuse() -> Any:
        raise refusal

    return refuse


def run(main: Callable[[], None], words: list[str]) -> int:
    """Run one command with its streams in files, and return its exit code."""
    for descriptor, name in ((STDOUT, PRINTED), (STDERR, TOLD)):
        file = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND)
        os.dup2(file, descriptor)
        os.close(file)
    sys.stdout, sys.stderr = (
        io.TextIOWrapper(io.FileIO(descriptor, "wb", closefd=False), "utf-8", write_through=True)
        for descriptor in (STDOUT, STDERR)
    )
    sys.argv = ["lagrange", *words]
    try:
        main()
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException:
        traceback.print_exc()
        code = 3
    else:
        code = 0
    sys.stdout.flush()
    sys.stderr.flush()
    return code


def _taken(folder: Path) -> dict[str, str]:
    """Texts of the files that a command wrote below the folder, which are removed."""
    texts = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            texts[str(path.relative_to(folder))] = path.read_bytes().decode("utf-8", "replace")
            path.unlink()
    return texts


def outputs(main: Callable[[], None], words: list[str], written: Path) -> dict[str, str]:
    """What came of one command: exit code, streams, and files written into a folder."""
    code = run(main, words)
    streams = {
        "standard output": Path(PRINTED).read_text("utf-8", "replace"),
        "standard error": Path(TOLD).read_text("utf-8", "replace"),
    }
    return {"exit code": str(code), **streams, **_taken(written)}


def scene(main: Callable[[], None], folder: str, commands: list[list[str]]) -> None:
    """Run the commands of a scene in a folder; those that write do so below ``out``."""
    os.chdir(folder)
    written = Path("out")
    written.mkdir()
    results = [outputs(main, words, written) for words in commands]
    Path(RESULTS).write_text(json.dumps(results), encoding="utf-8")


def serve(main: Callable[[], None]) -> None:
    """Answer requests until there are no more, each from a process of its own."""
    gc.freeze()
    for line in sys.stdin:
        request = json.loads(line)
        sys.stdout.flush()
        child = os.fork()
        if child == 0:
            code = 1
            try:
                scene(main, **request)
                code = 0
            except BaseException:
                traceback.print_exc()
            finally:
                os._exit(code)
        _, status = os.waitpid(child, 0)
        print(os.waitstatus_to_exitcode(status), flush=True)


if __name__ == "__main__":
    entry = load(Path(sys.argv[1]))
    share_derivations()
    serve(entry)
