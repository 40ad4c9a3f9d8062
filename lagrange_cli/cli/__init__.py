"""The command line: options in, a call of the Python interface, report out.

:mod:`.main` calls the subcommands, one file each in :mod:`.commands`; :mod:`.options` and
:mod:`.session` are what they share, and :mod:`.terminal` knows streams and signals. What is asked
is answered by :mod:`lagrange_cli.api`, and what a person reads is written by
:mod:`lagrange_cli.report`; nothing behind these is imported.

Importing these modules imports Click and nothing heavier; each command imports
what it calls when it runs.
"""

__all__ = ["main"]
