"""The result of an ensemble: a frozen value with arrays over members, and its description."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

import numpy as np

from lagrange_cli.drawn import Reported
from lagrange_cli.files import whole_file
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Labels
from lagrange_cli.simulate.request import resolve
from lagrange_cli.version import __version__

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.plan.plan import Blocks
    from lagrange_cli.simulate.model.requested_outputs import Reduction


#: Libraries whose versions a result says.
_LIBRARIES = ("numpy", "scipy", "sympy")

#: Kinds of arrays whose names end in that of a column, or of a value that members are given.
_OF_COLUMNS = {"", "given", "final", "scale"}

#: Absolute value of a column, which has its unit.
_ABSOLUTE = re.compile(r"abs\(\s*([^()]+|dot\([^()]+\))\s*\)")

#: Words that xarray takes for lengths of time, which it would turn into dates.
_CONVERTED = {"days", "hours", "minutes", "seconds", "milliseconds", "microseconds", "nanoseconds"}


@dataclass(frozen=True, repr=False)
class Ensemble(Reported):
    """Samples of many motions, and what is known of each.

    Attributes
    ----------
    name
        Name of the scene.
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


@dataclass(frozen=True)
class Description:
    """Facts of a result, and units and symbols of its arrays.

    Attributes
    ----------
    facts
        Facts of the result, as JSON values.
    labels
        Symbols and units of columns.
    reductions
        Reductions by the texts that were written for them.
    """

    facts: Mapping[str, Any]
    labels: Labels
    reductions: Mapping[str, Reduction]

    @classmethod
    def of_blocks(cls, blocks: Blocks) -> Description:
        """Describe the result of some members."""
        plan = blocks.plan
        text = plan.recipe.text
        request = resolve(plan.model, plan.options)
        facts = {
            "name": plan.model.name,
            "title": plan.model.labels.title,
            "scene_sha256": hashlib.sha256(text.data).hexdigest(),
            "values": {**text.parameters, **text.initial},
            "members": len(blocks.members),
            **blocks.members.description(),
            "accuracy": request.accuracy,
            "from": float(request.times[0]),
            "until": float(request.times[-1]),
            "samples": plan.samples,
            "versions": _versions(),
        }
        return cls(
            facts,
            plan.model.labels,
            {reduction.text: reduction for reduction in plan.selection.reductions},
        )

    def plain(self) -> dict[str, str | int | float]:
        """Return the facts as texts and numbers, which attributes are in every format."""
        known = {name: fact for name, fact in self.facts.items() if fact is not None}
        return {
            name: fact if isinstance(fact, str | int | float) else json.dumps(fact)
            for name, fact in known.items()
        }

    def of_array(self, name: str) -> dict[str, str]:
        """Return the unit and the symbol of an array, by its name in the result, where known."""
        kind, _, written = name.partition("/") if "/" in name else ("", "", name)
        symbol = self.labels.symbol(written).plain if kind in _OF_COLUMNS else written
        known = {"long_name": symbol}
        unit = unit_of(name, self.labels, self.reductions)
        if unit:
            known["units"] = unit.removesuffix("s") if unit in _CONVERTED else unit
        return known


def unit_of(name: str, labels: Labels, reductions: Mapping[str, Reduction]) -> str | None:
    """Return the unit of an array, by its name in the result; None if it is not known.

    Parameters
    ----------
    labels
        Units of columns.
    reductions
        Reductions by the texts that were written for them.
    """
    kind, _, written = name.partition("/") if "/" in name else ("", "", name)
    if kind in _OF_COLUMNS:
        return labels.units.get(written)
    reduction = reductions.get(written) if kind.startswith("reduced") else None
    if name == "member/holds_until" or (reduction and reduction.kind == "first"):
        return labels.units.get("t")
    if reduction is None:
        return None
    reduced = reduction.text[reduction.start : reduction.end].strip()
    inside = _ABSOLUTE.fullmatch(reduced)
    return labels.units.get(inside[1] if inside else reduced)


def _versions() -> dict[str, str]:
    versions = {"lagrange-cli": __version__}
    for name in _LIBRARIES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            continue
    return versions
