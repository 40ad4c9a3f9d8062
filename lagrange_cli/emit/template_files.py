"""Templates of emitted code: files with tokens like ``@NAME@``, read when first asked for.

Each file below ``templates`` is code of its language once its tokens have values, so that a
compiler, or Python's parser, can read it; tests have them do so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pkgutil import get_data

#: The package beside whose modules the folder of the templates lies.
_PACKAGE = "lagrange_cli.emit"


def template(language: str, name: str) -> str:
    """Return the text of ``templates/LANGUAGE/NAME.in``."""
    return _text(language, f"{name}.in")


def c_template(name: str) -> str:
    """Return the text of ``templates/c/NAME.c.in``."""
    return _text("c", f"{name}.c.in")


def unit_template(name: str) -> str:
    """Return the text of ``templates/fmu/NAME.c.in``."""
    return _text("fmu", f"{name}.c.in")


def python_template(name: str) -> str:
    """Return the text of ``templates/python/NAME.py.in``."""
    return _text("python", f"{name}.py.in")


@cache
def _text(folder: str, name: str) -> str:
    data = get_data(_PACKAGE, f"templates/{folder}/{name}")
    assert data is not None
    return data.decode("ascii")


def filled(template: str, replacements: Mapping[str, str]) -> str:
    """The template with a text for each token, in their order: a text may hold later tokens."""
    for token, text in replacements.items():
        template = template.replace(token, text)
    return template


def event_lines(
    text: Callable[[str], str], kinds: Sequence[str], test: tuple[str, str], indent: str, tab: str
) -> str:
    """Return the lines of a run behind an event, from the templates of a language.

    Parameters
    ----------
    text
        Returns the template of a name: ``happens_contacts``, ``happens_switches``, and
        ``happens_both`` for what follows where there are both.
    kinds
        ``contacts`` and ``switches``, those that there are.
    test
        Lines around what events of contacts alone do.
    indent, tab
        Spaces before each line, and before what stands between the lines of the test.
    """
    lines = {kind: text(f"happens_{kind}").splitlines() for kind in kinds}
    if len(kinds) > 1:
        lines["contacts"] = [test[0], *(tab + line for line in lines["contacts"]), test[1]]
        lines["both"] = text("happens_both").splitlines()
    return "".join(f"{indent}{line}\n" for part in lines.values() for line in part)
