"""Members drawn at random: ``theta ~ uniform(-pi, pi)``, each from its number and a seed.

The generator counts (Philox: Salmon, Moraes, Dror, Shaw, Parallel random numbers: as easy as
1, 2, 3, SC11), so that member k has the same values wherever and in whatever order it is run.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lagrange_cli.errors import Mark
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.plan.enumeration import (
    MOST_MEMBERS,
    Cell,
    Members,
    refused,
    too_many,
)
from lagrange_cli.simulate.ensemble.plan.sources import call_of, constant, split_at_commas

#: Number of seeds: the largest seed plus one.
SEEDS = 2**64

#: Members whose values are drawn at a time, a multiple of :data:`_NUMBERS_A_COUNT`.
_AT_A_TIME = 4096

#: Numbers that the generator yields for each count.
_NUMBERS_A_COUNT = 4

_EXAMPLE = "'theta ~ uniform(-pi, pi)', loguniform(0.1, 10) or normal(0, 0.1): mean and deviation"


def _normal(first: float, second: float, uniform: Array) -> Array:
    from scipy.special import ndtri

    return np.asarray(first + second * ndtri(uniform))


def _loguniform(first: float, second: float, uniform: Array) -> Array:
    return np.asarray(np.exp(np.log(first) + uniform * np.log(second / first)))


#: Name → (both arguments, uniform numbers between 0 and 1) → values.
_DRAWS: dict[str, Callable[[float, float, Array], Array]] = {
    "uniform": lambda first, second, uniform: first + uniform * (second - first),
    "loguniform": _loguniform,
    "normal": _normal,
}

#: Name → condition on its arguments, and the refusal of others.
_NEEDS: dict[str, tuple[Callable[[float, float], bool], str]] = {
    "uniform": (lambda a, b: a < b, "uniform takes its least and its largest value"),
    "loguniform": (lambda a, b: 0 < a < b, "loguniform takes two positive ends, the least first"),
    "normal": (lambda a, b: b > 0, "normal takes a mean and a positive standard deviation"),
}


@dataclass(frozen=True)
class Distribution:
    """A distribution of numbers.

    Attributes
    ----------
    kind
        Its name.
    first, second
        Its arguments.
    """

    kind: str
    first: float
    second: float

    def drawn(self, uniform: Array) -> Array:
        """Return the quantiles at some uniform numbers between 0 and 1."""
        with np.errstate(all="ignore"):
            return _DRAWS[self.kind](self.first, self.second, uniform)


@dataclass(frozen=True)
class SampledMembers(Members):
    """Members drawn at random.

    Attributes
    ----------
    distributions
        Distribution of each name.
    number
        Number of members.
    seed
        Key of the generator, below :data:`SEEDS`.
    """

    distributions: tuple[Distribution, ...]
    number: int
    seed: int

    def __len__(self) -> int:
        return self.number

    def rows(self, first: int = 0, last: int | None = None) -> Iterator[tuple[str, ...]]:
        end = self.number if last is None else min(last, self.number)
        for begin in range(first, end, _AT_A_TIME):
            columns = self.numbers(begin, min(begin + _AT_A_TIME, end))
            yield from zip(*(map(repr, column.tolist()) for column in columns), strict=True)

    def numbers(self, first: int, last: int) -> list[Array]:
        """Draw the values of members from ``first`` to before ``last``, an array a name."""
        last = min(last, self.number)
        return [
            distribution.drawn(_uniform(self.seed, stream, first, last))
            for stream, distribution in enumerate(self.distributions)
        ]

    def mark(self, member: int, name: str) -> Mark:
        return self.heads[self.names.index(name)]

    def cells(self) -> Iterator[Cell]:
        return iter(())

    def identity(self) -> object:
        drawn = [(d.kind, d.first, d.second) for d in self.distributions]
        return self.names, drawn, self.number, self.seed

    def description(self) -> dict[str, object]:
        drawn = [f"{d.kind}({d.first!r}, {d.second!r})" for d in self.distributions]
        return {"drawn": dict(zip(self.names, drawn, strict=True)), "seed": self.seed}


def _uniform(seed: int, stream: int, first: int, last: int) -> Array:
    """Return the uniform numbers of some members, in the open interval from 0 to 1."""
    count, skipped = divmod(first, _NUMBERS_A_COUNT)
    key = np.array([seed, stream], dtype=np.uint64)
    generator = np.random.Philox(key=key, counter=np.array([count, 0, 0, 0], dtype=np.uint64))
    bits = generator.random_raw(skipped + last - first)[skipped:]
    return np.asarray(((bits >> np.uint64(11)) + 0.5) * 2.0**-53)


def sampled(specifications: Sequence[str], number: int, seed: int) -> Members:
    """Read distributions, each ``NAME ~ KIND(FIRST, SECOND)``.

    Raises
    ------
    InputError
        Located in the option: it is no distribution; or there are too many members.
    """
    read = [_read(text) for text in specifications]
    if number > MOST_MEMBERS:
        raise too_many(Mark("--members", 1, 1), MOST_MEMBERS)
    names, heads, distributions = zip(*read, strict=True)
    return SampledMembers(names, heads, distributions, number, seed)


def _read(text: str) -> tuple[str, Mark, Distribution]:
    name, tilde, written = text.partition("~")
    head = Mark("--sample", 1, 1, text, max(1, len(name.rstrip())))
    if not (tilde and name.strip() and written.strip()):
        raise refused("this is not of the form NAME ~ DISTRIBUTION", head, f"--sample {_EXAMPLE}")
    start = len(name) + 1 + len(written) - len(written.lstrip())
    mark = replace(head, column=start + 1, length=len(written.strip()))
    call = call_of(written)
    if call is None or call[0] not in _DRAWS:
        raise refused("this is no distribution", mark, f"a distribution is {_EXAMPLE}")
    kind, arguments = call
    holds, needs = _NEEDS[kind]
    values = [constant(part, mark) for part in split_at_commas(arguments, mark)]
    if len(values) != 2 or not holds(*values):
        raise refused(needs, mark, f"--sample {_EXAMPLE}")
    return re.sub(r"\s+", "", name), head, Distribution(kind, *values)
