"""The command line: Click commands, without mathematics.

:mod:`.main` calls the subcommands, one file each in :mod:`.commands`; :mod:`.options` and
:mod:`.session` are what they share, :mod:`.remembered` answers from the cache, and
:mod:`.terminal` knows streams and signals. What a person reads is written by
:mod:`lagrange_cli.report`.

Importing these modules imports Click and nothing heavier; each command imports
the rooms that it uses when it runs.
"""

__all__ = ["main"]
