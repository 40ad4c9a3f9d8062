"""Wording on branches of equilibria that text and documents share."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lagrange_cli.analysis.branches.values import Branch, Branches, EndKind, MarkKind
    from lagrange_cli.emit.language import Language

#: Branches and marked points that are listed.
MOST_LISTED = 16


def kind_word(kind: MarkKind, say: Language) -> str:
    """Name what happens at a marked point."""
    return {
        "fold": say("fold"),
        "pitchfork": say("pitchfork"),
        "transcritical": say("transcritical"),
        "branch point": say("branch point"),
        "divergence": say("divergence"),
        "flutter": say("flutter"),
    }[kind]


def end_line(kind: EndKind, place: str, say: Language) -> str:
    """Say how a branch ends, other than with the range or in a closed loop; else nothing.

    ``place``: the parameter there, as ``p = 1``.
    """
    if kind in ("range", "closed"):
        return ""
    return {
        "branch point": say("begins at {place}", place=place),
        "singular": say("ends at {place}: coordinates are singular beyond", place=place),
        "far": say("ends at {place}: it leaves every bound", place=place),
        "stuck": say("ends at {place}: it could not be followed further", place=place),
        "budget": say("ends at {place}: the budget is spent", place=place),
    }[kind]


def found_line(found: Branches, say: Language, inline: Callable[[str], str], name: str) -> str:
    """Say over which range how many branches were found, and how."""
    return say(
        "{name} from {start} to {end}; {count} found, from equilibria at {values} values; there may"
        " be others",
        name=inline(name),
        start=f"{found.low:.6g}",
        end=f"{found.high:.6g}",
        count=len(found.branches),
        values=found.values,
    )


def skipped_lines(found: Branches, say: Language) -> list[str]:
    """Say how many equilibria were not followed; nothing if all were."""
    lines = []
    if found.skipped:
        lines.append(
            say(
                "{count} equilibria were not followed: they are degenerate, or parts of continua",
                count=found.skipped,
            )
        )
    if found.left:
        lines.append(say("{count} more were not followed: the budget is spent", count=found.left))
    return lines


def within_turn(found: Branches, name: str, value: float) -> float:
    """Return an angle of which a turn means nothing between -π and π, others as they are."""
    if name not in found.periodic:
        return value
    turned = math.remainder(value, 2 * math.pi)
    return math.pi if turned <= -math.pi + 1e-12 else turned


def followed(found: Branches, names: Sequence[str]) -> list[tuple[int, str]]:
    """List the coordinates that branches have, with their numbers."""
    return [(k, name) for k, name in enumerate(names) if name not in found.free]


def on_branches(found: Branches, mark: int) -> list[int]:
    """List the numbers, from 1, of the branches that a marked point is on."""
    return [
        k
        for k, branch in enumerate(found.branches, 1)
        if any(number == mark for _, number in branch.marks)
    ]


def end_lines(branch: Branch, say: Language, place: Callable[[float], str]) -> list[str]:
    """Say how a branch ends on both sides, where that is worth a line."""
    if branch.ends[1] == "closed":
        return [say("a closed loop")]
    values = float(branch.values[0]), float(branch.values[-1])
    lines = [end_line(k, place(x), say) for k, x in zip(branch.ends, values, strict=True)]
    return list(dict.fromkeys(line for line in lines if line))


def way_of(values: Sequence[float]) -> tuple[str, ...]:
    """Write the value of a stretch, both ends, or the ends with what is farthest from them amid."""
    start, end = (f"{values[k] + 0.0:.6g}" for k in (0, -1))
    if start != end:
        return start, end
    far = max(values, key=lambda x: abs(x - values[0]))
    middle = f"{far + 0.0:.6g}"
    size = max(1.0, abs(values[0]))
    return (start,) if abs(far - values[0]) <= 1e-9 * size else (start, middle, end)


def value_text(value: float, error: float) -> str:
    """Write a number with the digits that are known, sixteen at most."""
    if value == 0.0 or abs(value) <= error:
        return "0"
    digits = math.floor(math.log10(abs(value))) - math.floor(math.log10(max(error, 1e-300)))
    return f"{value:.{max(1, min(16, digits))}g}"


def error_text(error: float) -> str:
    """Write an error with one digit, rounded up."""
    if error == 0.0:
        return "0"
    size = 10.0 ** math.floor(math.log10(error))
    return f"{math.ceil(error / size - 1e-9) * size:.0e}"
