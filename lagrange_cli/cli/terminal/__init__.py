"""Terminals, streams and signals, as the subcommands use them.

Text and progress go in; what a person sees comes out, and what a program reads on standard output
stays apart from it. Nothing here knows of mechanics. Read :mod:`.output` first.
"""

__all__ = [
    "appearance",
    "command",
    "interrupts",
    "output",
    "progress",
    "streams",
]
