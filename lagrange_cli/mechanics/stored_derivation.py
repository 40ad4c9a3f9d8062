"""Derivations that the cache keeps: the same scene with the same options is derived once.

The equations are one entry, and their textbook form is another, since only readers ask for it. An
entry's key holds the scene's text, all options, the code of the program and its libraries.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from lagrange_cli.cache import Cache, digest, fingerprint
from lagrange_cli.cache.values import from_bytes, to_bytes

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations, TextbookForm
    from lagrange_cli.mechanics.step_values import Way
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.scene.model import Scene
    from lagrange_cli.scene.reader import SceneText


def stored_derivation(
    scene: Scene,
    text: SceneText,
    cache: Cache | None,
    *,
    digits: int = 30,
    forces: bool = False,
    formulation: Formulation = "auto",
    steps: Way | None = None,
) -> Equations:
    """Return the equations of a scene from the cache, or derive and store them.

    Parameters
    ----------
    scene
        The scene that ``text`` reads as.
    text
        Its text, with the values that options give.
    cache
        Holds equations and textbook forms; None to derive anew.
    digits, forces, formulation, steps
        As :func:`.derivation.derive` takes them.

    Raises
    ------
    InputError
        The scene is refused. Refusals are not stored.
    """

    def derived() -> Equations:
        from lagrange_cli.mechanics import derive

        return derive(scene, digits=digits, forces=forces, formulation=formulation, steps=steps)

    if cache is None or scene.columns:
        return derived()  # The content of a file is in no key.
    values = [sorted(texts.items()) for texts in (text.parameters, text.initial, text.times)]
    question = json.dumps([digits, forces, formulation, steps, *values])
    key = digest("equations", fingerprint(), question, text.file, text.data)
    data = cache.get(key)
    if data is not None:
        equations: Equations = from_bytes(data)
        form = _StoredForm(cache, digest("textbook", key), lambda: derived().derivation.textbook())
    else:
        equations = derived()
        form = _StoredForm(cache, digest("textbook", key), equations.derivation.textbook)
        _store(
            cache,
            key,
            replace(equations, derivation=replace(equations.derivation, textbook=unwritten)),
        )
    return replace(equations, derivation=replace(equations.derivation, textbook=form))


def unwritten() -> TextbookForm:
    """Stand in for the textbook form of equations in the cache, which is an entry of its own."""
    raise AssertionError("stored equations are given their textbook form when they are read")


def _store(cache: Cache, key: str, value: object) -> None:
    """Put a value under a key, unless it cannot be serialized."""
    data = to_bytes(value)
    if data is not None:
        cache.put(key, data)


@dataclass(frozen=True)
class _StoredForm:
    """The textbook form of stored equations: from the cache, or written and stored."""

    cache: Cache
    key: str
    write: Callable[[], TextbookForm]

    def __call__(self) -> TextbookForm:
        return self._form

    @cached_property
    def _form(self) -> TextbookForm:
        data = self.cache.get(self.key)
        if data is not None:
            form: TextbookForm = from_bytes(data)
            return form
        form = self.write()
        _store(self.cache, self.key, form)
        return form
