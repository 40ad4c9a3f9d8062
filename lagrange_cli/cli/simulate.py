"""``lagrange simulate``: a trajectory, with the accuracy it has."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import click

from lagrange_cli.cli import options
from lagrange_cli.cli.derive import derived
from lagrange_cli.cli.output import print_text, write_file
from lagrange_cli.cli.session import Session

if TYPE_CHECKING:
    from lagrange_cli.simulate import Trajectory

__all__ = ["simulate"]


class _Method(click.Option):
    """An option whose help names the registry of integrators, imported only for that."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        from lagrange_cli.simulate.integrators import INTEGRATORS

        self.help = f"Integration method: auto, {', '.join(INTEGRATORS)}.  [default: auto]"
        return super().get_help_record(ctx)
