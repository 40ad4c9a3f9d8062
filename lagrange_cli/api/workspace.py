"""The workspace of a caller: the cache of answers, and whoever is told of warnings and stages."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from lagrange_cli.errors import Problem

if TYPE_CHECKING:
    from lagrange_cli.cache import Cache


@dataclass
class Workspace:
    """The user's cache. Nobody is told anything here; the command line tells its user."""

    _explained: bool = field(default=False, init=False)

    @cached_property
    def cache(self) -> Cache:
        """Open the user's cache; if there is none, a detail says why."""
        from lagrange_cli.cache import open_cache

        opened = open_cache()
        self._explain(opened, "nothing")
        return opened

    def keep(self, key: str, data: bytes) -> None:
        """Keep data in the cache; if they cannot be kept, a detail says why."""
        self.cache.put(key, data)
        self._explain(self.cache, "nothing")

    def explain_code(self) -> None:
        """Say why compiled code could not be kept in the cache, as a detail."""
        self._explain(self.cache, "no compiled code")

    def _explain(self, cache: Cache, what: str) -> None:
        """Say why something is not kept, but only once."""
        if cache.reason is not None and not self._explained:
            self._explained = True
            self.detail(f"{what} is kept in the cache: {cache.reason}")

    def tell(self, warnings: Iterable[Problem], remarks: Iterable[str]) -> None:
        """Take the warnings and remarks of a derivation, which may be refused."""

    def detail(self, text: str) -> None:
        """Take a remark on the way in which something was done."""

    def stages(self) -> AbstractContextManager[None]:
        """Return the context in which work announces its stages."""
        return nullcontext()
