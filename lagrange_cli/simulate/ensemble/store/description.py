"""What a result says of itself beside its numbers: scene, members, versions, units."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from lagrange_cli.simulate.model.labels import Labels
from lagrange_cli.simulate.request import resolve
from lagrange_cli.version import __version__

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.plan.plan import Blocks
    from lagrange_cli.simulate.model.reductions import Reduction

#: Libraries whose versions a result says.
_LIBRARIES = ("numpy", "scipy", "sympy")

#: Kinds of arrays whose names end in that of a column, or of a value that members are given.
_OF_COLUMNS = {"", "given", "final", "scale"}

#: Words that xarray takes for lengths of time, which it would turn into dates.
_CONVERTED = {"days", "hours", "minutes", "seconds", "milliseconds", "microseconds", "nanoseconds"}


@dataclass(frozen=True)
class Description:
    """What is known of a result and of each of its arrays.

    Attributes
    ----------
    facts
        Of the result, as JSON values.
    labels
        Symbols and units of columns.
    reductions
        By what was written for them.
    """

    facts: Mapping[str, Any]
    labels: Labels
    reductions: Mapping[str, Reduction]

    @classmethod
    def of(cls, blocks: Blocks) -> Description:
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
        return cls(facts, plan.model.labels, {of.text: of for of in plan.kept.reductions})

    def plain(self) -> dict[str, str | int | float]:
        """Return the facts as texts and numbers, which attributes are in every format."""
        known = {name: fact for name, fact in self.facts.items() if fact is not None}
        return {
            name: fact if isinstance(fact, str | int | float) else json.dumps(fact)
            for name, fact in known.items()
        }

    def of_array(self, name: str) -> dict[str, str]:
        """Return the unit and the symbol of an array, by its name in the result, where known."""
        kind, _, own = name.partition("/") if "/" in name else ("", "", name)
        known = {"long_name": own if kind not in _OF_COLUMNS else self.labels.symbol(own).plain}
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
        By what was written for them.
    """
    kind, _, own = name.partition("/") if "/" in name else ("", "", name)
    if kind in _OF_COLUMNS:
        return labels.units.get(own)
    reduction = reductions.get(own) if kind.startswith("reduced") else None
    if name == "member/holds_until" or (reduction and reduction.kind == "first"):
        return labels.units.get("t")
    if reduction is None:
        return None
    return labels.units.get(reduction.text[reduction.start : reduction.end].strip())


def _versions() -> dict[str, str]:
    found = {"lagrange-cli": __version__}
    for name in _LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
