"""Expectations that do not hold, replaced in a scene's text by the values that were found."""

from __future__ import annotations

from dataclasses import dataclass

from lagrange_cli.cache import Cache
from lagrange_cli.check.check import ReportStore, check_text
from lagrange_cli.check.model import CheckOptions, SceneReport
from lagrange_cli.check.walk import name_of
from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.files import read_bytes
from lagrange_cli.scene.layout import plain_tree
from lagrange_cli.scene.reading.source import Mapping, compose, decode, edited

#: Byte order mark of UTF-8, which decoding leaves out.
_ORDER_MARK = b"\xef\xbb\xbf"


@dataclass(frozen=True, slots=True)
class Update:
    """A scene that passes with the values that were found.

    Attributes
    ----------
    path
        The scene.
    before, after
        Its text in UTF-8; the rest of the text and its comments are the same.
    report
        The outcome of the check of the new text, which is ``pass``.
    """

    path: str
    before: bytes
    after: bytes
    report: SceneReport


def update_of(
    report: SceneReport, options: CheckOptions | None = None, *, cache: Cache | None = None
) -> Update:
    """Replace the expectations that failed by values found, and check the scene again.

    Raises
    ------
    InputError
        A problem has no value that would mend it (an equation that is wrong, a drift that is too
        large, a scene that is refused), or the scene would not pass with the values.
    """
    lasting = [problem for problem in report.problems if not problem.edits]
    if lasting:
        raise InputError(*lasting)
    before, file = read_bytes(report.path), name_of(report.path)
    text = decode(before, file)
    after = edited(text, (edit for problem in report.problems for edit in problem.edits))
    if _without_expectations(after, file) != _without_expectations(text, file):
        hint = "an alias stands for a value of the scene and for what is expected"
        place = report.problems[0].mark
        raise InputError(Problem("other sections would change", place, hint, rule="edit"))
    data = after.encode()
    if before.startswith(_ORDER_MARK):
        data = _ORDER_MARK + data
    options = options or CheckOptions()
    store = None if cache is None else ReportStore.of_run(cache, options)
    again = check_text(report.path, data, options=options, store=store)
    if again.outcome != "pass":
        raise InputError(*again.problems)
    return Update(report.path, before, data, again)


def _without_expectations(text: str, file: str) -> object:
    """Return the tree of a scene's other sections.

    Raises
    ------
    InputError
        The text is no scene.
    """
    tree = compose(text, file)
    if not isinstance(tree, Mapping):
        raise InputError(Problem("this is no scene", Mark(file, 1, 1), rule="type"))
    others = [(key, value) for key, value in tree.entries if key.text != "expect"]
    return plain_tree(Mapping(tuple(others), tree.mark), is_root=True)
