"""Requests of subcommands with many options: analyses, ensembles, sections of motions.

Options that belong together go in, calls of the Python interface and their reports come out; the
subcommands in :mod:`lagrange_cli.cli.commands` declare the options. Read :mod:`.ensemble` first.
"""

__all__ = ["analysis", "ensemble", "sections"]
