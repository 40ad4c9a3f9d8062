"""The command line: Click commands, one file a subcommand, without mathematics.

Importing these modules imports Click and nothing heavier; each command imports
the rooms that it uses when it runs.
"""

__all__ = ["main"]
