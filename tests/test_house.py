"""Limits that keep the code readable: sizes, circles, contracts, first words, names."""

from __future__ import annotations

import ast
import io
import re
import tokenize
import tomllib
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "lagrange_cli"
FILES = sorted(PACKAGE.rglob("*.py"))
CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
    "importlinter"
]["contracts"]

#: A folder listing is a table of contents, a file fits a sitting, a function a screen.
MOST_MODULES, MOST_LINES, MOST_FUNCTION_LINES = 16, 450, 60
#: Lines of code below which a module with one importer stands in that importer's file.
FEWEST_CODE_LINES = 60

#: No docstring begins with these: the first word is a verb or the noun that is described.
FIRST_WORDS = ("What", "How", "Where", "Of", "Whether", "Those", "Which", "Whose", "Beside")
#: Participles and adjectives that say nothing as the name of a value: a noun stands there.
WITHOUT_NOUN = (
    *("found", "of", "how", "given", "held", "own", "other", "rest", "few", "kept", "told"),
    *("mapped", "sided", "beside"),
)

#: Where such a name is part of the Python interface, or the language asks for it.
PUBLIC = {
    "of": {"simulate/results/trajectory.py", "studies/section/result.py"},
    "given": {"simulate/ensemble/store/result.py", "studies/section/result.py"},
    "other": {"mechanics/sparse.py"},
}

Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Module


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    return tuple(ast.walk(tree(path)))


def place(path: Path, node: ast.AST | None = None) -> str:
    return f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 1)}"


def dotted(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {dotted(path): path for path in FILES}


def definitions(path: Path) -> Iterator[Definition]:
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Module)
    return (node for node in nodes(path) if isinstance(node, kinds))


def imported(path: Path) -> set[str]:
    """Modules of the package that a file imports, in functions and for types alone too."""
    names = set()
    for node in nodes(path):
        if isinstance(node, ast.ImportFrom) and node.module in MODULES:
            whole = {f"{node.module}.{alias.name}" for alias in node.names}
            names |= {name if name in MODULES else node.module for name in whole}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names if alias.name in MODULES}
    return names


def code_lines(path: Path) -> int:
    """Lines of a file that are no docstring, comment or blank."""
    skipped = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT)
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline):
        if token.type not in (*skipped, tokenize.ENDMARKER):
            lines |= set(range(token.start[0], token.end[0] + 1))
    for node in definitions(path):
        if ast.get_docstring(node) is not None:
            text = node.body[0]
            lines -= set(range(text.lineno, (text.end_lineno or text.lineno) + 1))
    return len(lines)


def test_folders_are_tables_of_contents() -> None:
    modules = Counter(path.parent for path in FILES if path.name != "__init__.py")
    assert not {str(folder): n for folder, n in modules.items() if n > MOST_MODULES}


def test_files_fit_a_sitting_and_functions_a_screen() -> None:
    long = [place(p) for p in FILES if len(p.read_text("utf-8").splitlines()) > MOST_LINES]
    for path in FILES:
        for node in definitions(path):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                # Names of arguments and the docstring are not counted.
                first = node.body[1:2] if ast.get_docstring(node) is not None else node.body[:1]
                lines = sum((node.end_lineno or 0) - statement.lineno + 1 for statement in first)
                if lines > MOST_FUNCTION_LINES:
                    long.append(f"{place(path, node)} {node.name}")
    assert not long


def test_a_small_module_with_one_reader_stands_in_its_file() -> None:
    readers: Counter[str] = Counter()
    only: dict[str, Path] = {}
    for path in FILES:
        for name in imported(path):
            readers[name] += 1
            only[name] = path
    alone = [
        place(path)
        for name, path in MODULES.items()
        if path.name != "__init__.py"
        and readers[name] == 1
        and only[name].name != "__init__.py"
        and code_lines(path) < FEWEST_CODE_LINES
        and len(path.read_text("utf-8").splitlines())
        + len(only[name].read_text("utf-8").splitlines())
        <= MOST_LINES
    ]
    assert not alone


def test_no_circle_of_imports() -> None:
    """Imports for types alone count, and so do those within functions."""
    numbers = {name: k for k, name in enumerate(MODULES)}
    pairs = [(numbers[n], numbers[m]) for n, p in MODULES.items() for m in imported(p) if m != n]
    rows, columns = np.array(pairs).T
    graph = coo_matrix((np.ones(len(pairs)), (rows, columns)), shape=(len(numbers),) * 2)
    _, labels = connected_components(graph, directed=True, connection="strong")
    circles = [label for label, size in Counter(labels.tolist()).items() if size > 1]
    assert not [[n for n, k in numbers.items() if labels[k] == label] for label in circles]


def test_every_folder_has_its_contract() -> None:
    stated = {container for c in CONTRACTS for container in c.get("containers", ())}
    exhaustive = all(c["exhaustive"] for c in CONTRACTS if c["type"] == "layers")
    folders = Counter(path.parent for path in FILES if path.name != "__init__.py")
    several = {dotted(folder / "__init__.py") for folder, n in folders.items() if n > 1}
    assert exhaustive
    assert not several - stated


def test_emission_sees_no_part_of_scenes_but_their_language() -> None:
    (contract,) = [c for c in CONTRACTS if "of scenes their language alone" in c["name"]]
    parts = {p.stem for p in (PACKAGE / "scene").iterdir() if not p.name.startswith("__")}
    hidden = {
        module.removeprefix("lagrange_cli.scene.") for module in contract["forbidden_modules"]
    }
    assert hidden == parts - {"language"}


def test_docstrings_begin_with_a_verb_or_a_noun() -> None:
    first = re.compile(rf"({'|'.join(FIRST_WORDS)})\b")
    assert not [
        f"{place(path, node)} {text.splitlines()[0]}"
        for path in FILES
        for node in definitions(path)
        if (text := ast.get_docstring(node)) and first.match(text)
    ]


def names(node: ast.AST) -> Iterator[str]:
    """Names that a node gives to a value, an argument, a field or a function."""
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
        yield node.id
    elif isinstance(node, ast.arg):
        yield node.arg
    elif isinstance(node, ast.AnnAssign):
        yield ast.unparse(node.target)
    elif isinstance(node, ast.FunctionDef):
        # ``CNames.of(equations)`` reads as it is meant: the names of these equations.
        made = any(ast.unparse(decorator) == "classmethod" for decorator in node.decorator_list)
        yield "" if made else node.name


def test_names_have_a_noun() -> None:
    public = {(PACKAGE / path, word) for word, paths in PUBLIC.items() for path in paths}
    assert not [
        f"{place(path, node)} {word}"
        for path in FILES
        for node in nodes(path)
        for word in names(node)
        if word in WITHOUT_NOUN and (path, word) not in public
    ]


def test_no_text_is_run() -> None:
    """Functions are values that are interpreted: none is won back from text of a language."""
    assert not [
        place(path, node)
        for path in FILES
        for node in nodes(path)
        if isinstance(node, ast.Name) and node.id in ("exec", "eval", "compile", "__import__")
    ]


def test_constants_say_why() -> None:
    assert not [place(p) for p in FILES if "set by hand" in p.read_text(encoding="utf-8")]
