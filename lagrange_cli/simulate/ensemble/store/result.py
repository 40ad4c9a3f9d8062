"""The result of an ensemble: a frozen value with arrays over members, and its file."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lagrange_cli.files import whole_file
from lagrange_cli.notation.html import html_table, html_text
from lagrange_cli.simulate.arrays import Array


@dataclass(frozen=True, repr=False)
class Ensemble:
    """Samples of many motions, and what is known of each.

    Attributes
    ----------
    name
        The scene's.
    arrays
        All arrays, by the names that ``lagrange simulate --ensemble`` gives them in an NPZ. Those
        of a file are read when they are asked for.
    """

    name: str
    arrays: Mapping[str, Any] = field(compare=False)

    @property
    def t(self) -> Array:
        """Sample times, shape (samples,)."""
        times: Array = self.arrays["t"]
        return times

    @property
    def columns(self) -> dict[str, Array]:
        """Columns as of :class:`.results.trajectory.Trajectory`, shape (members, samples).

        NaN after the sample until which a member is known.
        """
        return {n: self.arrays[n] for n in self.arrays if n != "t" and "/" not in n}

    @property
    def given(self) -> dict[str, Array]:
        """Values in which members differ, shape (members,)."""
        return self._group("given")

    @property
    def scales(self) -> dict[str, Array]:
        """Name → scale in which a member's errors count, shape (members,)."""
        return self._group("scale")

    @property
    def final(self) -> dict[str, Array]:
        """Columns at the last sample, shape (members,); NaN if a member does not reach it."""
        return self._group("final")

    @property
    def reduced(self) -> dict[str, Array]:
        """Numbers of motions, shape (members,); NaN where there is none."""
        return self._group("reduced")

    @property
    def reduced_error(self) -> dict[str, Array]:
        """Estimated errors of :attr:`reduced`; infinite where it is open whether there is one."""
        return self._group("reduced_error")

    @property
    def figures(self) -> dict[str, Array]:
        """Fields of :class:`.results.trajectory.Trajectory` of all members, shape (members,).

        Numbers: ``estimated``, ``holds_until``, drifts and counts, NaN where there is none. Texts:
        ``status`` (``refused`` for a member that cannot be begun), ``reason``, ``method``,
        ``formulation``.
        """
        return self._group("member")

    @property
    def status(self) -> list[str]:
        """The status of each member."""
        statuses: list[str] = self.arrays["member/status"].tolist()
        return statuses

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the file that ``lagrange simulate --ensemble -o`` writes, an NPZ.

        Raises
        ------
        InputError
            It cannot be written.
        """
        with whole_file(path) as stream:
            np.savez(stream, **self.arrays)

    def _group(self, kind: str) -> dict[str, Array]:
        start = f"{kind}/"
        return {n.removeprefix(start): self.arrays[n] for n in self.arrays if n.startswith(start)}

    def __len__(self) -> int:
        return len(self.arrays["member/status"])

    def _counts(self) -> str:
        counts = ", ".join(f"{n} {status}" for status, n in sorted(Counter(self.status).items()))
        return f"{len(self)} members, {len(self.t)} samples; {counts}"

    def __repr__(self) -> str:
        return f"<Ensemble of {self.name}: {self._counts()}>"

    def _repr_html_(self) -> str:
        """Return what notebooks show: a row for each member, as far as they are shown."""
        figures = {name: self.figures[name] for name in ("status", "estimated", "method", "reason")}
        columns = {**self.given, **figures}
        rows = ([_html(values[i]) for values in columns.values()] for i in range(len(self)))
        caption = f"<b>{html_text(self.name)}</b>: {html_text(self._counts())}"
        return html_table(caption, tuple(columns), rows, len(self))


def _html(value: Any) -> str:
    """A cell: numbers in six digits, nothing for those that are not known."""
    if isinstance(value, str):
        return html_text(value)
    return "" if np.isnan(value) else f"{value:.6g}"
