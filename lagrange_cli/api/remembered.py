"""Answer a question that was asked before from the cache, without any mathematics.

An answer is a JSON value, with the warnings and remarks that belong to it. The question is the
command with the options that matter, and the scene: its bytes, which are read once and both hashed
and derived, and its name in messages. Lagrange's code and its libraries are in the key as well.
Refusals are not kept.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, NamedTuple

from lagrange_cli.cache import digest, fingerprint
from lagrange_cli.errors import Mark, Problem
from lagrange_cli.files import read_bytes

if TYPE_CHECKING:
    from lagrange_cli.api.workspace import Workspace


class SceneSource(NamedTuple):
    """A scene as it was read: its path, ``-`` for standard input, and its bytes."""

    path: str
    data: bytes

    @property
    def file(self) -> str:
        """Return the name that messages have for the scene."""
        return "<stdin>" if self.path == "-" else self.path


class Answer(NamedTuple):
    """The answer of a command.

    Attributes
    ----------
    value
        A JSON value; its meaning is the command's own.
    warnings, remarks
        To be told with it.
    lasting
        False if it depends on more than its key says, as on another file: it is not kept.
    """

    value: Any
    warnings: Iterable[Problem] = ()
    remarks: Iterable[str] = ()
    lasting: bool = True


def read_source(scene: str) -> SceneSource:
    """Read a scene file, or standard input for ``-``.

    Raises
    ------
    InputError
        It cannot be read, or is too large.
    """
    return SceneSource(scene, read_bytes(scene))


def remembered(
    workspace: Workspace,
    command: str,
    source: SceneSource,
    options: Sequence[Any],
    work: Callable[[], Answer],
) -> Any:
    """Return the value of the answer to a question, kept from before or else worked out.

    Parameters
    ----------
    workspace
        Has the cache, and takes warnings and remarks of an answer that was kept.
    command
        Name of the command that asks.
    source
        The scene.
    options
        Every option that the answer depends on, in a fixed order, as JSON values.
    work
        Finds the answer, and tells the workspace its warnings and remarks itself.

    Raises
    ------
    InputError
        From ``work``, or there are warnings and ``--strict``.
    """
    asked = json.dumps(options)
    key = digest(command, fingerprint(), asked, source.file, source.data)
    before = workspace.cache.get(key)
    if before is not None:
        answer = _decoded(before)
        workspace.tell(answer.warnings, answer.remarks)
        workspace.detail("from the cache")
        return answer.value
    with workspace.stages():
        answer = work()
    if answer.lasting:
        workspace.keep(key, _encoded(answer))
    return answer.value


def _encoded(answer: Answer) -> bytes:
    content = {
        "value": answer.value,
        "warnings": [asdict(problem) for problem in answer.warnings],
        "remarks": list(answer.remarks),
    }
    return json.dumps(content).encode()


def _decoded(data: bytes) -> Answer:
    content = json.loads(data)
    warnings = tuple(_problem(**fields) for fields in content["warnings"])
    return Answer(content["value"], warnings, tuple(content["remarks"]))


def _problem(mark: dict[str, Any] | None, **fields: Any) -> Problem:
    return Problem(mark=None if mark is None else Mark(**mark), **fields)
