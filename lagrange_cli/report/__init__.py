"""Reports of values: what a person reads of each, and its JSON.

In go the values that the rooms below work out (a trajectory, a measured trade, the outcomes of a
check), out come texts; nothing is computed here and nothing is printed. One module a command,
named like it, each with a table ``FORMATS`` from the name of a format to the function that
writes it. Tables and JSON text are those of :mod:`.tables`; read :mod:`.simulate`
first.

The derivation itself is written by the formats of :mod:`lagrange_cli.emit`, which the Python
interface and documents use too; it is a :class:`Page` like the reports of all others.
"""

from lagrange_cli.notation.page import UNBROKEN, USUAL_WIDTH, Page, Paint, Role

__all__ = [
    "UNBROKEN",
    "USUAL_WIDTH",
    "Page",
    "Paint",
    "Role",
    "check",
    "ensemble",
    "fit",
    "listings",
    "path",
    "section",
    "simulate",
    "stress",
    "tables",
    "tradeoff",
]
