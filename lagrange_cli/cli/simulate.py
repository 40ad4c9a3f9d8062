"""``lagrange simulate``: a trajectory, with the accuracy it has."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import TYPE_CHECKING

import click

from lagrange_cli.cli import options
from lagrange_cli.cli.derive import derived
from lagrange_cli.cli.output import print_text, write_file
from lagrange_cli.cli.session import Session

__all__ = ["simulate"]


class _Method(click.ParamType):
    """A name of the registry of integrators, which is imported when it is needed."""

    name = "method"

    def _names(self) -> list[str]:
        from lagrange_cli.simulate.integrators import INTEGRATORS

        return ["auto", *INTEGRATORS]

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        return f"[{'|'.join(self._names())}]"

    def convert(
        self, value: str, param: click.Parameter | None, ctx: click.Context | None
    ) -> str:
        return click.Choice(self._names()).convert(value, param, ctx)
